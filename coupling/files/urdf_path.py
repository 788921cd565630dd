"""Where a URDF lies: beside the robot file, or in an installed package."""

from __future__ import annotations

import importlib.util
import os
import sys
from collections.abc import Iterator
from pathlib import Path

from elastic_robot.errors import RobotFileError

_PACKAGE = "package://"


def find_urdf(reference: str, folder: Path) -> Path:
    """Return the file that a robot file calls its URDF.

    Args:
        reference: A path, relative to `folder`, or package://NAME/PATH with the name of a Python
            package, a ROS package (ROS_PACKAGE_PATH, AMENT_PREFIX_PATH) or one of Pinocchio's data
            packages (cmeel), looked up in the order ROS, Python, cmeel.
        folder: Of the robot file.

    Raises:
        RobotFileError: If there is no such package or file.

    Example:
        >>> find_urdf("package://coupling/files/robots/icme2008.toml", Path()).name
        'icme2008.toml'
    """
    if not reference.startswith(_PACKAGE):
        path = folder / reference
        if not path.is_file():
            raise RobotFileError(
                f"{path}: no such file; needed is a URDF, by its path from the robot file or as"
                f" {_PACKAGE}NAME/PATH"
            )
        return path
    name, _, rest = reference.removeprefix(_PACKAGE).partition("/")
    packages = [package for package in _package_folders(name) if package.is_dir()]
    for package in packages:
        if (package / rest).is_file():
            return package / rest
    if packages:
        raise RobotFileError(f"{reference}: there is no file {rest!r} in {packages[0]}")
    raise RobotFileError(
        f"{reference}: no package {name!r} is installed; needed is an importable Python package or a"
        " folder of that name on ROS_PACKAGE_PATH or AMENT_PREFIX_PATH"
    )


def _package_folders(name: str) -> Iterator[Path]:
    """Yield the folders in which a package of that name may be."""
    for entry in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry, name)
    for entry in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if entry:
            yield Path(entry, "share", name)
    spec = importlib.util.find_spec(name) if name.isidentifier() else None
    for location in (spec.submodule_search_locations or []) if spec else []:
        yield Path(location)
    for entry in sys.path:
        yield Path(entry, "cmeel.prefix", "share", name)
