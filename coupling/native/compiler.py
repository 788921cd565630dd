"""Compiles C to libraries: with the host's compiler, or with Zig's for any platform.

Zig's compiler comes from PyPI (`pip install ziglang`) and carries the C libraries of all platforms, so
that a Windows or macOS library can be built on Linux.  The wheel's build hook runs this where nothing is
installed, not this distribution either; without filelock two that build at once both compile.
"""

from __future__ import annotations

import functools
import hashlib
import importlib.util
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from coupling.errors import BuildError
from coupling.files.atomic_file import AtomicFile, writing
from coupling.native.cache import cache_folder, compiler_environment

try:
    from filelock import FileLock
except ImportError:
    FileLock = None  # type: ignore[assignment, misc]

# What goes into FMUs beside the model: as a wheel has it (pyproject.toml), or in the checkout.
_SHIPPED = Path(__file__).parent / "fmu_src"
FMU_SOURCES = _SHIPPED if _SHIPPED.is_dir() else Path(__file__).parents[2] / "fmu_src"
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
    for candidate in PLATFORMS.values():
        if candidate.machine == name:
            return candidate
    raise CompilerError(f"this machine: expected one of {', '.join(PLATFORMS)}, got {name}")


def compile_library(
    target: Platform,
    sources: Sequence[Path],
    definitions: Sequence[str] = (),
    cache: Path | None = None,
    libraries: Sequence[str] = ("m",),
    compiler: Sequence[str] = (),
) -> Path:
    """Return a shared library of C sources, from the cache if it was compiled before.

    Of several that ask for the same one at once the first compiles it, and the others wait.

    Args:
        sources: C files; headers are found in SOURCES and beside them.
        definitions: Further flags, such as -DNAME.
        cache: Folder for libraries; `cache_folder` unless given.
        libraries: Libraries of the system, linked where it is not Windows.
        compiler: Command of the compiler; `host_compiler` unless given.

    Raises:
        CompilerError: If there is no compiler for the platform, or it fails; with what it says.
    """
    compiler = compiler or host_compiler(target)
    file = library_file(target, sources, compiler, definitions, cache)
    if file.is_file():
        return file
    command = [*compiler, *_flags(target, definitions)]
    command += [f"-I{folder.resolve()}" for folder in _header_folders(sources)]
    command += [str(source.resolve()) for source in sources]
    command += [] if target.suffix == ".dll" else [f"-l{name}" for name in libraries]
    with writing(file.parent, CompilerError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with FileLock(file.with_suffix(".lock")) if FileLock is not None else nullcontext():
            if not file.is_file():
                _compile(command, file, f"{' '.join(compiler)} failed for {target.name}")
    return file


def _compile(command: Sequence[str], file: Path, failed: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        # Libraries for Windows and macOS state the name that they are linked as: it is always the same.
        built = Path(folder, f"library{file.suffix}")
        words = [*command, "-o", built.name]
        process = subprocess.run(
            words,
            cwd=folder,
            env=compiler_environment(),
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
        )
        if process.returncode != 0:
            raise CompilerError(f"{failed}:\n{process.stderr}")
        AtomicFile(file).write([built.read_bytes()])


def library_file(
    target: Platform,
    sources: Sequence[Path],
    compiler: Sequence[str],
    definitions: Sequence[str] = (),
    cache: Path | None = None,
) -> Path:
    """Return where `compile_library` keeps a library: named by a hash of all that decides what it is."""
    flags = _flags(target, definitions)
    command = ["python" if part == sys.executable else part for part in compiler]
    words = repr((command, flags)).encode()
    digest = hashlib.sha256(words + _version(tuple(compiler)))
    headers = sorted({h for folder in _header_folders(sources) for h in folder.glob("**/*.h")})
    for file in [*sources, *headers]:
        digest.update(file.name.encode())
        digest.update(file.read_bytes())
    return (cache or cache_folder()).resolve() / f"{digest.hexdigest()[:24]}{target.suffix}"


def _flags(target: Platform, definitions: Sequence[str]) -> list[str]:
    needless = {"-fPIC"} if target.suffix == ".dll" else set()
    return [flag for flag in (*FLAGS, *definitions) if flag not in needless]


def _header_folders(sources: Sequence[Path]) -> list[Path]:
    return sorted({source.parent for source in sources} | {SOURCES})


def core_sources() -> list[Path]:
    """Return the C files of the model, without the FMI functions."""
    return [source for source in sorted(SOURCES.rglob("*.c")) if not source.stem.startswith("fmi")]


def zig() -> list[str] | None:
    """Return the command of Zig's C compiler, or None if it is not installed."""
    if importlib.util.find_spec("ziglang") is None:
        return None
    return [sys.executable, "-P", "-m", "ziglang", "cc"]


def host_compiler(target: Platform) -> list[str]:
    """Return the host's own compiler for this machine, and Zig's for others or where it has none.

    Raises:
        CompilerError: If there is none.
    """
    return _own_compiler(target) or portable_compiler(target)


def portable_compiler(target: Platform) -> list[str]:
    """Return Zig's compiler, whose libraries are the same wherever they are made, else the host's own.

    Raises:
        CompilerError: If there is none.
    """
    command = zig()
    if command is not None:
        return [*command, "-target", target.target]
    native = _own_compiler(target)
    if native is None:
        raise CompilerError(
            f"there is no C compiler for {target.name}: install the package ziglang (pip install"
            " ziglang), or cc, gcc or clang for this machine only"
        )
    return native


def _own_compiler(target: Platform) -> list[str] | None:
    if target != host_platform():
        return None
    compilers = [[name] for name in ("cc", "gcc", "clang") if shutil.which(name)]
    return os.environ.get("CC", "").split() or next(iter(compilers), None)


@functools.cache
def _version(compiler: tuple[str, ...]) -> bytes:
    with tempfile.TemporaryDirectory() as folder:  # Zig leaves files where it is started
        words, environment = [*compiler, "--version"], compiler_environment()
        process = subprocess.run(
            words, cwd=folder, env=environment, capture_output=True, check=False
        )
        return process.stdout
