"""documentation/index.html: what the robot in an FMU is, for a reader with nothing but a browser."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape

from coupling.files.balancer_table import points_in_words
from coupling.files.drive_table import drive_in_words
from coupling.files.gear_table import errors_in_words
from coupling.fmu_export.grouping import Groups
from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot
from elastic_robot.fmi.variables import Block, Variable

VariableRow = tuple[str, str, str, str, str, str]
_VARIABLE_HEADER = ("name", "causality", "variability", "unit", "start", "meaning")

_STYLE = """
body { font: 15px/1.45 sans-serif; color: #222; max-width: 75em; margin: 2em auto; padding: 0 1em }
table { border-collapse: collapse; margin: .6em 0 1.6em } caption { text-align: left; color: #555 }
th, td { border-bottom: 1px solid #ddd; padding: .25em .8em .25em 0; text-align: left }
td.number { text-align: right; font-variant-numeric: tabular-nums } th { color: #555 }
code { background: #f4f4f4; padding: .1em .3em }
"""


def index_html(
    robot: Robot, variables: Iterable[VariableRow], fmi_version: str, version: str, needs: str
) -> str:
    """Return the page: conventions, frames, joints, bodies, variables.

    Args:
        robot: The robot in the FMU.
        variables: Lines of the table of variables.
        fmi_version: Such as 2.0.
        version: Version of the model.
        needs: Needs of the FMU on its host, as HTML.
    """
    name = escape(robot.name)
    return "\n".join(
        [
            "<!DOCTYPE html>",
            f'<html lang="en"><head><meta charset="utf-8"><title>{name}: elastic robot</title>',
            f"<style>{_STYLE}</style></head><body>",
            f"<h1>{name}</h1>",
            f"<p>Industrial robot with {len(robot.joints)} joints that give way under load, as an FMI"
            f" {fmi_version} functional mock-up unit. Model version {escape(version)}.</p>",
            _USE,
            f'<p>{needs} Licences: <a href="licenses/">licenses</a>.</p>',
            "<h2>Frames and signs</h2>",
            _FRAMES,
            _tool(robot),
            "<h2>Joints</h2>",
            _joints(robot.joints),
            _motors(robot.joints),
            _gear_parts(robot.joints),
            "<h2>Bodies</h2>",
            _bodies(robot),
            "<h2>Variables</h2>",
            _table("", list(_VARIABLE_HEADER), [list(row) for row in variables]),
            "</body></html>",
            "",
        ]
    )


def variable_rows(blocks: Mapping[str, Block], groups: Groups) -> list[VariableRow]:
    """Return the lines of the table of variables; arrays have their sizes."""
    return [
        (
            group.name if group.is_scalar else f"{group.name}[{len(group.elements)}]",
            blocks[name].causality,
            blocks[name].variability,
            group.elements[0].unit,
            " ".join(_start(v) for v in group.elements).strip(),
            group.text,
        )
        for name, block in groups.items()
        for group in block
    ]


_USE = """
<p>Inputs are those at a communication step's start, outputs belong to its end; s seconds into the
step the force is <code>force</code> + s <code>force_rate</code>. The drives follow the file named by
<code>trajectory</code>, or, where that is empty, <code>q_cmd</code>, <code>qd_cmd</code> and
<code>qdd_cmd</code> at the step's start: s seconds later q + qd s + qdd s&sup2;/2 + j s&sup3;/6 with
the jerk j of the last two commands, continuous where the commands are smooth. The initial
state is the equilibrium under gravity, the wrench, the contact spring and the contact set before
initialisation ends
(<code>initial_state</code> = <code>equilibrium</code>), or no deflection
(<code>undeflected</code>). Gears with hysteresis come to it from no load, or, slipping all the way,
<code>equilibrium_from_below</code> or <code>equilibrium_from_above</code>.
<code>mode</code> = <code>quasistatic</code> takes the equilibrium at every step's end: no inertia, no
damping, no memory but that of hysteresis. Any step size will do, and it may change.</p>
<p>A contact spring pulls the TCP to an anchor: force K (a - p), p the elastic TCP, s seconds into a step
a = <code>anchor</code> position + s velocity, K its symmetric stiffness, no eigenvalue below zero. It is
part of the robot's equations, so it may be as stiff as the contact is. Without stiffness there is none.
</p>
<p>A contact that lifts off, <code>contact.*</code>: a sphere about the TCP on the plane through the
anchor, with the force k d max(0, 1 + c d') at a penetration d, which never pulls, and Coulomb
friction above the slip speed. Touch-down and lift-off are found inside the step. Without stiffness
there is none.</p>
"""

_FRAMES = """
<p>Everything is in SI units. The base frame is fixed; body i has its origin on axis i and is
parallel to base when all angles are zero. A wrench acts <em>on the tool</em>, at the TCP, in base
axes: a force of -1000 N in z presses the tool down. Poses are position and unit quaternion (x, y,
z, w with w &ge; 0) that takes tool axes to base axes. Small rotations are rotation vectors in base
axes. Joint i turns by Rot(axis, q + e) Rot(tilt 1, a) Rot(tilt 2, b): q the drive, e the torsion of
the gear, a and b the tilts. <code>backlash</code> is half the width of the backlash.</p>
"""


def _tool(robot: Robot) -> str:
    return (
        f"<p>TCP in the last body: position {_vector(robot.tcp_position)} m; roll, pitch, yaw"
        f" {_vector(robot.tcp_rpy)} rad, R = Rz Ry Rx. Gravity {_vector(robot.gravity)}"
        " m/s&sup2; in base axes.</p>"
    )


def _joints(joints: Sequence[Joint]) -> str:
    rows = []
    hysteresis = ["hysteresis: slip torque [N m] at slip angle [rad]"]
    if not any(joint.hysteresis for joint in joints):
        hysteresis = []
    for number, joint in enumerate(joints, start=1):
        limits = _vector(joint.limits) if joint.limits else ""
        highest = [f"{v:.6g}" if v else "" for v in (joint.max_rate, joint.max_acceleration)]
        elastic = ["rigid", "", ""]
        if joint.stiffness is not None:
            elastic = [f"{v:.6g}" for v in (joint.stiffness, joint.damping, joint.backlash)]
        if hysteresis:
            slips = [(element.slip_torque, element.slip_angle) for element in joint.hysteresis]
            elastic.append(", ".join(f"{torque:.6g} at {angle:.6g}" for torque, angle in slips))
        geometry = [_vector(joint.origin), _vector(joint.axis)]
        rows.append([f"joint[{number}]", joint.name, *geometry, limits, *highest, *elastic])
        for k, tilt in enumerate(joint.tilt, start=1):
            elastic = [f"{tilt.stiffness:.6g}", f"{tilt.damping:.6g}", "", *[""] * len(hysteresis)]
            name = f"joint[{number}].tilt[{k}]"
            rows.append([name, "", "", _vector(tilt.axis), "", "", "", *elastic])
    return _table(
        "Origin in the previous body; axes in the body's axes.",
        [
            *["", "name", "origin [m]", "axis"],
            *["limits [rad]", "rate [rad/s]", "acceleration [rad/s&sup2;]"],
            *["stiffness [N m/rad]", "damping [N m s/rad]", "backlash [rad]"],
            *hysteresis,
        ],
        rows,
    )


def _motors(joints: Sequence[Joint]) -> str:
    """Return the table of the joints' motors; nothing where there are none."""
    rows = [
        [f"joint[{number}]", drive_in_words(joint.drive)]
        for number, joint in enumerate(joints, start=1)
        if joint.drive is not None
    ]
    caption = "At the gear's output: moved where drive is not ideal."
    return _table(caption, ["", "motor"], rows) if rows else ""


def _gear_parts(joints: Sequence[Joint]) -> str:
    """Return the table of kinematic errors and balancers; nothing where there are none."""
    rows = []
    for number, joint in enumerate(joints, start=1):
        if joint.kinematic_error or joint.balancer:
            balancer = points_in_words(joint.balancer) if joint.balancer else ""
            rows.append([f"joint[{number}]", errors_in_words(joint.kinematic_error), balancer])
    caption = "Sines of the gears, over the joint's angle; torque on the link about its axis."
    return _table(caption, ["", "kinematic error", "balancer"], rows) if rows else ""


def _bodies(robot: Robot) -> str:
    rows = [_body(f"{n}", joint.body) for n, joint in enumerate(robot.joints, start=1)]
    if robot.payload is not None:
        rows.append(_body("payload", robot.payload))
    return _table(
        "Inertia about the centre of mass: xx, yy, zz, or xx, yy, zz, xy, xz, yz.",
        ["body", "mass [kg]", "centre of mass [m]", "inertia [kg m&sup2;]"],
        rows,
    )


def _body(name: str, body: Body) -> list[str]:
    return [name, f"{body.mass:.6g}", _vector(body.com), _vector(body.inertia)]


def _start(variable: Variable) -> str:
    value = variable.start
    return "" if value is None else f"{value:.9g}" if isinstance(value, float) else value


def _table(caption: str, header: list[str], rows: list[list[str]]) -> str:
    head = "".join(f"<th>{cell}</th>" for cell in header)
    body = "\n".join(
        "<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    title = f"<caption>{caption}</caption>" if caption else ""
    return f"<table>{title}<tr>{head}</tr>\n{body}</table>"


def _vector(values: Iterable[float]) -> str:
    return ", ".join(f"{value:.6g}" for value in values)
