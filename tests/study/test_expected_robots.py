"""A study without parameters of its own draws the robots that a run expects, by the same rule."""

import numpy as np
import pytest
from line_case import line_case

from coupling.events import unwatched
from coupling.run.execute import run_compensation
from coupling.run.expected_robots import DRAWN_ROBOTS
from coupling.run.figures import outlook_of
from coupling.run.folder import write_run
from coupling.run.stored_run import read_run
from coupling.study.conduct import changed_table, open_study, simulate_samples
from coupling.study.findings import read_study, write_findings
from coupling.study.robot_pool import Workers

pytestmark = pytest.mark.usefixtures("drawn_robots")


def test_a_study_goes_on_with_the_robots_of_its_run_and_gives_one_figure(tmp_path):
    """The first 16 samples are the run's 16 robots; what is expected is that of all of them."""
    case = line_case(tmp_path, "native")
    run = run_compensation(case)
    folder, place = tmp_path / "run", tmp_path / "study"
    folder.mkdir(), place.mkdir()
    write_run(folder, case, run)
    table = changed_table(case.study, samples=24)
    study = open_study(place, case, table, folder, couple=False)
    samples = simulate_samples(study, Workers(1), unwatched)
    by_run = [replay.deviation.maximum for replay in run.finding_of(DRAWN_ROBOTS).completed]
    by_study = [sample.deviation.maximum for sample in samples]
    assert len(by_run) == 16
    assert by_study[:16] == pytest.approx(by_run, rel=1e-9)
    write_findings(study, samples)
    figures = read_study(place).figures
    assert not figures.chosen
    single = outlook_of(run).deviation
    drawn = float(np.quantile(by_study, 0.95, method="weibull"))
    assert figures.expected.maximum == pytest.approx(max(single, drawn), rel=1e-12)
    stated = read_run(folder).figures.expected_deviation()
    assert figures.expected.is_whole == stated.is_whole
    assert figures.expected.maximum == pytest.approx(stated.maximum, rel=0.1)
