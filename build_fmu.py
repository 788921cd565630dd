"""robot.toml -> ElasticRobot.fmu.

python build_fmu.py [--robot ROBOT.toml] [-o FILE.fmu]
"""

from __future__ import annotations

import argparse
import hashlib
import os
import sys
import tempfile
from pathlib import Path

from pythonfmu.builder import FmuBuilder

import elastic_robot
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.robot_file import find_robot, load_robot


class BuildError(ElasticRobotError):
    """The FMU cannot be written."""


def build(robot: Robot, file: Path) -> Path:
    """Write a robot's FMU; an existing file is replaced only when the new one is complete.

    Args:
        robot: The robot, fixed in the FMU.
        file: Where to write it, ending in .fmu.

    Returns:
        The file.

    Raises:
        BuildError: If the file cannot be written.
    """
    if file.suffix != ".fmu":
        raise BuildError(f"{file}: the FMU's name must end in .fmu")
    model = Path(elastic_robot.__file__).parent
    slave = model.parent / "elastic_robot_slave.py"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=file.parent, prefix=".fmu") as folder:
            description = Path(folder, "robot.json")
            description.write_text(robot.to_json(), encoding="utf-8")
            built = FmuBuilder.build_FMU(
                slave, dest=Path(folder, "ElasticRobot.fmu"), project_files=[model, description]
            )
            os.replace(built, file)
    except OSError as cause:
        raise BuildError(f"{file}: cannot be written: {cause.strerror or cause}") from cause
    return file


def fingerprint(folder: Path) -> str:
    """Return a hash of the sources and descriptions under a folder: what an FMU will do."""
    digest = hashlib.sha256()
    for file in sorted(folder.rglob("*")):
        if file.suffix in (".py", ".json", ".toml"):
            digest.update(file.relative_to(folder).as_posix().encode())
            digest.update(file.read_bytes())
    return digest.hexdigest()[:16]


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
    except ElasticRobotError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{file}: built")
    return 0


if __name__ == "__main__":
    sys.exit(main())
