"""Hatchling's hook of the wheel: the desk side inside of elastic_robot, and the C core's libraries.

The folder `coupling` of the checkout is `elastic_robot.coupling` in the wheel, so that no name but
`elastic_robot` stands beside other people's packages; its modules import each other by that name there.
The core is compiled for all platforms with Zig, as data; `ELASTIC_ROBOT_PLATFORMS` names some of them
(linux64,win64), for a wheel that is made sooner.  The wheel is py3-none-any all the same: it holds no
extension module, and every platform gets all libraries.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

# A statement, also one in a docstring's example.
_IMPORT = re.compile(r"^(\s*(?:(?:>>>|\.\.\.) +)?from )(coupling(?:\.\w+)* import )", re.MULTILINE)


def installed_source(source: str) -> str:
    r"""Return a module of `coupling` as it stands in the wheel.

    Example:
        >>> installed_source("from coupling.path.frame import Frame\n")
        'from elastic_robot.coupling.path.frame import Frame\n'
    """
    return _IMPORT.sub(r"\1elastic_robot.\2", source)


class Wheel(BuildHookInterface):  # type: ignore[type-arg]
    """Puts imports and libraries into the wheel; an editable install has both as the checkout does."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Write the modules, compile what is not in the cache, and tell where both go in the wheel."""
        if version == "editable":
            return
        self._sources = tempfile.TemporaryDirectory()
        build_data["force_include"] |= self._installed_modules(Path(self._sources.name))
        build_data["force_include"] |= self._libraries()

    def finalize(self, version: str, build_data: dict[str, Any], artifact_path: str) -> None:
        """Remove the modules that were written for the wheel."""
        if version != "editable":
            self._sources.cleanup()

    def _installed_modules(self, folder: Path) -> dict[str, str]:
        places = {}
        for number, file in enumerate(sorted(Path(self.root, "coupling").rglob("*.py"))):
            written = folder / f"{number}.py"
            # Bytes: no line end is changed.
            written.write_bytes(installed_source(file.read_bytes().decode()).encode())
            places[str(written)] = f"elastic_robot/{file.relative_to(self.root).as_posix()}"
        return places

    def _libraries(self) -> dict[str, str]:
        sys.path.insert(0, self.root)
        from coupling.native.compiler import PLATFORMS
        from coupling.native.core_library import (
            SHIPPED,
            core_libraries,
            library_name,
            platforms_named,
        )
        from coupling.native.desk_library import desk_library, desk_library_name

        asked = filter(None, os.environ.get("ELASTIC_ROBOT_PLATFORMS", "").split(","))
        platforms = platforms_named(asked) or list(PLATFORMS.values())
        folder = SHIPPED.resolve().relative_to(Path(self.root).resolve()).as_posix()
        for platform in platforms:
            print(f"C core: {platform.name}", file=sys.stderr)
        found = core_libraries(platforms)
        names = {str(found[platform.name]): library_name(platform) for platform in platforms}
        names |= {
            str(desk_library(platform)): desk_library_name(platform) for platform in platforms
        }
        return {file: f"elastic_robot/{folder}/{name}" for file, name in names.items()}
