"""Bodies of a URDF's joints: what the robot file replaces, what cannot matter, and what is missing."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from coupling.files.robot_schema import UrdfJoint
from elastic_robot.body import Body


def body_of(
    inertia: pin.Inertia,
    scale: float,
    keys: UrdfJoint | None,
    base_from_file: np.ndarray,
    lone_axis: np.ndarray | None,
) -> tuple[Body, str]:
    """Return the body behind a joint, in its frame, and a remark where its inertia was completed.

    Args:
        inertia: Mass [kg], centre [m] and inertia about it [kg m^2] that the URDF has there, body axes.
        scale: Factor of its masses and inertias.
        keys: Table of the joint in the robot file, whose mass, com and inertia replace the URDF's.
        base_from_file: Rotation from the axes of that table, which are the URDF joint's, (3, 3).
        lone_axis: Direction of the joint's axis, (3,), where the body turns about it alone: of a first
            joint without tilts.  None for others.

    Raises:
        ValueError: If no body has these numbers.
    """
    mass, centre, matrix = inertia.mass * scale, inertia.lever, inertia.inertia * scale
    if keys is not None:
        for needed in ("mass", "com", "inertia"):
            if keys.has_part_of_body and inertia.mass == 0.0 and getattr(keys, needed) is None:
                raise ValueError(
                    f"expected mass, com and inertia, as the URDF has no mass there, got no {needed}"
                )
        if keys.mass is not None:
            mass = keys.mass
        if keys.com is not None:
            centre = base_from_file @ keys.com
        if keys.inertia is not None:
            stated = Body(max(mass, 1.0), (0.0, 0.0, 0.0), tuple(keys.inertia)).inertia_matrix
            matrix = base_from_file @ stated @ base_from_file.T
    moments = np.linalg.eigvalsh(matrix)
    if lone_axis is None or mass == 0.0 or _is_possible(moments):
        return Body.from_matrix(mass, centre, matrix), ""
    about = float(lone_axis @ matrix @ lone_axis)
    along = np.outer(lone_axis, lone_axis)
    completed = about * (along + 0.5 * (np.eye(3) - along))  # those of a disc
    return (
        Body.from_matrix(mass, centre, completed),
        f"principal moments {', '.join(f'{moment:.4g}' for moment in moments)} kg m2 are those of no"
        f" body: only the {about:.4g} kg m2 about the joint's axis matter, and are used",
    )


def _is_possible(moments: np.ndarray) -> bool:
    """Return whether principal moments in rising order are those of a body, but for rounding."""
    small, middle, large = moments
    slack = 1e-6 * max(large, 0.0)
    return bool(small >= -slack and large <= small + middle + slack)
