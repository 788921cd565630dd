"""Scheme "robin": the robot moves against the process's own stiffness instead of a given force."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import SimulationError
from coupling.path.contact_spring import ContactSpring
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.path.linear import interpolate_rows
from coupling.process.base import joined, own_blocks
from coupling.robot.contract import SimulatedRobot
from coupling.solve.local_stabilisation import LocalStabilisation
from coupling.solve.relaxation import Anderson, Restarting
from coupling.solve.scheme import Iterate, LoadedMotion, Scheme
from elastic_robot.fmi.interface import Mode

# Part of its stiffness that a process keeps, from evaluation to evaluation, where contact is lost: the
# next path may touch again, and without it the tool would be thrown off again.
_KEPT = 0.25
# Robots and the linear process agree where what springs do not give of its forces changes by no more
# than this part of the change of its forces, or no tool moves farther [m]; after so many simulations at
# most.  The next evaluation corrects what is left.
_AGREED, _STILL, _MOST = 0.01, 1e-7, 25
# Displacement along its force that a tool may make in the first update [m].  The stiffness that this
# asks for should rather be too large, which is slow, than too small, which loses contact.
_FIRST_MOVE = 2e-4
# A tool that moved less between two evaluations says nothing of the stiffness [m].
_LEAST_MOVE = 1e-8
# Evaluations by which the stiffness under a moving robot is estimated.
_ESTIMATED = 4
# Forces of a noisy process that differ by no more than this many standard deviations of the noise in
# their difference say nothing either: of three components one in a thousand is larger by chance.
_NOISE_BAND = 4.0
# A force that changes at a right angle to the motion, by this cosine, is no reaction to it.
_LEAST_COSINE = 1e-3


class Robin(Scheme):
    """The robot under F(x_k) + K (x_k - x), K about the process's stiffness -dF/dx.

    At the fixed point nothing is added to F at a sample, so that K changes no answer there; on the way
    it holds a gear that a given force would leave without a place in its backlash, and with the right K
    the iteration is Newton's.  K is that of the process's response where stated, else estimated from
    evaluation to evaluation; under a moving robot by the first few of them, and then Anderson's mixing
    solves for what springs cannot give, such as damping and friction (docs/robin.md).

    What a tool feels of its own displacement acts as a spring within each robot.  What springs cannot
    give, such as forces between two tools, follows by simulating the robots again.

    Args:
        first: Factor of every update.
    """

    def __init__(self, first: float = 1.0) -> None:
        self._first, self._updates = first, 0
        self._acceleration = Restarting(Anderson, first)
        self._is_kept = False
        self._stiffness: ProcessStiffness | None = None
        self._own: np.ndarray | None = None
        self._stabilisation: LocalStabilisation | None = None
        self._rows = np.arange(0)

    def move_robot(
        self, robot: SimulatedRobot, command: JointPath, iterate: Iterate, mode: Mode
    ) -> LoadedMotion:
        """Return the robots' motion against a process that goes on as it has answered.

        Raises:
            SimulationError: If a robot cannot be simulated under the process's answer and the springs.
        """
        process = LinearProcess(iterate, self._react(iterate, mode))
        time, x = iterate.path.time, iterate.path
        blocks = interpolate_rows(
            time, iterate.response.wrench.instants, own_blocks(process.stiffness), axis=1
        )
        spring = ContactSpring(_anchors(iterate), blocks)
        answered = replace(iterate.loads, spring=spring)
        inner, rest_force, best, least = Anderson(), np.zeros_like(x.position), None, np.inf
        for _ in range(_MOST):
            loads = answered.plus(rest_force)
            try:
                motion = LoadedMotion(loads, robot.simulate(command, loads, mode))
            except SimulationError:
                if best is None:
                    raise
                break  # the next evaluation goes on from the best there is
            residual = float(np.abs(process.rest_force(motion.path) - rest_force).max())
            if best is None or residual < least:
                best, least = motion, residual
            change = float(np.abs(process.change(motion.path)).max())
            if residual <= _AGREED * change or motion.path.distance_to(x).max() <= _STILL:
                break
            step = inner.update(
                x.deviation_from(iterate.path), motion.path.deviation_from(iterate.path)
            )
            x = iterate.path.displaced(step)
            rest_force = process.rest_force(x)
        assert best is not None
        return best

    def update(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the relaxed iterate, with tools that creep carried on."""
        self._updates += 1
        if self._is_kept:
            return self._acceleration.update(x, g)
        if self._stabilisation is None:
            return x + self._first * (g - x)
        assert self._stiffness is not None
        move = (g - x)[:, self._rows, :3]
        self._stabilisation = self._stabilisation.after(move, self._stiffness.usual)
        factor = np.ones((*x.shape[:2], 1))
        factor[:, self._rows, 0] = self._stabilisation.factor
        return x + self._first * factor * (g - x)

    def _react(self, iterate: Iterate, mode: Mode) -> np.ndarray:
        """Return the stiffness at the process's samples, (n, 3 tools, 3 tools)."""
        position, force = iterate.path.position[:, iterate.rows], iterate.force
        stated = iterate.response.stiffness
        is_estimated = stated is None and mode == "dynamic"
        self._is_kept = is_estimated and self._updates >= _ESTIMATED
        if self._is_kept and self._own is not None:
            return self._own
        if self._stiffness is not None:
            if stated is not None:
                stated = self._hold_lost_contact(force, stated)
            self._stiffness = self._stiffness.then(position, force, stated, iterate.response.noise)
        elif stated is not None:
            self._stiffness = ProcessStiffness(position, force, stated)
        else:
            self._stiffness = self._guess(position, force)
        self._own, self._rows = self._stiffness.matrices, iterate.rows
        if mode == "dynamic":  # a moving robot cannot jump from sample to sample
            return self._own
        if self._stabilisation is None or self._stabilisation.hold.shape != force.shape[:2]:
            self._stabilisation = LocalStabilisation.initial(np.zeros(force.shape[:2]))
        holding = np.repeat(self._stabilisation.hold, 3, axis=0).T[..., None]
        return self._own + holding * np.eye(holding.shape[1])

    def _guess(self, position: np.ndarray, force: np.ndarray) -> ProcessStiffness:
        """Return the stiffness that the coupling before this one found, or a first guess."""
        size = 3 * len(force)
        if self._own is not None and self._own.shape == (force.shape[1], size, size):
            return ProcessStiffness(position, force, self._own)
        return ProcessStiffness.first(position, force)

    def _hold_lost_contact(self, force: np.ndarray, stated: np.ndarray) -> np.ndarray:
        """Return a stated stiffness; a tool that has lost contact keeps part of what held it."""
        assert self._stiffness is not None
        stiffness = stated.copy()
        for k, size in enumerate(np.any(force, axis=-1)):
            block = np.s_[:, 3 * k : 3 * k + 3, 3 * k : 3 * k + 3]
            lost = ~size & ~np.any(stated[block], axis=(-1, -2))
            stiffness[block][lost] = _KEPT * self._stiffness.matrices[block][lost]
        return stiffness

    def reset(self) -> None:
        """Forget earlier evaluations, but how stiff the process was and what did not settle."""
        self._stiffness = None
        self._updates, self._is_kept = 0, False
        self._acceleration.reset()
        if self._stabilisation is not None:
            self._stabilisation = self._stabilisation.restarted()


@dataclass(frozen=True)
class LinearProcess:
    """F(x) = F(x_k) + K (x_k - x) at the samples of the process, straight between them.

    Attributes:
        iterate: The path x_k and the answer to it.
        stiffness: K at the samples [N/m], (n, 3 tools, 3 tools).
    """

    iterate: Iterate
    stiffness: np.ndarray

    def change(self, path: ToolPath) -> np.ndarray:
        """Return by how much the forces [N] on a path differ from those answered, (tools, k, 3)."""
        return self._change(path, self.stiffness)

    def rest_force(self, path: ToolPath) -> np.ndarray:
        """Return the part of this change that each tool's spring does not give [N], (tools, k, 3)."""
        between = self.stiffness.copy()
        for first in range(0, between.shape[-1], 3):
            between[:, first : first + 3, first : first + 3] = 0.0
        return self._change(path, between)

    def _change(self, path: ToolPath, stiffness: np.ndarray) -> np.ndarray:
        displacement = (self.iterate.path.position - path.position)[:, self.iterate.rows]
        change = np.einsum("nij,nj->ni", stiffness, joined(displacement))
        tools = change.reshape(len(change), -1, 3).swapaxes(0, 1)
        return interpolate_rows(path.time, self.iterate.response.wrench.instants, tools, axis=1)


def _anchors(iterate: Iterate) -> np.ndarray:
    """Return where the springs of a process pull to [m], (tools, k, 3).

    Between two samples the force goes on by the stiffness, from what is straight between the tools'
    positions there: a stiff contact pushes back at once, whatever the robot does in between.
    """
    path, rows = iterate.path, iterate.rows
    return interpolate_rows(path.time, path.time[rows], path.position[:, rows], axis=1)


@dataclass(frozen=True)
class ProcessStiffness:
    """Stiffness of a process along the path of all tools, as its evaluations show it.

    Attributes:
        position: Positions of the TCPs that the process saw last [m], (tools, n, 3).
        force: Forces that it answered with [N], (tools, n, 3).
        matrices: Stiffness that it states, or that explains its answers [N/m], (n, 3 tools, 3 tools).
    """

    position: np.ndarray
    force: np.ndarray
    matrices: np.ndarray

    @classmethod
    def first(cls, position: np.ndarray, force: np.ndarray) -> ProcessStiffness:
        """Return a guess along the force [N] at positions [m], (tools, n, 3), of one size everywhere."""
        size = np.linalg.norm(force, axis=-1, keepdims=True)
        direction = np.divide(force, size, out=np.zeros_like(force), where=size > 0.0)
        tools, count = force.shape[:2]
        stiffness = np.zeros((count, tools, 3, tools, 3))
        for k, along in enumerate(direction):
            stiffness[:, k, :, k] = float(size.max()) / _FIRST_MOVE * _square(along)
        return cls(position, force, stiffness.reshape(count, 3 * tools, 3 * tools))

    @property
    def usual(self) -> float:
        """Stiffness that is usual along the path [N/m]: the median where there is one, 0 without."""
        sizes = np.trace(own_blocks(self.matrices), axis1=-2, axis2=-1)
        return float(np.median(sizes[sizes > 0.0])) if np.any(sizes > 0.0) else 0.0

    def then(
        self,
        position: np.ndarray,
        force: np.ndarray,
        stated: np.ndarray | None = None,
        noise: float = 0.0,
    ) -> ProcessStiffness:
        """Return the stiffness after one more evaluation, stated [N/m], (n, 3 tools, 3 tools), or not.

        Otherwise that of a sample is the symmetric one of rank one that explains the change of the
        forces on all tools, df df^T / (-df . dx): of all that are not negative the smallest.  It stays
        where no tool moved, the forces did not fall back, or noise explains how they changed.

        Args:
            noise: Standard deviation of white noise in the forces [N].
        """
        step = position - self.position
        moves, changed = joined(step), joined(force - self.force)
        work = -np.sum(changed * moves, axis=-1)
        distance, strong = np.linalg.norm(moves, axis=-1), np.linalg.norm(changed, axis=-1)
        band = _NOISE_BAND * np.sqrt(2.0) * noise
        falls = (
            (distance > _LEAST_MOVE) & (work > _LEAST_COSINE * distance * strong) & (strong > band)
        )
        secant = _square(changed) / np.where(falls, work, 1.0)[..., None, None]
        stiffness = (
            np.where(falls[..., None, None], secant, self.matrices) if stated is None else stated
        )
        return ProcessStiffness(position, force, stiffness)


def _square(vectors: np.ndarray) -> np.ndarray:
    """Return v v^T of vectors (..., m)."""
    return vectors[..., :, None] * vectors[..., None, :]
