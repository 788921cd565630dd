"""robot.toml -> ElasticRobot.fmu.

python build_fmu.py [--robot ROBOT.toml] [-o FILE.fmu] [--kind python|native]
                    [--platforms linux64,win64,...|all] [--sources] [--fmi 2|3]
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType

from coupling.errors import BuildError
from coupling.files.robot_file import find_robot, load_robot
from coupling.fmu_export.compiler import PLATFORMS
from coupling.fmu_export.native_fmu import build_native_fmu
from coupling.fmu_export.native_standards import STANDARDS
from coupling.fmu_export.python_fmu import build_python_fmu as build
from coupling.fmu_export.python_host import without_host
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.fmi.interface import MODEL_NAME

__all__ = ["KINDS", "build", "build_kind", "build_native_fmu", "main", "remark"]

KINDS = ("python", "native")


def build_kind(
    robot: Robot,
    file: Path,
    resources: Mapping[str, bytes] = MappingProxyType({}),
    *,
    kind: str,
    platforms: str = "",
    with_sources: bool = False,
    fmi: str = "2",
) -> Path:
    """Write a robot's FMU of either kind.

    Args:
        robot: The robot, fixed in the FMU.
        file: Where to write it, ending in .fmu.
        resources: More files by name; `trajectory` can name one of them.
        kind: One of KINDS.
        platforms: That libraries are compiled for: names with commas between them, or "all" for a
            native FMU; empty: this machine's.
        with_sources: Pack the C sources of a native FMU as well.
        fmi: Version of FMI; 3 is for a native FMU.

    Returns:
        The file.

    Raises:
        BuildError: If the kind is not known, the options do not fit it or the FMU cannot be written.
    """
    if kind not in KINDS:
        raise BuildError(f"kind is {kind!r}; needed is one of {', '.join(KINDS)}")
    names = [name for name in platforms.split(",") if name]
    if kind == "native":
        names = list(PLATFORMS) if platforms == "all" else names
        return build_native_fmu(robot, file, names, with_sources, resources, fmi)
    if with_sources or fmi != "2":
        raise BuildError(
            "sources or FMI 3 are chosen for an FMU in Python; needed is --kind native"
        )
    return build(robot, file, resources, names)


def remark(file: Path, kind: str) -> str:
    """Return a sentence on an FMU's libraries, empty where there is nothing to say."""
    alone = without_host(file, MODEL_NAME) if kind == "python" else []
    if not alone:
        return ""
    return (
        f"{', '.join(alone)}: PythonFMU's library alone, as python_host was not compiled for it"
        " (docs/fmu.md; --platforms)"
    )


def main(arguments: list[str] | None = None) -> int:
    """Build from the command line; return the exit status: 0 built, 2 bad input."""
    parser = argparse.ArgumentParser(description="Build the FMU of an elastic robot.")
    parser.add_argument(
        "--robot", default="icme2008", help="robot.toml, or the name of a shipped robot"
    )
    parser.add_argument("-o", "--output", type=Path, default=Path("ElasticRobot.fmu"))
    parser.add_argument("--kind", choices=KINDS, default=KINDS[0], help="of the FMU")
    parser.add_argument(
        "--platforms",
        default="",
        help=f"{','.join(PLATFORMS)} or all to compile for; this machine unless given",
    )
    parser.add_argument("--sources", action="store_true", help="pack the C sources as well")
    parser.add_argument("--fmi", choices=STANDARDS, default="2", help="version of FMI")
    options = parser.parse_args(arguments)
    try:
        robot = load_robot(find_robot(options.robot))
        file = build_kind(
            robot,
            options.output,
            kind=options.kind,
            platforms=options.platforms,
            with_sources=options.sources,
            fmi=options.fmi,
        )
    except (BuildError, ElasticRobotError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    print(f"{file}: built")
    if told := remark(file, options.kind):
        print(told)
    return 0


if __name__ == "__main__":
    sys.exit(main())
