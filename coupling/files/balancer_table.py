"""[joint.balancer] of a robot file: points of a counterbalance's torque, or its gas spring."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from coupling.files.toml_file import Positive, Schema, Vector3
from elastic_robot.balancers import BalancerCurve
from elastic_robot.description import Table

_Pair = Annotated[list[float], Field(min_length=2, max_length=2)]
# What the C core holds of a balancer (ER_MAX_BALANCER_POINTS in robot_data.h).
MOST_POINTS = 256
# Part of its largest torque by which a gas spring's table may be wrong between its points.
_ACCURACY = 1e-6
# Angles at which that, length and volume are looked at.
_LOOKED_AT = 4001
# A spring shorter than this part of its longest length turns about one of its ends.
_FOLDED_RATIO = 1e-3


class GasSpringTable(Schema):
    """`gas_spring` of a balancer: where it holds, and its gas at one of its lengths."""

    base_point: Vector3
    link_point: Vector3
    pressure_Pa: Positive
    length_m: Positive
    gas_volume_m3: Positive
    area_m2: Positive
    pulls: bool
    exponent: Positive = 1.0


class BalancerTable(Schema):
    """[joint.balancer]: torque on the joint's link about its axis, or the gas spring that makes it."""

    torque_table: Annotated[list[_Pair], Field(min_length=3, max_length=MOST_POINTS)] | None = None
    gas_spring: GasSpringTable | None = None

    @model_validator(mode="after")
    def _one_form(self) -> BalancerTable:
        if (self.torque_table is None) == (self.gas_spring is None):
            got = "neither" if self.torque_table is None else "both"
            raise ValueError(f"expected either torque_table or gas_spring, got {got}")
        return self

    def in_words(self) -> str:
        """Return what it is."""
        if self.torque_table is not None:
            return points_in_words(self.torque_table)
        spring = self.gas_spring
        assert spring is not None
        way, force = "pulls" if spring.pulls else "pushes", spring.pressure_Pa * spring.area_m2
        return f"a gas spring that {way} with {force:.4g} N at {spring.length_m:.4g} m"


def points_in_words(points: Sequence[Sequence[float]]) -> str:
    """Return what the points of a balancer come to, (angle [rad], torque [N m]) each."""
    torques = [torque for _, torque in points]
    return f"{len(torques)} points, {min(torques):.4g} to {max(torques):.4g} N m"


@dataclass(frozen=True)
class BalancerGeometry:
    """A joint as its balancer sees it; axes of the previous body's frame, which its own has at 0.

    Attributes:
        origin: Joint centre in the previous body's frame [m], (3,).
        axis: Unit vector of rotation, (3,).
        base_point: Point of the spring on the previous body, in its frame [m], (3,).
        link_point: Point of the spring on the link, in its frame [m], (3,).
    """

    origin: np.ndarray
    axis: np.ndarray
    base_point: np.ndarray
    link_point: np.ndarray

    def length(self, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return L [m] and dL/dphi [m/rad] of the spring at joint angles (k,) [rad], (k,) each."""
        from scipy.spatial.transform import Rotation

        arm = Rotation.from_rotvec(angle[:, None] * self.axis).apply(self.link_point)
        way = self.origin + arm - self.base_point
        length = np.linalg.norm(way, axis=1)
        along = np.einsum("ka,ka->k", way, np.cross(self.axis, arm))
        with np.errstate(divide="ignore", invalid="ignore"):
            return length, along / length


def gas_spring_points(
    spring: GasSpringTable, geometry: BalancerGeometry, limits: tuple[float, float]
) -> Table:
    """Return points of the torque that a gas spring gives a link (angle [rad], torque [N m]).

    With the length L, at which the gas has the volume V and the pressure p, n its exponent and A the
    area of the piston,

        V = V_0 -+ A (L - L_0),   p = p_0 (V_0 / V)^n,   torque = -+ p A dL/dphi

    with the upper signs for a spring that pulls: its gas is compressed where it grows longer.  The
    points lie over the joint's limits, closer at the ends, where a natural spline has no curvature.

    Args:
        limits: Lowest and highest angle of the joint [rad].

    Raises:
        ValueError: If the spring folds, its gas has no volume left, it turns nothing, or its torque
            bends more than a table holds.
    """
    sign = -1.0 if spring.pulls else 1.0

    @np.errstate(over="ignore", invalid="ignore")
    def torque(angle: np.ndarray) -> np.ndarray:
        length, by_angle = geometry.length(angle)
        volume = spring.gas_volume_m3 + sign * spring.area_m2 * (length - spring.length_m)
        _require(length > _FOLDED_RATIO * length.max(), "a length > 0 [m]", angle, length)
        _require(volume > 0.0, "a volume of its gas > 0 [m^3]", angle, volume)
        pressure = spring.pressure_Pa * (spring.gas_volume_m3 / volume) ** spring.exponent
        torque_points: np.ndarray = sign * spring.area_m2 * pressure * by_angle
        _require(np.isfinite(torque_points), "a finite torque [N m]", angle, torque_points)
        return torque_points

    between = np.linspace(*limits, _LOOKED_AT)
    exact = torque(between)
    allowed = _ACCURACY * np.abs(exact).max()
    arm = np.abs(geometry.length(between)[1]).max()
    if arm <= _FOLDED_RATIO * np.linalg.norm(geometry.link_point):
        raise ValueError(
            "gas_spring: expected points beside the joint's axis, got ones about which the spring turns"
            " nothing"
        )
    middle, half = 0.5 * (limits[0] + limits[1]), 0.5 * (limits[1] - limits[0])
    points = 9
    while True:
        angle = middle - half * np.cos(np.linspace(0.0, np.pi, points))
        angle[[0, -1]] = limits
        at = torque(angle)
        table = tuple(zip(angle.tolist(), at.tolist(), strict=True))
        missed = np.abs(BalancerCurve.through(table).torque(between) - exact).max()
        if missed <= allowed:
            return table
        if points == MOST_POINTS:
            raise ValueError(
                f"gas_spring: expected a torque that {MOST_POINTS} points over the joint's limits"
                f" interpolate to {allowed:.3g} N m, got {missed:.3g} N m between them: give narrower"
                " limits, or torque_table"
            )
        points = min(points + points // 3, MOST_POINTS)


def _require(good: np.ndarray, what: str, angle: np.ndarray, values: np.ndarray) -> None:
    if not good.all():
        worst = int(np.argmin(good))
        raise ValueError(
            f"gas_spring: expected {what} over the joint's limits, got {values[worst]:.4g} at"
            f" {angle[worst]:.4g} rad"
        )
