"""The library that stands in front of PythonFMU's in an FMU: `fmu_src/python_host`.

It bears the FMU's name, and PythonFMU's lies beside it as <name>_pythonfmu.  Without a compiler for a
platform PythonFMU's library keeps the FMU's name there, and the FMU works as far as PythonFMU does.
"""

from __future__ import annotations

import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

from coupling.errors import BuildError
from coupling.fmu_export.native_standards import STANDARDS
from coupling.native.compiler import (
    FMU_SOURCES,
    PLATFORMS,
    SOURCES,
    CompilerError,
    Platform,
    compile_library,
    host_platform,
)

HOST_SOURCES = FMU_SOURCES / "python_host"
_INNER = "_pythonfmu"  # as component.h has it
_SYSTEMS = {".so": "library_linux.c", ".dll": "library_windows.c"}
_LICENSE = "documentation/licenses/fmi-headers.txt"


def with_host(
    entries: Mapping[str, bytes], model_name: str, platforms: Sequence[str] = ()
) -> dict[str, bytes]:
    """Return an FMU's content with our library in front of PythonFMU's.

    Args:
        entries: Content by path inside the archive, as PythonFMU's builder makes it.
        model_name: Name of the libraries.
        platforms: Names of PLATFORMS that it must be on; none: this machine's, if there is a compiler.

    Raises:
        BuildError: If a platform has no library of PythonFMU's, or cannot be compiled for.
    """
    hosted = dict(entries)
    for name in platforms or _this_machine():
        plain = _library(name, model_name)
        if plain not in entries:
            if not platforms:
                continue
            available = ", ".join(n for n in PLATFORMS if _library(n, model_name) in entries)
            raise BuildError(
                f"platform: expected one that PythonFMU has libraries for, {available}, got {name!r}"
            )
        try:
            host = host_library(PLATFORMS[name])
        except CompilerError:
            if platforms:
                raise
            continue
        hosted[_library(name, model_name + _INNER)] = entries[plain]
        hosted[plain] = host.read_bytes()
        hosted[_LICENSE] = STANDARDS["2"].headers_license().encode()
    return hosted


def host_library(platform: Platform) -> Path:
    """Return the library for a platform.

    Raises:
        CompilerError: If it cannot be compiled.
    """
    system = _SYSTEMS[platform.suffix]
    sources = [f for f in sorted(HOST_SOURCES.glob("*.c")) if f.name not in _SYSTEMS.values()]
    sources += [HOST_SOURCES / system, SOURCES / "io" / "file.c"]
    return compile_library(platform, sources, libraries=("dl", "pthread"))


def without_host(file: Path, model_name: str) -> list[str]:
    """Return the platforms on which PythonFMU's library stands alone in an FMU."""
    with zipfile.ZipFile(file) as archive:
        names = set(archive.namelist())
    if "resources/slavemodule.txt" not in names:  # PythonFMU's library looks there for the slave
        return []
    return [
        platform
        for platform in PLATFORMS
        if _library(platform, model_name) in names
        and _library(platform, model_name + _INNER) not in names
    ]


def _this_machine() -> list[str]:
    try:
        return [host_platform().name]
    except CompilerError:
        return []


def _library(platform: str, name: str) -> str:
    suffix = PLATFORMS[platform].suffix if platform in PLATFORMS else ""
    return f"binaries/{platform}/{name}{suffix}"
