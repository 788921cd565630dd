"""A row of the table of parameters: all that is said of one kind of number that robots have."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np

from elastic_robot.description import Joint
from elastic_robot.drive import Drive
from elastic_robot.torque_curves import CurveClass


@dataclass(frozen=True)
class UsualRange:
    """Range in which the magnitude of a value usually is.

    Attributes:
        unit: Unit of both; "" for a number without one.
        why: Things that have these values.
        or_none: Whether 0 says that there is none of it, which is usual as well.
    """

    low: float
    high: float
    unit: str
    why: str
    or_none: bool = False

    def holds(self, value: float) -> bool:
        """Return whether a value is usual."""
        return self.low <= abs(value) <= self.high or (self.or_none and value == 0.0)


@dataclass(frozen=True)
class Variation:
    """How robots differ from their description in a kind of parameter, in all joints or in each.

    Attributes:
        name: Name of it; `_factor` or `_deg` behind it makes its key in a case.
        replays: Values in it on which a command is replayed, in SI.
        also: Further kinds that differ by the same factor.
        words: Name in sentences where it is not `name`.
        replay_words: Name of the replay where it is not by a percentage.
        is_shift: Whether it is an angle that is added, not a factor.
        above_zero: Whether no robot has 0 of it.
        place: Parts that have it, in sentences on robots that have any: "gears" or "motors"; "" for what
            every robot has.
    """

    name: str
    replays: tuple[float, ...] = ()
    also: tuple[str, ...] = ()
    words: str = ""
    replay_words: str = ""
    is_shift: bool = False
    above_zero: bool = False
    place: str = ""

    @property
    def key(self) -> str:
        """Its key in [plant] and [study]."""
        return f"{self.name}_deg" if self.is_shift else f"{self.name}_factor"

    @property
    def unit(self) -> float:
        """What 1 of its key is, in SI."""
        return float(np.deg2rad(1.0)) if self.is_shift else 1.0

    @property
    def neutral(self) -> float:
        """Value that changes nothing."""
        return 0.0 if self.is_shift else 1.0

    @property
    def in_words(self) -> str:
        """Its name in sentences."""
        return self.words or self.name.replace("_", " ")

    @property
    def named_replays(self) -> dict[str, float]:
        """Values of the replays by their names.

        Example:
            >>> Variation("friction", replays=(1.3, 0.7)).named_replays
            {'friction +30 %': 1.3, 'friction -30 %': 0.7}
        """
        return {
            self.replay_words or f"{self.in_words} {100.0 * (value - 1.0):+.3g} %": value
            for value in self.replays
        }

    def changed(self, value: float, amount: float) -> float:
        """Return a parameter's value that differs by an amount: a factor, or a shift [rad]."""
        return value + amount if self.is_shift else value * amount


@dataclass(frozen=True)
class MotionTerm:
    """How a motion identifies a kind of parameter.

    Attributes:
        name: Term of the equations of motion, of which other numbers may be, too.
        part: Part of the robot that has it; a gear's shows where its link is measured.
        size: Function of the start's part that gives its usual size, for what may be there where the
            start has none; None: the start's value, and without any it is not there.
        is_needed: Whether a robot without it cannot be computed: what is not identified is the start's.
        is_signed: Whether it may be negative.
        vanishes: Whether it may turn out to be none, which a narrow interval around none shows.
        most: Highest value, in usual sizes.
        prior: Standard deviation around the start, in parts of it; infinite if nothing is known.
    """

    name: str
    part: Literal["gear", "balancer", "motor", "payload"]
    size: Callable[[Any], float] | None = None
    is_needed: bool = False
    is_signed: bool = False
    vanishes: bool = False
    most: float = 30.0
    prior: float = np.inf


@dataclass(frozen=True)
class ParameterKind:
    """A number that a joint, a tilt or the payload has: a row of the table.

    Attributes:
        read: Function that returns its value in a part of the robot; 0 where that has none.
        write: Function that returns the part with another value.
        least, most: Bounds of what a model can be computed with; what is beyond is written as the bound.
        of_motor: Whether a drive that follows its command exactly does without it.
        acts: Function of a part and the torque curve: whether it changes anything there.
        at_rest: Whether the deflections of a robot at rest follow it.
        inverse: Whether fits count by its inverse, of which deflections are linear.
        prior: Standard deviation of the logarithm of a factor before anything is measured; None for what
            is not learned from measured runs.
        motion: Fit by which a motion identifies it, if it does.
        variation: Differences of robots in it from their description, if these are looked at.
        usual: Usual ranges of its numbers, by their places in a robot file.
        in_file: Function of the changed part that returns its numbers by their places in the part's
            table of a robot file.
        scaled_in_file: Places of numbers there that are multiplied as the parameter is; in a list of
            tables, those of each entry: `gear.hysteresis[].slip_torque`.
    """

    unit: str
    read: Callable[[Any], float]
    write: Callable[[Any, float], Any]
    least: float = -np.inf
    most: float = np.inf
    of_motor: bool = False
    acts: Callable[[Any, CurveClass], bool] | None = None
    at_rest: bool = False
    inverse: bool = False
    prior: float | None = None
    motion: MotionTerm | None = None
    variation: Variation | None = None
    usual: Mapping[str, UsualRange] = field(default_factory=dict)
    in_file: Callable[[Any], Mapping[str, object]] | None = None
    scaled_in_file: tuple[str, ...] = ()


def field_kind(key: str, unit: str, **further: Any) -> ParameterKind:
    """Return the kind of a field of its part, which has the same name in a robot file."""
    return ParameterKind(
        unit,
        lambda part: getattr(part, key, None) or 0.0,
        lambda part, value: replace(part, **{key: value}),
        in_file=lambda part: {key: getattr(part, key)},
        **further,
    )


def drive_kind(
    unit: str,
    read: Callable[[Drive], float],
    write: Callable[[Drive, float], Drive],
    **further: Any,
) -> ParameterKind:
    """Return the kind of a number of a joint's drive."""

    def read_joint(part: Any) -> float:
        drive = getattr(part, "drive", None)
        return 0.0 if drive is None else read(drive)

    def write_joint(joint: Joint, value: float) -> Joint:
        return joint if joint.drive is None else replace(joint, drive=write(joint.drive, value))

    return ParameterKind(unit, read_joint, write_joint, of_motor=True, **further)


def drive_field_kind(key: str, unit: str, **further: Any) -> ParameterKind:
    """Return the kind of a field of a joint's drive."""
    return drive_kind(
        unit,
        lambda drive: float(getattr(drive, key)),
        lambda drive, value: replace(drive, **{key: value}),
        **further,
    )


def entries_kind(
    entries: str, key: str, unit: str, total: Callable[[Iterable[float]], float], **further: Any
) -> ParameterKind:
    """Return the kind of a number of all entries of a gear, as elements of hysteresis, changed alike.

    Args:
        entries: Name of their tuple in a joint and of their list under `gear` in a robot file.
        key: Name of the number in an entry.
        total: Function that gives the parameter of these numbers.
    """

    def read(part: Any) -> float:
        values = [float(getattr(entry, key)) for entry in getattr(part, entries, ())]
        return total(values) if values else 0.0

    def write(part: Any, value: float) -> Any:
        factor = value / read(part)
        existing = getattr(part, entries) if factor > 0.0 else ()
        scaled = (replace(entry, **{key: factor * getattr(entry, key)}) for entry in existing)
        return replace(part, **{entries: tuple(scaled)})

    return ParameterKind(unit, read, write, scaled_in_file=(f"gear.{entries}[].{key}",), **further)
