"""A gear reverses on the way along the ISO 9283 path: what its drive does, and the tool."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from coupling.case.case import Case
from coupling.inverse.inversion import DesiredMotion, MovingRobot
from coupling.inverse.joint_limits import JointLimits
from coupling.path.histories import WrenchHistory
from coupling.report.colours import AFTER, BEFORE, DESIRED
from coupling.results.gear_result import BacklashReversal
from coupling.robot.inverse_kinematics import InverseKinematics
from coupling.run.execute import Run, run_compensation
from docs.scripts.pictures import styled
from docs.scripts.runs import example

FEED = 0.25  # [m/s]
# The first passage of this gear from flank to flank after this time [s].
JOINT, AFTER_TIME = 4, 5.0
WINDOW = 0.2  # [s]
STEP = 5e-4  # of what is drawn of the gear [s]
WATCHED = 0.004  # of what is drawn of the tool [s]
_UM = 1e6


@dataclass(frozen=True)
class Crossing:
    """A gear that crosses its backlash.

    Attributes:
        change: When it is.
        half_width: Of the backlash B [rad].
        time: Times of the gear's motion [s], (k,).
        torque: T that it has to carry [N m], (k,).
        link, drive: Angles phi and q [rad], (k,); the wind-up is their difference.
        watched: Times of the tool's deviations [s], (m,).
        inverted, mirrored: Deviations of the tool under both commands [m], (m,).
        largest: Largest of these along the whole path [m].
    """

    change: BacklashReversal
    half_width: float
    time: np.ndarray
    torque: np.ndarray
    link: np.ndarray
    drive: np.ndarray
    watched: np.ndarray
    inverted: np.ndarray
    mirrored: np.ndarray
    largest: tuple[float, float]

    @property
    def caption(self) -> str:
        """Return what the picture shows, in words."""
        change, (inverted, mirrored) = self.change, self.largest
        bend = np.gradient(np.gradient(self.drive, STEP), STEP)[2:-2]
        return (
            f"*ISO 9283 at {FEED:g} m/s, 4 ms cycle: the torque of gear {change.joint}"
            f" passes zero, the gear leaves one flank at {change.begins:.3f} s and\nreaches the other"
            f" {1e3 * (change.ends - change.begins):.0f} ms later. Link and drive after"
            " subtraction of a line; shaded: the backlash. The drive moves back by 2 B while the"
            f" link moves on, with up to {np.abs(bend).max():.0f} rad/s². Over the\nwhole path the tool"
            f" stays within {_UM * inverted:.1f} um; under the mirrored command of the quasi-static"
            f" robot it\nleaves it by up to {_UM * mirrored:.0f} um.*"
        )


def crossing() -> Crossing:
    """Run the path with both methods, and return a crossing and its surroundings."""
    keys = {"feed_m_s": FEED, "sample_s": WATCHED}
    case = example("iso9283", tool_path=keys)
    run = run_compensation(case)
    still = example(
        "iso9283",
        tool_path=keys,
        robot={"mode": "quasistatic"},
        compensation={"method": "mirror"},
    )
    mirrored = run_compensation(still)
    change = _first_change(run)
    begin = 0.5 * (change.begins + change.ends - WINDOW)
    time = np.arange(begin, begin + WINDOW, STEP)
    torque, link, half_width = _gear(case, time)
    drive = run.correction.joints.trajectory.at(time)[0]
    deviations = []
    for path, desired in (
        (run.correction.achieved, run.desired),
        (mirrored.dynamic, mirrored.desired),
    ):
        assert path is not None
        deviations.append((desired.time, path.distance_to(desired).ravel()))
    watched = np.arange(begin, begin + WINDOW, WATCHED)
    return Crossing(
        change,
        half_width,
        time,
        torque,
        link,
        drive[:, JOINT - 1],
        watched,
        np.interp(watched, *deviations[0]),
        np.interp(watched, *deviations[1]),
        (deviations[0][1].max(), deviations[1][1].max()),
    )


def _first_change(run: Run) -> BacklashReversal:
    return next(
        change
        for change in run.correction.backlash_reversals or ()
        if change.joint == JOINT and change.begins > AFTER_TIME and change.before * change.after < 0
    )


def _gear(case: Case, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return the torque that the gear has to carry, the angle of its link, and half of its backlash."""
    placed = case.robots[0]
    moving = MovingRobot(placed.description, placed.torque_curve)
    rigid = InverseKinematics(placed.description, placed.home).plan(case.desired)
    wanted = DesiredMotion(case.desired, rigid, WrenchHistory.none(case.desired.time))
    found = moving.invert(
        wanted, case.controller, JointLimits.of(placed.description), lambda *_: None
    )
    theta, rate, acceleration = (found.links.theta.at(time, order) for order in range(3))
    load = moving.model.state(theta, rate, acceleration, np.zeros((len(time), 6))).load
    gear = int(np.flatnonzero(moving.model.gear_joint == JOINT - 1)[0])
    row = int(moving.model.gears[gear])
    backlash = moving.model.parameters.backlash[moving.model.chain.torsions[gear]]
    return -load[:, row], theta[:, row], float(backlash)


def drawn(found: Crossing) -> go.Figure:
    """Draw torque, wind-up, drive and link, and the tool's deviation over time."""
    figure = make_subplots(rows=4, cols=1, shared_xaxes=True, vertical_spacing=0.03)
    time, watched = 1e3 * (found.time - found.time[0]), 1e3 * (found.watched - found.time[0])
    line = np.polynomial.Polynomial.fit(found.time, found.link, 1)(found.time)

    def add(row: int, x: np.ndarray, y: np.ndarray, color: str, name: str = "") -> None:
        figure.add_scatter(
            x=x, y=y, mode="lines", line={"color": color, "width": 2, "simplify": False},
            name=name,
            showlegend=bool(name), row=row, col=1,
        )  # fmt: skip

    add(1, time, found.torque, DESIRED)
    add(2, time, 1e3 * (found.link - found.drive), DESIRED)
    add(3, time, 1e3 * (found.link - line), DESIRED, "link")
    add(3, time, 1e3 * (found.drive - line), AFTER, "drive")
    add(4, watched, _UM * found.inverted, AFTER, "tool, inverse")
    add(4, watched, _UM * found.mirrored, BEFORE, "tool, mirrored")
    backlash = 1e3 * found.half_width
    figure.add_hrect(
        y0=-backlash, y1=backlash, fillcolor="#999999", opacity=0.2, line_width=0, row=2
    )
    figure.add_hline(y=0.0, line={"color": "#999999", "width": 1}, row=1)
    for row, title in enumerate(
        ("torque [N m]", "wind-up [mrad]", "angle [mrad]", "tool is off [um]"), start=1
    ):
        figure.update_yaxes(title=title, row=row, col=1)
    figure.update_yaxes(type="log", row=4, col=1)
    figure.update_xaxes(title="time [ms]", row=4, col=1)
    return styled(figure, 900, 800)
