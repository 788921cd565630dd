"""URDF text -> its tree of links and joints, each refused by its name where there can be none.

Read as the parsers of ROS and Pinocchio do: prefixes such as `gazebo:` need no declaration, a blank line
may precede `<?xml`, axes need no unit length, the first of several elements of a kind counts, and what a
tree of bodies does not need (geometry, transmissions, extensions) is not looked at.  A loop of joints,
which a parser in native code follows without end, is refused here.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from coupling.errors import one_of
from coupling.files.bounded_file import read_bounded
from coupling.files.urdf_elements import (
    child_of,
    link_of,
    name_of,
    number_of,
    parse_xml,
    placement_of,
    plain_name,
    vector_of,
)
from elastic_robot.chain import spatial_inertia
from elastic_robot.errors import RobotFileError

# A description of links and joints has no such size; meshes are files of their own.
_MAX_BYTES = 64 * 2**20
# Types of joints that turn about an axis, and all others of the format.
ROTATIONS = ("revolute", "continuous")
_TYPES = (*ROTATIONS, "prismatic", "fixed", "floating", "planar")
# What stands beside links and joints and joins none; xacro leaves its properties behind.
_HARMLESS_WORDS = """
link joint material transmission gazebo ros2_control sensor mujoco plugin group group_state
disable_collisions collision_checking self_collision_checking version author license contact static
frame xacro:property
"""
_HARMLESS = frozenset(_HARMLESS_WORDS.split())
_HARMLESS_PREFIXES = ("gazebo:", "sensor:", "controller:", "interface:", "drake:collision_")
_OTHER_ROOTS = {
    "sdf": ", an SDF model: convert it to URDF, or give a URDF or MJCF of the robot",
    "mujoco": ", an MJCF model: give it the ending .xml",
    "COLLADA": ", a drawing: give the URDF that names it",
}
_MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass(frozen=True)
class TreeJoint:
    """A joint of a URDF.

    Attributes:
        name: Its name.
        kind: Its type, as revolute.
        parent, child: Names of the links that it joins.
        parent_from_joint: Placement of its frame, which is its child link's, at zero.
        axis: Unit vector in that frame, (3,); of a joint that turns or slides.
        limits: Lowest and highest angle [rad]; None where there are none.
        max_rate: Highest rate [rad/s]; None where there is none.
        effort: Highest torque as it is written, 0.0 where it is not [N m].
        mimics: Name of the joint that it follows, or empty.
    """

    name: str
    kind: str
    parent: str
    child: str
    parent_from_joint: pin.SE3
    axis: np.ndarray
    limits: tuple[float, float] | None
    max_rate: float | None
    effort: float
    mimics: str

    @property
    def is_rotation(self) -> bool:
        """Whether it is a driven rotation."""
        return self.kind in ROTATIONS and not self.mimics


@dataclass(frozen=True)
class UrdfTree:
    """The links of a URDF, joined to a tree.

    Attributes:
        links: Elements of the links by their names.
        joints: Joints by their names.
    """

    links: dict[str, Element]
    joints: dict[str, TreeJoint]

    @cached_property
    def parent_joint(self) -> dict[str, TreeJoint]:
        """Joint before each link but the root, by the link's name."""
        return {joint.child: joint for joint in self.joints.values()}

    @cached_property
    def child_joints(self) -> dict[str, list[TreeJoint]]:
        """Joints behind each link, by its name."""
        behind: dict[str, list[TreeJoint]] = {name: [] for name in self.links}
        for joint in self.joints.values():
            behind[joint.parent].append(joint)
        return behind

    @cached_property
    def root(self) -> str:
        """Link that no joint moves."""
        return next(name for name in self.links if name not in self.parent_joint)

    def link(self, name: str) -> str:
        """Return a link's name as the URDF has it.

        Raises:
            ValueError: If there is none.
        """
        if plain_name(name) not in self.links:
            raise ValueError(one_of(self.links, name, kind="link "))
        return plain_name(name)

    def way(self, base: str, tip: str) -> list[TreeJoint]:
        """Return the joints from one link to another, in their order.

        Raises:
            ValueError: If the tip is not behind the base.
        """
        joints: list[TreeJoint] = []
        link = tip
        while link != base:
            if link == self.root:
                raise ValueError(
                    f"expected a base between the root and {tip!r}, got {base!r}: name a link from"
                    " which the tip moves"
                )
            joints.append(self.parent_joint[link])
            link = joints[-1].parent
        return joints[::-1]

    def rigid_links(self, link: str, on_way: Collection[str]) -> Iterator[tuple[str, pin.SE3]]:
        """Yield a link, those behind it up to a way's joints, and their frames in its own."""
        waiting = [(link, pin.SE3.Identity())]
        while waiting:
            name, placement = waiting.pop()
            yield name, placement
            waiting += [
                (behind.child, placement * behind.parent_from_joint)
                for behind in self.child_joints[name]
                if behind.name not in on_way
            ]

    def inertia(self, link: str) -> pin.Inertia:
        """Return mass, centre of mass and inertia about it of a link, in its frame; zero for none.

        Raises:
            ValueError: With the link's name, if a number of them is missing or none.
        """
        inertial = self.links[link].find("inertial")
        if inertial is None:
            return pin.Inertia.Zero()
        try:
            mass = number_of(child_of(inertial, "mass"), "value")
            if mass < 0.0:
                raise ValueError(f"mass: expected >= 0 [kg], got {mass:g}")
            moments = child_of(inertial, "inertia")
            xx, yy, zz, xy, xz, yz = (number_of(moments, key) for key in _MOMENTS)
            placement = placement_of(inertial)
        except ValueError as cause:
            raise ValueError(f"link {link!r}: inertial: {cause}") from cause
        matrix = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return placement.act(spatial_inertia(mass, np.zeros(3), matrix))


def read_tree(file: Path) -> UrdfTree:
    """Read the links and joints of a URDF.

    Raises:
        RobotFileError: If the file is no URDF, or its joints make no tree of its links.
    """
    text = read_bounded(file, _MAX_BYTES, RobotFileError)
    try:
        root = parse_xml(text)
        if root.tag != "robot":
            remedy = _OTHER_ROOTS.get(root.tag, "")
            raise ValueError(f"expected <robot>, got <{root.tag[:40]}>{remedy}")
    except ValueError as cause:
        raise RobotFileError(f"{file}: is not a URDF: {cause}") from cause
    try:
        _require_harmless(root)
        links = _links(root)
        tree = UrdfTree(links, _joints(root, links))
        _require_tree(tree)
    except ValueError as cause:
        raise RobotFileError(f"{file}: {cause}") from cause
    return tree


def _require_harmless(root: Element) -> None:
    """Refuse what stands beside links and joints and may be one of them, or join them."""
    for element in root:
        tag = element.tag
        if tag not in _HARMLESS and not tag.startswith(_HARMLESS_PREFIXES):
            remedy = "take it out if it joins no links"
            if tag.startswith("xacro:"):
                remedy = "convert the file by xacro first, or give it the ending .xacro"
            raise ValueError(f"expected links and joints, got <{tag[:40]}>: {remedy}")


def _links(root: Element) -> dict[str, Element]:
    """Return the links by their names."""
    links = [(name_of(link, "link"), link) for link in root.findall("link")]
    if not links:
        raise ValueError(
            "expected links, got none: convert a xacro file first, of its files the one with the robot"
        )
    _require_once("link", (name for name, _ in links))
    return dict(links)


def _joints(root: Element, links: dict[str, Element]) -> dict[str, TreeJoint]:
    """Return the joints by their names, whose links exist."""
    # Those of a <transmission> or a <gazebo> are not among the robot's own children.
    joints = [_joint(element) for element in root.findall("joint")]
    _require_once("joint", (joint.name for joint in joints))
    for joint in joints:
        for role in ("parent", "child"):
            link = getattr(joint, role)
            if link not in links:
                raise ValueError(
                    f"joint {joint.name!r}: {role}: {one_of(links, link, kind='link ')}"
                )
    return {joint.name: joint for joint in joints}


def _joint(element: Element) -> TreeJoint:
    name = name_of(element, "joint")
    try:
        kind = element.get("type", "")
        if kind not in _TYPES:
            raise ValueError(f"type: {one_of(_TYPES, kind)}")
        mimic = element.find("mimic")
        limits, max_rate, effort = _limits(element, kind)
        return TreeJoint(
            name=name,
            kind=kind,
            parent=link_of(element, "parent"),
            child=link_of(element, "child"),
            parent_from_joint=placement_of(element),
            axis=_axis(element, kind),
            limits=limits,
            max_rate=max_rate,
            effort=effort,
            mimics="" if mimic is None else plain_name(mimic.get("joint", "")) or "?",
        )
    except ValueError as cause:
        raise ValueError(f"joint {name!r}: {cause}") from cause


def _limits(element: Element, kind: str) -> tuple[tuple[float, float] | None, float | None, float]:
    """Return range, highest rate and effort of a joint; a range of 0 to 0 is one that is not stated."""
    limit = element.find("limit")
    if limit is None or kind in ("fixed", "floating", "planar"):
        return None, None, 0.0
    low, high, rate, effort = (
        number_of(limit, key, default=0.0) for key in ("lower", "upper", "velocity", "effort")
    )
    stated = kind != "continuous" and not low == high == 0.0
    return (low, high) if stated else None, rate if rate > 0.0 else None, effort


def _axis(element: Element, kind: str) -> np.ndarray:
    """Return a joint's unit vector; x where none is given, as the format has it."""
    axis = element.find("axis")
    if axis is not None and axis.get("xyz") is None and kind not in ("fixed", "floating"):
        raise ValueError("axis: expected xyz, three numbers in one text, got none")
    vector = np.array([1.0, 0.0, 0.0]) if axis is None else vector_of(axis, "xyz", (1.0, 0.0, 0.0))
    length = float(np.linalg.norm(vector))
    if length == 0.0 and kind in (*ROTATIONS, "prismatic"):
        raise ValueError(f"axis: expected a direction, got {vector.tolist()}")
    return vector / length if length > 0.0 else vector


def _require_tree(tree: UrdfTree) -> None:
    """Refuse joints that close a loop, and links that hang on nothing."""
    for link, count in Counter(joint.child for joint in tree.joints.values()).items():
        if count > 1:
            parents = [repr(joint.name) for joint in tree.joints.values() if joint.child == link]
            raise ValueError(
                f"link {link!r}: expected one joint before it, got {' and '.join(parents)}: a URDF is a"
                " tree, so cut the loop (a closed parallelogram, for instance) by removing all but one"
                " of these joints"
            )
    roots = [name for name in tree.links if name not in tree.parent_joint]
    reached = set(roots)
    waiting = list(roots)
    while waiting:
        behind = [joint.child for joint in tree.child_joints[waiting.pop()]]
        reached.update(behind)
        waiting += behind
    lost = [name for name in tree.links if name not in reached]
    if lost:
        raise ValueError(
            f"link {lost[0]!r}: expected a way from a root, got joints in a circle"
            f" ({_some(lost)}): remove the joint that closes it"
        )
    if len(roots) > 1:
        raise ValueError(
            f"expected one link without a joint before it, got {len(roots)} ({_some(roots)}): join them"
            " by fixed joints, or remove what is not the robot's"
        )


def _some(names: list[str]) -> str:
    return ", ".join(names[:6]) + (", ..." if len(names) > 6 else "")


def _require_once(kind: str, names: Iterable[str]) -> None:
    for name, count in Counter(names).items():
        if count > 1:
            raise ValueError(f"{kind} {name!r}: expected it once, got it {count} times")
