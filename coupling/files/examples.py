"""The examples: in a wheel beside the package's other data, in a checkout where they are."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

_PACKAGE = Path(str(resources.files("coupling.files")))


def example(name: str) -> Path:
    """Return an example's file.

    Args:
        name: Its place in the folder of examples, such as "cases/cone.toml".

    Example:
        >>> example("cases/cone.toml").is_file()
        True
    """
    checkout = _PACKAGE.parents[1]
    here = checkout if (checkout / "pyproject.toml").is_file() else _PACKAGE
    return here / "examples" / name
