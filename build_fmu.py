"""robot.toml -> ElasticRobot.fmu.

python build_fmu.py [--robot ROBOT.toml] [-o FILE.fmu]
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from coupling.errors import BuildError
from coupling.fmu_export.python_fmu import build_python_fmu as build
from elastic_robot.errors import ElasticRobotError
from elastic_robot.robot_file import find_robot, load_robot

__all__ = ["build", "main"]


def main(arguments: list[str] | None = None) -> int:
    """Build from the command line; return the exit status: 0 built, 2 bad input."""
    parser = argparse.ArgumentParser(description="Build the FMU of an elastic robot.")
    parser.add_argument(
        "--robot", default="icme2008", help="robot.toml, or the name of a shipped robot"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("ElasticRobot.fmu"))
    options = parser.parse_args(arguments)
    try:
        file = build(load_robot(find_robot(options.robot)), options.output)
    except (BuildError, ElasticRobotError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{file}: built")
    return 0


if __name__ == "__main__":
    sys.exit(main())
