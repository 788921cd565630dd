"""Write the tables of docs/import.md and docs/ssp.md from real runs: make masters-table."""

from __future__ import annotations

import re
import sys
import tempfile
from itertools import pairwise
from pathlib import Path

from coupling.case import load_case
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import build_fmu
from coupling.run.ssp import write_ssp
from coupling.run.study import run_coupling
from docs.scripts.masters import (
    MASTERS,
    PAGE,
    SSP_PAGE,
    MasterError,
    differences,
    distance_at_samples,
    prepare,
    run,
    run_reference,
    run_system,
)

HEADER = "| master | version | imports | difference (m) | how to run |\n|---|---|---|---|---|\n"
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
                seen = f"yes | {position:.1g}"
            except MasterError as error:
                print(f"{master.snippet}: {error}", file=sys.stderr)
                seen = "no | -"
            name = master.snippet.replace("-", " ")
            rows.append(f"| {name} | {master.version} | {seen} | {master.how} |\n")
    return HEADER + "".join(rows)


def ssp_table() -> str:
    """Return how far co-simulation is from weak coupling, by step."""
    case = load_case(SSP_CASE)
    coupled = run_coupling(case).achieved
    rows = ["| step (ms) | largest distance (um) | times the next smaller |\n|---|---|---|\n"]
    with tempfile.TemporaryDirectory() as name:
        write_ssp(case, Path(name, "system.ssp"))
        distances = []
        for step in SSP_STEPS:
            poses = run_system("SSP-libcosimpy", Path(name), step, coupled.time[-1])
            distances.append(distance_at_samples(poses, coupled).max())
    ratios = [f"{a / b:.2f}" for a, b in pairwise(distances)]
    for step, distance, ratio in zip(SSP_STEPS, distances, [*ratios, ""], strict=True):
        rows.append(f"| {1e3 * step:g} | {1e6 * distance:.2f} | {ratio} |\n")
    return "".join(rows)


def _replace_table(page: Path, table: str) -> None:
    marked = re.compile(r"(?<=<!-- table -->\n).*(?=<!-- end of table -->)", re.DOTALL)
    text = page.read_text(encoding="utf-8")
    page.write_text(marked.sub(lambda _: table, text), encoding="utf-8")


if __name__ == "__main__":
    _replace_table(PAGE, import_table())
    _replace_table(SSP_PAGE, ssp_table())
