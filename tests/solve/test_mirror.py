"""Mirroring: filters, convergence of the quasi-static robot, divergence of the dynamic one."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import LINE_CASE

from coupling.case.file import load_case
from coupling.path.low_pass import low_pass
from coupling.run.execute import run_compensation
from coupling.run.figures import shares_of
from coupling.solve.mirror import limit_rate
from coupling.solve.outcome import Outcome


@pytest.fixture
def slow_line(tmp_path):
    """The test case as a slow stroke, with other settings written into its text."""

    def case(mode: str, compensation: str):
        text = (LINE_CASE).read_text()
        text = text.replace('mode         = "quasistatic"', f'mode = "{mode}"')
        text = text.replace("feed_m_s = 0.1", "feed_m_s = 0.05").replace(
            "blend_s  = 0.1", "blend_s = 0.6"
        )
        text = text.replace("tolerance_m = 1e-8", "tolerance_m = 1e-6")
        text = text.replace("tolerance_m = 1e-6\n", compensation + "\n") if compensation else text
        head, tail = text.split("[compensation]")
        head = head.replace(compensation, "tolerance_m = 1e-6") if compensation else head
        file = tmp_path / f"{mode}.toml"
        file.write_text(head + "[compensation]" + tail)
        return load_case(file)

    return case


def test_gain_one_mirroring_of_the_dynamic_robot_is_recognised_as_diverging(slow_line):
    run = run_compensation(slow_line("dynamic", "tolerance_m = 5e-5"))
    found = run.correction
    assert found.outcome is Outcome.DIVERGED
    assert 'mode = "quasistatic"' in found.reason
    assert "cutoff_Hz" in found.reason
    # It ends early and gives back the best command it had.
    sizes = [entry.deviation.maximum for entry in found.iterations]
    assert len(sizes) <= 4
    assert run.deviation(run.correction.achieved).maximum == pytest.approx(min(sizes), rel=1e-3)


def test_band_limited_mirroring_of_the_dynamic_robot_converges(slow_line):
    run = run_compensation(slow_line("dynamic", "tolerance_m = 5e-5\ncutoff_Hz = 3.0"))
    assert run.correction.converged, run.correction.reason
    assert run.deviation(run.before).maximum > 1e-3
    assert run.deviation(run.correction.achieved).maximum <= 5e-5


def test_quasistatic_mirroring_contracts_and_serves_the_dynamic_robot(slow_line):
    run = run_compensation(slow_line("quasistatic", ""))
    assert run.correction.converged, run.correction.reason
    sizes = [entry.deviation.maximum for entry in run.correction.iterations]
    assert all(later < 0.2 * earlier for earlier, later in itertools.pairwise(sizes))
    dynamic = shares_of(run).dynamic_after
    assert run.deviation(run.correction.achieved).maximum <= 1e-6
    assert dynamic is not None
    assert dynamic.maximum < 0.1 * run.deviation(run.before).maximum


def test_low_pass_keeps_the_slow_and_drops_the_fast():
    time = np.arange(0.0, 20.0, 0.01)
    slow, fast = np.sin(2 * np.pi * 0.2 * time), np.sin(2 * np.pi * 20.0 * time)
    filtered = low_pass(time, np.column_stack([slow + fast, slow]), 3.0)
    middle = slice(200, -200)
    # Butterworth of order 2, twice: gain 1/(1 + (f/fc)^4) = 1 - 2e-5 and 5e-4.
    np.testing.assert_allclose(filtered[middle, 0], slow[middle], atol=1e-3)
    np.testing.assert_allclose(filtered[middle, 1], slow[middle], atol=1e-4)


def test_low_pass_of_uneven_times_is_that_of_even_ones():
    """Steps of 10 ms and of 3.3 ms in turn; straight pieces leave 1/8 (w h)^2 of a sine, 2e-4."""
    time = np.cumsum(np.tile([0.01, 0.01 / 3.0], 1500))
    slow, fast = np.sin(2 * np.pi * 0.6 * time), np.sin(2 * np.pi * 20.0 * time)
    filtered = low_pass(time, (slow + fast)[:, None], 3.0)
    middle = slice(300, -300)
    gain = 1.0 / (1.0 + 0.2**4)
    np.testing.assert_allclose(filtered[middle, 0], gain * slow[middle], atol=2e-3)


@given(st.integers(0, 10**6))
def test_rate_limit_holds_and_leaves_slow_corrections_alone(seed):
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.01, 0.05, 40))
    correction = rng.normal(size=(40, 6)) * 1e-3
    limited = limit_rate(time, correction, 0.02)
    rates = np.abs(np.diff(limited, axis=0)) / np.diff(time)[:, None]
    assert rates.max() <= 0.02 * (1 + 1e-9)
    assert np.array_equal(limit_rate(time, limited, 0.02 * (1 + 1e-6)), limited)
    assert limited.min() >= correction.min()
    assert limited.max() <= correction.max()
