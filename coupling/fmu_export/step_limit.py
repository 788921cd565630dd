"""How long a master's steps may be between a robot and a process without memory.

**Force alone.** Around a posture the robot is z' = A z + B f, y = C z, the process f = -K y.  A
master that advances both side by side (Jacobi) holds the force over a step of length h, and the
process needs that step to answer the pose at its start:

    z[k+1] = Phi z[k] + Gamma f[k]        f[k+1] = -K C z[k]

with Phi = exp(A h), Gamma = int exp(A s) ds B.  Deviations grow where an eigenvalue of this map is
larger than 1.  The quasi-static robot is y[k+1] = S f[k], with its compliance S: the eigenvalues are
the square roots of those of -S K, whatever the step.

**Contact spring.** f + K (y[k-1] - y) holds no old pose, so lasting contact is z' = (A - B K C) z at any
step.  Only that contact begins or ends is noticed up to two steps late: a tool of mass m that comes at
a speed v is 2 h v deep by then and finds K (2 h v)^2 / 2 in the spring, which is (2 h)^2 K / m times
what it brings.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from coupling.fmu.stepped import SteppedFmu
from coupling.fmu_export.system_structure import POSE_UNITS, SPRING_UNITS, WRENCH_UNITS
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.path.length_text import format_um
from coupling.process.force_laws import ForceLaw, ForceReaction
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError
from elastic_robot.robot import ElasticRobot
from elastic_robot.tool_load import ContactSpring, Load
from elastic_robot.trajectory import HeldCommand

# Steps between which the limit is looked for [s]; shorter ones no master takes for seconds of a path.
SHORTEST, LONGEST = 1e-5, 0.1
# Steps tried between them.  The first at which deviations grow is the limit; longer ones may be stable
# again.
_TRIES = 50
# Relative precision of the limit.
_PRECISION = 1e-4
# Postures at most, spread over the time in contact.
_POSTURES = 12
# Share of the limit that is called safe: between the postures, and with other loads, robot and
# process are a little stiffer or softer.
_SHARE = 0.8
# Energy that a late touch may add, over that which the tool brings.  Between 1 and 4 tools begin to
# bounce for good on walls of 1e7 N/m, as the robot's damping takes next to nothing away (docs/ssp.md).
_TOUCH = 0.25
# What a safe step is rounded down to.
_ROUND = (1.0, 2.0, 5.0)
_UPPER = np.triu_indices(3)  # xx, xy, xz, yy, yz, zz


@dataclass(frozen=True)
class LinearisedPosture:
    """Robot and process at one time of the path, for small deviations.

    Attributes:
        time: Time [s].
        a, b, c: Matrices of the state space of the robot, force [N] to displacement of the TCP [m] in
            base axes: (s, s), (s, 3), (3, s); a quasi-static robot has no states.
        compliance: Its static compliance [m/N], (3, 3).
        stiffness: K of the process [N/m], (3, 3).
    """

    time: float
    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    compliance: np.ndarray
    stiffness: np.ndarray

    @property
    def stiffnesses(self) -> tuple[float, float]:
        """Largest stiffness of the process, and that of the robot in its direction [N/m]."""
        sizes, directions = np.linalg.eigh(self.stiffness)
        along = directions[:, -1]
        return float(sizes[-1]), float(1.0 / (along @ self.compliance @ along))

    @property
    def contact_rate(self) -> float:
        """Square root of K / m, with the mass that the robot's tool has in contact [rad/s]."""
        mobility = self.c @ self.a @ self.b  # how a force accelerates the tool [1/kg]
        squares = np.linalg.eigvals(self.stiffness @ mobility).real
        return float(np.sqrt(max(squares.max(initial=0.0), 0.0)))

    def growth(self, step: float) -> float:
        """Return by what deviations grow over a step [s]: the map's spectral radius.

        Example:
            >>> a, b, c = np.zeros((0, 0)), np.zeros((0, 1)), np.zeros((1, 0))  # a quasi-static robot
            >>> soft = LinearisedPosture(0.0, a, b, c, np.array([[1e-4]]), stiffness=np.array([[2e4]]))
            >>> round(soft.growth(0.01) ** 2, 3)
            2.0
        """
        states, forces = self.b.shape
        if not states:
            answer = -self.stiffness @ self.compliance
            return float(np.sqrt(np.abs(np.linalg.eigvals(answer)).max()))
        joined = np.zeros((states + forces, states + forces))
        joined[:states, :states], joined[:states, states:] = self.a, self.b
        over_step = expm(joined * step)
        over_step[states:, :states] = -self.stiffness @ self.c
        over_step[states:, states:] = 0.0
        return float(np.abs(np.linalg.eigvals(over_step)).max())


@dataclass(frozen=True)
class StepLimit:
    """Up to which step robot and process are stable at every posture.

    Attributes:
        postures: Those in contact; none: the desired path touches nothing.
        lasting: Shortest step at which deviations grow in lasting contact under the force alone [s]: 0
            where they grow at the shortest, infinite where they do not up to the longest.
        touch: Step up to which a late touch adds little energy [s].
    """

    postures: tuple[LinearisedPosture, ...]
    lasting: float
    touch: float

    @classmethod
    def of(cls, postures: Sequence[LinearisedPosture]) -> StepLimit:
        """Look for the limits."""
        tries = np.geomspace(SHORTEST, LONGEST, _TRIES)
        lasting = np.inf
        for posture in postures:
            sooner = tries[tries < lasting]
            grown = next((k for k, h in enumerate(sooner) if posture.growth(h) >= 1.0), None)
            if grown == 0:
                lasting = 0.0
            elif grown is not None:
                lasting = brentq(
                    lambda step, at=posture: at.growth(step) - 1.0,
                    *tries[grown - 1 : grown + 1],
                    rtol=_PRECISION,
                )
        rate = max((posture.contact_rate for posture in postures), default=0.0)
        touch = 0.5 * np.sqrt(_TOUCH) / rate if rate > 0.0 else np.inf
        return cls(tuple(postures), float(lasting), float(touch))

    def growth(self, step: float) -> float:
        """Return by what deviations grow over a step of the force alone where they grow most."""
        return max((posture.growth(step) for posture in self.postures), default=0.0)

    def safe_step(self, spring: bool, longest: float) -> float:
        """Return a round step [s] that is safe; 0 where there is none.

        Args:
            spring: Whether the process gives its contact spring, not its force alone.
            longest: Longest step to return [s].
        """
        bound = min(longest, self.touch, np.inf if spring else _SHARE * self.lasting)
        steps = [share * 10.0**power for power in range(-5, 2) for share in _ROUND]
        return max((step for step in steps if step <= bound * (1.0 + 1e-9)), default=0.0)


def postures_in_contact(
    robot: Robot, motion: JointPath, desired: np.ndarray, reaction: ForceReaction, quasistatic: bool
) -> tuple[LinearisedPosture, ...]:
    """Return robot and process around samples of a path at which the process has a stiffness.

    Gears count as engaged: in their backlash a robot is softer, and what grows there ends at the flanks.

    Args:
        motion: Its drives at the samples.
        desired: Desired position of the TCP there, base frame [m], (n, 3).
        reaction: Force and stiffness of the process there.
        quasistatic: Whether the robot is at rest at every moment.
    """
    size = np.abs(reaction.stiffness).max(axis=(1, 2))
    touching = np.flatnonzero(size)
    if not len(touching):
        return ()
    spread = touching[np.linspace(0, len(touching) - 1, _POSTURES).round().astype(int)]
    model = ElasticRobot(robot, "linear")
    postures = []
    for k in np.unique([*spread, int(size.argmax())]):
        stiffness = reaction.stiffness[k]
        try:
            _posture_at_rest(model, motion.q[0][k], desired[k], reaction.force[k], stiffness)
        except ElasticRobotError:
            continue  # without an equilibrium there is nothing to linearise around
        a, b, c, _ = model.linearise().state_space
        if quasistatic:
            a, b, c = np.zeros((0, 0)), np.zeros((0, 6)), np.zeros((3, 0))
        compliance = model.compliance()[:3, :3]
        postures.append(
            LinearisedPosture(float(motion.time[k]), a, b[:, :3], c[:3], compliance, stiffness)
        )
    return tuple(postures)


def _posture_at_rest(
    model: ElasticRobot,
    drives: np.ndarray,
    desired: np.ndarray,
    force: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Bring a robot to rest under the force with which a process meets it, held."""
    rates = np.zeros_like(drives)
    command = HeldCommand(0.0, drives, rates, rates)
    wrench = np.concatenate([force, np.zeros(3)])
    # Where the robot gives way, the process pushes less than at the desired place.
    model.reset(0.0, command, Load(wrench, ContactSpring(desired, np.zeros(3), stiffness)))
    met = force + stiffness @ (desired - model.tcp()[:3])
    model.reset(0.0, command, Load(np.concatenate([met, np.zeros(3)])))


@dataclass(frozen=True)
class StepError:
    """Distance of a stepwise co-simulation from the converged coupling, along the path.

    Attributes:
        step: Communication step [s].
        largest, rms: Distance of the TCPs at the path's samples [m].
    """

    step: float
    largest: float
    rms: float

    def __str__(self) -> str:
        """Return it in words."""
        cost = f"up to {format_um(self.largest)} um, rms {format_um(self.rms)} um"
        return f"{1e3 * self.step:g} ms: {cost}"


def step_errors(
    robot: Path, law: ForceLaw, with_spring: bool, coupled: ToolPath, steps: Sequence[float]
) -> list[StepError]:
    """Return what communication steps cost [s].

    Args:
        robot: A native FMU of the robot, with its command and settings as start values.
        law: Force law of the process, base frame.
        with_spring: Whether the robot takes the process's contact spring as well.
        coupled: Path of the tool that is nearest to the truth, base frame.

    Raises:
        FmuError: If the FMU refuses a step.
    """
    return [_error(robot, law, with_spring, coupled, step) for step in steps]


def _error(
    robot: Path, law: ForceLaw, with_spring: bool, coupled: ToolPath, step: float
) -> StepError:
    time, (position,) = coupled.time, coupled.position
    instants, stepped = _step_path(robot, law, with_spring, time[0], time[-1], step)
    at_samples = [np.interp(time, instants, axis) for axis in stepped.T]
    distance = np.linalg.norm(np.transpose(at_samples) - position, axis=1)
    return StepError(step, float(distance.max()), float(np.sqrt(np.mean(distance**2))))


def _step_path(
    robot: Path, law: ForceLaw, with_spring: bool, start: float, stop: float, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the communication points [s], (n,), and the TCP's positions there [m], (n, 3).

    Both are advanced in parallel, as `process_slave` does the process.
    """
    instants = np.append(np.arange(start, stop - 1e-6 * step, step), stop)
    lengths = np.diff(instants)
    # Origin of the law at a step's start, at its end, and at the end of one more of its length.
    places = [law.place(instants[:-1] + ahead * lengths) for ahead in (0, 1, 2)]
    inputs = (*WRENCH_UNITS, *(SPRING_UNITS if with_spring else ()))
    with SteppedFmu(robot, inputs, tuple(POSE_UNITS), start=start) as fmu:
        position = fmu.read()[:3]
        first_answer = _answer(law, np.tile(places[0][0], (3, 1)), step, position)
        positions = [position]
        for length, *ahead in zip(lengths.tolist(), *places, strict=True):
            answer = _answer(law, np.array(ahead), length, position)
            position = fmu.step(first_answer[: len(inputs)], length)[:3]
            positions.append(position)
            first_answer = answer
    return instants, np.array(positions)


def _answer(law: ForceLaw, places: np.ndarray, step: float, position: np.ndarray) -> np.ndarray:
    """Return wrench and contact spring in the order of their variables, (18,)."""
    now, felt, after = places
    reaction = law.reaction_around(now[None], position[None])
    stiffness = reaction.stiffness[0][_UPPER]
    velocity = (after - felt) / step
    return np.concatenate(
        [reaction.force[0], np.zeros(3), position + felt - now, velocity, stiffness]
    )
