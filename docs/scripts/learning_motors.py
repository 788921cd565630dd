"""What angles and torques of motors add to a measured run of the tool, for docs/learn.md."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from coupling.files.robot_file import find_robot
from coupling.identification.runs.learning import Learned, LearnOptions, learn
from coupling.identification.runs.measurement import Measurement
from coupling.identification.runs.motors import MeasuredMotors
from coupling.identification.runs.parameters import learnable
from coupling.identification.runs.source import read_source
from coupling.path.histories import ToolPath
from coupling.path.motor_history import MotorHistory
from coupling.robot.parameters import apply_values, scaled_values
from coupling.run.models import Models
from docs.scripts.inverse_servos import with_motors
from docs.scripts.learning_shop import CUT, Shop, _unseen
from docs.scripts.learning_studies import DEPTH, Left, case_text
from docs.scripts.next_histories import commanded
from docs.scripts.page import table
from docs.scripts.robots_with_backlash import FANUC_HOME, MIXED, with_backlash

# Factors of friction and hysteresis of the robot that really moves.
TRUTH = {"friction": 1.2, "hysteresis": 1.2}
# Noise of positions [m], of encoders [rad], and of torques over their rms.
NOISE, ENCODER, TORQUE = 1e-5, 5e-6, 0.01


@dataclass(frozen=True)
class _Run:
    """What one run determines, and deviations under the commands of `learn` and `next` after it."""

    found: Learned
    left: Left
    next: Left

    def cells(self) -> tuple[str, str, str, str]:
        """What is left by both, error and half interval of friction, and what is held."""
        identifiable = [own for own in self.found.parameters if own.identifiable]
        truth = [
            (TRUTH.get(p.parameter.kind, 1.0) if p.parameter.gear is not None else 1.0) * p.start
            for p in identifiable
        ]
        held = sum(p.low <= value <= p.high for p, value in zip(identifiable, truth, strict=True))
        friction = [own for own in self.found.parameters if own.parameter.kind == "friction"]
        off = max(abs(own.value / own.start / TRUTH["friction"] - 1.0) for own in friction)
        half = np.median([0.5 * np.log(own.high / own.low) for own in friction])
        return (
            f"{_both(self.left)}, less a constant {self.left}",
            _both(self.next),
            f"{100.0 * off:.1f}, {100.0 * half:.1f}",
            f"{held} of {len(identifiable)}",
        )


def _both(left: Left) -> str:
    return f"{1e6 * left.maximum:.0f} / {1e6 * left.rms:.1f}"


class MotorShop(Shop):
    """Where robots with servos are run, with what their motors do."""

    def real(self, run: Path) -> tuple[ToolPath, MotorHistory]:
        """Return what tool and motors really do under a run's command."""
        source, placed = _unseen(run), self._case(self._first).robots[0]
        parameters = learnable(placed.description, placed.torque_curve, placed.drive)
        x = [0.0 if p.gear is None else np.log(TRUTH.get(p.kind, 1.0)) for p in parameters]
        fmu = self._models.of(placed.description, placed.torque_curve, placed.drive).fmu
        joints = [i for i, joint in enumerate(placed.description.joints) if joint.drive]
        stored = source.stored
        other = apply_values(placed.description, scaled_values(parameters, np.array(x)))
        return fmu.with_motors(stored.joints, stored.wrench, joints, other)

    def left(self, run: Path) -> Left:
        """Return what a run's command leaves."""
        return Left.of(self.off(run, self.real(run)[0]))

    def measured(self, with_columns: bool) -> _Run:
        """Return what a run tells, with and without columns of motors."""
        path, moved = self.real(self._first)
        rng, at = np.random.default_rng(1), _unseen(self._first).world_from_base
        rows = np.flatnonzero(path.time <= path.time[-1] - CUT)
        position = at.points(path.position[0][rows] + NOISE * rng.standard_normal((len(rows), 3)))
        motors = None
        if with_columns:
            size = TORQUE * np.sqrt(np.mean(moved.torque**2, axis=0))
            noise = np.hstack([np.full(len(size), ENCODER), size])
            values = np.hstack([moved.angle, moved.torque])[rows]
            values = values + noise * rng.standard_normal(values.shape)
            columns = tuple((kind, j) for kind in ("motor", "motor_torque") for j in moved.joints)
            motors = MeasuredMotors(columns, values, np.ones(len(columns)))
        source = read_source(
            self._first, Measurement("measured.csv", path.time[rows], position, None, motors)
        )
        with Models("native") as models:
            found = learn([source], LearnOptions(), models)
        run = self._first if found.refusal else self.commanded(self._first, found)
        after = self._folder / f"next{len(list(self._folder.glob('next*')))}"
        commanded([source], after)
        return _Run(found, self.left(run), self.left(after))


def motors() -> str:
    """Return the table."""
    own = with_motors(find_robot("icme2008"))
    fanuc, abb = (
        with_motors(Path(with_backlash(find_robot(name), MIXED)))
        for name in ("fanuc_r2000ic", "abb_irb7600")
    )
    cases = {
        "example, cone": case_text(
            "cone", robot={"description": own, "drive": "servo"}, tool_path={"depth_m": DEPTH}
        ),
        "FANUC R-2000iC, cone": case_text(
            "cone",
            robot={"description": fanuc, "drive": "servo", "home_deg": FANUC_HOME},
            part={"position_m": [1.6, 0.3, 0.6]},
            tool_path={"depth_m": DEPTH},
        ),
        "ABB IRB 7600, ISO 9283 at 0.25 m/s": case_text(
            "iso9283",
            robot={"description": abb, "drive": "servo"},
            tool_path={"feed_m_s": 0.25, "sample_s": 0.004},
        ),
    }
    head = (
        *("max / rms [um]", "before", "motor columns", "after one run"),
        "with next, frame known",
        *("friction: largest error, median half interval [%]", "held"),
    )
    rows: list[Sequence[str]] = []
    for title, data in cases.items():
        with MotorShop(data) as shop:
            before = shop.left(shop._first)
            for with_columns in (False, True):
                found = shop.measured(with_columns)
                rows.append((title, _both(before), "yes" if with_columns else "no", *found.cells()))
                print(*rows[-1], flush=True)
    return table(head, rows)
