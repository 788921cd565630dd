"""Usual ranges of the numbers of case and robot files, and of what follows from them."""

from __future__ import annotations

import re

from coupling.robot.parameter_kind import UsualRange
from coupling.robot.parameter_table import PARAMETER_KINDS, VARIED

_STEP = UsualRange(2e-5, 5e-3, "m", "steps between the contours of a formed wall")
_WALL = UsualRange(5.0, 89.0, "deg", "walls of formed parts")
_TOOL = UsualRange(1e-3, 0.1, "m", "tools for incremental forming")
_CUTTING = "coefficients of cutting: plastics at the lower end, nickel alloys at the upper"
_EDGE = "coefficients of an edge: sharp in plastics at the lower end, worn in steel at the upper"
_ACROSS = UsualRange(1e6, 1e10, "Pa", _CUTTING, or_none=True)
_ALONG_EDGE = UsualRange(1e2, 3e5, "N/m", _EDGE, or_none=True)
_TURN = UsualRange(0.0, 360.0, "deg", "up to one turn")
_TILT = UsualRange(0.0, 60.0, "deg", "tilts of a tool that still works with its tip")
_IN_CELL = UsualRange(0.0, 20.0, "m", "places in a robot's cell")
_ON_PART = UsualRange(0.0, 10.0, "m", "points of parts that a robot works on")
_FREQUENCY = UsualRange(0.05, 500.0, "Hz", "motion of robots, up to that of a spindle")
_CLOSENESS = UsualRange(1e-9, 1e-3, "m", "from rounding to what forming notices")
_FACTOR = UsualRange(0.1, 10.0, "", "factors of a parameter", or_none=True)
_PHASE = UsualRange(0.0, 360.0, "deg", "phases")
_CARRIED = UsualRange(
    1e-3, 2500.0, "kg", "tools and spindles; the heaviest robots carry 2.3 t", True
)
_ON_BODY = UsualRange(0.0, 3.0, "m", "places on a link of a robot or its tool")
_RADIANS = UsualRange(0.0, 6.3, "rad", "up to one turn")
_GEAR_TORQUE = UsualRange(
    1.0, 2e5, "N m", "torques of gears, from small arms to the heaviest robots"
)
_AT_OUTPUT = "both at the gear's output, where a motor's torques are gear_ratio times as large"

# What is usual, by the place of a key in a case or a robot file; [support] has the ranges of [robot].
# Behind them what follows from several keys, and from the response of the process.
EXPECTED = {
    **{key: usual for kind in PARAMETER_KINDS.values() for key, usual in kind.usual.items()},
    **{
        f"{table}.{variation.key}": _PHASE if variation.is_shift else _FACTOR
        for table in ("plant", "study")
        for _, variation in VARIED.values()
    },
    "robot.home_deg": UsualRange(
        7.0, 720.0, "deg", "postures with a bent elbow or wrist", or_none=True
    ),
    "robot.base_rpy_deg": _TURN,
    "support.base_position_m": UsualRange(0.2, 20.0, "m", "a robot beside the first"),
    "support.tool_diameter_m": _TOOL,
    "support.gap_m": UsualRange(5e-5, 2e-2, "m", "one or two thicknesses of a sheet"),
    "part.position_m": _IN_CELL,
    "part.rpy_deg": _TURN,
    "part.tolerance_mm": UsualRange(1e-3, 20.0, "mm", "from precise milling to formed parts"),
    "part.touch_off": _ON_PART,
    "tool_path.lead_deg": _TILT,
    "tool_path.lean_deg": _TILT,
    "tool_path.rotation_deg": _TURN,
    "tool_path.feed_m_s": UsualRange(
        2e-4, 2.0, "m/s", "feeds of forming, milling and measuring with robots"
    ),
    "tool_path.rapid_m_s": UsualRange(1e-3, 4.0, "m/s", "what robots reach between cuts"),
    "tool_path.max_turn_deg_s": UsualRange(5.0, 720.0, "deg/s", "wrists of robots"),
    "tool_path.blend_s": UsualRange(1e-3, 10.0, "s", "starts and stops of robots"),
    "tool_path.turn_s": UsualRange(0.05, 60.0, "s", "rotations of a tool at a corner"),
    "tool_path.sample_s": UsualRange(1e-5, 1.0, "s", "from milling to slow forming"),
    "tool_path.corner_deg": UsualRange(0.5, 90.0, "deg", "corners of programs", or_none=True),
    "tool_path.radius_m": UsualRange(2e-3, 1.0, "m", "formed parts"),
    "tool_path.size_m": UsualRange(1e-2, 3.0, "m", "squares that a robot reaches"),
    "tool_path.wall_angle_deg": _WALL,
    "tool_path.step_down_m": _STEP,
    "tool_path.depth_m": UsualRange(1e-4, 0.5, "m", "depth of formed parts"),
    "tool_path.clearance_m": UsualRange(2e-4, 0.2, "m", "heights of air moves"),
    "tool_path.points_m": _ON_PART,
    "process.tensile_strength_Pa": UsualRange(
        3e7, 2.5e9, "Pa", "metal sheet, from soft aluminium to press-hardened steel"
    ),
    "process.strength_Pa": UsualRange(2e7, 3e9, "Pa", "factor of the hardening laws of metals"),
    "process.youngs_modulus_Pa": UsualRange(1e9, 4.2e11, "Pa", "from plastics to tungsten"),
    "process.poisson_ratio": UsualRange(0.1, 0.48, "", "metals and plastics", or_none=True),
    "process.hardening_exponent": UsualRange(0.01, 0.7, "", "metal sheet", or_none=True),
    "process.prestrain": UsualRange(1e-5, 0.5, "", "from annealed to rolled sheet"),
    "process.anisotropy": UsualRange(0.3, 4.0, "", "ratios of rolled sheet"),
    "process.friction_coefficient": UsualRange(
        0.01, 0.5, "", "from a lubricated tool to a dry one", or_none=True
    ),
    "process.force_factor": UsualRange(0.2, 5.0, "", "a measured force over a computed one"),
    "process.sheet_thickness_m": UsualRange(
        5e-5,
        1e-2,
        "m",
        "from foil to thick plate; single point forming is done up to a few millimetres",
    ),
    "process.sheet_size_m": UsualRange(0.01, 3.0, "m", "clamped sheets"),
    "process.backing_radius_m": UsualRange(2e-3, 1.5, "m", "openings of backing plates"),
    "process.backing_edge_radius_m": UsualRange(
        1e-5, 0.1, "m", "edges of backing plates", or_none=True
    ),
    "process.element_m": UsualRange(1e-4, 5e-2, "m", "elements of a sheet"),
    "process.position_m": UsualRange(1e-4, 0.1, "m", "parts of the tool's radius"),
    "process.window_m": UsualRange(1e-3, 1.0, "m", "the tool's surroundings"),
    "process.tool_diameter_m": _TOOL,
    "process.wall_angle_deg": _WALL,
    "process.step_down_m": _STEP,
    "process.ramp_depth_m": UsualRange(5e-5, 0.1, "m", "depths over which a force rises"),
    "process.penetration_stiffness_N_m": UsualRange(
        1e3, 1e8, "N/m", "sheet under a tool; 1.2e5 is 1 mm of soft aluminium", or_none=True
    ),
    "process.pinch_stiffness_N_m": UsualRange(
        1e3, 1e9, "N/m", "sheet between two tools", or_none=True
    ),
    "process.stiffness_N_m": UsualRange(
        1e2, 1e10, "N/m", "from a foam to a block of steel", or_none=True
    ),
    "process.point_m": _ON_PART,
    "process.cutoff_Hz": _FREQUENCY,
    "process.time_limit_s": UsualRange(1.0, 1e6, "s", "from a formula to a week of simulation"),
    "process.cutter_diameter_m": UsualRange(1e-4, 0.3, "m", "end mills and face mills"),
    "process.teeth": UsualRange(1.0, 20.0, "", "end mills and face mills"),
    "process.pitch_deg": UsualRange(10.0, 300.0, "deg", "angles from a tooth to the next"),
    "process.runout_m": UsualRange(1e-7, 1e-4, "m", "run-out of cutters in holders", or_none=True),
    "process.runout_deg": _TURN,
    "process.end_edge_m": UsualRange(1e-4, 0.1, "m", "edges on the ends of cutters", or_none=True),
    "process.helix_deg": UsualRange(5.0, 65.0, "deg", "end mills", or_none=True),
    "process.radial_depth_m": UsualRange(1e-5, 0.3, "m", "up to a cutter's diameter"),
    "process.surface_z_m": UsualRange(0.0, 1.0, "m", "raw surfaces of parts"),
    "process.spindle_speed_rpm": UsualRange(100.0, 2e5, "1/min", "spindles for milling"),
    "process.spindle_max_rpm": UsualRange(1000.0, 2e5, "1/min", "spindles for milling"),
    "process.spindle_power_W": UsualRange(100.0, 2e5, "W", "spindles for milling"),
    "process.spindle_torque_Nm": UsualRange(0.05, 2e3, "N m", "spindles for milling"),
    "process.stock_m": _ON_PART,
    "process.raster_m": UsualRange(1e-5, 1e-3, "m", "a hundredth to a tenth of a cutter's radius"),
    "process.kc11_Pa": UsualRange(
        1e8, 5e9, "Pa", "plastics at the lower end, nickel alloys at the upper"
    ),
    "process.kienzle_exponent": UsualRange(0.05, 0.5, "", "metals", or_none=True),
    "process.radial_ratio": UsualRange(0.1, 1.5, "", "radial by tangential forces", or_none=True),
    "process.axial_ratio": UsualRange(0.05, 1.0, "", "axial by tangential forces", or_none=True),
    "process.K_tc_Pa": UsualRange(2e7, 1e10, "Pa", _CUTTING),
    "process.K_rc_Pa": _ACROSS,
    "process.K_ac_Pa": _ACROSS,
    "process.K_te_N_m": _ALONG_EDGE,
    "process.K_re_N_m": _ALONG_EDGE,
    "process.K_ae_N_m": _ALONG_EDGE,
    "coupling.relaxation": UsualRange(0.01, 2.0, "", "relaxations that converge"),
    "coupling.tolerance_m": _CLOSENESS,
    "coupling.rms_tolerance_m": _CLOSENESS,
    "coupling.force_tolerance": UsualRange(1e-8, 0.1, "", "parts of the largest force"),
    "compensation.tolerance_m": _CLOSENESS,
    "compensation.cutoff_Hz": _FREQUENCY,
    "compensation.max_correction_rate_m_s": UsualRange(1e-3, 2.0, "m/s", "corrections of a feed"),
    "controller.cycle_s": UsualRange(2e-4, 0.1, "s", "cycles of robot controllers"),
    "controller.max_acceleration_rad_s2": UsualRange(0.3, 1e3, "rad/s2", "axes of robots"),
    "plant.force_factor": _FACTOR,
    "plant.payload_kg": _CARRIED,
    "plant.payload_position_m": _ON_BODY,
    "study.force_factor": _FACTOR,
    "study.payload_kg": _CARRIED,
    "study.payload_position_m": _ON_BODY,
    "stability.spindle_rpm": UsualRange(100.0, 2e5, "1/min", "spindles for milling"),
    "stability.max_depth_m": UsualRange(1e-4, 0.2, "m", "depths up to the length of an edge"),
    "stability.tool_mode.frequency_Hz": UsualRange(
        20.0, 2e4, "Hz", "modes of tools, holders and spindles"
    ),
    "stability.tool_mode.damping_ratio": UsualRange(
        1e-3, 0.3, "", "damping of tools, holders and spindles"
    ),
    "stability.tool_mode.stiffness_N_m": UsualRange(
        1e5, 1e9, "N/m", "stiffness of tools in their holders"
    ),
    "stability.process_damping.indentation_N_m3": UsualRange(
        1e11, 1e15, "N/m3", "indentation of metals, some 4e13 in steel"
    ),
    "stability.process_damping.wear_land_m": UsualRange(1e-6, 2e-3, "m", "lands of worn flanks"),
    "stability.process_damping.friction": UsualRange(
        0.02, 2.0, "", "friction of a flank", or_none=True
    ),
    "place.x_m": _IN_CELL,
    "place.y_m": _IN_CELL,
    "place.z_m": _IN_CELL,
    "place.yaw_deg": _TURN,
    "place.lead_deg": _TILT,
    "place.lean_deg": _TILT,
    "place.rotation_deg": _TURN,
    "place.base_roll_deg": _TURN,
    "place.elbow_deg": _TURN,
    "place.joint_margin_deg": UsualRange(0.5, 45.0, "deg", "distances from a limit", or_none=True),
    "place.least_conditioning": UsualRange(1e-3, 0.5, "", "postures that are not singular"),
    "gravity": UsualRange(9.7, 9.9, "m/s2", "on Earth", or_none=True),
    "modal_damping.ratio": UsualRange(0.01, 0.15, "", "modes of robots, measured: 0.02 to 0.08"),
    "payload_N": UsualRange(4.0, 3e4, "N", "the heaviest robots carry 23 kN"),
    "payload.mass": _CARRIED,
    "payload.com": _ON_BODY,
    "payload.inertia": UsualRange(0.0, 2e3, "kg m2", "tools and spindles"),
    "controller.joint_matrix": UsualRange(0.0, 3.0, "", "signs and coupled axes"),
    "controller.joint_offset_deg": _TURN,
    "controller.base_position": _ON_BODY,
    "controller.flange_position": _ON_BODY,
    "controller.flange_rpy_deg": _TURN,
    "tcp.position": _ON_BODY,
    "tcp.rpy": _RADIANS,
    "urdf.mass_scale": UsualRange(0.02, 50.0, "", "exports of CAD with the wrong density"),
    "joint.origin": UsualRange(0.0, 10.0, "m", "from one axis to the next"),
    "joint.mass": UsualRange(0.0, 5e3, "kg", "links, from small arms to the heaviest robots"),
    "joint.com": UsualRange(0.0, 5.0, "m", "centres of mass in or beside their link"),
    "joint.inertia": UsualRange(0.0, 1e4, "kg m2", "links, up to those of the heaviest robots"),
    "joint.limits": UsualRange(
        0.0, 20.0, "rad", "wrists that turn three times to either side at most"
    ),
    "joint.max_rate": UsualRange(0.05, 30.0, "rad/s", "axes of robots"),
    "joint.max_acceleration": UsualRange(0.1, 1e3, "rad/s2", "axes of robots"),
    "joint.torque_table.angle": UsualRange(1e-6, 0.1, "rad", "wind-ups of gears"),
    "joint.torque_table.torque": _GEAR_TORQUE,
    "joint.gear_torque_Nm.peak": _GEAR_TORQUE,
    "joint.gear_torque_Nm.emergency": _GEAR_TORQUE,
    "joint.gear.hysteresis_width_arcmin": UsualRange(0.05, 20.0, "arcmin", "gears of robots"),
    "joint.gear.lost_motion_arcmin": UsualRange(0.05, 20.0, "arcmin", "gears of robots"),
    "joint.gear.rated_torque_Nm": _GEAR_TORQUE,
    "joint.gear.kinematic_error.per_turn_of_joint": UsualRange(
        0.2, 1e5, "", "from a turn of the output to the teeth of the input"
    ),
    "joint.gear.kinematic_error.per_turn_of_motor": UsualRange(
        1e-3, 200.0, "", "from a turn of the output to the teeth of the input"
    ),
    "joint.drive.gear_ratio": UsualRange(1.0, 1e3, "", "from direct drives to large gears"),
    "joint.drive.max_torque_Nm": _GEAR_TORQUE,
    "joint.drive.torque_constant_Nm_A": UsualRange(1e-3, 20.0, "N m/A", "servo motors"),
    "joint.drive.friction.stribeck_rate": UsualRange(1e-4, 2.0, "rad/s", "axes of robots"),
    "joint.drive.friction.presliding_rad": UsualRange(
        1e-7, 5e-3, "rad", "less than the wind-up of a gear"
    ),
    "joint.drive.servo.position_gain": UsualRange(
        3.0, 100.0, "1/s", "position loops of machine axes"
    ),
    "joint.drive.servo.integral_time_s": UsualRange(1e-3, 5.0, "s", "rate loops of machine axes"),
    "joint.drive.servo.rate_feed_forward": UsualRange(0.0, 1.2, "", "1 is the whole rate"),
    "joint.balancer.torque_table.angle": UsualRange(0.0, 7.0, "rad", "angles of a joint"),
    "joint.balancer.gas_spring.base_point": _ON_BODY,
    "joint.balancer.gas_spring.link_point": _ON_BODY,
    "joint.balancer.gas_spring.length_m": UsualRange(0.05, 3.0, "m", "gas springs of robots"),
    "joint.balancer.gas_spring.gas_volume_m3": UsualRange(1e-5, 0.1, "m3", "gas springs of robots"),
    "joint.balancer.gas_spring.area_m2": UsualRange(1e-5, 0.05, "m2", "pistons of gas springs"),
    "joint.balancer.gas_spring.exponent": UsualRange(0.9, 1.7, "", "isothermal to adiabatic"),
    "robot.reach": UsualRange(
        0.05, 20.0, "m", "the length of all links, from a small arm to the longest ones"
    ),
    "robot.payload_over_rating": UsualRange(
        0.0, 1.001, "of the rated load", "a payload within what the robot is rated for"
    ),
    "robot.distance_from_column": UsualRange(
        0.1, 1.5, "of the reach", "tools clear of the column that turns with joint 1"
    ),
    "joint.inertia_excess": UsualRange(
        0.0, 1e-4, "%", "the largest principal moment of a body is at most the sum of the others"
    ),
    "joint.drive.friction_over_inertia": UsualRange(
        0.05,
        300.0,
        "rad/s2",
        f"friction at rest over the rotor's inertia, {_AT_OUTPUT}",
        or_none=True,
    ),
    "joint.drive.viscous_over_inertia": UsualRange(
        0.02, 100.0, "1/s", f"viscous friction over the rotor's inertia, {_AT_OUTPUT}", or_none=True
    ),
    "joint.drive.torque_over_inertia": UsualRange(
        2.0, 1e4, "rad/s2", f"largest torque over the rotor's inertia, {_AT_OUTPUT}"
    ),
    "joint.drive.rate_bandwidth": UsualRange(
        2.0, 500.0, "Hz", "rate loops: their gain by the rotor's inertia and 2 pi"
    ),
    "milling.axial_depth": UsualRange(
        0.0, 2.0, "diameters of the cutter", "slots to about one deep, walls to two"
    ),
    "milling.feed_per_tooth": UsualRange(
        2e-6, 1.5e-3, "m", "less than the radius of an edge rubs, more breaks it"
    ),
    "answer.peak_force": UsualRange(
        0.5, 5e4, "N", "forces on a robot's tool; the heaviest robots carry 23 kN", or_none=True
    ),
}

# Parts of an entry of [study], whose range is that of the entry.
_OF_SPREAD = re.compile(r"^(study\.\w+)\.(low|high|mean)$")


def range_key(key: str) -> str:
    """Return the key of `EXPECTED` that a key of a file belongs to; not all have a range there.

    Example:
        >>> range_key("support.home_deg"), range_key("study.force_factor.low")
        ('robot.home_deg', 'study.force_factor')
    """
    key = key.replace("plant.support.", "plant.", 1)
    if key.startswith("study.") and key.endswith(".deviation"):
        return "study.deviation"
    if spread := _OF_SPREAD.match(key):
        return spread[1]
    if key.startswith("process.parameters."):
        return "process.parameters"
    if key.startswith("support.") and key not in EXPECTED:
        return key.replace("support.", "robot.", 1)
    return key
