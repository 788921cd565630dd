"""The best settings as case files, and their figures along the whole path."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import tomlkit

from coupling.case.case import Case, PlacedRobot
from coupling.case.file import load_case
from coupling.errors import CaseError, PlanningError, StabilityError
from coupling.inverse.inversion import DesiredMotion
from coupling.path.frame import Frame
from coupling.place.placing import Placing, setting_keys
from coupling.place.stations import stations_along
from coupling.process.base import Process
from coupling.results.cut_result import CutStability
from coupling.results.placement_result import SettingResult
from coupling.run.gear_loads import diagnose_robots, wanted_of
from coupling.stability.path_stability import stability_in_brief

# What of a setting turns the tool on the part, so that the process may answer otherwise.
_TOOL = slice(4, 7)

# Postures that differ by more are not the same one [rad].
_ANOTHER = 0.05

ProcessOf = Callable[[Case], Process]


@dataclass(frozen=True)
class EvaluatedSetting:
    """A setting, looked at along the whole path.

    Attributes:
        setting: By `NAMES` [m], [rad], (9,).
        content: Text of its case file.
        result: Its figures at the strongest places of the path; margins those of its gears, too.
        refusals: Reasons for which it is not admitted.
        placed: Its robot.
        motion: Path, joint angles and wrench there.
    """

    setting: np.ndarray
    content: str
    result: SettingResult
    refusals: tuple[str, ...]
    placed: PlacedRobot
    motion: DesiredMotion

    @property
    def depth_over_limit(self) -> float:
        """Programmed depth over the limiting one [1]; infinite where the cut chatters."""
        cut = self.result.stability
        if cut is not None and not cut.stable:
            return np.inf
        return 0.0 if cut is None else cut.depth_m / cut.limit_m


def evaluate_setting(
    placing: Placing, setting: np.ndarray, process_of: ProcessOf
) -> EvaluatedSetting:
    """Return a setting with its figures along the whole path, planned as any case is.

    The wrench turns with the part; where the tool is turned on it, the process is evaluated anew.

    Args:
        setting: By `NAMES` [m], [rad], (9,).

    Raises:
        PlanningError: If the robot cannot follow.
    """
    q = placing.screen(placing.stations.strongest()).batch(setting[None]).q[0, :, 0]
    if not np.isfinite(q).all():
        raise PlanningError("out of reach")
    is_present = np.array_equal(setting, placing.present)
    home = placing.case.robots[0].home if is_present else q
    if placing.arm.is_redundant:  # its home says which of its postures it takes
        home = placing.arm.homes(setting[None])[:, 0]
    content = tomlkit.dumps(placing.content(setting, home))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, f"{placing.case.name}.toml")
        file.write_text(content, encoding="utf-8")
        try:
            case = load_case(file)
        except CaseError as cause:  # its path would turn the tool too fast
            raise PlanningError(str(cause)) from cause
    wrench = placing.wrench.transformed(Frame(np.zeros(3), case.task.part.rotation))
    if np.any(setting[_TOOL] != placing.present[_TOOL]):
        wrench = process_of(case).evaluate(case.desired).wrench
    # The same motion, but for rounding: its process is evaluated at the same times.
    wrench = wrench.refined(case.desired.time)
    stations = stations_along(case.untilted, placing.cell.sphere_radius, wrench).strongest()
    figures = placing.screen(stations).figures(setting[None])
    (desired_motion,) = wanted_of(case.robots, case.desired, wrench)
    if placing.arm.is_redundant and np.abs(desired_motion.rigid.q[0][0] - q).max() > _ANOTHER:
        raise PlanningError("another posture than the one looked at is nearer to home")
    gears = diagnose_robots(case.robots, case.desired, wrench, desired_motion.rigid)[0]
    # Tilts that spring back where a load ends are in the diagnosis alone.
    exact = np.array([[gear.margin for gear in gears]]) - placing.gears.held_torque
    figures = replace(figures, margin=np.minimum(figures.margin, exact))
    goal, refused = placing.goal, placing.goal.demands.refusals(figures)
    result = SettingResult(
        setting=setting_keys(setting),
        admitted=bool(goal.demands.admits(figures)[0]),
        cost_m=float(goal.cost(figures)[0]),
        moved_m=float(goal.deviation(figures)[0]),
        exposure_m=float(goal.demands.exposure(figures)[0]),
        compliance_m_N=float(figures.compliance[0]),
        conditioning=float(figures.conditioning[0]),
        limit_margin_rad=float(figures.limit_margin[0]),
        rate_share=float(figures.rate_share[0]),
        motor_share=float(figures.motor_share[0]),
        gears=tuple(
            gear.model_copy(update={"swing": swing})
            for gear, swing in zip(gears, figures.swing[0].tolist(), strict=True)
        ),
        stability=_stability(case),
    )
    refusals = tuple(what for what, wrong in refused.items() if wrong[0])
    return EvaluatedSetting(setting, content, result, refusals, case.robots[0], desired_motion)


def _stability(case: Case) -> CutStability | None:
    try:
        return stability_in_brief(case)
    except StabilityError as cause:
        raise PlanningError(str(cause)) from cause
