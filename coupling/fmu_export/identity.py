"""What FMUs of every kind tell of themselves: names, version, licences, icon."""

from __future__ import annotations

from datetime import datetime
from importlib import metadata
from pathlib import Path

import elastic_robot
from coupling.fmu_export.model_description import About
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import MODEL_NAME, STEP_SIZE, TOLERANCE

ICON = Path(__file__).parent / "model.png"


def about_robot(
    robot: Robot, with_what: str, date: datetime, capabilities: tuple[str, ...]
) -> About:
    """Return what a robot's FMU tells of itself.

    Args:
        robot: The robot in the FMU.
        with_what: Tool beside this one that it was made with.
        date: Of the build.
        capabilities: Flags of `CoSimulation` that are true.
    """
    return About(
        model_name=MODEL_NAME,
        description=f"Industrial robot {robot.name} with elastic joints, tilts and backlash:"
        " tool forces in, TCP pose out",
        version=elastic_robot.__version__,
        tool=f"elastic-robot-fmu {elastic_robot.__version__}, {with_what}",
        date=f"{date:%Y-%m-%dT%H:%M:%SZ}",
        capabilities=capabilities,
        step_size=STEP_SIZE,
        tolerance=TOLERANCE,
    )


def license_text(distribution: str) -> str:
    """Return the licence of an installed distribution."""
    text = metadata.distribution(distribution).read_text("licenses/LICENSE")
    assert text is not None, distribution
    return text
