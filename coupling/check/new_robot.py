"""A robot file on top of a URDF that somebody else wrote: its numbers, and marked stand-ins.

Nothing in it is of the robot unless the URDF has it: gears have the stiffness of a class, with its
range, and bodies without mass an estimate, each said beside the number and in [sources].
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pinocchio as pin

from coupling.check.chain_ends import ChainEnds, chain_ends
from coupling.check.typical_gears import CLASSES, GearClass, Spindle, class_of
from coupling.errors import one_of
from coupling.files.foreign_description import ForeignRobot, foreign_robot
from coupling.files.urdf import UrdfChain, read_urdf
from coupling.files.urdf_bodies import body_of
from coupling.files.urdf_tree import UrdfTree, read_tree
from elastic_robot.errors import RobotFileError

# Modes of robots that others measured have damping ratios of 0.02 to 0.08.
_DAMPING_RATIO = 0.04
# Lengths [m], and quarters of a turn, that are the same but for rounding in a URDF.
_URDF_ROUNDING = 1e-5
# Moment of inertia about a joint below which there is none, over mass and squared length.
_LEAST_INERTIA = 1e-9
# Each link weighs so much of the one before, and is as thick as a part of the longest one.
_MASS_RATIO, _THICKNESS_RATIO = 0.7, 0.15


@dataclass(frozen=True)
class RobotChoice:
    """What is to be taken for a robot that a URDF does not tell.

    Attributes:
        base, tip: Names of its first and last link; None: guessed.
        gears: Name of the class of its gears; None: guessed by its size.
    """

    base: str | None = None
    tip: str | None = None
    gears: str | None = None


@dataclass(frozen=True)
class NewRobot:
    """A robot file to be written.

    Attributes:
        texts: Its text and that of a URDF that had to be made, by their names.
        remarks: Sentences on what was chosen, and what is missing.
        spindle: Spindle that a robot of its class mills with.
    """

    file: str
    texts: dict[str, str]
    remarks: tuple[str, ...]
    spindle: Spindle


def new_robot(name_or_path: str, choice: RobotChoice, folder: Path) -> NewRobot:
    """Return a robot file for a robot as others describe it.

    Args:
        name_or_path: A URDF, xacro or MJCF file, or a name of robot_descriptions.

    Raises:
        RobotFileError: If the description cannot be read, or does not tell which chain is meant.
    """
    if choice.gears is not None and choice.gears not in CLASSES:
        raise RobotFileError(f"--payload-class: {one_of(CLASSES, choice.gears)}")
    foreign = foreign_robot(name_or_path)
    with tempfile.TemporaryDirectory() as scratch:
        urdf = foreign.file or Path(scratch, f"{foreign.name}.urdf")
        if foreign.file is None:
            urdf.write_text(foreign.text, encoding="utf-8")
        try:
            tree = read_tree(urdf)
            ends = chain_ends(tree, choice.base, choice.tip)
            chain = read_urdf(urdf, ends.base, ends.tip)
        except RobotFileError as cause:
            text = str(cause).removeprefix(f"{urdf}: ")
            raise RobotFileError(f"{name_or_path}: {text}") from cause
    texts = {} if foreign.file else {f"{foreign.name}.urdf": foreign.text}
    urdf_name = f"{foreign.name}.urdf"
    if foreign.file:
        urdf_name = Path(os.path.relpath(foreign.file.resolve(), folder.resolve())).as_posix()
    skeleton = _Skeleton(foreign, tree, ends, chain, choice.gears, urdf_name)
    file = f"{foreign.name}.toml"
    return NewRobot(
        file,
        {file: skeleton.text(), **texts},
        tuple(skeleton.remarks()),
        skeleton.gear_class.spindle,
    )


@dataclass(frozen=True)
class _Skeleton:
    """Content of a new robot file."""

    foreign: ForeignRobot
    tree: UrdfTree
    ends: ChainEnds
    chain: UrdfChain
    gears: str | None
    urdf: str

    def text(self) -> str:
        lines = [
            f"# {_printable(self.foreign.name)}, written by elastic-robot init from"
            f" {_printable(self.foreign.source)}.",
            "#",
            *(f"# {_printable(text)}" for text in self.remarks()),
            "",
            f"name = {_quote(self.foreign.name)}",
            *self._gravity(),
            "",
            "[urdf]",
            f"file = {_quote(self.urdf)}",
            f"base = {_quote(self.ends.base)}",
            "",
            "[tcp]                       # its x axis points along the tool, away from the flange",
            f"link = {_quote(self.ends.tip)}",
            "position = [0.0, 0.0, 0.0]           # tip of the tool in that link's frame [m]",
            f"rpy = {_numbers(self._tool_rpy())}",
            "",
            "[modal_damping]",
            f"ratio = {_DAMPING_RATIO:g}                # of all modes",
        ]
        for number, joint in enumerate(self.chain.joints):
            low, typical, high = self._stiffness(number)
            lines += [
                "",
                "[[joint]]",
                f"name = {_quote(joint.name)}",
                f"stiffness = {typical:g}                # of the class: {low:g} to {high:g}",
                f"stiffness_range = [{low:g}, {high:g}]",
                *self._body(number),
            ]
        return "\n".join([*lines, "", "[sources]", *self._sources(), ""])

    def remarks(self) -> Iterator[str]:
        """Yield what was chosen, and what is missing."""
        joints = len(self.chain.joints)
        yield (
            f"Chain of {joints} joints from {self.ends.base!r} to {self.ends.tip!r} ({self.ends.about}):"
            " --base and --tip choose others."
        )
        chosen = "as asked for" if self.gears else f"by {self._length:.2f} m of links"
        yield (
            f"Gears: typical of {self.gear_class.about} ({chosen}; --payload-class:"
            f" {', '.join(CLASSES)}), not measured on this robot."
        )
        if self._estimated:
            yield (
                f"Masses: the URDF has none behind {_names(self._estimated_names)}; they are ESTIMATES"
                f" after a moving mass of {self.gear_class.moving_mass:g} kg: gravity sag and motion are"
                " no better than these."
            )
        if self._impossible:
            names = [self.chain.joints[number].name for number in self._impossible]
            yield (
                f"Inertias: those of the URDF behind {_names(names)} are of no body, or resist no turn"
                " of the joint; they are ESTIMATES, rods of its masses."
            )
        yield from self.foreign.remarks

    @property
    def _length(self) -> float:
        """Length of the links from the first joint to the tip [m]."""
        ends = [*self.chain.base_from_joint, self.chain.base_from_tip]
        steps = np.diff([placement.translation for placement in ends], axis=0)
        return float(np.linalg.norm(steps, axis=1).sum())

    @property
    def gear_class(self) -> GearClass:
        """Class of its gears, as chosen or by its size."""
        return CLASSES[self.gears or class_of(self._length)]

    def _stiffness(self, number: int) -> tuple[float, float, float]:
        wrist = number >= max(len(self.chain.joints) - 3, 3)
        return self.gear_class.wrist if wrist else self.gear_class.arm

    def _gravity(self) -> list[str]:
        """Return the line of a gravity that is not the default: of a base that is turned."""
        root_from_base = pin.SE3.Identity()
        for joint in self.tree.way(self.tree.root, self.ends.base):
            root_from_base = root_from_base * joint.parent_from_joint
        gravity = root_from_base.rotation.T @ [0.0, 0.0, -9.81]
        if np.allclose(gravity, [0.0, 0.0, -9.81], atol=1e-9):
            return []
        return [f"gravity = {_numbers(gravity)}     # the root's -z, in the axes of the base"]

    def _tool_rpy(self) -> np.ndarray:
        """Return the turn of a tool along the last axis, away from the joint before, in the tip's frame.

        At zero angles its y axis is as near as may be to the base's: a robot that is stretched forward
        then bends its wrist, and does not turn it, to point the tool down.
        """
        axis = np.array(self.chain.joints[-1].axis)
        ends = [placement.translation for placement in self.chain.base_from_joint]
        out = self.chain.base_from_tip.translation - ends[-1]
        if abs(out @ axis) < _URDF_ROUNDING and len(ends) > 1:
            out = ends[-1] - ends[-2]
        x = axis if out @ axis >= -_URDF_ROUNDING else -axis
        leftward = np.array([0.0, 1.0, 0.0] if abs(x[1]) < 0.9 else [-1.0, 0.0, 0.0])
        y = leftward - (leftward @ x) * x
        y /= np.linalg.norm(y)
        base_from_tool = np.stack([x, y, np.cross(x, y)], axis=1)
        quarters = pin.rpy.matrixToRpy(self.chain.base_from_tip.rotation.T @ base_from_tool)
        quarters /= 0.5 * np.pi
        whole = np.round(quarters)
        near: np.ndarray = np.where(np.abs(quarters - whole) < _URDF_ROUNDING, whole, quarters)
        return 0.5 * np.pi * near

    @property
    def _estimated(self) -> list[int]:
        """Numbers of the bodies whose mass has to be estimated.

        A link between others may be without mass; the last one, which nothing else moves, may not.
        """
        masses = [body.mass for body in self.chain.inertias]
        if not any(masses):
            return list(range(len(masses)))
        last = max(number for number, mass in enumerate(masses) if mass > 0.0)
        return list(range(last + 1, len(masses)))

    @property
    def _estimated_names(self) -> list[str]:
        return [self.chain.joints[number].name for number in self._estimated]

    @property
    def _impossible(self) -> list[int]:
        """Numbers of the bodies whose inertia no body has, or leaves a joint with nothing to move."""
        numbers = []
        parts = zip(self.chain.joints, self.chain.inertias, strict=True)
        for number, (joint, inertia) in enumerate(parts):
            try:
                body_of(inertia, 1.0, None, np.eye(3), None if number else np.array(joint.axis))
            except ValueError:
                numbers.append(number)
        last = max((k for k, body in enumerate(self.chain.inertias) if body.mass > 0.0), default=0)
        if last not in (*numbers, *self._estimated) and not self._resists(last):
            numbers.append(last)
        return numbers

    def _resists(self, number: int) -> bool:
        """Return whether the body behind a joint has an inertia about its axis."""
        axis, body = np.array(self.chain.joints[number].axis), self.chain.inertias[number]
        off = np.cross(axis, body.lever)
        moment = float(axis @ body.inertia @ axis + body.mass * (off @ off))
        return moment > _LEAST_INERTIA * body.mass * self._length**2

    def _body(self, number: int) -> list[str]:
        """Return the lines of an estimated body: a rod from its joint to the next one."""
        mass = self.chain.inertias[number].mass
        count = len(self.chain.joints)
        if number in self._estimated:
            shares = _MASS_RATIO ** np.arange(count)
            mass = self.gear_class.moving_mass * shares[number] / shares.sum()
        elif number not in self._impossible:
            return []
        here = self.chain.base_from_joint[number]
        ends = [*self.chain.base_from_joint, self.chain.base_from_tip]
        way = here.rotation.T @ (ends[number + 1].translation - here.translation)
        thickness = _THICKNESS_RATIO * self._length / count
        moment = mass * (way @ way / 12.0 + thickness**2 / 2.0)
        inertia = f"inertia = [{moment:.3g}, {moment:.3g}, {moment:.3g}]    # an ESTIMATE"
        if number not in self._estimated:
            return [inertia]
        return [f"mass = {mass:.3g}    # an ESTIMATE", f"com = {_numbers(0.5 * way)}", inertia]

    def _sources(self) -> Iterator[str]:
        yield f'"urdf" = {_quote(self.foreign.source)}'
        yield '"tcp" = "an assumption of elastic-robot init: the flange, x along the last axis"'
        source = f"typical of {self.gear_class.about}, not of this robot: {self.gear_class.source}"
        yield f'"joint.stiffness" = {_quote(source)}'
        yield '"joint.stiffness_range" = "the same: the whole class"'
        yield '"modal_damping" = "an assumption: robots measured by others have 0.02 to 0.08"'
        estimate = "an ESTIMATE of elastic-robot init: {} spread as rods"
        moving = estimate.format(f"{self.gear_class.moving_mass:g} kg")
        if self._estimated:
            yield f'"joint.mass" = {_quote(moving)}'
            yield f'"joint.com" = {_quote(moving)}'
        if self._estimated or self._impossible:
            spread = moving if self._estimated else estimate.format("the URDF's masses")
            yield f'"joint.inertia" = {_quote(spread)}'


def _printable(text: str) -> str:
    return "".join(letter if letter.isprintable() else " " for letter in text)


def _names(names: Sequence[str]) -> str:
    return ", ".join(map(repr, names))


def _numbers(values: np.ndarray) -> str:
    return f"[{', '.join(repr(round(float(value), 12) + 0.0) for value in values)}]"


def _quote(text: str) -> str:
    """Return a text as a basic string of TOML."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"')
    plain = "".join(
        letter if letter.isprintable() else f"\\U{ord(letter):08x}" for letter in escaped
    )
    return f'"{plain}"'
