"""How often intervals of parameters hold the truth."""

from __future__ import annotations

import gc
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from coupling.files.robot_file import find_robot
from coupling.identification.runs.results import Learned
from docs.scripts.learning_shop import Shop
from docs.scripts.learning_studies import DEPTH, Trial, Truth, drawn
from docs.scripts.page import table
from docs.scripts.robots_with_backlash import (
    EVEN,
    FANUC_HOME,
    KUKA,
    KUKA_HOME,
    MIXED,
    with_backlash,
)
from docs.scripts.runs import example_data

# Where inverse kinematics starts [deg].
HOME = [0.0, 10.0, 20.0, 0.0, 60.0, 0.0]
# How much of a run is measured [s].
SECONDS = 12.0
# Hidden robots of each case, by how many times what is known before, and noise of a coordinate [m].
TIMES, NOISES, ROBOTS = (0.5, 1.0, 1.5), (1e-5, 2e-5, 3e-5), 5
# The first seed of those that are judged: no rule of the fit was chosen with them.
FIRST_SEED = 2000


@dataclass(frozen=True)
class CoveredParameter:
    """One parameter that a run tells.

    Attributes:
        times: By how many times what is known before its robot was drawn.
        kind: Which.
        error: Error of its logarithm by the half width of its interval.
        half: That half width.
    """

    times: float
    kind: str
    error: float
    half: float

    @classmethod
    def of(cls, found: Learned, truth: Truth, times: float) -> Iterator[CoveredParameter]:
        """Yield what a run tells of a robot that is known."""
        for own in found.result.parameters:
            if own.identified:
                half = float(np.log(own.high / own.value))
                off = abs(np.log(own.factor / truth.factors.get(own.name, 1.0)))
                yield cls(times, own.kind, float(off) / half, half)


def cone_of(home: Sequence[float], file: str, at: Sequence[float], **path: Any) -> dict[str, Any]:
    """Return the case of the cone's first contours elsewhere, by another robot."""
    return example_data(
        "cone",
        robot={"description": file, "home_deg": list(home)},
        part={"position_m": list(at)},
        tool_path={"depth_m": DEPTH} | path,
    )


def rolled() -> dict[str, Any]:
    """Return the case of ISO 9283 on a base that is rolled, so that every gear is loaded."""
    return example_data(
        "iso9283", robot={"base_rpy_deg": [6.0, 0.0, 0.0]}, tool_path={"feed_m_s": 0.25}
    )


def cases() -> dict[str, dict[str, Any]]:
    """Return robots on paths."""
    kuka = with_backlash(KUKA, EVEN)
    abb, fanuc = (
        with_backlash(find_robot(name), MIXED) for name in ("abb_irb7600", "fanuc_r2000ic")
    )
    pyramid = {"kind": "pyramid"}
    return {
        "example, cone": cone_of(HOME, "icme2008", (1.6, 0.0, 0.8)),
        "example, pyramid": cone_of(HOME, "icme2008", (1.6, 0.0, 0.8), **pyramid),
        "example, ISO 9283": rolled(),
        "KUKA, cone": cone_of(KUKA_HOME, kuka, (1.9, 0.1, 0.9)),
        "KUKA, pyramid": cone_of(KUKA_HOME, kuka, (1.9, 0.1, 0.9), **pyramid),
        "ABB, cone": cone_of(HOME, abb, (1.7, -0.3, 0.9)),
        "ABB, pyramid": cone_of(HOME, abb, (1.7, -0.3, 0.9), **pyramid),
        "FANUC, cone": cone_of(FANUC_HOME, fanuc, (1.6, 0.3, 0.6)),
    }


def coverage() -> str:
    """Return how often the intervals of what one run tells hold the truth."""
    learned: list[CoveredParameter] = []
    for number, (name, data) in enumerate(cases().items()):
        with Shop(data) as shop:
            for k in range(ROBOTS):
                count = ROBOTS * number + k
                times, noise, seed = TIMES[count % 3], NOISES[count // 3 % 3], FIRST_SEED + count
                truth = drawn(shop.robot, seed, times)
                trial = Trial(noise=noise, seconds=SECONDS, runs=1)
                found = shop.found(truth, trial, seed)
                own = list(CoveredParameter.of(found, truth, times))
                learned += own
                outside = sum(one.error > 1.0 for one in own)
                over = found.result.left_m.learned / found.result.noise_left_m
                print(
                    name,
                    truth.name,
                    f"{len(own)} identifiable, {outside} outside, {over:.2f} noises left",
                )
                print(_row("so far", learned), flush=True)
                gc.collect()
    groups = {f"{times:g} times": [one for one in learned if one.times == times] for times in TIMES}
    groups |= {kind: [one for one in learned if one.kind == kind] for kind in _kinds(learned)}
    rows = [_row(name, own) for name, own in groups.items()]
    head = ("", "identifiable", "held", "[%]", "median error [%]", "median half interval [%]")
    return table(head, [*rows, _row("all", learned)])


def _kinds(learned: list[CoveredParameter]) -> list[str]:
    return sorted({one.kind for one in learned})


def _row(name: str, learned: list[CoveredParameter]) -> tuple[str, ...]:
    held = sum(one.error <= 1.0 for one in learned)
    return (
        name,
        f"{len(learned)}",
        f"{held}",
        f"{100.0 * held / max(len(learned), 1):.1f}",
        f"{100.0 * np.median([one.error * one.half for one in learned]):.1f}",
        f"{100.0 * np.median([one.half for one in learned]):.1f}",
    )
