"""Directional derivatives by every tunable parameter, of random robots with all parts of the model."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from native_pair import make_pair
from random_robots import driven, make_robot, with_gear_parts, with_hysteresis

from coupling.fmu_export.exchange_blocks import all_blocks

STEP = 0.004
LOAD = (300.0, -200.0, -400.0, 30.0, 10.0, -20.0)
CURVES = ("linear", "backlash", "spline")
# Parts of the parameters by which they are moved: elements that slip meanwhile want small ones.
WIDTHS = (1e-4, 1e-5, 1e-6)
Values = dict[str, np.ndarray]


class Motion:
    """A random robot under a load in both versions of FMI, whose parameters may be other ones."""

    def __init__(self, seed: int, drive: str, folder: Path) -> None:
        rng, joints = np.random.default_rng(seed), 1 + seed % 5
        robot = make_robot(seed, joints)
        moved = drive != "ideal" or seed % 2
        robot = driven(robot, rng) if moved else with_hysteresis(robot, seed)
        self.robot = with_gear_parts(robot, seed)
        self.pair = make_pair(self.robot, folder)
        self.two, self.three, self.states = self.pair.fmi2(), self.pair.fmi3(), ()
        curve = CURVES[seed % 3] if drive == "ideal" else "linear"
        self.strings = {"torque_curve": curve, "drive": drive}
        table = {name: block for name, block in all_blocks(self.robot).items() if block.variables}
        self.references = {
            name: [self.pair.scalars[v.name] for v in block.variables]
            for name, block in table.items()
        }
        self.parameters = [name for name, b in table.items() if b.variability == "tunable"]
        self.outputs = [name for name, b in table.items() if b.causality == "output"]
        q, qd = rng.uniform(-1.0, 1.0, (2, joints)) * [[1.0], [0.3]]
        torque = 50.0 * rng.normal(size=len(self.references.get("torque_cmd", ())))
        self.inputs = {"wrench": np.array(LOAD), "q_cmd": q, "qd_cmd": qd, "torque_cmd": torque}

    def at(self, step: int) -> Values:
        """What is set before a step."""
        q = self.inputs["q_cmd"] + step * STEP * self.inputs["qd_cmd"]
        moved = {**self.inputs, "q_cmd": q}
        return {name: values for name, values in moved.items() if len(values)}

    def start(self, stepped: bool) -> None:
        """Initialise with the load, or go on to where the third step begins."""
        two, three, ours = self.two, self.three, self.pair.references
        for name, value in self.strings.items():
            two.setString([self.pair.scalars[name]], [value])
            three.setString([ours[name]], [value])
        two.setupExperiment(startTime=0.0)
        self.set({"tolerance": np.array([1e-11])})
        two.enterInitializationMode()
        three.enterInitializationMode(startTime=0.0)
        self.set(self.at(0))
        if not stepped:
            return
        two.exitInitializationMode()
        three.exitInitializationMode()
        for step in range(2):
            self.set(self.at(step))
            two.doStep(step * STEP, STEP)
            three.doStep(step * STEP, STEP)
        self.set(self.at(2))
        self.states = two.getFMUstate(), three.getFMUState()

    def move(self, name: str, values: np.ndarray) -> Values:
        """Start, or take the third step, with other parameters of a block; return the outputs."""
        if self.states:
            self.two.setFMUstate(self.states[0])
            self.three.setFMUState(self.states[1])
        self.set({name: values})
        if self.states:
            self.two.doStep(2 * STEP, STEP)
            self.three.doStep(2 * STEP, STEP)
        return {output: self.get(output) for output in self.outputs}

    def set(self, values: Mapping[str, np.ndarray]) -> None:
        for name, given in values.items():
            self.two.setReal(self.references[name], given.tolist())
            self.three.setFloat64(self.arrays(name)[0], given.tolist())

    def get(self, name: str) -> np.ndarray:
        return np.array(self.two.getReal(self.references[name]))

    def arrays(self, *names: str) -> tuple[list[int], int]:
        """Value references of blocks in FMI 3.0, and how many numbers they are."""
        return self.pair.arrays_of([k for name in names for k in self.references[name]])


def slopes(motion: Motion, name: str, seeds: np.ndarray):
    """Return, by width, outputs and their slopes along a change of a block, by four points."""
    own, found = motion.get(name), []
    for width in WIDTHS:
        far, near, up, high = (
            motion.move(name, own + part * width * seeds) for part in (-2.0, -1.0, 1.0, 2.0)
        )
        by_block = {
            k: (far[k] - 8.0 * near[k] + 8.0 * up[k] - high[k]) / (12.0 * width) for k in up
        }
        found.append((width, up, by_block))
    motion.move(name, own)
    return found


@pytest.mark.parametrize("stepped", [False, True])
@pytest.mark.parametrize(
    ("seed", "drive"),
    [(2, "ideal"), (3, "ideal"), (4, "ideal"), (2, "servo"), (3, "servo"), (4, "torque")],
)
def test_derivatives_by_each_parameter_are_slopes(tmp_path, seed, drive, stepped):
    """Of start and step, to 1e-4 of the largest of a block and rounding; in both versions the same."""
    motion, rng = Motion(seed, drive, tmp_path), np.random.default_rng(seed)
    motion.start(stepped)
    unknowns = [k for name in motion.outputs for k in motion.references[name]]
    ends = np.cumsum([len(motion.references[name]) for name in motion.outputs])[:-1]
    assert len(motion.parameters) == (6 if any(j.drive for j in motion.robot.joints) else 5)
    for name in motion.parameters:
        own = motion.get(name)
        seeds = rng.normal(size=len(own)) * np.abs(own)
        measured = slopes(motion, name, seeds)
        answered = motion.two.getDirectionalDerivative(
            unknowns, motion.references[name], seeds.tolist()
        )
        (outputs, count), (knowns, _) = motion.arrays(*motion.outputs), motion.arrays(name)
        assert answered == motion.three.getDirectionalDerivative(
            outputs, knowns, seeds.tolist(), count
        )
        for block, found in zip(motion.outputs, np.split(np.array(answered), ends), strict=True):
            errors = [
                np.abs(found - slope[block]).max()
                - 1e-4 * np.abs(slope[block]).max()
                - 2e-14 * np.abs(values[block]).max() / width
                for width, values, slope in measured
            ]
            assert min(errors) <= 0.0, (block, name, found, [s[block] for *_, s in measured])
