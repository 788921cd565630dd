"""Write the tables and the picture of docs/motion.md: make motion.

The KR 300's recordings, each predicted from the other, and both fitted; with names, only those parts:
python docs/scripts/make_motion.py left picture.  The coverage takes some minutes.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
from plotly.subplots import make_subplots

from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.motion.identification import identify_motion
from coupling.identification.motion.recording import Recording, read_recording
from coupling.report.colours import AFTER, BEFORE, DESIRED, GREEN, JOINTS, PLANT, QUIET
from coupling.results.motion_result import MotionResult
from docs.scripts.experiment import Curve, Page, add_curves
from docs.scripts.motion_recovery import every_error
from docs.scripts.page import table
from docs.scripts.pictures import save, styled
from examples.identify.kuka_kr300_motion import converted

BANDWIDTH, REPETITIONS = 20.0, 200
PAGE = Page("motion")
_UM = 1e6
# Causes of motor less link, those that would hide others first.
_SHARES = {"lines of the encoder": JOINTS[5], "loop": JOINTS[4], "slow error": PLANT, "gear": GREEN}


@cache
def recording(name: str) -> Recording:
    """Return a recording of the KR 300."""
    with tempfile.TemporaryDirectory() as folder:
        return read_recording(converted(name, Path(folder)), load_robot(find_robot("kuka_kr300")))


@cache
def found(fit: str, predict: str) -> MotionResult:
    """Return what recordings, a letter each, say of the KR 300, and how they predict others."""
    robot = load_robot(find_robot("kuka_kr300"))
    recordings = [replace(recording(name), is_held_out=name in predict) for name in fit + predict]
    return identify_motion(robot, recordings, BANDWIDTH).result


@PAGE.part
def left() -> str:
    """Return what is left of both recordings."""
    rows = []
    for fit, predict in (("A", "B"), ("B", "A"), ("AB", "")):
        for one in found(fit, predict).recordings:
            words = "predicted" if one.held_out else "fitted"
            rows.append(
                (
                    " and ".join(fit),
                    f"{one.name[5]}, {words}",
                    *_row(one.wind_up_rad[:3], _UM),
                    " ".join(_row(one.wind_up_lag_alone_rad[:3], _UM)),
                    *_row(one.torque_relative, 100.0),
                    " ".join(_row(one.slow_torque_relative, 100.0)),
                )
            )
    links, torques = (
        [f"{what} {i + 1}" for i in range(n)] for what, n in (("link", 3), ("torque", 6))
    )
    head = ("fitted to", "recording", *links, "lag and offset alone", *torques)
    return table((*head, f"torques below {BANDWIDTH:g} Hz"), rows)


@PAGE.part
def coverage() -> str:
    """Return how often intervals hold what is known."""
    inside = np.array([error < 1.0 for error in every_error(REPETITIONS).values()])
    shares = 100.0 * inside.mean(axis=1)
    # Numbers of one recording share its noise: the mean's standard error is that over recordings.
    error = 100.0 * np.std(inside.mean(axis=0)) / np.sqrt(REPETITIONS)
    row = (f"{len(inside)}", f"{shares.mean():.1f} % ± {error:.1f} %")
    head = ("numbers", "inside their interval, mean", "lowest", "highest")
    return table(head, [(*row, f"{shares.min():.1f} %", f"{shares.max():.1f} %")])


@PAGE.part
def picture() -> str:
    """Draw B as A predicts it, and return the picture's line."""
    result = found("A", "B")
    (one,) = (own for own in result.recordings if own.held_out)
    figure = make_subplots(rows=3, cols=3, vertical_spacing=0.07, horizontal_spacing=0.1)
    for k in range(3):
        measured, rest = (
            _UM * np.array(own[k]) for own in (one.measured_wind_up, one.left_wind_up)
        )
        shares = {own.name: _UM * np.array(own.wind_up[k]) for own in one.shares}
        curves = [
            (1, "measured", measured, DESIRED),
            (1, "predicted", measured - rest, AFTER),
            *((2, words, shares[words], _SHARES[words]) for words in _SHARES if words in shares),
            (2, "measured, without the lag", measured - shares["lag"], QUIET),
            (3, "left", rest, BEFORE),
        ]
        for row, words, values_, color in curves:
            name = words if k == 0 else ""
            curve = Curve(name, np.array(one.time), values_, color, 1)
            add_curves(figure, [curve], row=row, col=k + 1)
        figure.update_xaxes(title_text="time [s]", row=3, col=k + 1)
        figure.update_yaxes(title_text=f"joint {k + 1} [urad]", row=2, col=k + 1)
    save("motion", styled(figure, 1200, 820))
    return "![Motor less link of recording B, predicted by a fit to A](figures/motion.png)"


def _row(values_: tuple[float | None, ...], factor: float) -> list[str]:
    return [f"{factor * value:.0f}" if value is not None else "" for value in values_]


if __name__ == "__main__":
    PAGE.write()
