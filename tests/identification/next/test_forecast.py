"""What the next run is forecast to leave, where that is known."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from coupling.identification.next.deviation_size import deviation_size
from coupling.identification.next.forecast import forecast
from coupling.identification.next.repeatability import VALUES, Hypotheses
from coupling.identification.runs.measurement import SimulatedPath

TIME = np.linspace(0.0, 20.0, 2001)  # [s]
DEVIATION = 3e-5 * np.sin(1.5 * TIME)[:, None] * np.array([1.0, 1.0, 1.0])  # [m]


# A wave of another frequency.
WAVE = 1e-4 * np.sin(2.5 * TIME)[:, None] * np.array([0.0, 1.0, 0.0])


def moved(x: np.ndarray, wave: np.ndarray) -> SimpleNamespace:
    """Return the path of a tool that one parameter moves by a wave."""
    return SimpleNamespace(time=TIME, position=(x.sum() * wave)[None])


def told(
    new: float = 0.0,
    factor: float = 1.0,
    off: tuple[float, float] = (0.0, 0.0),
    wave: np.ndarray = WAVE,
    weight: float | None = None,
    noise: float = 0.0,
    own_noise: float = 0.0,
):
    """Return the forecast for a robot that does under the next command what it was measured to do.

    Two robots are possible: the next command moves their tools by `off` waves more.
    """
    history = SimpleNamespace(
        parameters=(SimpleNamespace(name="wave"),),
        robot_at=lambda x: x,
        fmu=SimpleNamespace(simulate=lambda command, wrench, mode, robot: moved(robot, wave)),
        simulated=lambda number, x: SimulatedPath(moved(0.0 * x, wave)),
    )
    size = deviation_size(TIME, DEVIATION, noise)
    seen = SimpleNamespace(time=TIME)
    run = SimpleNamespace(measured=seen, deviation=DEVIATION, noise=noise, size=size)
    history.runs = (run,)
    near = np.array(off)[:, None]
    found = SimpleNamespace(
        history=history,
        move=SimpleNamespace(
            model=SimpleNamespace(
                x=np.zeros(1), close=near, robots=near, scales=np.ones(2), left_over=1.0
            )
        ),
        repeating=None
        if weight is None
        else SimpleNamespace(weights=(weight,), own_noise=own_noise),
        reference=0,
        options=SimpleNamespace(absolute=True, seed=1),
        hypotheses=Hypotheses(np.array([new**2]), np.array([factor]), np.array([1.0])),
        left=lambda size: size.rms,
    )
    return forecast(found, SimpleNamespace(), SimpleNamespace())


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))))


def test_a_robot_that_is_sure_does_what_it_did():
    found = told()
    assert found.rms == pytest.approx(rms(DEVIATION), rel=0.01)
    assert found.low == pytest.approx(found.rms * np.exp(-1.645 * 0.15), rel=0.02)


def test_robots_that_are_possible_add_what_they_differ_by():
    """Deviation and wave have no product, so that their squares add; four times the variance counts."""
    for factor in (1.0, 4.0):
        expected = np.hypot(rms(DEVIATION), np.sqrt(factor) * 0.5 * rms(WAVE))
        assert told(off=(0.5, -0.5), factor=factor).rms == pytest.approx(expected, rel=0.02)


def test_what_they_do_along_the_deviation_adds_to_it():
    found = told(off=(0.5, 0.5), wave=DEVIATION, factor=4.0)
    assert found.rms == pytest.approx(2.0 * rms(DEVIATION), rel=0.02)


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_what_is_new_is_in_the_next_pass_and_in_what_the_command_took_off(weight):
    """Of runs r + n1 and r + n2 - w n1, drawn: what is left of the first is (1 - w) n1 beside r."""
    new, rng = 2e-5, np.random.default_rng(2)
    own, next_one = (
        new * rng.standard_normal((20_000, int(VALUES))) / np.sqrt(VALUES) for _ in range(2)
    )
    squares = np.sum((next_one - weight * own) ** 2 - ((1.0 - weight) * own) ** 2, axis=1)
    expected = np.sqrt(rms(DEVIATION) ** 2 + squares.mean())
    found = told(new=new, weight=weight)
    assert found.rms == pytest.approx(expected, rel=0.05)
    assert found.high > 1.05 * told().high


def test_noise_that_the_command_took_for_a_deviation_comes_back():
    """It has 3 s^2 of a share of the noise s in the command, and as much in what was measured."""
    noise, share = 2e-5, 0.1
    quiet = told(weight=1.0, noise=noise).rms
    loud = told(weight=1.0, noise=noise, own_noise=share).rms
    assert loud**2 - quiet**2 == pytest.approx(6.0 * share * noise**2, rel=0.15)
