"""Base and tip of a robot in a URDF that nobody has named: the links that are usually meant."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from coupling.errors import one_of
from coupling.files.urdf_tree import TreeJoint, UrdfTree
from elastic_robot.errors import RobotFileError

# Links that a tool is put on, the usual ones first.
_TIPS = (
    "tool0",
    "flange",
    "tcp",
    "ee_link",
    "link_ee",
    "end_effector",
    "end_effector_link",
    "endeffector",
    "ee",
    "attachment_site",
    "attachment",
    "link8",
    "hand",
    "gripper_link",
    "gripper",
    "tool",
    "tool_link",
)
# A chain to one of them counts from so many joints on: the wrist of a gripper is none.
_MIN_JOINTS = 3
# Joints behind so many are a gripper's where they, or the links that they move, are called so.
_GRIPPER_JOINT = re.compile(r"grip|finger|thumb|knuckle|jaw", re.IGNORECASE)
_FINGER_LINK = re.compile(r"finger|thumb|knuckle|jaw", re.IGNORECASE)


@dataclass(frozen=True)
class ChainEnds:
    """Base and tip of a chain of rotations.

    Attributes:
        joints: Names of the joints between them that turn.
    """

    base: str
    tip: str
    joints: tuple[str, ...]
    about: str


def chain_ends(tree: UrdfTree, base: str | None = None, tip: str | None = None) -> ChainEnds:
    """Return base and tip; those that are not given are guessed.

    What slides or floats before most of the rotations carries the robot, as a rail or a vehicle: the
    base is behind it.  What slides behind them is carried, as the quill of a SCARA: the tip is before.
    So are the fingers of a gripper.

    Raises:
        RobotFileError: If no joint turns, or it is not clear which chain is meant.
    """
    root = tree.root
    if base is not None:
        root = _link(tree, base, "--base")
    if tip is not None:
        tip = _link(tree, tip, "--tip")
        return _ends(tree, root, tip, base is None, "as asked for")
    chains: dict[str, tuple[str, ...]] = {}
    moving = _moving_joints(tree, root)
    for link in tree.links:
        if joints := _rotations(moving.get(link, ())):
            chains[link] = joints
    if not chains:
        raise RobotFileError(f"expected joints that turn behind {root!r}, got none")
    longest = max(map(len, chains.values()))
    for name in _TIPS:
        names = [
            link
            for link, joints in chains.items()
            if len(joints) >= min(_MIN_JOINTS, longest) and _is_called(link, name)
        ]
        if names:
            return _ends(tree, root, _the_one(names, chains), base is None, "by its name")
    full = _longest(chains)
    arms = _longest({k: joints for k, joints in chains.items() if not _has_gripper(tree, joints)})
    # An arm carries its gripper; a finger of a hand carries no other one.
    if any(all(j[: len(arm)] == arm for j in full.values()) for arm in arms.values()):
        full = arms
    last = [link for link in full if not any(j.child in full for j in tree.child_joints[link])]
    chosen = _the_one(last, chains)
    joints = full[chosen]
    about = f"the end of the longest chain, {len(joints)} joints{_behind(tree, joints[-1])}"
    return _ends(tree, root, chosen, base is None, about)


def _longest(chains: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """Return the chains that have most joints, by their last links."""
    most = max(map(len, chains.values()), default=0)
    return {link: joints for link, joints in chains.items() if len(joints) == most}


def _has_gripper(tree: UrdfTree, joints: Sequence[str]) -> bool:
    """Return whether joints in their order end with those of a gripper."""
    return any(_is_of_gripper(tree.joints[name]) for name in joints[_MIN_JOINTS:])


def _is_of_gripper(joint: TreeJoint) -> bool:
    called = _GRIPPER_JOINT.search(joint.name) or _FINGER_LINK.search(joint.child)
    return called is not None


def _behind(tree: UrdfTree, last: str) -> str:
    """Return what moves behind the last joint of an arm, in words; empty for nothing."""
    moving = {joint.name for joint in tree.joints.values() if joint.kind != "fixed"}
    for link, _ in tree.rigid_links(tree.joints[last].child, moving):
        for joint in tree.child_joints[link]:
            if joint.name in moving and (not joint.is_rotation or _is_of_gripper(joint)):
                kind = "a mimic joint" if joint.mimics else joint.kind
                kind = "a gripper's" if joint.is_rotation else kind
                return f", as {joint.name!r} behind it is {kind}: it is carried at zero"
    return ""


def _ends(tree: UrdfTree, root: str, tip: str, may_move: bool, about: str) -> ChainEnds:
    """Return the ends of the chain to a tip, its base behind what carries the robot."""
    moving = tuple(joint for joint in tree.way(root, tip) if joint.kind != "fixed")
    base = root
    carriers = len(moving) - len(_rotations(moving)) if may_move else 0
    if carriers < len(moving):
        for joint in moving[:carriers]:
            base = joint.child
        rail_joints = [repr(joint.name) for joint in moving[:carriers]]
        moving = moving[carriers:]
        if rail_joints:
            about += f", behind {', '.join(rail_joints)}, held at zero"
    return ChainEnds(base, tip, tuple(j.name for j in moving if j.is_rotation), about)


def _the_one(links: list[str], chains: dict[str, tuple[str, ...]]) -> str:
    """Return the first of the links of one chain; chains of different joints are refused."""
    most = max(len(chains[link]) for link in links)
    links = [link for link in links if len(chains[link]) == most]
    if len({chains[link] for link in links}) > 1:
        raise RobotFileError(
            f"expected one chain of joints, got several, to {', '.join(links[:6])}: choose its last link"
            " by --tip"
        )
    return links[0]


def _rotations(moving: tuple[TreeJoint, ...]) -> tuple[str, ...]:
    """Return the joints that turn behind all that slides, if no more turn before that."""
    runs: list[list[str]] = [[]]
    for joint in moving:
        if joint.is_rotation:
            runs[-1].append(joint.name)
        else:
            runs.append([])
    *before, last = runs
    return tuple(last) if all(len(run) < len(last) for run in before) else ()


def _moving_joints(tree: UrdfTree, root: str) -> dict[str, tuple[TreeJoint, ...]]:
    """Return the joints that are not fixed on the way to each link behind a root."""
    moving: dict[str, tuple[TreeJoint, ...]] = {root: ()}
    waiting = [root]
    while waiting:
        link = waiting.pop()
        for joint in tree.child_joints[link]:
            way = moving[link]
            moving[joint.child] = way if joint.kind == "fixed" else (*way, joint)
            waiting.append(joint.child)
    return moving


def _link(tree: UrdfTree, name: str, option: str) -> str:
    try:
        return tree.link(name)
    except ValueError:
        raise RobotFileError(f"{option}: {one_of(tree.links, name, kind='link ')}") from None


def _is_called(link: str, name: str) -> bool:
    """Return whether a link has a name, perhaps behind a prefix.

    Example:
        >>> _is_called("left_tool0", "tool0"), _is_called("wheel", "ee")
        (True, False)
    """
    return re.search(rf"(^|[^a-z0-9]){name}$", link.lower()) is not None
