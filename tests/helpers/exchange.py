"""A native FMU in model exchange, through FMPy: states, derivatives and variables as NumPy arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import fmpy
import numpy as np
from fmpy.fmi2 import FMU2Model
from native_fmu import POSTURE

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.exchange_blocks import all_blocks
from elastic_robot.description import Robot

STATES = ("deflection", "deflection_rate")
DERIVATIVES = ("deflection_derivative", "rate_derivative")


@dataclass
class Exchange:
    """An instance of model exchange of FMI 2.0, and the value references of each block."""

    robot: Robot
    folder: Path
    references: dict[str, list[int]] = field(init=False)

    def __post_init__(self) -> None:
        self.description = fmpy.read_model_description(str(self.folder))
        by_name = {v.name: v.valueReference for v in self.description.modelVariables}
        self.references = {
            name: [by_name[v.name] for v in block.variables]
            for name, block in all_blocks(self.robot).items()
        }
        self.references["time"] = [by_name["time"]]
        self.strings = {
            v.name: v.valueReference for v in self.description.modelVariables if v.type == "String"
        }
        self.indicators = self.description.numberOfEventIndicators
        self.states = self.description.numberOfContinuousStates
        self.fmu = FMU2Model(
            guid=self.description.guid,
            unzipDirectory=str(self.folder),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        self.fmu.instantiate()

    def of(self, *names: str) -> list[int]:
        """Value references of blocks."""
        return [reference for name in names for reference in self.references[name]]

    def start(self, q: Sequence[float] = POSTURE, time: float = 0.0, **strings: str) -> Exchange:
        """Initialise in a posture; continuous-time mode."""
        self.fmu.setupExperiment(startTime=time)
        for name, value in strings.items():
            self.fmu.setString([self.strings[name]], [value])
        self.fmu.enterInitializationMode()
        self.set("q_cmd", q)
        self.fmu.exitInitializationMode()
        self.fmu.newDiscreteStates()
        self.fmu.enterContinuousTimeMode()
        return self

    def set(self, name: str, values: Sequence[float]) -> None:
        self.fmu.setReal(self.references[name], [float(value) for value in values])

    def get(self, *names: str) -> np.ndarray:
        return np.array(self.fmu.getReal(self.of(*names)))

    def _vector(self, getter, count: int) -> np.ndarray:
        values = np.zeros(count)
        getter(np.ctypeslib.as_ctypes(values), count)
        return values

    @property
    def state(self) -> np.ndarray:
        """x, then x'."""
        return self._vector(self.fmu.getContinuousStates, self.states)

    @state.setter
    def state(self, values: np.ndarray) -> None:
        given = np.ascontiguousarray(values, dtype=float)
        self.fmu.setContinuousStates(np.ctypeslib.as_ctypes(given), len(given))

    def derivatives(self) -> np.ndarray:
        """x', then x''."""
        return self._vector(self.fmu.getDerivatives, self.states)

    def event_indicators(self) -> np.ndarray:
        return self._vector(self.fmu.getEventIndicators, self.indicators)

    def nominals(self) -> np.ndarray:
        return self._vector(self.fmu.getNominalsOfContinuousStates, self.states)

    def jacobian(self, unknowns: Sequence[str], known: str) -> np.ndarray:
        """Derivatives of blocks by each variable of a block."""
        asked = self.of(*unknowns)
        columns = [
            self.fmu.getDirectionalDerivative(asked, [reference], [1.0])
            for reference in self.references[known]
        ]
        return np.array(columns).reshape(-1, len(asked)).T


def exchange_of(robot: Robot, folder: Path) -> Exchange:
    """An instance of a robot's own FMU."""
    file = build_fmu(robot, folder / "Robot.fmu", BuildOptions("native"))
    fmpy.extract(str(file), unzipdir=str(folder / "fmu"))
    return Exchange(robot, folder / "fmu")
