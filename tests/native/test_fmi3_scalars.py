"""The native FMU of FMI 3.0 with scalars: the variables of FMI 2.0, and the same numbers."""

from __future__ import annotations

from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from random_robots import make_robot

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.description import Robot

STEP = 0.004  # [s]


@dataclass
class Scalars:
    """One robot in both versions of FMI, unpacked in folders "2" and "3"."""

    folder: Path

    def __post_init__(self) -> None:
        self.description = {
            fmi: fmpy.read_model_description(str(self.folder / fmi)) for fmi in "23"
        }
        variables = self.description["3"].modelVariables
        self.references = {v.name: v.valueReference for v in variables}

    def slave(self, fmi: str) -> FMU2Slave | FMU3Slave:
        """An instance in initialisation mode."""
        slave = {"2": FMU2Slave, "3": FMU3Slave}[fmi](
            guid=self.description[fmi].guid,
            unzipDirectory=str(self.folder / fmi),
            modelIdentifier="ElasticRobot",
            instanceName="robot",
        )
        slave.instantiate()
        if fmi == "2":
            slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        return slave

    def of_causality(self, causality: str) -> list[int]:
        """Value references of reals."""
        variables = self.description["2"].modelVariables
        found = [v for v in variables if v.causality == causality and v.type == "Real"]
        return [v.valueReference for v in found]


def make_scalars(robot: Robot, folder: Path) -> Scalars:
    for fmi in "23":
        file = build_fmu(robot, folder / f"{fmi}.fmu", BuildOptions("native", fmi=fmi))
        fmpy.extract(str(file), unzipdir=str(folder / fmi))
    return Scalars(folder)


@pytest.fixture(scope="module")
def scalars(example, tmp_path_factory) -> Scalars:
    return make_scalars(example, tmp_path_factory.mktemp("scalars"))


def test_variables_are_those_of_fmi2_to_the_reference_unit_and_start(scalars):
    """Time, the independent variable, is the last one."""

    def told(fmi: str) -> dict[str, tuple]:
        common = attrgetter(
            *("valueReference", "causality", "variability", "initial", "unit", "min", "max"),
            *("nominal", "description"),
        )
        kinds = {"Real": "Float64"}  # by their names in FMI 3
        return {
            v.name: (*common(v), kinds.get(v.type, v.type), str(v.start), v.shape or None)
            for v in scalars.description[fmi].modelVariables
        }

    two, three = told("2"), told("3")
    assert three["time"][:2] == (len(two) - 1, "independent")
    assert three == two
    text = (scalars.folder / "3" / "modelDescription.xml").read_text()
    assert "<Dimension" not in text


def test_what_outputs_and_derivatives_follow_is_as_in_fmi2(scalars):
    """FMI 2 counts variables from one, FMI 3 names value references, which count from zero.

    Parameters are knowns of outputs and derivatives in FMI 3 alone (FMI 3.0.2, 2.4.8).
    """
    parameters = set(scalars.of_causality("parameter"))

    def structure(fmi: str, elements: tuple[str, str], key: str, first: int) -> list[list[int]]:
        root = ElementTree.parse(scalars.folder / fmi / "modelDescription.xml").getroot()
        found = [e for name in elements for e in root.findall(f"ModelStructure/{name}")]
        return [
            [int(k) - first for k in (e.get(key), *e.get("dependencies").split())] for e in found
        ]

    lists = [f"{name}/Unknown" for name in ("Outputs", "Derivatives", "InitialUnknowns")]
    two = structure("2", tuple(lists), "index", 1)
    names = ("Output", "ContinuousStateDerivative", "InitialUnknown")
    three = structure("3", names, "valueReference", 0)
    tuned = len(two) - len(scalars.description["2"].initialUnknowns)
    three[:tuned] = [[k for k in row if k not in parameters] for row in three[:tuned]]
    assert three == two
    states = [v for v in scalars.description["2"].modelVariables if v.derivative is not None]
    assert len(two) == 2 * (len(scalars.of_causality("output")) + len(states))


@pytest.mark.parametrize(("seed", "joints"), [(2, 1), (6, 4)])
def test_all_reals_and_derivatives_are_bit_for_bit_those_of_fmi2(tmp_path, seed, joints):
    """A random robot under random commands and wrenches; a state goes back on the way."""
    scalars = make_scalars(make_robot(seed, joints), tmp_path)
    rng = np.random.default_rng(seed)
    inputs, outputs = (scalars.of_causality(name) for name in ("input", "output"))
    moved = inputs[: 6 + 2 * joints]
    two, three = (scalars.slave(fmi) for fmi in "23")
    for slave in (two, three):
        slave.exitInitializationMode()
    for k in range(10):
        values = (rng.normal(size=len(moved)) * ([100.0] * 6 + [0.1] * 2 * joints)).tolist()
        state = three.getFMUState()
        for size in (0.5 * STEP, STEP):  # the first is taken back
            three.setFMUState(state)
            three.setFloat64(moved, values)
            three.doStep(STEP * k, size)
        two.setReal(moved, values)
        two.doStep(STEP * k, STEP)
        assert three.getFloat64(outputs) == two.getReal(outputs)
    seed_of = rng.normal(size=len(moved)).tolist()
    expected = two.getDirectionalDerivative(outputs, moved, seed_of)
    assert three.getDirectionalDerivative(outputs, moved, seed_of, len(outputs)) == expected
    assert np.any(np.abs(expected) > 0.0)


def test_arrays_are_for_fmi3(tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--arrays"]) == 2
    assert "arrays: expected FMI 3, got FMI 2: add --fmi 3" in capsys.readouterr().err
    with pytest.raises(BuildError, match="arrays"):
        BuildOptions("python", arrays=True)
