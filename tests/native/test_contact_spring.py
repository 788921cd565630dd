"""The contact spring at the TCP in the C core: against Pinocchio, at rest, and in the stepper."""

from __future__ import annotations

import numpy as np
import pytest
from native_core import CURVES, Core, with_settings

POSTURE = np.array([0.0, -0.3, 0.5, 0.0, 0.6, 0.0])
NONE = np.zeros(6)


def _spring(core: Core, stiffness: float) -> np.ndarray:
    """A load: a spring in all directions, its anchor above the tool by 10 um."""
    x, y, z = core.outputs(11)["tcp"][:3]
    spring = [
        x,
        y,
        z + 1e-5,
        0.0,
        0.0,
        0.0,
        *(stiffness * np.array([1.0, 0.0, 0.0, 1.0, 0.0, 1.0])),
    ]
    return np.append(NONE, spring)


@pytest.mark.parametrize("held_before", [True, False])
def test_a_stiff_spring_takes_steps_as_long_as_a_soft_one(example, held_before):
    """60 ms on 1e8 N/m, at 1e-4 m, in 9 tries; with matrices that leave it out it takes 23."""
    core = with_settings(example, most_tries=9.0, most_tries_per_longest=1e-9)
    core.reset("linear", 0.0, POSTURE, NONE, tolerance=1e-4)
    stiff = _spring(core, 1e8)
    for number, holds in enumerate((held_before, True, True, held_before, True)):
        core.step(0.06 * (number + 1), POSTURE, stiff if holds else NONE)


@pytest.mark.parametrize("plain", [True, False])
@pytest.mark.parametrize("quasistatic", [True, False])
@pytest.mark.parametrize("kind", CURVES)
def test_without_stiffness_an_anchor_changes_no_bit(example, kind, quasistatic, plain):
    rng = np.random.default_rng(2)
    cores, loads = (Core(example, plain), Core(example, plain)), []
    for core in cores:
        core.reset(kind, 0.0, POSTURE, NONE, quasistatic=quasistatic)
    for number in range(40):
        wrench = 300.0 * rng.normal(size=6) * (number % 5 < 3)
        anchor = np.concatenate([rng.normal(size=6), np.copysign(NONE, rng.normal(size=6))])
        q, end = POSTURE + 1e-3 * rng.normal(size=6), 0.004 * (number + 1)
        found = []
        for core, load in zip(cores, (wrench, np.append(wrench, anchor)), strict=True):
            core.step(end, q, load)
            found.append(b"".join(values.tobytes() for values in core.outputs(11).values()))
        assert found[0] == found[1]
        loads.append(found[0])
    assert len(set(loads)) == 40
