"""FMUs that run in Python, on PythonFMU's binaries: what the robot's and the process's share."""

from __future__ import annotations

import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from datetime import datetime
from importlib import metadata
from pathlib import Path

from pythonfmu.builder import FmuBuilder

from coupling.fmu_export.archive import licenses, write_fmu
from coupling.fmu_export.fmi2 import fmi2_description
from coupling.fmu_export.model_description import STATUSES, ModelInfo
from coupling.fmu_export.python_host import with_host
from coupling.native.compiler import FMU_SOURCES
from elastic_robot.fmi.variables import Block


@contextmanager
def _importable(folder: Path) -> Iterator[None]:
    """Put a folder first on the module path, and leave the path as it was."""
    before = sys.path.copy()
    sys.path.insert(0, str(folder))
    try:
        yield
    finally:
        sys.path[:] = before


@dataclass(frozen=True)
class PythonSlave:
    """A slave in Python.

    Attributes:
        module: Name of the module in `fmu_src/` that has its class, as `elastic_robot_slave` has
            `ElasticRobotSlave`.
        class_name: The class's `modelName`.
        model_name: Name of the FMU's model and its identifier.
        description: One line.
        capabilities: Flags of `CoSimulation` that are true.
        blocks: The variables.
        files: Files that it imports, by path inside the resources.
    """

    module: str
    class_name: str
    model_name: str
    description: str
    capabilities: tuple[str, ...]
    blocks: Mapping[str, Block]
    files: Mapping[str, Path] = field(default_factory=dict)

    def write(
        self,
        file: Path,
        date: datetime,
        resources: Mapping[str, bytes],
        further: dict[str, bytes],
        platforms: Sequence[str] = (),
    ) -> Path:
        """Write the FMU and return the file.

        In front of PythonFMU's library stands ours, for this machine if it has a compiler.

        Args:
            file: File to write, ending in .fmu.
            date: Date of every entry.
            resources: Files that the slave reads, by name.
            further: Further content of the FMU, by path inside the archive.
            platforms: Names of the platforms on which ours must stand in front.

        Raises:
            BuildError: If a platform is not known or has no library of PythonFMU's, the compiler
                fails, or the file cannot be written.
        """
        tool = f"PythonFMU {metadata.version('pythonfmu')}"
        described = ModelInfo(self.model_name, self.description, tool, date, self.capabilities)
        entries = self._build_files(resources) | licenses(pythonfmu="pythonfmu") | further
        entries = with_host(entries, self.model_name, platforms)

        def identified(guid: str) -> dict[str, bytes]:
            return {
                "modelDescription.xml": fmi2_description(
                    described, self.blocks, guid, statuses=(*STATUSES, "Fatal")
                ),
                "resources/guid.txt": f"{guid}\n".encode(),
            }

        return write_fmu(file, entries, identified, date)

    def _build_files(self, resources: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return the slave with PythonFMU's binaries and package."""
        with tempfile.TemporaryDirectory() as folder, _importable(FMU_SOURCES):
            files = [Path(folder, name) for name in resources]
            for path, data in zip(files, resources.values(), strict=True):
                path.write_bytes(data)
            # PythonFMU keeps one module of each name: the robot's entry must not be the process's.
            entry = Path(folder, f"{self.module.replace('_slave', '_entry')}.py")
            entry.write_bytes((FMU_SOURCES / "slave_entry.py").read_bytes())
            file = Path(folder, f"{self.class_name}.fmu")
            modules = [FMU_SOURCES / f"{name}.py" for name in (self.module, "slave_refusal")]
            needed = [*self._copy_imports(Path(folder)), *modules, *files]
            FmuBuilder.build_FMU(entry, dest=file, project_files=needed)
            with zipfile.ZipFile(file) as archive:
                return {self._entry_path(name): archive.read(name) for name in archive.namelist()}

    def _copy_imports(self, folder: Path) -> set[Path]:
        """Copy what is imported into a folder, and return the folders and files that are then in it."""
        for name, source in self.files.items():
            copy = folder / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes(source.read_bytes())
        return {folder / Path(name).parts[0] for name in self.files}

    def _entry_path(self, entry: str) -> str:
        """Return the path of an entry; a library bears the name of the model, not of the class."""
        folder, _, file = entry.rpartition("/")
        stem, dot, suffix = file.partition(".")
        if not folder.startswith("binaries/") or stem != self.class_name:
            return entry
        return f"{folder}/{self.model_name}{dot}{suffix}"
