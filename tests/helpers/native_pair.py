"""One robot as native FMUs of FMI 2.0 and of FMI 3.0, through FMPy, variables by name."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from native_fmu import POSTURE

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.native.compiler import host_platform
from elastic_robot.description import Robot


@dataclass
class Pair:
    """One robot as FMUs of both versions of FMI, unpacked."""

    folder2: Path
    folder3: Path

    def __post_init__(self) -> None:
        self.description = fmpy.read_model_description(str(self.folder3))
        self.references = {v.name: v.valueReference for v in self.description.modelVariables}
        self.sizes = {
            v.valueReference: int(np.prod(v.shape)) if v.shape else 1
            for v in self.description.modelVariables
        }
        scalars = fmpy.read_model_description(str(self.folder2))
        self.scalars = {v.name: v.valueReference for v in scalars.modelVariables}
        self.guid2 = scalars.guid

    @property
    def library3(self) -> Path:
        """The library of FMI 3.0 for this machine."""
        platform = host_platform()
        return self.folder3 / "binaries" / platform.machine / f"ElasticRobot{platform.suffix}"

    def fmi2(self) -> FMU2Slave:
        slave = FMU2Slave(
            guid=self.guid2,
            unzipDirectory=str(self.folder2),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate()
        return slave

    def fmi3(self, token: str | None = None, **options: object) -> FMU3Slave:
        slave = FMU3Slave(
            guid=token or self.description.guid,
            unzipDirectory=str(self.folder3),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate(**options)
        return slave

    def get(self, slave: FMU3Slave, *names: str) -> list[float]:
        found = [self.references[name] for name in names]
        return slave.getFloat64(found, sum(self.sizes[k] for k in found))

    def pick(self, unknown: str, known: str) -> tuple[list[int], list[int]]:
        """Value references of an output and an input."""
        return [self.references[unknown]], [self.references[known]]

    def arrays_of(self, references: Sequence[int]) -> tuple[list[int], int]:
        """Variables of FMI 3.0 for whole ones of FMI 2.0 by elements, and how many numbers they have."""
        found = [k for k in references if k in self.sizes]
        return found, sum(self.sizes[k] for k in found)

    def set(self, slave: FMU3Slave, name: str, values: list[float]) -> None:
        slave.setFloat64([self.references[name]], values)

    def started(self, **strings: str) -> FMU3Slave:
        """An instance at rest in POSTURE."""
        slave = self.fmi3()
        for name, value in strings.items():
            slave.setString([self.references[name]], [value])
        slave.enterInitializationMode(startTime=0.0)
        self.set(slave, "q_cmd", POSTURE)
        slave.exitInitializationMode()
        return slave

    def everything(self, slave: FMU3Slave) -> list[float]:
        """All reals, in the order of their value references."""
        reals = sorted(
            v.valueReference
            for v in self.description.modelVariables
            if v.type == "Float64" and v.name != "time"
        )
        return slave.getFloat64(reals, sum(self.sizes[k] for k in reals))


def make_pair(robot: Robot, folder: Path, arrays: bool = True) -> Pair:
    for fmi in ("2", "3"):
        options = BuildOptions("native", fmi=fmi, arrays=arrays and fmi == "3")
        file = build_fmu(robot, folder / f"{fmi}.fmu", options)
        fmpy.extract(str(file), unzipdir=str(folder / fmi))
    return Pair(folder / "2", folder / "3")
