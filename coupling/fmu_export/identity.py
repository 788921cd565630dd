"""What FMUs of every kind tell of themselves: names, version, licences, icon."""

from __future__ import annotations

from datetime import datetime
from importlib import metadata
from pathlib import Path

import elastic_robot
from coupling.fmu_export.model_description import ModelInfo
from elastic_robot.description import Robot
from elastic_robot.fmi.interface import STEP_SIZE
from elastic_robot.fmi.tolerance import RELATIVE

ICON = Path(__file__).parent / "model.png"


def robot_line(robot: Robot) -> str:
    """Return a robot's FMU in one line."""
    return (
        f"Industrial robot {robot.name} with elastic joints, tilts and backlash:"
        " tool forces in, TCP pose out"
    )


def about(
    model_name: str,
    description: str,
    with_what: str,
    date: datetime,
    capabilities: tuple[str, ...],
) -> ModelInfo:
    """Return what an FMU tells of itself.

    Args:
        model_name: Name of the model; also of its library.
        description: One line.
        with_what: Tool beside this one that it was made with.
        date: Date of the build.
        capabilities: Flags of `CoSimulation` that are true.
    """
    return ModelInfo(
        model_name=model_name,
        description=description,
        version=elastic_robot.__version__,
        tool=f"elastic-robot-fmu {elastic_robot.__version__}, {with_what}",
        date=f"{date:%Y-%m-%dT%H:%M:%SZ}",
        capabilities=capabilities,
        step_size=STEP_SIZE,
        tolerance=RELATIVE,
    )


def licenses(**distributions: str) -> dict[str, bytes]:
    """Return the licences of installed distributions as an FMU's content, by the names of the files.

    This project's own is always among them.
    """
    entries = {}
    for name, distribution in {"license": "elastic-robot-fmu", **distributions}.items():
        text = metadata.distribution(distribution).read_text("licenses/LICENSE")
        assert text is not None, distribution
        entries[f"documentation/licenses/{name}.txt"] = text.encode()
    return entries
