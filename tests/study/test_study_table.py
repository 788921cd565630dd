"""[study]: which parameters are uncertain and by how much, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from line_case import moving_line
from places import LINE_CASE
from studies import moving

from coupling.case.file import load_case
from coupling.case.plant import Distribution, StudyTable
from coupling.errors import CaseError
from coupling.files.robot_file import find_robot, load_robot
from coupling.run.uncertain_parameters import UncertainParameter, UncertainParameters
from coupling.study.conduct import changed_table

# What is wrong with [study], and what the one message must contain.
BAD_STUDIES = {
    "unknown key": ("stiffnes_factor = [0.9, 1.1]", "did you mean 'stiffness_factor'"),
    "negative": ("damping_factor = [-0.1, 1.1]", "damping_factor: expected values >= 0, got -0.1"),
    "no stiffness": ("stiffness_factor = [0.0, 1.1]", "stiffness_factor: expected values > 0"),
    "upside down": (
        "force_factor = [1.1, 0.9]",
        "expected [low, high], low < high, got [1.1, 0.9]",
    ),
    "wide": ("backlash_factor = { mean = 1.0, deviation = 0.5 }", "expected values >= 0, got -0.5"),
    "half": ("backlash_factor = { mean = 1.0 }", "or { mean = .., deviation = .. }, got neither"),
    "both": ("force_factor = { low = 0.9, high = 1.1, mean = 1.0 }", "got neither"),
    "words": ('force_factor = "much"', "force_factor: expected [low, high] or"),
    "not finite": ("force_factor = [0.9, inf]", "force_factor: high: expected a finite number"),
    "no samples": ("samples = 0", "samples: expected a number greater than or equal to 1, got 0"),
    "few samples": ("samples = 5", "expected at least 19 for a band that holds 90 %"),
    "design": ('design = "grid"', "design: expected 'sobol' or 'latin-hypercube', got 'grid'"),
}


@pytest.mark.parametrize("name", BAD_STUDIES)
def test_a_bad_study_is_one_message(tmp_path, name):
    table, words = BAD_STUDIES[name]
    with pytest.raises(CaseError) as refused:
        changed_table(load_case(moving(tmp_path, f"[study]\n{table}\n")).study)
    assert words in str(refused.value)
    assert "study: " in str(refused.value)


def test_what_means_nothing_is_left_out():
    """A linear robot has no backlash to be uncertain of, a free one no force."""
    factors = {f"{name}_factor": [0.9, 1.1] for name in ("stiffness", "backlash", "force")}
    case = replace(load_case(LINE_CASE), study=StudyTable.model_validate(factors))
    assert UncertainParameters.chosen(case, loaded=False).names == ("stiffness_factor",)
    assert UncertainParameters.chosen(case, loaded=False).silent == (
        "backlash_factor",
        "force_factor",
    )
    assert UncertainParameters.chosen(case, loaded=True).names[-1] == "force_factor"


def test_slip_torques_are_uncertain_where_gears_have_elements(tmp_path):
    """All alike or each by itself; without elements it is left out."""
    gear = "gear.hysteresis = [{ slip_torque = 40.0, slip_angle = 2e-5 }]\n"
    text = find_robot("icme2008").read_text().replace("backlash  =", f"{gear}backlash  =", 2)
    (tmp_path / "robot.toml").write_text(text)
    slipping = ('"icme2008"', '"robot.toml"')

    def parameters(more: str, *changes: tuple[str, str]) -> UncertainParameters:
        (tmp_path / "case.toml").write_text(f"{moving_line(*changes)}\n[study]\n{more}\n")
        return UncertainParameters.chosen(load_case(tmp_path / "case.toml"), loaded=False)

    alike = parameters("hysteresis_factor = [0.5, 1.5]", slipping)
    assert alike.names == ("hysteresis_factor",)
    assert alike.entries[-1].range == pytest.approx((0.5, 1.5))
    (changed,) = alike.sampled([0.9]).differences
    robot = load_robot(tmp_path / "robot.toml")
    assert changed.values(robot, "backlash") == {
        f"joint[{i}].hysteresis": pytest.approx(36.0, rel=1e-15) for i in (1, 2)
    }
    each = parameters("hysteresis_factor = [0.5, 1.5]\njoints = 'each'", slipping)
    assert each.names == ("hysteresis_factor[1]", "hysteresis_factor[2]")
    (changed,) = each.sampled([1.0, 0.5]).differences
    assert changed.values(robot, "linear") == {"joint[2].hysteresis": 20.0}
    assert parameters("hysteresis_factor = [0.5, 1.5]").silent == ("hysteresis_factor",)


def test_normal_parameters_have_their_moments():
    """Mean and deviation of a normal distribution that is cut off at three of it: 0.9733 of it."""
    parameter = UncertainParameter("force_factor", Distribution(mean=1.0, deviation=0.1))
    values = parameter.at((np.arange(20_000) + 0.5) / 20_000)
    assert values.mean() == pytest.approx(1.0, abs=1e-6)
    assert values.std() == pytest.approx(0.1 * np.sqrt(0.97334), rel=1e-4)
    assert parameter.range == pytest.approx((0.7, 1.3))
