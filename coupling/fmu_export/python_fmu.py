"""The robot's FMU that runs in Python, on PythonFMU's binaries."""

from __future__ import annotations

import tempfile
import zipfile
from html import escape
from importlib import metadata
from pathlib import Path

from pythonfmu.builder import FmuBuilder

import elastic_robot
from coupling.fmu_export.archive import build_date, content_guid, write_fmu
from coupling.fmu_export.documentation import index_html
from coupling.fmu_export.identity import ICON, about_robot, license_text
from coupling.fmu_export.model_description import model_description
from coupling.fmu_export.requirements import (
    conda_environment,
    external_dependencies,
    pip_line,
    pip_requirements,
)
from elastic_robot.description import Robot
from elastic_robot.interface import MODEL_NAME, blocks

# The need of a Python environment is told in externalDependencies.txt and by the first error;
# masters refuse an FMU that declares needsExecutionTool.
_CAPABILITIES = (
    "canHandleVariableCommunicationStepSize",
    "canNotUseMemoryManagementFunctions",
    "canGetAndSetFMUstate",
    "canSerializeFMUstate",
)


def build_python_fmu(robot: Robot, file: Path) -> Path:
    """Write a robot's FMU; an existing file is replaced only when the new one is complete.

    The same robot and the same sources give the same bytes.

    Args:
        robot: The robot, fixed in the FMU.
        file: Where to write it, ending in .fmu.

    Returns:
        The file.

    Raises:
        BuildError: If the file cannot be written.
    """
    package = Path(elastic_robot.__file__).parent
    table = blocks(robot)
    date = build_date(package)
    entries = _runtime(package, robot)
    needs = (
        f"The Python of the host needs: <code>{escape(pip_line())}</code> (see"
        ' <a href="externalDependencies.txt">externalDependencies.txt</a>).'
    )
    html = index_html(robot, table, elastic_robot.__version__, needs)
    texts = {
        "resources/requirements.txt": "\n".join([*pip_requirements(), ""]),
        "resources/environment.yml": conda_environment(),
        "documentation/index.html": html,
        "documentation/externalDependencies.txt": external_dependencies(),
        "documentation/licenses/license.txt": license_text("elastic-robot-fmu"),
        "documentation/licenses/pythonfmu.txt": license_text("pythonfmu"),
    }
    entries |= {name: text.encode() for name, text in texts.items()}
    entries["model.png"] = ICON.read_bytes()
    about = about_robot(robot, f"PythonFMU {metadata.version('pythonfmu')}", date, _CAPABILITIES)
    # The description is part of the content that the GUID stands for.
    draft = model_description(about, table, guid="")
    guid = content_guid({**entries, "modelDescription.xml": draft})
    entries["modelDescription.xml"] = model_description(about, table, guid)
    write_fmu(file, entries, date)
    return file


def _runtime(package: Path, robot: Robot) -> dict[str, bytes]:
    """Return the slave with what PythonFMU adds to it: its binaries and its own package."""
    slave = package.parent / "elastic_robot_slave.py"
    with tempfile.TemporaryDirectory() as folder:
        description = Path(folder, "robot.json")
        description.write_text(robot.to_json(), encoding="utf-8")
        file = Path(folder, f"{MODEL_NAME}.fmu")
        FmuBuilder.build_FMU(slave, dest=file, project_files=[package, description])
        with zipfile.ZipFile(file) as archive:
            return {name: archive.read(name) for name in archive.namelist()}
