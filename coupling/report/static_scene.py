"""A scene as a picture that needs no program: for the first moment, print and machines without WebGL."""

from __future__ import annotations

import html
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from coupling.path.length_text import in_words
from coupling.results.scene import Scene, SceneRobot, SceneTrack

# Size of a picture, its margin [px], and from where it is seen, in axes of the part.
_WIDTH, _HEIGHT, _MARGIN = 480, 300, 14
_EYE = np.array([0.45, -0.9, 0.75])
# Steps of the colours to each side, and the largest number of pieces of a path.
_STEPS, _PIECES = 8, 1500
# The largest deviation is drawn as this part of the path's extent.
_SHOWN = 0.1
# Into the part, none, away from it: apart for colour-blind eyes.
_INWARD, _NONE, _OUTWARD = np.array([[0, 90, 181], [170, 170, 170], [220, 80, 0]], dtype=float)


def stills(scene: Scene, pieces: int = _PIECES) -> list[str]:
    """Return a scene's pictures as SVG, one for each path, or of its robots where it has none.

    Args:
        pieces: Number of pieces that a path has at most.
    """
    names = list(dict.fromkeys(track.name for track in scene.tracks))
    if not names:
        return [_shapes(scene)] if scene.robots or scene.lines or scene.surfaces else []
    largest = max(float(np.abs(track.signed[:, 0]).max()) for track in scene.tracks)
    distance = max(float(np.linalg.norm(t.deviation, axis=1).max()) for t in scene.tracks)
    extent = max(float(np.ptp(track.desired, axis=0).max()) for track in scene.tracks)
    factor = exaggeration(extent, distance)
    scale = max(largest, 1e-9)
    return [
        _paths(
            scene,
            [_thinned(t, pieces) for t in scene.tracks if t.name == name],
            name,
            scale,
            factor,
        )
        for name in names[:2]
    ]


def _thinned(track: SceneTrack, pieces: int) -> SceneTrack:
    """Return a track with so many rows, the largest deviation among them."""
    if len(track.time) <= pieces:
        return track
    rows = np.linspace(0, len(track.time) - 1, pieces).astype(int)
    rows = np.union1d(rows, np.linalg.norm(track.deviation, axis=1).argmax())
    arrays = {key: getattr(track, key)[rows] for key in ("time", "desired", "deviation", "signed")}
    return replace(track, **arrays)


def exaggeration(extent: float, largest: float) -> float:
    """Return the factor, 1, 2 or 5 times a power of ten, by which a deviation can be seen.

    Args:
        extent: Extent of the path [m].
        largest: Largest deviation [m].

    Example:
        >>> exaggeration(0.12, 0.0021)
        5.0
    """
    largest_scale = max(1.0, _SHOWN * extent / max(largest, 1e-12))
    decade = 10.0 ** np.floor(np.log10(largest_scale))
    return float(max(step * decade for step in (1.0, 2.0, 5.0) if step * decade <= largest_scale))


def _paths(
    scene: Scene, tracks: Sequence[SceneTrack], name: str, scale: float, factor: float
) -> str:
    """Draw the paths of one name from where a scene is first seen."""
    axes = _axes(_EYE) @ scene.world_from_part.rotation.as_matrix().T
    desired = [track.desired @ axes.T for track in tracks]
    actual = [(track.desired + factor * track.deviation) @ axes.T for track in tracks]
    place = _Placing(np.vstack([*desired, *actual]), bottom=46)
    shapes = [_line(place(points), "#8b95a0", 1.0) for points in desired]
    for track, points in zip(tracks, actual, strict=True):
        shapes += _draw_coloured(place(points), track.signed[:, 0] / scale)
    shapes += _bar(scale)
    largest = max(float(np.linalg.norm(track.deviation, axis=1).max()) for track in tracks)
    size = f"{factor:,.0f} times larger" if factor > 1.0 else "to scale"
    words = f"{name}: up to {in_words(largest)}, drawn {size}"
    return _picture(words, shapes)


def _draw_coloured(points: np.ndarray, values: np.ndarray) -> Iterator[str]:
    """Yield a path in pieces of one colour each."""
    steps = np.clip(np.round(_STEPS * values), -_STEPS, _STEPS).astype(int)
    ends = np.flatnonzero(np.diff(steps)) + 1
    for piece in np.split(np.arange(len(points)), ends):
        last = min(int(piece[-1]) + 2, len(points))
        yield _line(points[piece[0] : last], colour(steps[piece[0]] / _STEPS), 2.5)


def colour(part: float) -> str:
    """Return the colour of a signed deviation, as a part of the scale from -1 to 1.

    Example:
        >>> colour(0.0)
        '#aaaaaa'
    """
    other = _INWARD if part < 0 else _OUTWARD
    rgb = _NONE + min(abs(part), 1.0) * (other - _NONE)
    return f"#{''.join(f'{round(value):02x}' for value in rgb)}"


def _bar(scale: float) -> list[str]:
    """Draw the scale of colours with its ends."""
    start_x, wide, y = _MARGIN, 160, _HEIGHT - 34
    step = wide / (2 * _STEPS + 1)
    cells = [
        f'<rect x="{start_x + k * step:.1f}" y="{y}" width="{step + 0.3:.1f}" height="9"'
        f' fill="{colour((k - _STEPS) / _STEPS)}"/>'
        for k in range(2 * _STEPS + 1)
    ]
    words = f"{in_words(scale)} into the part to {in_words(scale)} away from it"
    return [*cells, _text(start_x + wide + 8, y + 9, words)]


def _shapes(scene: Scene) -> str:
    """Draw robots as links, lines, and the edges of surfaces, seen from the side."""
    axes = _axes(np.array([0.6, -1.0, 0.35]))
    chains = [links(robot, robot.motion.q[0]) @ axes.T for robot in scene.robots]
    lines = [(line.points @ axes.T, line.color) for line in scene.lines]
    pieces = [surface.points @ axes.T for surface in scene.surfaces]
    everything = np.vstack([*chains, *(points for points, _ in lines), *pieces])
    place = _Placing(everything[np.isfinite(everything).all(axis=1)], bottom=26)
    shapes = []
    for points, color in lines:
        gaps = np.flatnonzero(~np.isfinite(points[:, 0]))
        shapes += [
            _line(place(piece[np.isfinite(piece[:, 0])]), color, 1.5)
            for piece in np.split(points, gaps)
        ]
    for points in pieces:
        shapes += [
            f'<circle cx="{x:.0f}" cy="{y:.0f}" r="1" fill="#56606b"/>'
            for x, y in place(points[:: max(len(points) // _PIECES, 1)])
        ]
    for chain in chains:
        points = place(chain)
        shapes.append(_line(points, "#56606b", 6.0))
        shapes += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4" fill="#d98324"/>' for x, y in points]
    for number, (name, color) in enumerate({line.name: line.color for line in scene.lines}.items()):
        x, y = _MARGIN, _MARGIN + 4 + 16 * number
        shapes += [_line(np.array([[x, y], [x + 18, y]]), color, 3.0), _text(x + 24, y + 4, name)]
    names = [robot.name for robot in scene.robots] + [surface.name for surface in scene.surfaces]
    return _picture(" and ".join(dict.fromkeys(names)), shapes)


def links(robot: SceneRobot, q: np.ndarray) -> np.ndarray:
    """Return base, origins of the joints and TCP in the world [m], (joints + 2, 3).

    Args:
        q: Its joint angles [rad], (joints,).
    """
    frame, points = robot.world_from_base, [robot.world_from_base.position]
    for origin, axis, angle in zip(robot.origins, robot.axes, q, strict=True):
        rotation = type(frame.rotation).from_rotvec(angle * axis)
        frame = type(frame)(frame.points(origin), frame.rotation * rotation)
        points.append(frame.position)
    return np.array([*points, frame.points(robot.body_from_tool.position)])


def _axes(eye: np.ndarray) -> np.ndarray:
    """Return the directions to the right and downwards of a picture seen from `eye`, (2, 3)."""
    depth = eye / np.linalg.norm(eye)
    right = np.cross([0.0, 0.0, 1.0], depth)
    right /= np.linalg.norm(right)
    return np.array([right, -np.cross(depth, right)])


class _Placing:
    """Places points in a picture, on one scale.

    Args:
        points: All points, any unit, (n, 2).
        bottom: Height that they leave free [px].
    """

    def __init__(self, points: np.ndarray, bottom: int) -> None:
        extent = np.maximum(np.ptp(points, axis=0), 1e-9)
        room = np.array([_WIDTH - 2 * _MARGIN, _HEIGHT - 2 * _MARGIN - bottom])
        self.scale = float((room / extent).min())
        self.middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self.centre = _MARGIN + 0.5 * room

    def __call__(self, points: np.ndarray) -> np.ndarray:
        return self.centre + self.scale * (points - self.middle)


def _line(points: np.ndarray, stroke: str, width: float) -> str:
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
    return f'<polyline points="{corners}" stroke="{stroke}" stroke-width="{width:g}"/>'


def _text(x: float, y: float, words: str) -> str:
    return f'<text x="{x:g}" y="{y:g}">{html.escape(words)}</text>'


def _picture(words: str, shapes: Sequence[str]) -> str:
    label = _text(_MARGIN, _HEIGHT - 8, words)
    return (
        f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" role="img" aria-label="{html.escape(words)}"'
        f' fill="none" stroke-linejoin="round" stroke-linecap="round">{"".join(shapes)}{label}</svg>'
    )
