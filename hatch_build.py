"""Hatchling's hook of the wheel: the C core's libraries for all platforms, compiled with Zig, as data.

`ELASTIC_ROBOT_PLATFORMS` names some of them (linux64,win64), for a wheel that is made sooner.  The wheel
is py3-none-any all the same: it holds no extension module, and every platform gets all libraries.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class Libraries(BuildHookInterface):  # type: ignore[type-arg]
    """Adds the libraries to the wheel; an editable install compiles them when they are asked for."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile what is not in the cache, and tell where it goes in the wheel."""
        if version == "editable":
            return
        sys.path.insert(0, str(Path(self.root)))
        from coupling.fmu_export.compiler import PLATFORMS
        from coupling.fmu_export.core_library import (
            SHIPPED,
            core_libraries,
            library_name,
            platforms_named,
        )

        asked = filter(None, os.environ.get("ELASTIC_ROBOT_PLATFORMS", "").split(","))
        platforms = platforms_named(asked) or list(PLATFORMS.values())
        folder = SHIPPED.resolve().relative_to(Path(self.root).resolve()).as_posix()
        for platform in platforms:
            print(f"C core: {platform.name}", file=sys.stderr)
        found = core_libraries(platforms)
        for platform in platforms:
            place = f"{folder}/{library_name(platform)}"
            build_data["force_include"][str(found[platform.name])] = place
