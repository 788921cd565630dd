"""The robot's FMU in Python, on PythonFMU's binaries: to be read."""

from __future__ import annotations

import json
from collections.abc import Mapping
from html import escape
from importlib import metadata
from pathlib import Path

import elastic_robot
from coupling.fmu_export.archive import ICON, build_date
from coupling.fmu_export.build_options import BuildOptions
from coupling.fmu_export.grouping import scalars
from coupling.fmu_export.index_html import index_html, variable_rows
from coupling.fmu_export.model_description import at_points, robot_line
from coupling.fmu_export.python_host import HOST_SOURCES
from coupling.fmu_export.python_slave import PythonSlave
from elastic_robot.description import Robot
from elastic_robot.fingerprint import model_files
from elastic_robot.fmi.interface import MODEL_NAME, STARTS, blocks

# The need of a Python environment is stated in externalDependencies.txt and by the first error;
# masters refuse an FMU that declares needsExecutionTool.
_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canNotUseMemoryManagementFunctions",
)
# Imported by the model; the rest of the distribution's dependencies stay at the desk.
_NEEDED = ("numpy", "scipy", "pin")
# conda-forge has Pinocchio for Windows as well, under another name.
_CONDA_NAMES = {"pin": "pinocchio"}


def build_python_fmu(
    robot: Robot, file: Path, resources: Mapping[str, bytes], options: BuildOptions
) -> Path:
    """Write a robot's FMU and return the file.

    Args:
        robot: The robot, fixed in the FMU.
        file: File to write, ending in .fmu.
        resources: More files by name; `trajectory` can name one of them.
        options: Options of the build; `python_host` is compiled for its platforms, or this machine.

    Raises:
        BuildError: If the file cannot be written, or `python_host` is not for one of the platforms.
    """
    package = Path(elastic_robot.__file__).parent
    table = blocks(robot, options.strings)
    slave = PythonSlave(
        module="elastic_robot_slave",
        class_name=MODEL_NAME,
        model_name=options.name,
        description=robot_line(robot),
        capabilities=_CAPABILITIES,
        blocks=table if options.over_step else at_points(table),
        files={
            f"{package.name}/{file.relative_to(package).as_posix()}": file
            for file in model_files(package)
        },
    )
    needs = (
        f"The Python of the host needs: <code>{escape(pip_line())}</code> (see"
        ' <a href="externalDependencies.txt">externalDependencies.txt</a>).'
    )
    html = index_html(
        robot, variable_rows(table, scalars(table)), "2.0", elastic_robot.__version__, needs
    )
    texts = {
        "resources/requirements.txt": "\n".join([*pip_requirements(), ""]),
        "resources/environment.yml": conda_environment(),
        "documentation/index.html": html,
        "documentation/externalDependencies.txt": external_dependencies(),
    }
    strings = dict(options.strings)
    starts = {STARTS: json.dumps(strings).encode()} if strings else {}
    further = {name: text.encode() for name, text in texts.items()}
    return slave.write(
        file,
        build_date(package, HOST_SOURCES),
        {"robot.json": robot.to_json().encode(), **starts, **resources},
        {**further, "model.png": ICON.read_bytes()},
        options.platforms,
    )


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
