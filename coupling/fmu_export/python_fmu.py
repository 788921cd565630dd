"""The robot's FMU that runs in Python, on PythonFMU's binaries."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from html import escape
from importlib import metadata
from pathlib import Path
from types import MappingProxyType

import elastic_robot
from coupling.fmu_export.archive import build_date
from coupling.fmu_export.identity import ICON, about_robot
from coupling.fmu_export.index_html import index_html, scalar_rows
from coupling.fmu_export.python_host import HOST_SOURCES
from coupling.fmu_export.python_slave import slave_entries, write_slave
from coupling.fmu_export.requirements import (
    conda_environment,
    external_dependencies,
    pip_line,
    pip_requirements,
)
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import MODEL_NAME, blocks

# The need of a Python environment is told in externalDependencies.txt and by the first error;
# masters refuse an FMU that declares needsExecutionTool.
_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
)


def build_python_fmu(
    robot: Robot,
    file: Path,
    resources: Mapping[str, bytes] = MappingProxyType({}),
    platforms: Sequence[str] = (),
) -> Path:
    """Write a robot's FMU; an existing file is replaced only when the new one is complete.

    The same robot and the same sources give the same bytes.

    Args:
        robot: The robot, fixed in the FMU.
        file: Where to write it, ending in .fmu.
        resources: More files by name; `trajectory` can name one of them.
        platforms: That `python_host` must be compiled for; none: this machine, if it can.

    Returns:
        The file.

    Raises:
        BuildError: If the file cannot be written, or `python_host` is not for one of the platforms.
    """
    package = Path(elastic_robot.__file__).parent
    table = blocks(robot)
    date = build_date(package, HOST_SOURCES)
    slave = package.parent / "elastic_robot_slave.py"
    packed = {"robot.json": robot.to_json().encode(), **resources}
    entries = slave_entries(slave, MODEL_NAME, packed, [package], platforms)
    needs = (
        f"The Python of the host needs: <code>{escape(pip_line())}</code> (see"
        ' <a href="externalDependencies.txt">externalDependencies.txt</a>).'
    )
    html = index_html(robot, scalar_rows(table), "2.0", elastic_robot.__version__, needs)
    texts = {
        "resources/requirements.txt": "\n".join([*pip_requirements(), ""]),
        "resources/environment.yml": conda_environment(),
        "documentation/index.html": html,
        "documentation/externalDependencies.txt": external_dependencies(),
    }
    entries |= {name: text.encode() for name, text in texts.items()}
    entries["model.png"] = ICON.read_bytes()
    about = about_robot(robot, f"PythonFMU {metadata.version('pythonfmu')}", date, _CAPABILITIES)
    write_slave(file, about, table, entries, date)
    return file
