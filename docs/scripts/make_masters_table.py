"""Write the tables of docs/import.md and docs/ssp.md from real runs: make masters-table."""

from __future__ import annotations

import sys
import tempfile
from itertools import pairwise
from pathlib import Path

from coupling.case import load_case
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import build_fmu
from coupling.run.ssp import write_ssp
from docs.scripts.masters import (
    MASTERS,
    MasterError,
    differences,
    distance_at_samples,
    prepare,
    run,
    run_reference,
    run_system,
)
from docs.scripts.page import finish, replace, table
from docs.scripts.runs import coupled

SSP_CASE = Path(__file__).parents[2] / "tests" / "coupling" / "cases" / "line.toml"
SSP_STEPS = (0.01, 0.005, 0.0025, 0.00125)


def import_table() -> str:
    """Return the table's rows as measured here; masters that are not installed are left out."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        prepare(folder, build_fmu(load_robot(shipped_robots()["icme2008"]), folder / "Built.fmu"))
        reference = {kind: run_reference(kind, folder) for kind in (False, True)}
        for master in MASTERS:
            if master.version is None:
                print(f"{master.snippet}: not installed (make masters)", file=sys.stderr)
                continue
            try:
                position, _ = differences(run(master, folder), reference[master.by_inputs])
                seen = ("yes", f"{position:.1g}")
            except MasterError as error:
                print(f"{master.snippet}: {error}", file=sys.stderr)
                seen = ("no", "-")
            rows.append((master.snippet.replace("-", " "), master.version, *seen, master.how))
    return table(("master", "version", "imports", "difference (m)", "how to run"), rows)


def ssp_table() -> str:
    """Return how far co-simulation is from weak coupling, by step."""
    case = load_case(SSP_CASE)
    path = coupled(case).correction.achieved
    with tempfile.TemporaryDirectory() as name:
        write_ssp(case, Path(name, "system.ssp"))
        distances = []
        for step in SSP_STEPS:
            poses = run_system("SSP-libcosimpy", Path(name), step, path.time[-1])
            distances.append(distance_at_samples(poses, path).max())
    ratios = [f"{a / b:.2f}" for a, b in pairwise(distances)]
    rows = zip(SSP_STEPS, distances, [*ratios, ""], strict=True)
    return table(
        ("step (ms)", "largest distance (um)", "times the next smaller"),
        ((f"{1e3 * step:g}", f"{1e6 * distance:.2f}", ratio) for step, distance, ratio in rows),
    )


def write() -> None:
    """Write both tables."""
    replace("import", "table", import_table())
    replace("ssp", "table", ssp_table())


if __name__ == "__main__":
    sys.exit(finish(write))
