"""Packages that are needed for some files only: the extras of this package."""

from __future__ import annotations

import importlib
from types import ModuleType

from elastic_robot.errors import RobotFileError


def extra(module: str, name: str, what: str) -> ModuleType:
    """Return a module of an extra.

    Raises:
        RobotFileError: If it is not installed.
    """
    try:
        return importlib.import_module(module)
    except ImportError as cause:
        raise RobotFileError(
            f"{what} needs the package {module.partition('.')[0]}:"
            f" pip install 'elastic-robot-fmu[{name}]'"
        ) from cause
