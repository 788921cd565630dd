"""A scene in a page: its pictures, what moves it, and its numbers for the page's script."""

from __future__ import annotations

import html
from collections.abc import Iterable
from typing import Any

import numpy as np

from coupling.path.frame import Frame
from coupling.report.static_scene import stills
from coupling.results.scene import Scene, ScenePart, SceneRobot

# Steps in which lengths, angles and times are written: a tenth of what thinning leaves; that of a
# deviation as a part of the largest one, and the finest [m].
_METRE, _DEVIATION, _RADIAN, _TIME, _FINEST = 1e-5, 1e-3, 1e-4, 1e-3, 1e-9
_COMPONENTS = ("normal to the part", "along the feed", "across", "distance")
_POINTER = "Drag to turn, two fingers or the right button to shift, wheel to zoom."
_KEYS = (
    " Keys: space plays, arrows step, + and - exaggerate, v changes the view, numbers choose paths."
)


def scene_html(name: str, scene: Scene, label: str) -> str:
    """Return the place of a scene in a page.

    Args:
        name: Its name among the page's scenes.
        label: Content of the scene in words, as HTML.
    """
    pictures = "".join(f"<figure>{picture}</figure>" for picture in stills(scene))
    return (
        f'<div class="scene" id="{name}" data-scene="{name}">'
        f'<div class="stills">{pictures}</div>'
        f'<div class="stage" aria-label="{label}" aria-describedby="{name}_keys">'
        '<div class="panes"></div><pre class="readout" aria-live="polite"></pre></div>'
        f'<div class="controls">{"".join(_controls(name, scene))}</div></div>'
    )


def _controls(name: str, scene: Scene) -> Iterable[str]:
    tracks = list(dict.fromkeys(track.name for track in scene.tracks))
    surfaces = [surface.name for surface in scene.surfaces if surface.name]
    names = list(dict.fromkeys([*tracks, *surfaces]))
    moves = any(len(robot.motion.time) > 1 for robot in scene.robots) or bool(tracks)
    if moves:
        yield '<div><button type="button" data-control="play" aria-pressed="false">Play</button>'
        yield '<input type="range" data-control="time" min="0" max="1000" step="any" value="0"'
        yield ' aria-label="Time"></div>'
    if tracks or scene.surfaces:
        yield '<div class="bar"><span class="low"></span><i><b class="mark" hidden></b></i>'
        yield '<span class="high"></span></div>'
    if tracks:
        yield '<label>Exaggeration <input type="range" data-control="exaggeration" min="0" max="600"'
        yield ' step="any" value="0"><span class="factor"></span></label>'
    if len(names) > 1:
        yield f"<div>{''.join(_button('track', name, name) for name in names)}</div>"
        yield '<label><input type="checkbox" data-control="apart"> side by side</label>'
    if len(tracks) > 1:
        yield '<label><input type="checkbox" data-control="whole" checked> one scale for all</label>'
    colours = [(str(number), part) for number, part in enumerate(_COMPONENTS)] if tracks else []
    labels = dict.fromkeys(label for piece in scene.surfaces for label in piece.fields)
    colours += [(label, label) for label in labels]
    if colours:
        yield _select("colour", "Colour", colours)
    if tracks and scene.surfaces:
        yield '<label><input type="checkbox" data-control="surface" checked> part</label>'
    for line in {line.name: line for line in scene.lines}.values():
        yield f'<span class="swatch" style="--light: {line.color}">{html.escape(line.name)}</span>'
    if scene.robots:
        gears = [("off", "as drawn"), ("torque", "by torque at rest"), ("flank", "by flank")]
        if all(robot.motion.torque is None for robot in scene.robots):
            gears = gears[:1] + gears[2:] * any(robot.flanks for robot in scene.robots)
        if len(gears) > 1:
            yield _select("gears", "Gears", gears)
        modes = scene.robots[0].modes
        if modes:
            choice = [(str(k), f"{mode.frequency:.3g} Hz") for k, mode in enumerate(modes)]
            yield _select("mode", "Mode", [("-1", "at rest"), *choice])
        buttons = ("part", "above", "robot") if tracks else ()
        yield f"<div>{''.join(_button('view', view, view) for view in buttons)}</div>"
    yield f'<p class="keys" id="{name}_keys">{_POINTER}{_KEYS if tracks else ""}</p>'


def _button(kind: str, value: str, words: str) -> str:
    value, words = html.escape(value), html.escape(words)
    return f'<button type="button" aria-pressed="false" data-{kind}="{value}">{words}</button>'


def _select(name: str, label: str, options: Iterable[tuple[str, str]]) -> str:
    choices = "".join(
        f'<option value="{html.escape(value)}">{html.escape(words)}</option>'
        for value, words in options
    )
    return f'<label>{label} <select data-control="{name}">{choices}</select></label>'


def scene_numbers(scene: Scene) -> dict[str, Any]:
    """Return what the page's script draws, by its keys."""
    return {
        "robots": [_robot(robot) for robot in scene.robots],
        "tracks": [
            {
                "name": track.name,
                "robot": track.robot,
                "time": _rounded(track.time, _METRE),
                "desired": _rounded(track.desired, _METRE),
                "deviation": _rounded(track.deviation, _step_of(track.deviation)),
                "signed": _rounded(track.signed, _step_of(track.signed)),
            }
            for track in scene.tracks
        ],
        "lines": [
            {"name": line.name, "color": line.color, "points": _rounded(line.points, _METRE)}
            for line in scene.lines
        ],
        "surfaces": [
            {
                "name": piece.name,
                "points": _rounded(piece.points, _METRE),
                "triangles": piece.triangles,
                "time": None if piece.time is None else _rounded(piece.time, _TIME),
                "fields": {
                    label: _rounded_for_colour(values) for label, values in piece.fields.items()
                },
            }
            for piece in scene.surfaces
        ],
        "part": _pose(scene.world_from_part),
        "tolerance": scene.tolerance,
    }


def _robot(robot: SceneRobot) -> dict[str, Any]:
    motion, tool = robot.motion, robot.tool
    return {
        "name": robot.name,
        "base": _pose(robot.world_from_base),
        "origins": _rounded(robot.origins, _METRE),
        "axes": robot.axes,
        "tool_pose": _pose(robot.body_from_tool),
        "time": _rounded(motion.time, _METRE),
        "q": _rounded(motion.q, _RADIAN),
        "torque": None if motion.torque is None else np.round(motion.torque, 1),
        "flanks": {str(joint): steps for joint, steps in robot.flanks.items()},
        "tool": None if tool is None else {"diameter": tool.diameter, "is_round": tool.is_round},
        "meshes": [_surface(mesh) for mesh in robot.meshes],
        "modes": [
            {"frequency": mode.frequency, "amplitude": mode.amplitude} for mode in robot.modes
        ],
    }


def _surface(part: ScenePart) -> dict[str, Any]:
    return {
        "points": _rounded(part.points, _METRE),
        "triangles": part.triangles,
        "body": part.body,
    }


def _rounded_for_colour(values: np.ndarray) -> np.ndarray:
    """Return values in as many digits as colours tell, a thousandth of their span."""
    span = float(np.nanmax(values, initial=-np.inf) - np.nanmin(values, initial=np.inf))
    return np.round(values, 3 - int(np.floor(np.log10(span)))) if span > 0.0 else values


def _step_of(deviation: np.ndarray) -> float:
    """Return the step of rounding that is not seen beside the largest deviation [m], (n, 3)."""
    largest = float(np.abs(deviation).max(initial=_FINEST))
    return max(10.0 ** np.floor(np.log10(_DEVIATION * largest)), _FINEST)


def _pose(frame: Frame) -> list[float]:
    return list(frame.pose)


def _rounded(values: np.ndarray, step: float) -> np.ndarray:
    return np.round(values / step) * step
