"""python -m elastic_robot.coupling.cli."""

from coupling.cli import main

if __name__ == "__main__":
    main()
