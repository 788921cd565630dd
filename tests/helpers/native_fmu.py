"""An unpacked native FMU of FMI 2.0: its variables by name, instances through FMPy, masters in C."""

import ctypes
import hashlib
import os
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import fmpy
import pytest
from filelock import FileLock
from fmpy.fmi1 import printLogMessage
from fmpy.fmi2 import (
    FMU2Slave,
    calloc,
    fmi2CallbackAllocateMemoryTYPE,
    fmi2CallbackFreeMemoryTYPE,
    fmi2CallbackFunctions,
    fmi2CallbackLoggerTYPE,
    free,
)
from fmpy.logging import addLoggerProxy
from places import TESTS

from coupling.native.cache import cache_folder
from coupling.native.compiler import SOURCES, _version, host_platform
from elastic_robot.fmi.variables import POSE

POSTURE = [0.0, -0.3, 0.5, 0.0, 0.6, 0.0]
WRENCH = tuple(f"{kind}.{c}" for kind in ("force", "moment") for c in "xyz")
TCP = tuple(f"tcp.{c}" for c in POSE)
Q_CMD = tuple(f"q_cmd[{i}]" for i in range(1, 7))
SANITIZERS = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g1", "-O1")
_MASTERS = TESTS / "native"
_PRINTER = fmi2CallbackLoggerTYPE(printLogMessage)


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

    def slave(
        self, logging: bool = False, callbacks: fmi2CallbackFunctions | None = None
    ) -> FMU2Slave:
        """An instance that prints what it logs, or calls FMPy's callbacks."""
        slave = FMU2Slave(
            guid=self.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate(callbacks=callbacks or _printing(), loggingOn=logging)
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


def _printing() -> fmi2CallbackFunctions:
    """FMPy's own callbacks call the logger that some instance of the process was given last."""
    callbacks = fmi2CallbackFunctions(
        logger=_PRINTER,
        allocateMemory=fmi2CallbackAllocateMemoryTYPE(calloc),
        freeMemory=fmi2CallbackFreeMemoryTYPE(free),
    )
    addLoggerProxy(ctypes.byref(callbacks))
    return callbacks


def compiler() -> str:
    """This machine's compiler; the test is skipped where there is none."""
    found = shutil.which("cc")
    if found is None:
        pytest.skip("needs a C compiler named cc for the test's own host")
    return found


def compiled(folders: Sequence[Path], *arguments: str) -> Path:
    """What this machine's compiler makes in the first folder; kept in the cache folder, named by a
    hash of the compiler, its arguments and the C files of all folders."""
    command = [compiler(), "-std=c99", *arguments]
    digest = hashlib.sha256(repr(command).encode() + _version((compiler(),)))
    for folder in folders:
        for file in sorted(folder.rglob("*.[ch]")):
            digest.update(file.relative_to(folder).as_posix().encode() + file.read_bytes())
    made = cache_folder() / "tests" / digest.hexdigest()[:24]
    if not made.is_file():
        made.parent.mkdir(parents=True, exist_ok=True)
        with (
            FileLock(made.with_suffix(".lock")),
            tempfile.TemporaryDirectory(dir=made.parent) as new,
        ):
            out = Path(new, "out")
            subprocess.run([*command, "-o", str(out)], cwd=folders[0], check=True)
            out.rename(made)
    return made


def _of_master(name: str, *flags: str) -> Path:
    warned = ("-O1", "-Wall", "-Wextra", f"-I{os.path.relpath(SOURCES / 'fmi', _MASTERS)}")
    return compiled((_MASTERS, SOURCES), *warned, "-c", *flags, f"{name}.c")


def build_master(name: str, file: Path, *flags: str) -> Path:
    """Compile a master in C of tests/native that loads the library."""
    command = [compiler(), *flags, "-o", str(file), str(_of_master(name, *flags))]
    subprocess.run([*command, "-ldl", "-lm", "-lpthread"], check=True)
    return file


def build_linked(name: str, file: Path, library: Path, *flags: str) -> Path:
    """Compile a program of tests/native that is linked with a library of the FMU."""
    command = [compiler(), *flags, "-o", str(file), str(_of_master(name, *flags)), str(library)]
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
