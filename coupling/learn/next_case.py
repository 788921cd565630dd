"""The case of the next command: that of a run, with the robot that was learned."""

from __future__ import annotations

import copy
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import tomli_w


def next_case_text(data: Mapping[str, Any], robot: Path) -> str:
    """Return the case of a run with another robot file.

    A [plant] that was the model but for factors stays the robot that it was.

    Args:
        data: Content of the run's case.toml, whose paths are absolute.
        robot: The robot file that was learned.
    """
    content = copy.deepcopy(dict(data))
    before = content["robot"]["description"]
    content["robot"]["description"] = str(robot.resolve())
    plant = content.get("plant")
    if plant is not None:
        plant.setdefault("description", before)
    return tomli_w.dumps(content)
