"""The C core as a library for each platform: one for all robots, which are data beside it.

A wheel brings the libraries, so that no compiler is needed where it is installed.  In a checkout each is
compiled once, with Zig, and kept in the user's cache folder; without Zig this machine's compiler makes
the one for this machine.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from coupling.errors import BuildError, one_of
from coupling.native.compiler import (
    PLATFORMS,
    SOURCES,
    CompilerError,
    Platform,
    compile_library,
    host_platform,
    library_file,
    portable_compiler,
    zig,
)

# Where a wheel has them (hatch_build.py); a checkout has no such folder.
SHIPPED = Path(__file__).parent / "libraries"
# Symbols for a debugger would name folders of the machine that it was made on.
_STRIPPED = "-s"
# Small functions of other files are inlined: a step takes 3 to 8 % less time, to the same bits. Zig does
# so for Linux alone: for Windows it misses nanl of its own library, and its linker for macOS cannot.
_ACROSS_FILES = "-flto"


def platforms_named(names: Iterable[str]) -> list[Platform]:
    """Return platforms by name.

    Raises:
        BuildError: If one is not known.
    """
    platforms = []
    for name in names:
        if name not in PLATFORMS:
            raise BuildError(f"platform: {one_of(PLATFORMS, name)}")
        platforms.append(PLATFORMS[name])
    return platforms


def usual_platforms() -> list[Platform]:
    """Return the platforms unless others are named: all whose library is shipped, else this machine's.

    Raises:
        CompilerError: If none is shipped and this machine is none of PLATFORMS.
    """
    shipped = [p for p in PLATFORMS.values() if (SHIPPED / library_name(p)).is_file()]
    return shipped or [host_platform()]


def library_name(platform: Platform) -> str:
    """Return the name of a platform's library in SHIPPED."""
    return f"{platform.name}{platform.suffix}"


def core_libraries(platforms: Iterable[Platform]) -> dict[str, Path]:
    """Return the libraries by the names of their platforms; what is not there is compiled.

    Raises:
        CompilerError: If one is neither shipped nor can be compiled here.
    """
    names = list(platforms)
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return dict(zip((p.name for p in names), pool.map(core_library, names), strict=True))


def core_library(platform: Platform) -> Path:
    """Return the library for a platform, with the functions of all versions of FMI.

    Raises:
        CompilerError: If it is neither shipped nor can be compiled here.
    """
    return shipped_or_compiled(platform, library_name(platform), _sources())


def shipped_or_compiled(platform: Platform, name: str, sources: list[Path]) -> Path:
    """Return a library of C files by its name in SHIPPED; what is not there is compiled.

    Raises:
        CompilerError: If it is neither shipped nor can be compiled here.
    """
    shipped = SHIPPED / name
    if shipped.is_file():
        return shipped
    return compile_library(platform, sources, _flags(platform), compiler=_compiler(platform))


def is_ready(platform: Platform) -> bool:
    """Whether a platform's library is shipped, or was compiled before.

    Raises:
        CompilerError: If it is neither shipped nor can be compiled here.
    """
    if (SHIPPED / library_name(platform)).is_file():
        return True
    return library_file(platform, _sources(), _compiler(platform), _flags(platform)).is_file()


def _flags(platform: Platform) -> tuple[str, ...]:
    across_files = zig() is not None and platform.suffix == ".so"
    return (_STRIPPED, _ACROSS_FILES) if across_files else (_STRIPPED,)


def _sources() -> list[Path]:
    return sorted(SOURCES.rglob("*.c"))


def _compiler(platform: Platform) -> list[str]:
    try:
        return portable_compiler(platform)
    except CompilerError as cause:
        raise CompilerError(
            f"the C core for {platform.name}: expected its library as a wheel of this project brings"
            f" it, or a compiler to make it, got neither: {cause}"
        ) from cause
