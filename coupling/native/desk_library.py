"""The desk library: what the inverse computes in C, on the chain of the C core, called through ctypes.

An FMU has none of it.  It is shipped and compiled as the FMU's library is (`core_library`).
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path

from coupling.native.compiler import SOURCES, Platform, host_platform
from coupling.native.core_library import shipped_or_compiled

# The library's own C files, and those of the core that they call.
DESK_SOURCES = Path(__file__).parent / "desk"
_CORE = ("io", "core/chain")
_CORE_FILES = (
    "core/elements/gear.c",
    "core/elements/gear_parts.c",
    *(
        f"core/load/{name}.c"
        for name in ("anchor", "anchored_statics", "contact", "load", "statics")
    ),
)


def desk_sources() -> list[Path]:
    """Return the C files of the library."""
    folders = [DESK_SOURCES, *(SOURCES / folder for folder in _CORE)]
    files = [file for folder in folders for file in sorted(folder.glob("*.c"))]
    return [*files, *(SOURCES / name for name in _CORE_FILES)]


def desk_library_name(platform: Platform) -> str:
    """Return the name of a platform's library among those that a wheel brings."""
    return f"{platform.name}_desk{platform.suffix}"


def desk_library(platform: Platform) -> Path:
    """Return the library for a platform.

    Raises:
        CompilerError: If it is neither shipped nor can be compiled here.
    """
    return shipped_or_compiled(platform, desk_library_name(platform), desk_sources())


@cache
def loaded_library() -> ctypes.CDLL:
    """Return the library of this machine.

    Raises:
        CompilerError: If it is neither shipped nor can be compiled here.
    """
    library = ctypes.CDLL(str(desk_library(host_platform())))
    for name in ("er_desk_create", "er_desk_create_plain", "er_link_iterations_create"):
        getattr(library, name).restype = ctypes.c_void_p
    for name in ("er_link_iterations_improve", "er_gear_path", "er_desk_rest"):
        getattr(library, name).restype = ctypes.c_bool
    library.er_gear_law_with_elements.restype = ctypes.c_int64
    library.er_drive_fit_value.restype = ctypes.c_double
    return library
