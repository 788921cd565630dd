"""Tilts, backlashes and losses: told where they are, not told where there is noise only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from noisy_arm import arm, exact, noisy

from coupling.errors import IdentifyError
from coupling.identification.evidence import support
from coupling.identification.intervals import left_out
from coupling.identification.static.elastic import ElasticParameters
from coupling.identification.static.fit import IdentifyOptions, fit_static
from coupling.identification.static.identification import identify
from coupling.identification.static.measurements import noise_of
from coupling.identification.static.model import StaticModel
from coupling.identification.static.suspicions import loss_suspicion


def test_f_is_t_squared_and_leave_one_out_is_that_of_both_models():
    robot = arm(tilt=True)
    rows = noisy(exact(robot, 14, seed=1), np.random.default_rng(0), 2e-5)
    fit = fit_static(ElasticParameters.of(robot, "backlash"), rows, IdentifyOptions(noise_of(rows)))
    number = fit.elasticity.names.index("joint[3].tilt[1].stiffness")
    found = support(fit.experiment.linear, np.arange(4) == number, fit.experiment.weight, tests=1)
    columns = fit.experiment.linear.columns.reshape(-1, 4)
    rest = fit.experiment.linear.residual(fit.experiment.linear.solve())
    variance = np.sum(rest**2) / (rest.size - 4) * np.linalg.inv(columns.T @ columns)
    t = fit.x[number] / np.sqrt(variance[number, number])
    np.testing.assert_allclose(found.F, t**2, rtol=1e-6)
    problems = fit.experiment.linear.only(np.arange(4) != number), fit.experiment.linear
    without, within = (
        np.sum(left_out(problem, fit.experiment.weight) ** 2) for problem in problems
    )
    assert found.left_out_change == pytest.approx(np.sqrt(within / without) - 1.0)
    assert found.supported


@pytest.mark.parametrize("seed", range(2))
def test_a_tilt_that_is_there_is_added_and_one_that_is_not_is_not(seed):
    rng, axial = np.random.default_rng(seed), arm()
    for true, added in ((arm(tilt=True), ("joint[3].tilt[1].stiffness",)), (axial, ())):
        rows = noisy(exact(true, 16, seed=seed + 10), rng, 1e-5)
        found = identify(axial, rows, IdentifyOptions(noise_of(rows), add=("supported",)))
        assert tuple(p.name for p in found.result.parameters if p.added) == added
        if added:
            (own,) = [p for p in found.result.parameters if p.name in added]
            assert own.identified
            assert own.low < 8e5 < own.high


def test_a_tilt_of_the_start_file_without_support_keeps_its_value():
    rows = noisy(exact(arm(), 16, seed=4), np.random.default_rng(3), 1e-5)
    start = arm(tilt=True)
    found = identify(start, rows, IdentifyOptions(noise_of(rows)))
    (own,) = [p for p in found.result.parameters if "tilt" in p.name]
    assert not own.identified
    assert found.robot.joints[2].tilt[0].stiffness == pytest.approx(
        start.joints[2].tilt[0].stiffness, rel=1e-12
    )


def test_backlash_that_loads_reverse_is_found_by_name():
    """Joint 1 of an upright arm hangs amid its backlash, and every load takes it to a flank."""
    loose = replace(arm().joints[0], backlash=2e-4)
    true = replace(arm(), joints=(loose, *arm().joints[1:]))
    rows = noisy(exact(true, 16, seed=5), np.random.default_rng(1), 1e-5)
    found = identify(arm(), rows, IdentifyOptions(noise_of(rows), add=("joint[1].backlash",)))
    (own,) = [p for p in found.result.parameters if p.kind == "backlash"]
    assert own.identified
    assert own.low < 2e-4 < own.high < 3e-4
    with pytest.raises(IdentifyError, match=r"did you mean 'joint\[1\]\.backlash'"):
        identify(arm(), rows, IdentifyOptions(noise_of(rows), add=("joint[1].backlsh",)))


@pytest.mark.parametrize(("part", "words"), [(-5e-5, "friction"), (0.0, ""), (5e-5, "backlash")])
def test_a_constant_part_of_every_deflection_is_suspected(part, words):
    rows, rng = exact(arm(), 24, seed=6), np.random.default_rng(2)
    rows = replace(rows, wrench=rows.wrench * rng.uniform(0.1, 1.0, (24, 1)))
    elasticity = ElasticParameters.of(arm(), "linear")
    right = StaticModel(elasticity, rows, "linear").predict(elasticity.start).deflection
    way = right / np.linalg.norm(right, axis=1, keepdims=True)
    rows = noisy(replace(rows, deflection=right + part * way), rng, 5e-6)
    found = identify(arm(), rows, IdentifyOptions(noise_of(rows), "linear"))
    assert found.result.common_loss is not None
    assert abs(-found.result.common_loss.value_m - part) < found.result.common_loss.half_m
    said = loss_suspicion(found.result.common_loss)
    assert (words in said) if words else said == ""


@pytest.mark.parametrize("which", ["measured point", "load point"])
def test_a_point_that_was_elsewhere_is_suspected_where_it_was(which):
    """Made with one point 5 mm off, read as at the TCP; a right table raises no suspicion."""
    rng, shift = np.random.default_rng(4), np.array([0.003, -0.004, 0.001])
    rows = exact(arm(), 20, seed=8)
    place = {which.replace(" ", "_"): np.tile(shift, (20, 1))}
    elasticity = ElasticParameters.of(arm(), "linear")
    off = StaticModel(elasticity, replace(rows, **place), "linear").predict(elasticity.start)
    spoiled = noisy(replace(rows, deflection=off.deflection), rng, 1e-7)
    found = identify(arm(), spoiled, IdentifyOptions(noise_of(spoiled), "linear"))
    (words,) = [words for words in found.result.warnings if f"the {which} seems to be" in words]
    place = [float(number) for number in words.partition("[")[2].partition("]")[0].split(",")]
    np.testing.assert_allclose(place, shift, atol=5e-4)
    right = noisy(rows, rng, 5e-6)
    found = identify(arm(), right, IdentifyOptions(noise_of(right), "linear"))
    assert not any("seems to be" in words for words in found.result.warnings)
