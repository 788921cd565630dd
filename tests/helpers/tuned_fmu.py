"""A robot's FMU with other values of its own parameters, beside robots with other descriptions."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from coupling.path.histories import ToolPath, WrenchHistory
from coupling.path.joint_path import JointPath
from coupling.robot.robot_fmu import RobotFmu
from elastic_robot.fmi.interface import Mode


@contextmanager
def tuned(fmu: RobotFmu, values: Mapping[str, float | str]) -> Iterator[RobotFmu]:
    """Let an FMU's parameters have other values, by name, in simulations."""
    usual = fmu.parameters
    fmu.parameters = {**usual, **values}
    try:
        yield fmu
    finally:
        fmu.parameters = usual


def simulate_tuned(
    fmu: RobotFmu,
    command: JointPath,
    wrench: WrenchHistory,
    mode: Mode,
    values: Mapping[str, float | str],
) -> ToolPath:
    """Path of the tool with other values of the FMU's parameters, by name."""
    with tuned(fmu, values):
        return fmu.simulate(command, wrench, mode)
