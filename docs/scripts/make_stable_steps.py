"""Write the table of docs/ssp.md on safe steps from real runs: make stable-steps."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np

from coupling.case.case import Case
from coupling.fmu_export.ssp import SspSystem
from docs.scripts.experiment import Page, results
from docs.scripts.masters import MasterError, run_system
from docs.scripts.runs import EXAMPLES, case_of

ROBOTS = EXAMPLES / "robots"
STIFFNESSES = (1e4, 1e5, 1e6)  # [N/m]
STEPS = (0.001, 0.002, 0.005, 0.01, 0.02)  # [s]
PAGE = Page("ssp")


@dataclass(frozen=True)
class Cell:
    """A robot that presses a tool on a wall.

    Attributes:
        name: In the table.
        robot: Its description, a shipped name or a file.
        home: Where inverse kinematics starts [deg].
        place: Of the part [m].
    """

    name: str
    robot: str
    home: tuple[float, ...]
    place: tuple[float, float, float]

    def case(self, stiffness: float, scheme: str = "robin") -> Case:
        """Return the case: through the air onto the wall, 5 mm deep, 60 mm along it."""
        points = [[0.0, 0.0, 0.03], [0.0, 0.0, -0.005], [0.06, 0.0, -0.005]]
        data: dict[str, Any] = {
            "robot": {
                "description": self.robot,
                "torque_curve": "linear",
                "home_deg": list(self.home),
            },
            "part": {"position_m": list(self.place)},
            "tool_path": {
                "kind": "line",
                "points_m": points,
                "feed_m_s": 0.05,
                "blend_s": 0.1,
                "sample_s": 0.02,
            },
            "process": {"model": "elastic-wall", "stiffness_N_m": stiffness},
            "coupling": {"scheme": scheme, "tolerance_m": 1e-8},
        }
        return case_of(data)


UR10 = Cell(
    "UR10", str(ROBOTS / "ur10.toml"), (0.0, -57.0, 80.0, 67.0, -90.0, 0.0), (0.74, 0.164, 0.18)
)
CELLS = (
    UR10,
    Cell(
        "KUKA KR 210",
        str(ROBOTS / "kuka_kr210.toml"),
        (0.0, 17.0, 11.0, 0.0, 61.0, 0.0),
        (1.8, 0.0, 0.9),
    ),
    Cell("icme2008", "icme2008", (0.0, 10.0, 20.0, 0.0, 60.0, 0.0), (1.6, 0.1, 0.8)),
)


@PAGE.part
def forces() -> str:
    """Return safe steps, and the largest forces in libcosim without the spring and with it."""

    def pressed_by(case: Case) -> list[str]:
        forced, sprung = SspSystem.of(case, "force", step=STEPS[0]), SspSystem.of(case)
        safe = (forced.limit.safe_step(False, 0.01), sprung.step)
        both = zip(_largest(forced), _largest(sprung), strict=True)
        return [*(f"{1e3 * step:g}" for step in safe), *map(", ".join, both)]

    heads = ("safe, force (ms)", "safe, spring (ms)", *(f"{1e3 * step:g} ms" for step in STEPS))
    return results(
        ("robot", "process (N/m)"),
        {(cell.name, f"{k:.0e}"): cell.case(k) for cell in CELLS for k in STIFFNESSES},
        pressed_by,
        {head: itemgetter(k) for k, head in enumerate(heads)},
    )


def pressed(folder: Path, system: SspSystem, step: float) -> np.ndarray | None:
    """Return the rows of a run in libcosim of a folder, as `run_system`; None where it stops."""
    stop = step * np.floor(system.case.desired.time[-1] / step + 1e-9)
    try:
        # A nanosecond short: the sum of libcosim's steps must not pass the command's end.
        return run_system("libcosimpy", folder, step, float(stop) - 1e-9)
    except MasterError:
        return None


def _largest(system: SspSystem) -> list[str]:
    """Return the largest force of a run with every step [N]; "stops" where the run does."""
    found = []
    with tempfile.TemporaryDirectory() as folder:
        system.write(Path(folder, "system.ssp"))
        for step in STEPS:
            rows = pressed(Path(folder), system, step)
            found.append("stops" if rows is None else f"{rows[:, 10].max():.3g}")
    return found


if __name__ == "__main__":
    PAGE.write()
