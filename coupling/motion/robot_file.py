"""identified.toml: the start file with what a motion told, and why the rest was kept."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

from coupling.errors import IdentifyError
from coupling.files.robot_edit import RobotEdit
from coupling.motion.identification import MotionIdentification
from coupling.motion.parameters import MotionParameter, dry_friction
from coupling.results.motion_result import MotionParameterResult, MotionResult
from elastic_robot.description import Joint

_DRY = ("friction.coulomb_Nm", "friction.more_at_rest")


def moved_text(
    found: MotionIdentification, told: MotionResult, start: Path, target: Path, source: str
) -> str:
    """Return the robot file with what was identified.

    Args:
        found: The identification.
        told: Its figures.
        start: The start file.
        target: Where the new one will be.
        source: What was recorded, for [sources].

    Raises:
        IdentifyError: If the identification refuses to be written, or the file has another form.
        RobotFileError: If the start file cannot be read.
    """
    if found.refusal:
        raise IdentifyError(f"{target}: not written: {found.refusal}")
    file = RobotEdit(start, found.robot)
    says = f"identified, {source}"
    own = {p.name: p for p in found.first.problem.parameters if isinstance(p, MotionParameter)}
    results = {p.name: p for p in told.parameters if p.name in own}
    robot = found.identified_robot
    for name, result in results.items():
        remark = _remark(result)
        if name.endswith(_DRY[1]):
            continue
        if name.endswith(_DRY[0]):
            _write_dry(file, found, own[name].joint, results, says)
        elif name.endswith(".balancer"):
            if result.identified and result.value is not None:
                file.scale_balancer(own[name].joint + 1, result.value, says)
        elif name.endswith(".drive.inertia"):
            if result.identified and result.value is not None:
                file.scale_rotor(own[name].joint + 1, result.value / own[name].start, says)
        elif name.endswith((".hysteresis", ".load_friction")):
            if result.identified:
                _write_gear(file, robot.joints[own[name].joint], own[name], says)
        elif name.startswith("payload.com"):
            continue
        elif name.endswith(".stiffness") and result.identified and result.value is not None:
            file.change(name, result.value, says)
            file.remark(name, remark)
        else:
            file.set_number(name, result.value if result.identified else None, says, remark)
    if any(results[name].identified for name in results if name.startswith("payload.com")):
        assert robot.payload is not None
        file.set_number("payload.com", list(robot.payload.com), says, "")
    return file.text(_head(told, start, source), target)


def _write_dry(
    file: RobotEdit,
    found: MotionIdentification,
    joint: int,
    results: dict[str, MotionParameterResult],
    says: str,
) -> None:
    """Write both numbers of dry friction: that in motion, and that at rest where it is another."""
    place = f"joint[{joint + 1}].drive."
    slips, more = (results[place + key] for key in _DRY)
    drive = found.identified_robot.joints[joint].drive
    assert drive is not None
    slipping, sticking = dry_friction(drive)
    if slips.identified:
        file.set_number(place + _DRY[0], slipping, says, _remark(slips))
    if (more.identified or slips.identified) and sticking > 0.0:
        file.set_number(f"{place}friction.stiction_Nm", slipping + sticking, says, "")


def _write_gear(file: RobotEdit, joint: Joint, parameter: MotionParameter, says: str) -> None:
    """Write the elements of a gear's hysteresis, or its efficiency."""
    place = f"joint[{parameter.joint + 1}].gear"
    if parameter.name.endswith(".hysteresis"):
        elements = [asdict(element) for element in joint.hysteresis]
        file.set_number(f"{place}.hysteresis", elements, says, "")
    elif joint.drive is not None:
        file.set_number(f"{place}.efficiency", 1.0 / (1.0 + joint.drive.load_friction), says, "")


def _head(told: MotionResult, start: Path, source: str) -> str:
    lines = [f"Made from {start.name} by elastic-robot identify: {source}."]
    for one in told.recordings:
        words = "predicted" if one.held_out else "fitted"
        left = ", ".join(f"{1e6 * own:.0f}" for own in one.wind_up_rad if own is not None)
        torque = ", ".join(f"{100.0 * (own or 0.0):.0f}" for own in one.torque_relative)
        link = f"motor less link {left} urad rms left, " if left else ""
        lines.append(f"{one.name}, {words}: {link}motor torque {torque} % of its rms.")
    kept = [
        p.name
        for p in told.parameters
        if not p.identified and p.name.startswith(("joint", "payload"))
    ]
    lines.append(f"Not told, as in {start.name}: {', '.join(kept)}." if kept else "All are told.")
    return "\n".join(lines)


def _remark(result: MotionParameterResult) -> str:
    if not result.identified:
        return "NOT IDENTIFIED, start value kept"
    low, high = (f"{v:.4g}" if v is not None else "no end" for v in (result.low, result.high))
    return f"95 %: {low} to {high}"
