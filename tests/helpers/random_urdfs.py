"""Random URDFs: turned frames, fixed links, branches; tilts also written out as joints."""

from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np


@dataclass(frozen=True)
class RandomUrdf:
    """A serial robot as URDF.

    Attributes:
        plain: The robot.
        with_tilts: The same robot with every tilt as a joint of its own, behind the joint it
            belongs to and before the link that this moves.
        joints: Names of the chain's joints.
        tilts: Unit axes of each joint's tilts, in the joint's frame.
    """

    plain: str
    with_tilts: str
    joints: list[str]
    tilts: list[list[np.ndarray]]


def _text(values) -> str:
    return " ".join(f"{float(value):.17g}" for value in values)


def unit(rng: np.random.Generator) -> np.ndarray:
    vector = rng.normal(size=3)
    return vector / np.linalg.norm(vector)


class _Writer:
    def __init__(self, seed: int, write_tilts: bool) -> None:
        self.rng = np.random.default_rng(seed)
        self.write_tilts = write_tilts
        self.root = Element("robot", name=f"random{seed}")
        # MuJoCo, which reads the same file, shall keep fixed links as bodies.
        SubElement(SubElement(self.root, "mujoco"), "compiler", fusestatic="false")

    def origin(self, parent: Element) -> None:
        xyz, rpy = self.rng.uniform(-0.5, 0.5, 3), self.rng.uniform(-np.pi, np.pi, 3)
        SubElement(parent, "origin", xyz=_text(xyz), rpy=_text(rpy))

    def link(self, name: str) -> str:
        rng = self.rng
        link = SubElement(self.root, "link", name=name)
        inertial = SubElement(link, "inertial")
        self.origin(inertial)
        mass = rng.uniform(5.0, 100.0)
        SubElement(inertial, "mass", value=_text([mass]))
        points = rng.normal(size=(6, 3)) * 0.2  # of a positive mass distribution
        moment = mass * points.T @ points / 6.0
        inertia = np.trace(moment) * np.eye(3) - moment
        keys = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
        six = inertia[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
        SubElement(inertial, "inertia", {k: _text([v]) for k, v in zip(keys, six, strict=True)})
        return name

    def joint(self, name: str, kind: str, parent: str, child: str, axis=None) -> Element:
        joint = SubElement(self.root, "joint", name=name, type=kind)
        SubElement(joint, "parent", link=parent)
        SubElement(joint, "child", link=child)
        if axis is not None:
            SubElement(joint, "axis", xyz=_text(axis))
        if kind in ("revolute", "prismatic"):
            SubElement(joint, "limit", lower="-2", upper="2.5", velocity="1.5", effort="10")
        return joint

    def tilted(self, number: int, parent: str, axes: list[np.ndarray]) -> str:
        """Write the tilts of a joint as joints, with links of no mass between them."""
        for order, axis in enumerate(axes, start=1):
            child = f"tilt{number}_{order}_link"
            SubElement(self.root, "link", name=child)
            self.joint(f"tilt{number}_{order}", "continuous", parent, child, axis)
            parent = child
        return parent

    def write(self, joints: int) -> tuple[list[str], list[list[np.ndarray]]]:
        rng = self.rng
        names, tilts = [], []
        parent = self.link("base_link")
        for number in range(1, joints + 1):
            if rng.random() < 0.5:  # a flange between two joints
                flange = self.link(f"flange{number}")
                self.origin(self.joint(f"fixed{number}", "fixed", parent, flange))
                parent = flange
            if rng.random() < 0.3:  # a finger beside the chain
                finger = self.link(f"finger{number}")
                kind = ("prismatic", "revolute", "continuous")[rng.integers(3)]
                self.origin(self.joint(f"grip{number}", kind, parent, finger, unit(rng)))
            kind = ("revolute", "continuous")[rng.integers(2)]
            turning = f"link{number}"
            axis = unit(rng)
            # Tilts about the other two axes of a frame on the joint's axis, as of a bearing.
            first = np.cross(axis, unit(rng))
            first /= np.linalg.norm(first)
            axes = [first, np.cross(axis, first)][: rng.integers(0, 3)]
            carried = f"carrier{number}" if self.write_tilts and axes else turning
            # URDF axes need not have length one.
            self.origin(self.joint(f"joint{number}", kind, parent, carried, 3.0 * axis))
            if carried != turning:
                SubElement(self.root, "link", name=carried)
                last = self.tilted(number, carried, axes)
                self.joint(f"weld{number}", "fixed", last, turning)
            parent = self.link(turning)
            names.append(f"joint{number}")
            tilts.append(axes)
        SubElement(self.root, "link", name="tool")
        self.origin(self.joint("tool_joint", "fixed", parent, "tool"))
        return names, tilts


def make_urdf(seed: int, joints: int) -> RandomUrdf:
    plain, tilted = _Writer(seed, write_tilts=False), _Writer(seed, write_tilts=True)
    names, tilts = plain.write(joints)
    tilted.write(joints)
    text, text_with_tilts = (tostring(w.root, encoding="unicode") for w in (plain, tilted))
    return RandomUrdf(text, text_with_tilts, names, tilts)
