"""What the Python of an FMU's host must have installed."""

from __future__ import annotations

from importlib import metadata

# Imported by the model; the rest of the distribution's dependencies stay at the desk.
_NEEDED = ("numpy", "scipy", "pin")
# conda-forge has Pinocchio for Windows as well, under another name.
_CONDA_NAMES = {"pin": "pinocchio"}


def pip_requirements() -> list[str]:
    """Return the requirements in pip's notation, as this distribution states them."""
    stated = metadata.requires("elastic-robot-fmu") or []
    plain = [line.partition(";")[0].strip() for line in stated]
    return [next(p for p in plain if _name(p) == needed) for needed in _NEEDED]


def pip_line() -> str:
    """Return the command that installs them."""
    return "python -m pip install " + " ".join(f'"{line}"' for line in pip_requirements())


def conda_environment() -> str:
    """Return environment.yml."""
    lines = []
    for requirement in pip_requirements():
        name = _name(requirement)
        lines.append(f"  - {_CONDA_NAMES.get(name, name)}{requirement.removeprefix(name)}")
    return "\n".join(["channels:", "  - conda-forge", "dependencies:", *lines, ""])


def external_dependencies() -> str:
    """Return the text of documentation/externalDependencies.txt."""
    return (
        "The host process of this FMU is, or embeds, Python 3.11 or later, with these packages:\n\n"
        f"    {pip_line()}\n\n"
        "On Windows, where pin is not on PyPI, from conda-forge (resources/environment.yml):\n\n"
        "    conda env create -n elastic-robot -f environment.yml\n\n"
        "A host that is no Python program must load a Python library (libpython3.so, python3.dll)\n"
        "with global symbols before it loads this FMU.\n"
    )


def _name(requirement: str) -> str:
    return requirement.partition(">")[0]
