"""Build what a release consists of, and try it where nothing else of the project is: make release.

The recipe for conda-forge is parsed and rendered for its platforms.  Sdist and wheel with the C core's
libraries for all platforms, and their SHA256SUMS.  The sdist makes the same wheel again.  The wheel is
installed into a fresh environment, where its command builds an FMU and corrects a command.
"""

from __future__ import annotations

import argparse
import hashlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import venv
import zipfile
from collections.abc import Sequence
from pathlib import Path

import elastic_robot

ROOT = Path(__file__).parents[1]
VERSION = elastic_robot.__version__
# What conda-forge builds for by itself; the recipe's package is the same for all.
CONDA_PLATFORMS = ("linux-64", "osx-arm64", "win-64")


class ReleaseError(Exception):
    """What was built cannot be released."""


def changes(version: str, changelog: str) -> str:
    r"""Return a version's section of the changelog.

    Raises:
        ReleaseError: If it has none.

    Example:
        >>> changes("1.0", "## [1.0] - 2026-01-02\n\n- A robot.\n\n## [0.9] - ..")
        '- A robot.'
    """
    for section in re.split(r"^## ", changelog, flags=re.MULTILINE):
        if section.startswith(f"[{version}] - "):
            return section.partition("\n")[2].strip()
    raise ReleaseError(f"CHANGELOG.md: expected a section '## [{version}] - DATE', got none")


def checksums(files: Sequence[Path]) -> str:
    """Return lines of SHA-256 and name, as `sha256sum --check` reads them."""
    return "".join(
        f"{hashlib.sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in sorted(files)
    )


def check_recipe(text: str) -> None:
    """Check that rattler-build takes a recipe: its keys, specifications of versions, licence, variables.

    Raises:
        ReleaseError: If it does not.
    """
    from rattler_build import (
        PlatformConfig,
        RattlerBuildError,
        RenderConfig,
        Stage0Recipe,
        VariantConfig,
    )

    try:
        recipe = Stage0Recipe.from_yaml(text)
        for platform in CONDA_PLATFORMS:
            recipe.render(VariantConfig(), RenderConfig(PlatformConfig(target_platform=platform)))
    except RattlerBuildError as error:
        raise ReleaseError(f"recipe.yaml: {error}") from error


def build(folder: Path) -> tuple[Path, Path]:
    """Build sdist and wheel into an empty folder, and return them."""
    _run([sys.executable, "-m", "hatchling", "build", "-d", str(folder)], ROOT)
    (sdist,), (wheel,) = folder.glob("*.tar.gz"), folder.glob("*.whl")
    return sdist, wheel


def check_content(sdist: Path, wheel: Path) -> None:
    """Check that the wheel has every platform's library, and the sdist what the wheel is made of.

    Raises:
        ReleaseError: If something is missing.
    """
    from coupling.native.compiler import PLATFORMS
    from coupling.native.core_library import library_name
    from coupling.native.desk_library import desk_library_name

    with zipfile.ZipFile(wheel) as archive:
        packed = set(archive.namelist())
    with tarfile.open(sdist) as archive:
        sources = {name.partition("/")[2] for name in archive.getnames()}
    libraries = "elastic_robot/coupling/native/libraries"
    named = (library_name, desk_library_name)
    expected = {f"{libraries}/{name(p)}" for p in PLATFORMS.values() for name in named}
    _all_in(expected, packed, wheel)
    # What else the wheel is made of, FMUs are tried with below.
    modules = {name.removeprefix("elastic_robot/") for name in packed}
    made_of = {name for name in modules if (ROOT / name).is_file()}
    _all_in(
        {"hatch_build.py", "pyproject.toml", "fmu_src/native/fmi/fmi2.c", *made_of}, sources, sdist
    )


def check_wheel_of(sdist: Path, wheel: Path, folder: Path) -> None:
    """Check that an sdist, unpacked in a folder, makes the wheel that the checkout makes.

    Raises:
        ReleaseError: With the files that are other ones.
    """
    with tarfile.open(sdist) as archive:
        archive.extractall(folder, filter="data")
    (source,) = folder.iterdir()
    build_wheel = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    _run(build_wheel, source)
    other = contents(folder / wheel.name)
    own = contents(wheel)
    if different := sorted(name for name in own.keys() | other if own.get(name) != other.get(name)):
        raise ReleaseError(f"{sdist.name}: makes another wheel: {', '.join(different[:5])}")


def contents(wheel: Path) -> dict[str, bytes]:
    """Return what is in a wheel."""
    with zipfile.ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def _all_in(expected: set[str], found: set[str], archive: Path) -> None:
    if missing := sorted(expected - found):
        raise ReleaseError(f"{archive.name}: expected {', '.join(missing)}, got none")


def try_wheel(wheel: Path, folder: Path) -> None:
    """Install a wheel into a new environment, and use its command there.

    Raises:
        ReleaseError: If it says something other than the version, or does not do what it is told.
    """
    home = folder / "environment"
    venv.create(home, with_pip=True)
    programs = home / ("Scripts" if os.name == "nt" else "bin")
    command = str(programs / "elastic-robot")
    _run([str(programs / "python"), "-m", "pip", "install", "--quiet", str(wheel)], folder)
    said = _run([command, "--version"], folder).strip()
    if said != f"elastic-robot {VERSION}":
        raise ReleaseError(f"{wheel.name}: expected version {VERSION}, got {said!r}")
    _run([command, "build", "-o", "Robot.fmu"], folder)
    _run([command, "init", "mine", "--process", "measured"], folder)
    _run([command, "compensate", "mine/case.toml", "-o", "corrected"], folder)
    _all_in(
        {"Robot.fmu", "corrected/command.csv", "corrected/report.html"},
        {
            file.relative_to(folder).as_posix()
            for made in ("*", "corrected/*")
            for file in folder.glob(made)
        },
        wheel,
    )


def _run(command: Sequence[str], folder: Path) -> str:
    """Run a program, outside the checkout without it on the path, and return what it says."""
    outside = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    environment = dict(os.environ) if folder == ROOT else outside
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    if done.returncode:
        raise ReleaseError(f"{' '.join(command)}: status {done.returncode}\n{done.stderr}")
    return done.stdout


def main(arguments: Sequence[str] | None = None) -> int:
    """Make a release, and return the exit status."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist")
    output: Path = parser.parse_args(arguments).output
    try:
        text = changes(VERSION, (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
        check_recipe((ROOT / "recipe" / "recipe.yaml").read_text(encoding="utf-8"))
        shutil.rmtree(output, ignore_errors=True)
        files = build(output)
        check_content(*files)
        with tempfile.TemporaryDirectory() as name:
            check_wheel_of(*files, Path(name).resolve())
        with tempfile.TemporaryDirectory() as name:
            try_wheel(files[1], Path(name).resolve())
    except ReleaseError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    (output / "SHA256SUMS").write_text(checksums(files), encoding="utf-8")
    print(f"{output}: {VERSION}\n\n{text}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
