"""Contract of a process model: it sees the whole actual path of the tools and answers for all of it."""

from __future__ import annotations

import hashlib
import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal, Protocol, runtime_checkable

import numpy as np
from pydantic import Field

from coupling.errors import CaseError, reason_of
from coupling.files.toml_file import Positive, Schema
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.workpiece import Workpiece
from coupling.process.force_laws import ForceLaw
from coupling.process.noise_filter import AdaptiveLowPass, ForceFilter, LowPass, own_frequency
from coupling.toolpaths.instants import NO_CORNERS, Corners
from coupling.toolpaths.task import Task
from coupling.toolpaths.tilt import APPROACH

# Raised by one whenever any shipped process answers a path differently than before, beyond rounding:
# answers that were kept under a lower number are not used again (CONTRIBUTING.md).
PHYSICS = 11

# Folder in the workspace for what programs compute; kept even where a run fails.
EVALUATIONS = "evaluations"
# Tries after the first one at most: what fails as often will not succeed by itself.
_MOST_RETRIES = 20


@dataclass(frozen=True)
class ProcessResponse:
    """Response of a process to a path.

    Attributes:
        wrench: Wrenches on the tools along it.
        workpiece: Workpiece to look at, such as a formed sheet, if there is one.
        period: Period of the wrench [s], as of a mill's teeth; None where it has none.
        stiffness: Negative derivative of the forces by the tools' displacements, K = -dF/dx,
            base axes [N/m], (n, 3 tools, 3 tools), one tool after the other, where the process knows.
            What a tool feels of its own displacement is symmetric and not negative.
        noise: Standard deviation of white noise by which its forces differ from those of another answer
            to the same path [N].
    """

    wrench: WrenchHistory
    workpiece: Workpiece | None = None
    period: float | None = None
    stiffness: np.ndarray | None = None
    noise: float = 0.0


def joined(vectors: np.ndarray) -> np.ndarray:
    """Return vectors of all tools, any unit, (tools, n, 3), side by side, (n, 3 tools)."""
    return np.concatenate(list(vectors), axis=-1)


def own_blocks(stiffness: np.ndarray) -> np.ndarray:
    """Return the stiffness of every tool by its own displacement [N/m], (tools, n, 3, 3).

    Args:
        stiffness: Stiffness of all tools [N/m], (n, 3 tools, 3 tools).

    Example:
        >>> own_blocks(np.arange(36.0).reshape(1, 6, 6))[1, 0]
        array([[21., 22., 23.],
               [27., 28., 29.],
               [33., 34., 35.]])
    """
    starts = range(0, stiffness.shape[-1], 3)
    return np.stack([stiffness[:, k : k + 3, k : k + 3] for k in starts])


@dataclass(frozen=True)
class ProcessMemory:
    """How far a process looks back, and how the time of its coupling is divided.

    Attributes:
        step: Longest step of the paths that it is evaluated on [s].
        period: Period of its wrench, as of a mill's teeth [s].
        window: Time after which it about repeats [s].
        length: Time before which nothing counts [s].
    """

    step: float
    period: float
    window: float
    length: float


class Process(Protocol):
    """A process model without memory from one evaluation to the next."""

    @property
    def identity(self) -> str:
        """Key of its answers: equal for processes that answer alike, empty where it is not known."""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the response of the process to the actual path of all tools, base axes.

        Raises:
            ProcessError: If it has no answer.
        """


class MarchedProcess(Process, Protocol):
    """A process that answers to what its tools did before: it is coupled marching in time."""

    @property
    def memory(self) -> ProcessMemory:
        """How far it looks back."""

    def means(self, time: np.ndarray, pose: np.ndarray, since: int) -> np.ndarray:
        """Return the mean wrenches over the steps that end at the rows from one on [N, N m].

        Args:
            time: Times from `memory` before that row on, or from the beginning [s], (n,).
            pose: Actual poses of the tools there, as of `ToolPath` [m, 1], (tools, n, 7).
            since: Number of that row; at row 0 the wrench in initialisation.

        Returns:
            Wrenches in base axes, (tools, n - since, 6).
        """


@runtime_checkable
class MayMarch(Protocol):
    """A process that may be one of these, or stand before one."""

    @property
    def marched(self) -> MarchedProcess | None:
        """It, marching in time; None where it is evaluated along whole paths alone."""


def marched(process: Process) -> MarchedProcess | None:
    """Return a process that is coupled marching in time as such, None for others."""
    return process.marched if isinstance(process, MayMarch) else None


@dataclass(frozen=True)
class ProcessRequest:
    """One evaluation of a process.

    Attributes:
        path: The path.
        response: Its answer.
        seconds: Time that computing it took [s].
    """

    path: ToolPath
    response: ProcessResponse
    seconds: float


@dataclass(frozen=True, kw_only=True)
class WithIdentity:
    """Base of processes that carry the identity which their table gives them.

    Attributes:
        identity: Text of `ProcessSchema.identity`.
    """

    identity: str = ""


@dataclass(frozen=True)
class MemorylessProcess(WithIdentity, ABC):
    """A process of one tool whose force follows a `ForceLaw`; it can also be packed as an FMU."""

    @abstractmethod
    def law(self) -> ForceLaw:
        """Return the law."""

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return force and stiffness of the law along the actual path of the tool."""
        reaction = self.law().reaction(path.time, path.position[0])
        wrench = WrenchHistory.of_forces(path.time, [reaction.force])
        return ProcessResponse(wrench, stiffness=reaction.stiffness)


class ProcessSchema(Schema, ABC):
    """Base of all process tables of the case file; a table answers `process(task)`.

    Attributes:
        WITHOUT_EFFECT: Names of keys that the answers do not depend on, such as a time limit.
        FORMULA: Whether an answer is that of a formula, which takes a moment only.
        AROUND_EVALUATION: Names of keys of what is done with the answers.
        FORCE_FACTORS: Lowest and highest real force over the computed one, of comparisons with
            measurements (docs/trust.md); None: not known.
    """

    FORCE_FACTORS: ClassVar[tuple[float, float] | None] = None
    WITHOUT_EFFECT: ClassVar[frozenset[str]] = frozenset()
    FORMULA: ClassVar[bool] = False
    AROUND_EVALUATION: ClassVar[frozenset[str]] = frozenset()

    model: str

    @abstractmethod
    def process(self, task: Task) -> Process:
        """Return the process for a task.

        Raises:
            CaseError: If table and task do not fit.
        """

    def corners(self, task: Task) -> Corners:
        """Return the times at which the force along a task's desired path has corners [s], (k,).

        Between two samples the force is straight, so a process is evaluated there as well: where contact
        begins and ends, at the ends of ramps.  `coupling.process.corners` finds when a tool crosses a
        surface.

        Args:
            task: The task, its path in short steps.
        """
        return NO_CORNERS

    @property
    def forming_tool_diameter(self) -> float | None:
        """Diameter of the forming tool's sphere [m]; None where the process knows one tool alone."""
        return None

    def own_files(self) -> Iterable[Path]:
        """Return the user's files that the answers depend on."""
        return ()

    def identity(self, task: Task) -> str:
        """Return a hash of the resolved table, the task and the user's own files.

        Raises:
            CaseError: If a file cannot be read.
        """
        digest = hashlib.sha256()

        def add(content: bytes) -> None:
            digest.update(len(content).to_bytes(8, "big"))
            digest.update(content)

        table = self.model_dump(
            mode="json", exclude={*self.WITHOUT_EFFECT, *self.AROUND_EVALUATION}
        )
        add(json.dumps(table, sort_keys=True).encode())
        for values in _arrays_of(task):
            add(values.tobytes())
        code = Path(inspect.getfile(type(self)))
        code_files = [] if code.is_relative_to(Path(__file__).parent) else [code]
        for file in (*code_files, *self.own_files()):
            try:
                add(file.read_bytes())
            except OSError as cause:
                raise CaseError(f"process: {file}: cannot be read: {reason_of(cause)}") from cause
        return digest.hexdigest()


class NoisySchema(ProcessSchema, ABC):
    """Base of the tables of processes whose answers may hold noise: records, and programs of others.

    Attributes:
        cutoff_Hz: Frequency up to which their forces are believed; "none": all of it; None: where there
            is noise, that of the path's own motion at least, and higher where the force changes by more
            than noise explains.
    """

    cutoff_Hz: Positive | Literal["none"] | None = None

    def low_pass(self, path: ToolPath) -> ForceFilter | None:
        """Return the filter of the forces along a desired path; None: they are left as they are."""
        if self.cutoff_Hz == "none":
            return None
        if self.cutoff_Hz is None:
            return AdaptiveLowPass(own_frequency(path))
        return LowPass(self.cutoff_Hz)


class ProcessTable(NoisySchema, ABC):
    """Base of the tables of processes that this package does not know: yours, programs and FMUs.

    Attributes:
        retries: Number of times that an evaluation that fails is tried again.
    """

    AROUND_EVALUATION: ClassVar[frozenset[str]] = frozenset({"retries", "cutoff_Hz"})

    retries: Annotated[int, Field(ge=0, le=_MOST_RETRIES)] = 0


def _arrays_of(task: Task) -> Iterable[np.ndarray]:
    """Return all that a process may know of a task, as numbers."""
    yield from (task.part.position, task.part.rotation.as_quat())
    yield from (task.desired.time, task.desired.pose)
    yield np.array([np.nan if x is None else x for x in (task.wall_angle, task.step_down)])
    if not np.array_equal(task.contact, APPROACH):
        yield task.contact
    if task.support is not None:
        yield task.support.direction
        yield np.array([task.support.gap, task.support.tool_diameter])
