"""Nothing is learned where a robot that the runs allow would become worse."""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from coupling.errors import SimulationError
from coupling.identification.next.options import FrameAccuracy, NextOptions
from coupling.identification.next.path_learning import learn_path
from coupling.identification.next.trust_region import restrict_learning
from coupling.identification.runs.measurement import SimulatedPath
from coupling.inverse.inversion import DesiredMotion
from coupling.path.histories import ToolPath

TIME = np.linspace(0.0, 20.0, 2001)  # [s]
OPTIONS = NextOptions(FrameAccuracy(5e-5, 5e-5), repeatability=0.0)
AT_REST = ToolPath(TIME, np.tile([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0], (1, len(TIME), 1)))
WAVE = 1e-4 * np.sin(np.pi * TIME)[:, None] * np.array([1.0, 0.0, 0.0])
BOX = ((TIME > 12.0) & (TIME < 14.0)).astype(float)
CROSSING = 3e-4 * gaussian_filter1d(BOX, 20.0)[:, None] * np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0])


@dataclass(frozen=True)
class PathInverter:
    """The inverse of a robot that is where it is commanded."""

    simulations: int = 300

    def invert(self, motion, controller, goal, watch):
        return SimpleNamespace(joints=motion.path)


class RobotWithGear:
    """Where it is commanded, but for a gear that crosses at 13 s where its log factor is beyond 0.1.

    Args:
        is_shown: Whether it crosses under every command, by half as much where that is as before.
        is_unstable: Whether a robot beyond gives way instead under every command.
        gives_way: Whether it does so under commands that are changed at 13 s.
        is_touchy: Whether it crosses at 13 s wherever a command is changed.
    """

    def __init__(
        self,
        is_shown: bool = False,
        is_unstable: bool = False,
        gives_way: bool = False,
        is_touchy: bool = False,
    ) -> None:
        self.is_shown, self.is_unstable = is_shown, is_unstable
        self.gives_way, self.is_touchy = gives_way, is_touchy
        self.parameters = [SimpleNamespace(kind="backlash", gear=0)]
        self.fmu = SimpleNamespace(simulate=self.simulate)
        noise = 1e-5 * np.random.default_rng(1).standard_normal((len(TIME), 3))
        stored = SimpleNamespace(wrench=None, joints=AT_REST)
        source = SimpleNamespace(
            desired_motion=DesiredMotion(AT_REST, None, None),
            stored=stored,
            torque_curve="backlash",
            drive="ideal",
            controller=None,
            discrepancy=None,
        )
        measured = SimpleNamespace(time=TIME)
        run = SimpleNamespace(measured=measured, deviation=WAVE + noise, source=source, noise=1e-5)
        run.desired = SimpleNamespace(time=TIME, position=AT_REST.position)
        self.sources, self.runs = [source], [run]

    def robot_at(self, x):
        return x

    def simulate(self, command, wrench, mode, robot):
        beyond = abs(float(robot[0])) > 0.1
        change = np.abs(command.position - AT_REST.position)[0]
        changed = change[slice(None) if self.is_touchy else 1300].max() > 1e-6
        if beyond and (self.is_unstable or (self.gives_way and changed)):
            raise SimulationError("the robot gives way")
        part = 1.0 if changed else 0.5 * self.is_shown
        return command.displaced(beyond * part * CROSSING)

    def simulated(self, number, x):
        return SimulatedPath(self.simulate(AT_REST, None, "dynamic", x))

    def unmodelled(self, number, x):
        shift = self.runs[number].deviation - self.simulated(number, x).position(TIME)
        return np.hstack([shift, np.zeros_like(shift)])


def corrections(history: RobotWithGear) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times, what is learned, and what would be without a trust region [m], (n, 3)."""
    model = SimpleNamespace(x=np.zeros(1), highest_cutoff=5.0)
    models = SimpleNamespace(inverter=lambda *robot: PathInverter())
    update = learn_path(history, model, 2.0, OPTIONS)
    free = update.correction()
    learned = restrict_learning(update, history, model, OPTIONS, models)
    return free.time, learned.deviation[:, :3], free.deviation[:, :3]


def test_where_a_gear_may_cross_for_the_first_time_the_command_stays():
    time, learned, free = corrections(RobotWithGear())
    at_gear, elsewhere = (time > 12.5) & (time < 13.5), (time < 10.0) | (time > 16.0)
    assert np.abs(free[at_gear]).max() > 9e-5
    assert np.abs(learned[at_gear]).max() < 1e-6
    np.testing.assert_allclose(learned[elsewhere], free[elsewhere], atol=1e-7)


@pytest.mark.parametrize("history", [RobotWithGear(is_shown=True), RobotWithGear(is_unstable=True)])
def test_a_robot_that_the_runs_rule_out_keeps_nothing_from_being_learned(history):
    _, learned, free = corrections(history)
    np.testing.assert_array_equal(learned, free)


@pytest.mark.parametrize("history", [RobotWithGear(gives_way=True), RobotWithGear(is_touchy=True)])
def test_the_command_stays_where_no_part_of_learning_is_safe(history):
    """A plausible robot that gives way under the next command, or is worse with each part of it."""
    _, learned, free = corrections(history)
    assert np.abs(free).max() > 9e-5
    assert np.abs(learned).max() < 1e-12
