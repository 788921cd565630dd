"""Write the tables of docs/import.md and docs/ssp.md from real runs: make masters-table."""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from coupling.case.file import load_case
from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.ssp import INTERFACES, SspSystem
from coupling.run.execute import coupled_path
from docs.scripts.masters import (
    MASTERS,
    VERSIONS,
    Master,
    MasterError,
    differences,
    prepare,
    run,
    run_reference,
)
from docs.scripts.page import finish, replace, table

EXAMPLES = Path(__file__).parents[2] / "examples"
COST_STEPS = (0.01, 0.005, 0.002, 0.001)


def import_table() -> str:
    """Return the table's rows as measured here; masters that are not installed are left out."""
    masters = [master for master in MASTERS if master.version is not None]
    for master in set(MASTERS) - set(masters):
        print(f"{master.name}: not installed (make masters)", file=sys.stderr)
    with tempfile.TemporaryDirectory() as name:
        columns = [_column(version, masters, Path(name, version)) for version in VERSIONS]
    about = [
        (m.name.replace("-", " "), m.version, m.interface, m.driven_by, *cells, m.how)
        for m, *cells in zip(masters, *columns, strict=True)
    ]
    names = (f"FMI {version} (m)" for version in VERSIONS)
    return table(("master", "version", "runs", "driven by", *names, "how to run"), about)


def _column(version: str, masters: Sequence[Master], folder: Path) -> list[str]:
    """Return what masters make of an FMU: the difference from its own path along `trajectory`."""
    robot = load_robot(shipped_robots()["icme2008"])
    reference = folder / "reference"
    for place, fmi in ((folder, version), (reference, "2")):
        place.mkdir()
        options = BuildOptions(fmi=fmi)
        prepare(place, build_fmu(robot, place / "Built.fmu", options))
    expected = run_reference(False, reference)
    return [_cell(version, master, folder, expected) for master in masters]


def _cell(version: str, master: Master, folder: Path, expected: np.ndarray) -> str:
    try:
        position, _ = differences(run(master, folder), expected)
    except MasterError as error:
        print(f"{master.name}, FMI {version}: {error}", file=sys.stderr)
        return "no"
    return f"{position:.1g}"


def cost_table() -> str:
    """Return what steps of the cone's system cost, as `elastic-robot ssp` says it of two of them."""
    case = load_case(EXAMPLES / "cases" / "cone.toml")
    coupled = coupled_path(case)
    assert coupled is not None
    kinds = [SspSystem.of(case, interface).errors(coupled, COST_STEPS) for interface in INTERFACES]
    return table(
        ("step (ms)", *(f"{kind}: largest, rms (um)" for kind in INTERFACES)),
        (
            (f"{1e3 * step:g}", *(f"{1e6 * e.largest:.2g}, {1e6 * e.rms:.2g}" for e in errors))
            for step, *errors in zip(COST_STEPS, *kinds, strict=True)
        ),
    )


def write() -> None:
    """Write the tables."""
    replace("import", "table", import_table())
    replace("ssp", "cost", cost_table())


if __name__ == "__main__":
    sys.exit(finish(write))
