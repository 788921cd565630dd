"""Elastic multibody model of a serial industrial robot.

The joints of the robot deflect under load: every joint may wind up about its own axis (with gear
backlash) and tilt about up to two further axes; the links are rigid.  The motion of the drives is
prescribed, a wrench acts at the tool centre point (TCP), and the model returns the TCP's pose.

Conventions, used everywhere in this package, in the FMU and by those who use it:

Units
    SI in every array: m, kg, s, rad, N, N m.  Other units appear only as the suffix of a key in a
    TOML file (`home_deg`) and are converted where that file is read.
Frames
    base: fixed, axes of the robot file.  body i: origin on axis i, parallel to base at zero posture.
    tool: origin at the TCP.  A transform names both: `base_from_tool` maps tool to base coordinates.
Pose
    7 numbers x, y, z, qx, qy, qz, qw: position, then unit quaternion of base_from_tool, qw >= 0.
Wrench
    6 numbers fx, fy, fz, mx, my, mz: acts ON the robot at the TCP, in base axes.  A spring between the
    TCP and an anchor adds its force, stiffness times (anchor - TCP).
Small rotations
    Rotation vectors in base axes: R = exp(r) R_reference.
Joints
    R_i = Rot(axis, q_i + e_i) Rot(tilt_1, a_i) Rot(tilt_2, b_i): q is the drive, e the elastic torsion,
    a and b the tilts; a rigid joint has no e.
Coordinates
    theta: one angle per rotation of the chain, base to tool (12 for the example robot).
    x: the elastic angles e1 a1 b1 e2 ... in the same order (11), without the drives.
Backlash
    Half width of the backlash [rad].
"""

from elastic_robot.body import Body
from elastic_robot.description import Joint, Robot, Tilt
from elastic_robot.errors import ElasticRobotError

__version__ = "0.1.0"

__all__ = ["Body", "ElasticRobotError", "Joint", "Robot", "Tilt", "__version__"]
