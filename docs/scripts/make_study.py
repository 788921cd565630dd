"""Write the figures and the picture of docs/study.md: make study.

The example cone, 200 sampled robots and as many fresh ones; with names, only those parts:
python docs/scripts/make_study.py cone coverage.
"""

from __future__ import annotations

import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import plotly.graph_objects as go

from coupling.case.file import load_case
from coupling.events import unwatched
from coupling.report import study_report
from coupling.results.study_result import StudySample
from coupling.run.execute import run_compensation
from coupling.run.folder import write_run
from coupling.study.conduct import changed_table, open_study, simulate_samples
from coupling.study.findings import StoredStudy, read_study, write_findings
from coupling.study.folder import RUN
from coupling.study.robot_pool import Workers
from docs.scripts.experiment import Page, um
from docs.scripts.page import table
from docs.scripts.pictures import save
from docs.scripts.runs import CASES

CASE = CASES / "cone.toml"
PAGE = Page("study")
SEED, FRESH = 1, 2


@cache
def _studied() -> tuple[StoredStudy, list[StudySample]]:
    """Return the study of the cone, and fresh samples of another seed."""
    case = load_case(CASE)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        run = folder / RUN
        run.mkdir()
        write_run(run, case, run_compensation(case))
        found = {}
        for seed in (SEED, FRESH):
            place = folder / str(seed)
            place.mkdir()
            study = open_study(place, case, changed_table(case.study, seed=seed), run, couple=False)
            found[seed] = simulate_samples(study, Workers(), unwatched)
            write_findings(study, found[seed])
        return read_study(folder / str(SEED)), found[FRESH]


@PAGE.part
def cone() -> str:
    """Return what the command of the cone leaves, and which parameters are significant."""
    study, _ = _studied()
    figures = study.figures
    found, model = figures.quantiles_m, figures.command.deviation_m
    shares = ("0.05", "0.5", "0.9", "0.95")
    quantiles = table(
        ("cone, 200 robots [um]", "model", *(f"{100 * float(s):g} % below" for s in shares)),
        [
            (words, um(getattr(model, name), 3), *(um(found[name][share], 3) for share in shares))
            for name, words in (("maximum", "max"), ("rms", "rms"))
        ],
    )
    significance = table(
        ("parameter", "distribution", "share of max", "share of rms", "rank correlation, max"),
        [
            (
                f"`{entry.name}`",
                entry.distribution,
                *(f"{100 * found.share:.0f} %" for found in influence.values()),
                f"{influence['maximum'].rank_correlation:+.2f}",
            )
            for entry, influence in figures.ordered
        ],
    )
    ((first, _), *_) = figures.ordered
    save("study_cone", *_pictures(study))
    text = (
        "Usual values of what the robot file leaves out move all robots; of their scatter"
        f" `{first.name}` decides most."
    )
    return f"{quantiles}\n\n{significance}\n\n{text}"


def _pictures(study: StoredStudy) -> tuple[go.Figure, go.Figure]:
    """Return band and dots with a legend, which the report that they are made for has outside them."""
    band, dots = study_report.bands(study), study_report.scatter(study, 1)
    legend = {"y": 1.02, "yanchor": "bottom", "x": 0.0, "traceorder": "reversed"}
    band.update_layout(width=640, height=440, showlegend=True, legend=legend)
    dots.update_layout(width=460, height=440)
    return band.update_layout(margin_t=100), dots.update_layout(margin_t=100)


@PAGE.part
def coverage() -> str:
    """Return how many fresh robots the band holds."""
    study, fresh = _studied()
    distance = np.array([sample.distance for sample in fresh])
    low, high, line = (study.band[name] for name in ("low", "high", "everywhere"))
    inside = np.mean((distance >= low) & (distance <= high))
    below = np.mean(np.all(distance <= line, axis=1))
    return (
        f"Of {len(fresh)} fresh robots of another seed the band of 90 % for the cone holds"
        f" {100 * inside:.1f} % in the mean over the path; {100 * below:.1f} % stay below the line"
        " everywhere."
    )


if __name__ == "__main__":
    PAGE.write()
