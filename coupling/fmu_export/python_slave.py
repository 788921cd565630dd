"""FMUs that run in Python, on PythonFMU's binaries: what the robot's and the process's share."""

from __future__ import annotations

import tempfile
import zipfile
from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

from pythonfmu.builder import FmuBuilder

from coupling.fmu_export.archive import content_guid, write_fmu
from coupling.fmu_export.fmi2 import fmi2_description
from coupling.fmu_export.identity import license_text
from coupling.fmu_export.model_description import About
from coupling.fmu_export.python_host import with_host
from elastic_robot.fmi.interface import Block

_LICENSES = {"license.txt": "elastic-robot-fmu", "pythonfmu.txt": "pythonfmu"}


def slave_entries(
    slave: Path,
    model_name: str,
    resources: Mapping[str, bytes],
    packages: Sequence[Path] = (),
    platforms: Sequence[str] = (),
) -> dict[str, bytes]:
    """Return a slave with PythonFMU's binaries and package, and the licences of both.

    In front of PythonFMU's library stands ours, for this machine if it has a compiler.

    Args:
        slave: The file with the slave's class; PythonFMU makes an instance of it.
        model_name: The slave's `modelName`.
        resources: Files that the slave reads, by name.
        packages: Folders that the slave imports.
        platforms: That ours must stand in front on, by name.

    Raises:
        BuildError: If a platform is not known, has no library of PythonFMU's, or the compiler fails.
    """
    with tempfile.TemporaryDirectory() as folder:
        files = [Path(folder, name) for name in resources]
        for path, data in zip(files, resources.values(), strict=True):
            path.write_bytes(data)
        file = Path(folder, f"{model_name}.fmu")
        FmuBuilder.build_FMU(slave, dest=file, project_files=[*packages, *files])
        with zipfile.ZipFile(file) as archive:
            entries = {name: archive.read(name) for name in archive.namelist()}
    for name, distribution in _LICENSES.items():
        entries[f"documentation/licenses/{name}"] = license_text(distribution).encode()
    return with_host(entries, model_name, platforms)


def write_slave(
    file: Path,
    about: About,
    blocks: Mapping[str, Block],
    entries: Mapping[str, bytes],
    date: datetime,
) -> None:
    """Write an FMU whose GUID is a hash of its content.

    Args:
        file: Where to write it, ending in .fmu.
        about: What the FMU is.
        blocks: Its variables.
        entries: Content by path inside the archive, without the model description.
        date: Of every entry.

    Raises:
        BuildError: If the file cannot be written.
    """
    # The description is part of the content that the GUID stands for.
    draft = fmi2_description(about, blocks, guid="")
    guid = content_guid({**entries, "modelDescription.xml": draft})
    described = {
        **entries,
        "modelDescription.xml": fmi2_description(about, blocks, guid),
        "resources/guid.txt": f"{guid}\n".encode(),
    }
    write_fmu(file, described, date)
