"""Milling forces along the actual path: chip, engagement and depth follow from where the tool is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from coupling.errors import CaseError
from coupling.files.toml_file import Positive
from coupling.path.frame import Frame
from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.linear import interpolated
from coupling.process.base import Memory, ProcessResponse, ProcessSchema, WithIdentity
from coupling.process.corners import level_crossings
from coupling.process.cutting_force import (
    Cutter,
    CuttingCoefficients,
    Engagement,
    Way,
    mean_wrench,
    tooth_wrench,
)
from coupling.toolpaths.instants import Corners
from coupling.toolpaths.task import Task

# Samples that a tooth's passing needs at least; with fewer the robot would see a slower one.
_SAMPLES_PER_TOOTH = 6
# Longest step that tells a robot's vibrations, at 200 Hz ten in each [s].
_LONGEST = 5e-4
# Gauss points and weights of the mean over a step.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(3)
# A tool slower than this has no direction of feed of its own [m/s].
_STANDING = 1e-6

Arc = Callable[[np.ndarray, float], tuple[np.ndarray, np.ndarray]]


def _arc_of_slot(depth: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros_like(depth), np.full_like(depth, np.pi)


def _arc_of_up_milling(depth: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros_like(depth), np.arccos(1.0 - np.clip(depth / radius, 0.0, 2.0))


def _arc_of_down_milling(depth: np.ndarray, radius: float) -> tuple[np.ndarray, np.ndarray]:
    start, end = _arc_of_up_milling(depth, radius)
    return np.pi - end, np.pi - start


# Engaged arc from radial depth [m] and radius [m]; the material is on both sides, left or right.
ARCS: dict[str, Arc] = {
    "slot": _arc_of_slot,
    "up": _arc_of_up_milling,
    "down": _arc_of_down_milling,
}
_TOWARDS_MATERIAL = {"slot": 0.0, "up": 1.0, "down": -1.0}


@dataclass(frozen=True)
class Milling:
    """A milling cut along a desired path, in the part's x-y plane.

    Attributes:
        part: base_from_part.
        desired: Path of the tip's centre.
        cutter: The tool, its axis along the part's z.
        coefficients: Cutting coefficients of the material.
        engagement: "slot", "up" (material left of the feed) or "down" (right of it).
        radial_depth: Radial depth along the desired path [m].
        surface: Height of the raw surface in the part frame [m].
    """

    part: Frame
    desired: ToolPath
    cutter: Cutter
    coefficients: CuttingCoefficients
    engagement: str
    radial_depth: float
    surface: float

    def feed_directions(self) -> np.ndarray:
        """Return unit vectors along the desired feed in the part's x-y plane, (n, 2).

        Where the tool stands or plunges it is the direction of the last feed, or of the first.
        """
        points = self.part.coordinates(self.desired.position[0])[:, :2]
        velocity = np.gradient(points, self.desired.time, axis=0)
        speed = np.linalg.norm(velocity, axis=1)
        moving = speed > _STANDING
        last = np.maximum.accumulate(np.where(moving, np.arange(len(speed)), -1))
        at = np.where(last < 0, int(np.argmax(moving)), last)
        return velocity[at] / np.maximum(speed[at], _STANDING)[:, None]

    def feed_at(self, time: np.ndarray) -> np.ndarray:
        """Return the directions of the desired feed at times [s], (m,): of the step there, (m, 2)."""
        rows = np.searchsorted(self.desired.time, time)
        return self._feed[np.minimum(rows, len(self._feed) - 1)]

    @cached_property
    def _feed(self) -> np.ndarray:
        return self.feed_directions()

    @cached_property
    def _desired(self) -> np.ndarray:
        """Desired positions in the part [m], (n, 3)."""
        return self.part.coordinates(self.desired.position[0])

    def cut(self, path: ToolPath, time: np.ndarray, feed: np.ndarray) -> Engagement:
        """Return the cutter's engagement on an actual path.

        Args:
            path: Actual path.
            time: Instants [s], (m,).
            feed: Directions of the desired feed there, (m, 2).
        """
        actual = self.part.coordinates(path.position[0])
        now = interpolated(time, path.time, actual)
        before = interpolated(time - self.cutter.tooth_period, path.time, actual)
        way = (now - before)[:, :2]
        leftward = np.column_stack([-feed[:, 1], feed[:, 0]])
        chip = np.column_stack([np.sum(way * feed, axis=1), np.sum(way * leftward, axis=1)])
        offset = np.sum(
            (now - interpolated(time, self.desired.time, self._desired))[:, :2] * leftward, axis=1
        )
        radial = self.radial_depth + _TOWARDS_MATERIAL[self.engagement] * offset
        start, end = ARCS[self.engagement](radial, self.cutter.radius)
        return Engagement(chip, start, end, np.maximum(self.surface - now[:, 2], 0.0))

    def in_base(self, wrench: np.ndarray, feed: np.ndarray) -> np.ndarray:
        """Turn wrenches from the axes of the cut to those of the base [N, N m], (n, 6)."""
        cos, sin = feed.T[..., None]
        f, n, z = np.moveaxis(wrench.reshape(-1, 2, 3), 2, 0)
        in_part = np.stack([cos * f - sin * n, sin * f + cos * n, z], axis=2)
        return self.part.rotate(in_part).reshape(-1, 6)


@dataclass(frozen=True)
class MillingForce(WithIdentity):
    """Force of a milling cut, averaged over a revolution, for samples far apart.

    Attributes:
        milling: The cut.
    """

    milling: Milling

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the wrench along the actual path of the tool."""
        milling = self.milling
        feed = milling.feed_at(path.time)
        cut = milling.cut(path, path.time, feed)
        wrench = mean_wrench(milling.cutter, milling.coefficients, cut)
        in_base = milling.in_base(wrench, feed)
        return ProcessResponse(
            WrenchHistory(path.time, in_base), period=milling.cutter.tooth_period
        )


@dataclass(frozen=True)
class ToothPassing(WithIdentity):
    """Force of every tooth as it passes, which remembers what the passes before have left.

    Attributes:
        milling: The cut.
    """

    milling: Milling

    @property
    def marched(self) -> ToothPassing:
        """Itself: it is coupled marching in time."""
        return self

    @property
    def memory(self) -> Memory:
        """How far it looks back, and how its time is divided."""
        cutter = self.milling.cutter
        step = min(cutter.tooth_period / _SAMPLES_PER_TOOTH, _LONGEST)
        return Memory(step, cutter.period, cutter.turn_period, cutter.memory)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return the wrench along the actual path of the tool."""
        # Teeth come and go within a step: their impulse over it counts.
        history = WrenchHistory.of_means(path.time, self.means(path, 0)[0])
        return ProcessResponse(history, period=self.milling.cutter.period)

    def means(self, path: ToolPath, since: int) -> np.ndarray:
        """Return the mean wrenches over the steps that end at the rows from one on [N, N m].

        Args:
            path: Actual path, from `memory` before that row on, or from its beginning.
            since: Number of that row.

        Returns:
            Wrenches in base axes, (1, n - since, 6).
        """
        milling = self.milling
        ends = path.time[since:]
        steps = ends - path.time[np.maximum(np.arange(since, len(path.time)) - 1, 0)]
        time = (ends[:, None] - 0.5 * (1.0 - _NODES) * steps[:, None]).ravel()
        feed = milling.feed_at(time)
        cut = milling.cut(path, time, feed)
        way = Way(path.time, milling.part.coordinates(path.position[0])[:, :2])
        wrench = tooth_wrench(milling.cutter, milling.coefficients, cut, way, feed, time)
        in_base = milling.in_base(wrench, feed).reshape(len(ends), len(_NODES), 6)
        return np.einsum("g,ngw->nw", 0.5 * _WEIGHTS, in_base)[None]


FORCES: dict[str, type[MillingForce | ToothPassing]] = {
    "tooth-passing": ToothPassing,
    "mean": MillingForce,
}


class MillingForceTable(ProcessSchema):
    """Keys of cutter, cut and material; see docs/milling.md.

    force is "tooth-passing" (resolved in time) or "mean" (over a revolution); engagement is "slot",
    "up" or "down", the latter two with radial_depth_m.  The axial depth is how far the tool's tip
    is below surface_z_m.
    """

    FORMULA: ClassVar[bool] = True

    model: Literal["milling-force"]
    force: Literal["tooth-passing", "mean"] = "tooth-passing"
    cutter_diameter_m: Positive
    teeth: Annotated[int, Field(ge=1)]
    helix_deg: Annotated[float, Field(ge=0.0, lt=80.0)]
    spindle_speed_rpm: Positive
    engagement: Literal["slot", "up", "down"]
    radial_depth_m: Positive | None = None
    surface_z_m: float = 0.0
    K_tc_Pa: Annotated[float, Field(ge=0.0)]
    K_rc_Pa: Annotated[float, Field(ge=0.0)]
    K_ac_Pa: Annotated[float, Field(ge=0.0)]
    K_te_N_m: Annotated[float, Field(ge=0.0)]
    K_re_N_m: Annotated[float, Field(ge=0.0)]
    K_ae_N_m: Annotated[float, Field(ge=0.0)]

    @model_validator(mode="after")
    def _radial_depth_fits(self) -> MillingForceTable:
        depth, diameter = self.radial_depth_m, self.cutter_diameter_m
        if (depth is None) != (self.engagement == "slot"):
            raise ValueError(
                "radial_depth_m: expected a depth for up and down, none for a slot, got"
                f" {'none' if depth is None else depth} for {self.engagement}"
            )
        if depth is not None and depth > diameter:
            raise ValueError(
                f"radial_depth_m: expected at most cutter_diameter_m, {diameter}, got {depth}"
            )
        return self

    def corners(self, task: Task) -> Corners:
        """Return the times at which the tool's tip crosses the raw surface."""
        return level_crossings(task.forming, task.part, (self.surface_z_m,))

    def process(self, task: Task) -> MillingForce | ToothPassing:
        """Return the milling force along a task's path.

        Raises:
            CaseError: If the path's samples are too far apart for its teeth, or it never feeds.
        """
        cutter = Cutter(
            radius=0.5 * self.cutter_diameter_m,
            teeth=self.teeth,
            helix=float(np.deg2rad(self.helix_deg)),
            speed=self.spindle_speed_rpm * 2.0 * np.pi / 60.0,
        )
        longest = float(np.diff(task.desired.time).max())
        limit = cutter.tooth_period / _SAMPLES_PER_TOOTH
        if self.force == "tooth-passing" and longest > limit:
            raise CaseError(
                f"process: expected samples at most {1e3 * limit:.4g} ms apart, as a tooth passes"
                f" every {1e3 * cutter.tooth_period:.4g} ms, got {1e3 * longest:.4g} ms: lower"
                ' sample_s, or set force = "mean"'
            )
        coefficients = CuttingCoefficients(
            self.K_tc_Pa,
            self.K_rc_Pa,
            self.K_ac_Pa,
            self.K_te_N_m,
            self.K_re_N_m,
            self.K_ae_N_m,
        )
        milling = Milling(
            part=task.part,
            desired=task.forming,
            cutter=cutter,
            coefficients=coefficients,
            engagement=self.engagement,
            radial_depth=self.radial_depth_m or self.cutter_diameter_m,
            surface=self.surface_z_m,
        )
        if not np.any(milling.feed_directions()):
            raise CaseError("process: the tool path never moves in the part's x-y plane")
        return FORCES[self.force](milling, identity=self.identity(task))
