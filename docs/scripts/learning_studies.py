"""Robots whose parameters are hidden, how they are measured, and what was learned of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from coupling.robot.parameters import robot_parameters, value_of
from docs.scripts.learning_beyond import Beyond
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

# Logarithms of hidden factors are even between plus and minus this.
SPREAD = {"backlash": 0.3, "damping": 0.3, "stiffness": 0.1}
# The kinds of `drawn`, in the order of the draws.
DRAWN = ("backlash", "stiffness", "damping")
# Depth of the example cone's first contours [m]: 24.9 s.
DEPTH = 0.0015


@dataclass(frozen=True)
class Truth:
    """The robot that really moves.

    Attributes:
        name: In words.
        factors: Factors of the FMU's parameters, by name.
    """

    name: str
    factors: Mapping[str, float]

    def values(self, robot: Robot) -> dict[str, float]:
        """Return its parameters by name, with those of the model that it differs from."""
        return {name: factor * value_of(robot, name) for name, factor in self.factors.items()}


@dataclass(frozen=True)
class Left:
    """What a command leaves on the robot that really moves [m]: with a constant, and less it."""

    maximum: float
    rms: float
    less_maximum: float
    less_rms: float

    @classmethod
    def of(cls, deviation: np.ndarray) -> Left:
        """Return the figures of deviations [m], (n, 3)."""
        sizes = [
            np.linalg.norm(rows, axis=1) for rows in (deviation, deviation - deviation.mean(axis=0))
        ]
        figures = [(float(s.max()), float(np.sqrt(np.mean(s**2)))) for s in sizes]
        return cls(*figures[0], *figures[1])

    def __str__(self) -> str:
        return f"{1e6 * self.less_maximum:.0f} / {1e6 * self.less_rms:.1f}"


@dataclass(frozen=True)
class Trial:
    """How a robot is measured.

    Attributes:
        noise: Standard deviation of a coordinate [m].
        seconds: How much of a run is measured [s].
        runs: Number of runs that are learned from.
        beyond: What the tool does beyond the model.
    """

    noise: float = 1e-5
    seconds: float = np.inf
    runs: int = 2
    beyond: Beyond | None = None


def hidden(robot: Robot, seed: int, spread: Mapping[str, float] = SPREAD) -> Truth:
    """Return a robot with all parameters at random, logarithms even between plus and minus these."""
    rng, chain = np.random.default_rng(seed), build_chain(robot)
    factors = {}
    for kind, width in spread.items():
        rows = chain.torsions if kind == "backlash" else range(chain.elastic_count)
        for row in rows:
            factors[f"{chain.elastic_names[row]}.{kind}"] = float(
                np.exp(width * rng.uniform(-1.0, 1.0))
            )
    return Truth(f"random {seed}", factors)


def drawn(robot: Robot, seed: int, times: float) -> Truth:
    """Return a robot of so many times what is known before: normal logarithms of all that is learned."""
    rng = np.random.default_rng(seed)
    factors = {
        p.name: float(np.exp(times * (p.row.prior or 0.0) * rng.standard_normal()))
        for p in robot_parameters(robot, "backlash", DRAWN)
    }
    return Truth(f"drawn {seed}, {times:g} times", factors)
