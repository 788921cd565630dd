"""Runs of some robots along a wall, to be exported."""

from pathlib import Path

from coupling.case.file import load_case
from coupling.run.execute import run_compensation, run_coupling
from coupling.run.folder import write_run

# Robot, home, part.
ROBOTS = {
    "icme2008": ([0.0, 10.0, 20.0, 0.0, 60.0, 0.0], [1.6, 0.1, 0.8]),
    "abb_irb7600": ([0.0, 10.0, 20.0, 0.0, 60.0, 0.0], [1.6, 0.1, 0.9]),
    "fanuc_r2000ic": ([0.0, 10.0, -10.0, 0.0, -70.0, 0.0], [1.6, 0.1, 0.8]),
}


def ran(folder: Path, text: str, kind: str = "compensate") -> Path:
    """Return the run folder of a case."""
    work = {"compensate": run_compensation, "couple": run_coupling}[kind]
    (folder / "case.toml").write_text(text)
    (folder / "pair").mkdir()
    case = load_case(folder / "case.toml")
    run = work(case)
    assert run.correction.converged
    write_run(folder / "pair", case, run)
    return folder / "pair"
