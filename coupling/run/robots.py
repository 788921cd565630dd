"""What a result tells of its robots beside the case: where their numbers come from, and their links."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case import Case
from coupling.files.robot_file import find_robot, robot_numbers
from coupling.files.sources import Number, by_source
from coupling.robot.links import link_points
from coupling.run.study import Run
from elastic_robot.errors import ElasticRobotError


def drawn_robots(case: Case, run: Run) -> list[dict[str, Any]]:
    """Return name, file, sources and links of the robots of a run.

    `links_m` is at the middle row of the command, base, centres of the joints and TCP in the world [m].
    """
    found = []
    for placed, joints in zip(case.robots, run.correction.joints.robots, strict=True):
        table = case.resolved["robot" if placed.name == "forming" else placed.name]
        numbers: list[Number] = []
        # The run rests on what was read at its start: a file that is gone meanwhile spoils no result.
        with suppress(ElasticRobotError):
            _, numbers = robot_numbers(find_robot(table["description"]))
        own = link_points(placed.description, joints.q[0][len(joints.time) // 2])
        at = placed.placement
        found.append(
            {
                "name": placed.name,
                "title": placed.description.name,
                "description": Path(table["description"]).name,
                "torque_curve": placed.torque_curve,
                "sources": by_source(numbers),
                "links_m": np.round(at.position + at.rotation.apply(own), 6).tolist(),
            }
        )
    return found
