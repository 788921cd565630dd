"""An unpacked native FMU of FMI 2.0: its variables by name, instances through FMPy, masters in C."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Mapping
from pathlib import Path

import fmpy
import pytest
from fmpy.fmi2 import FMU2Slave
from places import TESTS

from coupling.fmu_export.compiler import SOURCES, host_platform
from elastic_robot.fmi.variables import POSE

POSTURE = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
WRENCH = tuple(f"{kind}.{c}" for kind in ("force", "moment") for c in "xyz")
TCP = tuple(f"tcp.{c}" for c in POSE)
Q_CMD = tuple(f"q_cmd[{i}]" for i in range(1, 7))
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")
_MASTERS = TESTS / "native"


class NativeFmu:
    """An FMU's folder, its GUID, library and value references.

    Args:
        file: The FMU.
        folder: Where it is unpacked.
        platform: Folder of its library; that of this machine unless given.
    """

    def __init__(self, file: Path, folder: Path, platform: str = "") -> None:
        fmpy.extract(str(file), unzipdir=str(folder))
        self.folder = folder
        self.description = fmpy.read_model_description(str(folder))
        self.guid = self.description.guid
        libraries = folder / "binaries" / (platform or host_platform().name)
        # PythonFMU's beside it has a longer name.
        self.library = next(libraries.glob(f"{self.description.coSimulation.modelIdentifier}.*"))
        self.resources = (folder / "resources").as_uri()
        variables = self.description.modelVariables
        self.references = {v.name: v.valueReference for v in variables}
        self.reals = [v.valueReference for v in variables if v.type == "Real"]
        self.strings = [v.valueReference for v in variables if v.type == "String"]
        self.inputs = [v.valueReference for v in variables if v.causality == "input"]
        self.outputs = [v.valueReference for v in variables if v.causality == "output"]

    def slave(self, logging: bool = False) -> FMU2Slave:
        """An instance."""
        slave = FMU2Slave(
            guid=self.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate(loggingOn=logging)
        return slave

    def started(self, q=POSTURE, tolerance: float | None = None, **strings: str) -> FMU2Slave:
        """An instance at rest under its weight."""
        return self.start(self.slave(), q, tolerance, **strings)

    def start(self, slave: FMU2Slave, q=POSTURE, tolerance: float | None = None, **strings: str):
        """Initialise an instance; returns it."""
        slave.setupExperiment(startTime=0.0)
        if tolerance is not None:
            self.set(slave, {"tcp_tolerance": tolerance})
        for name, value in strings.items():
            slave.setString([self.references[name]], [value])
        slave.enterInitializationMode()
        self.set(slave, {f"q_cmd[{i}]": value for i, value in enumerate(q, start=1)})
        slave.exitInitializationMode()
        return slave

    def of(self, names) -> list[int]:
        """Value references."""
        return [self.references[name] for name in names]

    def get(self, slave: FMU2Slave, *names: str) -> list[float]:
        return slave.getReal(self.of(names))

    def set(self, slave: FMU2Slave, values: Mapping[str, float]) -> None:
        slave.setReal(self.of(values), list(values.values()))


def compiler() -> str:
    """This machine's compiler; the test is skipped where there is none."""
    found = shutil.which("cc")
    if found is None:
        pytest.skip("needs a C compiler named cc for the test's own host")
    return found


def build_master(name: str, file: Path, *flags: str) -> Path:
    """Compile a master in C of tests/native that loads the library."""
    command = [compiler(), "-std=c99", "-O1", "-Wall", "-Wextra"]
    command += [f"-I{SOURCES / 'fmi'}", *flags, "-o", str(file), str(_MASTERS / f"{name}.c")]
    subprocess.run([*command, "-ldl", "-lm", "-lpthread"], check=True)
    return file


def build_linked(name: str, file: Path, library: Path, *flags: str) -> Path:
    """Compile a program of tests/native that is linked with a library of the FMU."""
    command = [compiler(), "-std=c99", "-O1", "-Wall", "-Wextra", *flags, f"-I{SOURCES / 'fmi'}"]
    command += ["-o", str(file), str(_MASTERS / f"{name}.c"), str(library)]
    subprocess.run([*command, f"-Wl,-rpath,{library.parent}", "-ldl", "-lm"], check=True)
    return file


def run_master(fmu: NativeFmu, command: list[str], script: str, timeout: float = 120.0) -> str:
    """Run in an empty environment: no PATH, no locale, no library paths."""
    done = subprocess.run(
        [*command, str(fmu.library), fmu.guid, fmu.resources, script],
        env={},
        capture_output=True,
        text=True,
        errors="replace",
        timeout=timeout,
    )
    assert done.returncode == 0, done.stderr[-5000:]
    return done.stdout
