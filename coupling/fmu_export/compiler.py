"""Compiles C to libraries: with the host's compiler, or with Zig's for any platform.

Zig's compiler comes from PyPI (`pip install ziglang`) and carries the C libraries of all platforms, so
that a Windows or macOS library can be built on Linux.
"""

from __future__ import annotations

import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import elastic_robot
from coupling.errors import BuildError

# What goes into FMUs beside the model: in the checkout, or as a wheel has it (pyproject.toml).
_SHIPPED = Path(__file__).parent / "fmu_src"
FMU_SOURCES = _SHIPPED if _SHIPPED.is_dir() else Path(elastic_robot.__file__).parent.parent
SOURCES = FMU_SOURCES / "native"
# Contracted multiply-adds are as exact as rounded ones, and nobody asks for errno; anything that drops
# checks of NaN is not used.
FLAGS = (
    *("-std=c99", "-O3", "-ffp-contract=fast", "-fno-math-errno"),
    *("-fPIC", "-shared", "-fvisibility=hidden"),
)


class CompilerError(BuildError):
    """There is no C compiler, or it refuses the sources."""


@dataclass(frozen=True)
class Platform:
    """A kind of machine that an FMU's library is for.

    Attributes:
        name: Name of the folder of its binary in an FMI 2 archive; that of FMI 3 where FMI 2 has none.
        machine: Processor and system, as FMI 3 names them.
        target: Name that Zig has for it, with the oldest system that the library runs on.
        suffix: Ending of a shared library.
    """

    name: str
    machine: str
    target: str
    suffix: str


PLATFORMS = {
    p.name: p
    for p in (
        Platform("linux64", "x86_64-linux", "x86_64-linux-gnu.2.17", ".so"),
        Platform("win64", "x86_64-windows", "x86_64-windows-gnu", ".dll"),
        Platform("darwin64", "x86_64-darwin", "x86_64-macos.11.0", ".dylib"),
        Platform("aarch64-linux", "aarch64-linux", "aarch64-linux-gnu.2.17", ".so"),
        Platform("aarch64-darwin", "aarch64-darwin", "aarch64-macos.11.0", ".dylib"),
    )
}


def host_platform() -> Platform:
    """Return the platform this runs on.

    Raises:
        CompilerError: If it is none of PLATFORMS.
    """
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(
        platform.machine().lower(), platform.machine().lower()
    )
    name = f"{machine}-{platform.system().lower()}"
    for known in PLATFORMS.values():
        if known.machine == name:
            return known
    raise CompilerError(f"this machine: expected one of {', '.join(PLATFORMS)}, got {name}")


def compile_library(
    target: Platform,
    sources: Sequence[Path],
    definitions: Sequence[str] = (),
    cache: Path | None = None,
    libraries: Sequence[str] = ("m",),
) -> Path:
    """Return a shared library of C sources, from the cache if it was compiled before.

    Args:
        target: The platform it is for.
        sources: C files; headers are found in SOURCES and beside them.
        definitions: Further flags, such as -DNAME.
        cache: Folder for libraries; `elastic-robot` in the user's cache folder unless given.
        libraries: Libraries of the system, linked where it is not Windows.

    Raises:
        CompilerError: If there is no compiler for the platform, or it fails; with what it says.
    """
    compiler = _compiler(target)
    flags = [*FLAGS, *definitions]
    folders = sorted({source.parent for source in sources} | {SOURCES})
    if target.suffix == ".dll":
        flags.remove("-fPIC")
    file = (
        cache or _cache()
    ).resolve() / f"{_key(compiler, flags, sources, folders)}{target.suffix}"
    if file.is_file():
        return file
    file.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=file.parent) as folder:
        built = Path(folder, file.name)
        command = [*compiler, *flags, *[f"-I{f.resolve()}" for f in folders], "-o", str(built)]
        command += [
            *(str(source.resolve()) for source in sources),
            *([] if target.suffix == ".dll" else [f"-l{name}" for name in libraries]),
        ]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        if done.returncode != 0:
            raise CompilerError(f"{' '.join(compiler)} failed for {target.name}:\n{done.stderr}")
        os.replace(built, file)
    return file


def core_sources() -> list[Path]:
    """Return the C files of the model, without the FMI functions."""
    return [source for source in sorted(SOURCES.rglob("*.c")) if not source.stem.startswith("fmi")]


def compiles_here() -> bool:
    """Whether there is a C compiler for this machine; none is started to find out."""
    try:
        return bool(_compiler(host_platform()))
    except CompilerError:
        return False


def zig() -> list[str] | None:
    """Return the command of Zig's C compiler, or None if it is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        return None
    return [sys.executable, "-m", "ziglang", "cc"]


def _compiler(target: Platform) -> list[str]:
    if target == host_platform():
        own = os.environ.get("CC", "").split()
        known = [[name] for name in ("cc", "gcc", "clang") if shutil.which(name)]
        if own or known:
            return own or known[0]
    found = zig()
    if found is None:
        raise CompilerError(
            f"there is no C compiler for {target.name}: install cc, gcc or clang (for this machine"
            " only) or the package ziglang (pip install ziglang)"
        )
    return [*found, "-target", target.target]


def _key(
    compiler: Sequence[str], flags: Sequence[str], sources: Sequence[Path], folders: Sequence[Path]
) -> str:
    """Hash of all that decides what the library will be."""
    with tempfile.TemporaryDirectory() as folder:  # Zig leaves files where it is started
        asked = [*compiler, "--version"]
        version = subprocess.run(asked, cwd=folder, capture_output=True, check=False).stdout
    digest = hashlib.sha256(repr((list(compiler), list(flags))).encode() + version)
    headers = sorted({header for folder in folders for header in folder.glob("**/*.h")})
    for file in [*sources, *headers]:
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return digest.hexdigest()[:24]


def _cache() -> Path:
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home, "elastic-robot")
