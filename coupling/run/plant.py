"""The command as written, on the plant: robots and a load that are not the model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.case.case import Case, PlacedRobot
from coupling.errors import ProcessError, SimulationError
from coupling.events import Watch
from coupling.path.histories import ToolPath
from coupling.path.joint_path import JointPath
from coupling.process.base import MarchedProcess, Process, ProcessMemory, ProcessResponse, marched
from coupling.results.replay import deviation_table
from coupling.results.run_result import PlantCouplingResult, PlantReplay, RunResult
from coupling.results.section import Section
from coupling.robot.cell import Cell
from coupling.robot.differences import Plant
from coupling.run.check import Check, CheckedCommand
from coupling.run.fmu_pool import FmuPool
from coupling.solve.correction import Correction
from coupling.solve.coupling import couple
from coupling.solve.fixed_point import Coupling


@dataclass(frozen=True)
class ScaledProcess:
    """A process whose wrench is another one's, times a factor."""

    process: Process
    factor: float

    @property
    def identity(self) -> str:
        """That of the other one, with the factor."""
        process_identity = self.process.identity
        return process_identity and f"{process_identity} times {self.factor!r}"

    @property
    def marched(self) -> ScaledMarch | None:
        """It, marching in time, where the other one is."""
        process = marched(self.process)
        return None if process is None else ScaledMarch(process, self.factor)

    def evaluate(self, path: ToolPath) -> ProcessResponse:
        """Return its answer to a path, times the factor."""
        response = self.process.evaluate(path)
        stiffness = None if response.stiffness is None else self.factor * response.stiffness
        return replace(response, wrench=response.wrench.scaled(self.factor), stiffness=stiffness)


@dataclass(frozen=True)
class ScaledMarch(ScaledProcess):
    """A `ScaledProcess` that is coupled marching in time."""

    process: MarchedProcess

    @property
    def memory(self) -> ProcessMemory:
        """That of the other one."""
        return self.process.memory

    def means(self, time: np.ndarray, pose: np.ndarray, since: int) -> np.ndarray:
        """Return the other one's mean wrenches, times the factor, as `MarchedProcess.means`."""
        return self.factor * self.process.means(time, pose, since)


def plant_cell(cell: Cell, plant: Plant, models: FmuPool) -> Cell:
    """Return the cell with the robots that really move: what is beyond the model they do themselves."""
    cell = Cell(tuple(replace(member, discrepancy=None) for member in cell.members))
    robots = [
        models.of(robot.description, robot.torque_curve, robot.drive).differing(
            robot.difference, "the plant's parameters"
        )
        for robot in plant.robots
    ]
    return cell.with_robots(robots)


def run_on_plant(case: Case, cell: Cell, correction: Correction, watch: Watch) -> PlantReplay:
    """Run a command as written on moving robots and under a load that differ from the model.

    Raises:
        SimulationError: If the plant cannot be simulated.
    """
    assert case.plant is not None
    coupling, remark = None, ""
    loads = correction.response.wrench.scaled(case.plant.force)
    try:
        if case.plant.couple:
            force, start = case.plant.force, correction.achieved
            try:
                coupled = coupled_on(case, cell, force, correction.joints, start, watch)
                loads = coupled.response.wrench
                coupling = PlantCouplingResult(
                    converged=coupled.converged,
                    outcome=coupled.outcome.value,
                    reason=coupled.reason,
                    process_evaluations=len(coupled.evaluations),
                )
            except ProcessError as error:  # what was computed on the model is worth keeping
                remark = f"the process failed on the plant's path: {error}"
        path = cell.simulate(correction.joints, loads, "dynamic")
    except SimulationError as error:
        raise SimulationError(f"plant: {error}") from error
    differences = in_words(case.plant, case.robots)
    return PlantReplay.of(path, correction.desired, loads, differences, coupling, remark)


def coupled_on(
    case: Case, cell: Cell, force: float, joints: JointPath, start: ToolPath, watch: Watch
) -> Coupling:
    """Return the coupling of a plant that moves under a command with the case's process.

    Args:
        start: Paths on the model, whose times hold the case's samples.

    Raises:
        ProcessError: If the process has no answer to the first path.
    """
    process = ScaledProcess(case.process, force)
    loop = replace(case.loop(cell, watch), process=process, mode="dynamic")
    rows = np.searchsorted(start.time, case.desired.time)
    return couple(loop, joints, start, rows)


def in_words(plant: Plant, robots: Sequence[PlacedRobot]) -> tuple[str, ...]:
    """Return what is other on a plant, a phrase for each difference."""
    said = []
    for difference, model in zip(plant.robots, robots, strict=True):
        phrases = list(difference.difference.in_words())
        if difference.drive != model.drive:
            phrases.insert(0, f'drive = "{difference.drive}"')
        if difference.torque_curve != model.torque_curve:
            phrases.insert(0, f'torque_curve = "{difference.torque_curve}"')
        if difference.description != model.description:
            phrases.insert(0, f"the robot {difference.description.name}")
        who = f"{model.name}: " if len(robots) > 1 else ""
        said += [f"{who}{phrase}" for phrase in phrases]
    if plant.force != 1.0:
        said.append(f"force x {plant.force:g}")
    return tuple(said)


def _compute(command: CheckedCommand) -> PlantReplay:
    case = command.case
    assert case.plant is not None  # else the check does not apply
    cell = plant_cell(command.cell, case.plant, command.fmus)
    return run_on_plant(case, cell, command.correction, command.watch)


def _sections(figures: RunResult) -> list[Section]:
    plant_result = figures.plant
    if plant_result is None:
        return []
    differences = ", ".join(plant_result.differences) or "nothing"
    text = f"The same command on a robot that differs from the model by: {differences}. "
    text += (
        "The wrench is that on the model, times the factor of the force."
        if plant_result.coupling is None
        else f"The process was evaluated on the plant's path: {plant_result.coupling.reason}."
    )
    warning = [f"Warning: {plant_result.remark}."] if plant_result.remark else []
    model, mode = figures.shares_m.dynamic_after, "dynamic"
    if model is None:  # a coupling corrects nothing
        model, mode = figures.deviation_before_m, figures.mode
    rows = [(f"{mode} model", model), ("dynamic plant", plant_result.deviation_m)]
    return [Section("On the plant", (text, *warning, deviation_table(rows)))]


PLANT_REPLAY = Check[PlantReplay | None](
    "plant",
    _compute,
    None,
    lambda command: command.case.plant is not None,
    sections=_sections,
)
