"""Deviation of a tool as the part has it: normal to its surface, along the feed, and across both."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from coupling.path.histories import ToolPath
from coupling.path.linear import arc_length, interpolate_rows
from coupling.toolpaths.tilt import APPROACH

# Points along the path at which the surface is looked for, and how many of them are neighbours.
_NODES, _NEIGHBOURS = 2500, 24
# Neighbours span a surface where their extent across is at least this part of that along, squared, and
# what is off their plane at most this part of that across, squared.
_WIDE, _FLAT = 0.02, 0.3
# What is shorter than this part of a path is no step along it.
_STANDING = 1e-9


def signed_deviation(desired: ToolPath, actual: ToolPath) -> np.ndarray:
    """Return the deviation of one tool normal to the part, along the feed and across both.

    The normal is that of the surface which neighbouring passes of the path span, and points to the
    tool's shaft: a positive deviation is one away from the part. A path of a single pass spans none; its
    normal is the tool's axis, perpendicular to the feed.

    Args:
        desired, actual: Paths of one tool at the same times.

    Returns:
        Deviations [m], (n, 3).
    """
    normal, along = part_axes(desired)
    difference = (actual.position - desired.position)[0]
    across = np.cross(normal, along)
    axes = np.stack([normal, along, across], axis=1)
    return np.einsum("nki,ni->nk", axes, difference)


def part_axes(path: ToolPath) -> tuple[np.ndarray, np.ndarray]:
    """Return the part's outward normal and the direction of the feed, unit vectors, (n, 3) each."""
    position = path.position[0]
    length = arc_length(position)
    shaft = -path.rotations[0].apply(APPROACH)
    if length[-1] == 0.0:
        return shaft, _perpendicular(np.zeros_like(shaft), shaft)
    moves = np.append(True, np.diff(length) > _STANDING * length[-1])
    way = length[moves]
    tangent = np.gradient(position[moves], way, axis=0) if len(way) > 1 else position[moves]
    along = _unit(interpolate_rows(length, way, tangent))
    nodes = np.linspace(0.0, length[-1], min(_NODES, max(int(moves.sum()), 2)))
    points = interpolate_rows(nodes, way, position[moves])
    towards = interpolate_rows(nodes, way, shaft[moves])
    normal = interpolate_rows(length, nodes, _normals(points, towards))
    return _perpendicular(normal, along), along


def _normals(points: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Return normals of the surface that points span, or `towards` where they span none, (n, 3)."""
    count = min(_NEIGHBOURS, len(points))
    _, neighbours = cKDTree(points).query(points, k=count)
    around = points[neighbours.reshape(len(points), count)]
    around = around - around.mean(axis=1, keepdims=True)
    sizes, directions = np.linalg.eigh(np.einsum("nki,nkj->nij", around, around))
    spans = (sizes[:, 1] > _WIDE * sizes[:, 2]) & (sizes[:, 0] < _FLAT * sizes[:, 1])
    normal = directions[:, :, 0]
    side = np.einsum("ni,ni->n", normal, towards)
    # A surface seen from its edge has no side to the tool.
    spans &= np.abs(side) > 0.1
    return np.where(spans[:, None], normal * np.sign(side)[:, None], towards)


def _perpendicular(vectors: np.ndarray, to: np.ndarray) -> np.ndarray:
    """Return unit vectors in the planes perpendicular to others; any where they are parallel."""
    across = vectors - np.einsum("ni,ni->n", vectors, to)[:, None] * to
    parallel = np.linalg.norm(across, axis=1) < 1e-6
    if parallel.any():
        # Of axes alike but for rounding the first, the same all along a plunge.
        least = np.eye(3)[np.abs(to[parallel]).round(3).argmin(axis=1)]
        across[parallel] = np.cross(to[parallel], least)
    return _unit(across)


def _unit(vectors: np.ndarray) -> np.ndarray:
    length = np.linalg.norm(vectors, axis=1, keepdims=True)
    return vectors / np.where(length > 0.0, length, 1.0)
