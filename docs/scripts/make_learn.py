"""Write the tables and the picture of docs/learn.md: make learn.

Robots whose parameters are hidden from the fit, measured in simulation; with names, only those parts:
python docs/scripts/make_learn.py hidden intervals.
"""

from __future__ import annotations

import sys
import tempfile
import tomllib
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import tomlkit

from coupling.files.robot_file import find_robot
from coupling.identification.runs.learning import Learned
from docs.scripts.learning_coverage import beyond, coverage
from docs.scripts.learning_motors import motors
from docs.scripts.learning_others import others
from docs.scripts.learning_shop import Shop, cone
from docs.scripts.learning_studies import (
    DEPTH,
    Learning,
    Trial,
    all_alike,
    case_text,
    changed,
    hidden,
    of_kinds,
    sequence,
)
from docs.scripts.page import finish, replace_parts, table
from docs.scripts.pictures import save, styled

SEEDS = (11, 12, 13, 14, 15)
# Half width of the backlash that the second robot is given [rad].
PLAY = 1e-4
# Noise of measured orientations [rad].
TURN_NOISE = 2e-5


@cache
def _learned(seed: int) -> Learning:
    """Return how a robot is learned in two runs."""
    return cone().learned(hidden(cone().robot, seed), seed=seed)


def _hidden() -> tuple[Learning, ...]:
    """Return how five robots are learned."""
    return tuple(map(_learned, SEEDS))


def robots() -> str:
    """Return what the commands leave on robots whose parameters are hidden."""
    rows = [
        (
            f"{number}",
            *(str(left) for left in found.left),
            ", ".join(f"{clock:.0f} ({cpu:.0f})" for clock, cpu in found.seconds),
        )
        for number, found in enumerate(_hidden(), start=1)
    ]
    head = ("robot", "with its file", "one run", "two runs", "time of the fits (CPU) [s]")
    return table(head, rows)


def intervals() -> str:
    """Return how far what one run tells was off, and how often its interval held the truth."""
    return _of_intervals([own.found[0] for own in _hidden()])


def orientations() -> str:
    """Return the same with orientations beside the positions."""
    shop, trial = cone(), Trial(runs=1, turn_noise=TURN_NOISE)
    found = [shop.learned(hidden(shop.robot, seed), trial, seed) for seed in SEEDS]
    return _of_intervals([own.found[0] for own in found])


def _of_intervals(found: Sequence[Learned]) -> str:
    errors: dict[str, list[tuple[float, float, float]]] = {}
    for seed, one in zip(SEEDS, found, strict=True):
        truth = hidden(cone().robot, seed)
        for kind, own in of_kinds(one, truth).items():
            errors.setdefault(kind, []).extend(own)
    rows = []
    for kind, own in errors.items():
        if not own:
            rows.append((kind, "0", "", "", "", ""))
            continue
        error, half, held = np.array(own).T
        rows.append(
            (
                kind,
                f"{len(own)}",
                f"{np.median(error):.1f}",
                f"{error.max():.1f}",
                f"{np.median(half):.1f}",
                f"{int(held.sum())} of {len(own)}",
            )
        )
    head = (
        "",
        "identifiable",
        "median error [%]",
        "largest [%]",
        "median half interval [%]",
        "held",
    )
    return table(head, rows)


def trials() -> str:
    """Return what one run is worth where something is other."""
    shop, one = cone(), Trial(runs=1)
    truth = hidden(shop.robot, SEEDS[0])
    cases = [
        ("noise 10 um, 250 Hz", truth, one),
        ("noise 30 um", truth, Trial(noise=3e-5, runs=1)),
        ("noise 100 um", truth, Trial(noise=1e-4, runs=1)),
        ("noise 30 um, 50 Hz", truth, Trial(noise=3e-5, every=5, runs=1)),
        ("orientations, 20 urad", truth, Trial(turn_noise=TURN_NOISE, runs=1)),
        ("12 s measured", truth, Trial(seconds=12.0, runs=1)),
        ("wrench 5 % larger", changed(truth, force=1.05), one),
        ("backlash with rounded edges", changed(truth, torque_curve="spline"), one),
        ("only the backlash differs, 20 % more", all_alike(shop.robot, "backlash", 1.2), one),
    ]
    rows = [(name, *_row(shop.learned(own, trial))) for name, own, trial in cases]
    others = {
        "rounded edges, also in the case": _contours(robot={"torque_curve": "spline"}),
        "another robot: ABB IRB 7600 with backlash": _contours(robot=_second_robot()),
        "ISO 9283 at 0.1 m/s, base upright": case_text("iso9283"),
    }
    for name, data in others.items():
        with Shop(data) as other:
            rows.append((name, *_row(other.learned(hidden(other.robot, SEEDS[0]), one))))
    return table(("", "before", "after one run", ""), rows)


def _row(found: Learning) -> tuple[str, str, str]:
    result = found.found[0]
    words = "refused" if result.refusal else "warned" if result.warnings else ""
    return str(found.left[0]), str(found.left[1]), words


def _contours(robot: dict[str, Any]) -> dict[str, Any]:
    """Return the case of the first contours with another robot."""
    return case_text("cone", robot=robot, tool_path={"depth_m": DEPTH})


def _second_robot() -> dict[str, Any]:
    """Return the table of the IRB 7600, with backlash in its gears, in a file that stays for a while."""
    data = tomllib.loads(find_robot("abb_irb7600").read_text(encoding="utf-8"))
    for joint in data["joint"]:
        joint["backlash"] = PLAY
    file = Path(tempfile.mkdtemp(), "irb7600.toml")
    file.write_text(tomlkit.dumps(data), encoding="utf-8")
    return {"description": str(file)}


def picture() -> str:
    """Draw how far the second robot's tool is off, before and after."""
    found, figure = _learned(SEEDS[1]), go.Figure()
    names = ("with its file", "after one run", "after two")
    for name, off, color in zip(names, found.off, ("#D55E00", "#56B4E9", "#0072B2"), strict=True):
        distance = 1e6 * np.linalg.norm(off - off.mean(axis=0), axis=1)
        figure.add_scatter(
            x=0.004 * np.arange(len(distance))[::5],
            y=np.maximum(distance[::5], 0.05),
            name=name,
            mode="lines",
            line={"color": color, "width": 1.2},
        )
    figure.update_xaxes(title="time [s]")
    figure.update_yaxes(title="distance [um]", type="log")
    save("learn", styled(figure, 900, 380))
    print(sequence(found.left))
    return (
        "![Distance of the tool from its path before, after one and after two measured runs]"
        "(figures/learn.png)"
    )


PARTS: dict[str, Callable[[], str]] = {
    "picture": picture,
    "hidden": robots,
    "intervals": intervals,
    "orientations": orientations,
    "coverage": coverage,
    "beyond": beyond,
    "trials": trials,
    "others": others,
    "motors": motors,
}


if __name__ == "__main__":
    sys.exit(finish(lambda: replace_parts("learn", PARTS, sys.argv[1:])))
