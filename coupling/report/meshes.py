"""Meshes of a robot's URDF, simplified to what a page can carry."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from coupling.errors import CouplingError
from coupling.files.extras import extra
from coupling.files.robot_file import find_robot, read_validated, urdf_of
from coupling.files.robot_schema import UrdfRobotFile
from coupling.files.urdf_visuals import UrdfVisual, read_visuals
from coupling.results.scene import ScenePart
from elastic_robot.errors import ElasticRobotError

# Triangles of a whole robot, and the largest file of a mesh that is read [bytes].
_TRIANGLES, _LARGEST = 12_000, 100_000_000
# What is smaller is not seen, and what is wider is no link [m].
_STEP, _WIDEST = 5e-4, 20.0


def robot_meshes(description: str) -> Sequence[ScenePart]:
    """Return the surfaces of a robot's bodies as its URDF has them, in as few triangles as show them.

    None without a URDF, without its meshes, or without the extra `meshes`: then links are drawn.

    Args:
        description: A shipped robot's name, or the path of its file.
    """
    try:
        path = find_robot(description)
        _, file = read_validated(path)
        if not isinstance(file, UrdfRobotFile):
            return ()
        trimesh = extra("trimesh", "meshes", "a mesh")
        urdf, _ = urdf_of(path, file)
        visuals = read_visuals(urdf, file.urdf.base, file.tcp.link)
    except (ElasticRobotError, CouplingError):
        return ()
    shapes = [(visual, mesh) for visual in visuals if (mesh := _mesh(trimesh, visual)) is not None]
    whole = sum(len(mesh.faces) for _, mesh in shapes)
    share = min(1.0, _TRIANGLES / max(whole, 1))
    return [_part(visual, _simplify(mesh, share)) for visual, mesh in shapes]


def _mesh(trimesh: Any, visual: UrdfVisual) -> Any | None:
    """Return a shape as a mesh in its own frame [m]; None where it cannot be read."""
    shape = visual.geometry
    try:
        match shape.tag:
            case "box":
                return trimesh.creation.box(extents=_numbers(shape.get("size", "")))
            case "cylinder":
                radius, length = (float(shape.get(key, "")) for key in ("radius", "length"))
                return trimesh.creation.cylinder(radius=radius, height=length, sections=24)
            case "sphere":
                return trimesh.creation.icosphere(
                    subdivisions=2, radius=float(shape.get("radius", ""))
                )
        file = visual.mesh
        if file is None or file.stat().st_size > _LARGEST:
            return None
        mesh = trimesh.load(file, force="mesh")
        if mesh.units is not None:  # of COLLADA, often inches
            mesh.apply_scale(trimesh.units.unit_conversion(mesh.units, "meters"))
        mesh.apply_scale(_numbers(shape.get("scale", "1 1 1")))
    except Exception:
        # Readers of many formats fail in many ways, and a picture without this shape is still one.
        return None
    # A file in millimetres without its scale would hide all.
    is_seen = len(mesh.faces) > 0 and bool((np.abs(mesh.vertices) < _WIDEST).all())
    return mesh if is_seen else None


def _simplify(mesh: Any, share: float) -> Any:
    if share >= 1.0:
        return mesh
    try:
        return mesh.simplify_quadric_decimation(face_count=max(int(share * len(mesh.faces)), 12))
    except (ImportError, ValueError):
        return mesh.convex_hull


def _part(visual: UrdfVisual, mesh: Any) -> ScenePart:
    placement = visual.body_from_shape
    points = np.asarray(mesh.vertices) @ placement.rotation.T + placement.translation
    return ScenePart(np.round(points / _STEP) * _STEP, np.asarray(mesh.faces), visual.body)


def _numbers(text: str) -> list[float]:
    values = [float(part) for part in text.split()]
    if len(values) != 3 or not np.isfinite(values).all():
        raise ValueError(f"expected 3 numbers, got {text[:60]!r}")
    return values
