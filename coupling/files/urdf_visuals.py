"""What a URDF's links look like: meshes and simple bodies, in the bodies of a chain."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
import pinocchio as pin

from coupling.files.urdf import find_urdf
from coupling.files.urdf_elements import placement_of
from coupling.files.urdf_tree import TreeJoint, UrdfTree, read_tree
from elastic_robot.errors import RobotFileError

_PACKAGE = "package://"


@dataclass(frozen=True)
class UrdfVisual:
    """A shape of a link.

    Attributes:
        body: Body that it belongs to: 0 for the base, else the number of the joint that moves it.
        body_from_shape: Its frame in that body, which is parallel to the base at zero angles.
        geometry: The URDF's element: mesh, box, cylinder or sphere.
        mesh: File of a mesh; None for a simple body, and for a mesh whose file is not there.
    """

    body: int
    body_from_shape: pin.SE3
    geometry: Element
    mesh: Path | None


def read_visuals(file: Path, base: str | None, tip: str) -> list[UrdfVisual]:
    """Return the shapes of the links from a base to a tip, by `read_urdf`'s names.

    Raises:
        RobotFileError: If the file is no URDF or has no such links.
    """
    tree = read_tree(file)
    try:
        first = tree.root if base is None else tree.link(base)
        way = tree.way(first, tree.link(tip))
        return list(_visuals(file, tree, first, way))
    except ValueError as cause:
        raise RobotFileError(f"{file}: {cause}") from cause


def _visuals(
    file: Path, tree: UrdfTree, base: str, way: Sequence[TreeJoint]
) -> Iterator[UrdfVisual]:
    driven = [joint for joint in way if joint.is_rotation]
    on_way = {joint.name for joint in driven}
    base_from_joint, frames = pin.SE3.Identity(), {}
    for joint in way:
        base_from_joint = base_from_joint * joint.parent_from_joint
        frames[joint.name] = base_from_joint.rotation
    heads = [(base, np.eye(3)), *((joint.child, frames[joint.name]) for joint in driven)]
    for body, (head, rotation) in enumerate(heads):
        body_from_head = pin.SE3(rotation, np.zeros(3))
        for link, head_from_link in tree.rigid_links(head, on_way):
            for visual in tree.links[link].findall("visual"):
                geometry = visual.find("geometry")
                if geometry is None or not len(geometry):
                    continue
                shape = geometry[0]
                placement = body_from_head * head_from_link * placement_of(visual)
                yield UrdfVisual(body, placement, shape, _mesh_file(file, shape))


def _mesh_file(urdf: Path, shape: Element) -> Path | None:
    """Return the file of a mesh: of an installed package, or one that the URDF lies in."""
    name = shape.get("filename", "")
    if shape.tag != "mesh" or not name:
        return None
    try:
        return find_urdf(name.removeprefix("file://"), urdf.parent)
    except (RobotFileError, OSError, ValueError):
        package, _, path_in_package = name.removeprefix(_PACKAGE).partition("/")
        folders = (folder for folder in urdf.resolve().parents if folder.name == package)
        files = (folder / path_in_package for folder in folders)
        return next((mesh for mesh in files if mesh.is_file()), None)
