"""First screen of an identification from deflections: a file that is no better is not called good."""

import pytest

from coupling.report.identify_answers import deflection_answer, response_answer
from coupling.results.identified_result import (
    IdentifiedResult,
    LogErrorResult,
    PostureResponseResult,
    ResponseFitResult,
    RmsResult,
)
from coupling.results.modes_result import ResponseResult


def _result(start: float | None, left_out: float | None, refusal: str = "") -> IdentifiedResult:
    rms = RmsResult(measured=1e-3, start=start, fit=1e-4, left_out=left_out, written=1e-4)
    return IdentifiedResult.model_construct(rms_m=rms, refusal=refusal, parameters=())


@pytest.mark.parametrize(
    ("start", "left_out", "refusal", "good"),
    [
        (5e-4, 2e-4, "", True),
        (2e-4, 2.1e-4, "", None),
        (None, 2e-4, "", True),
        (5e-4, None, "", True),
        (5e-4, 2e-4, "two rows are alike", False),
        (2e-4, 5e-4, "two rows are alike", False),
    ],
)
def test_a_robot_file_is_good_only_where_it_predicts_better_than_the_start(
    start, left_out, refusal, good
):
    answer = deflection_answer(_result(start, left_out, refusal), "new.toml")
    assert answer.good is good
    is_worse = good is None
    assert answer.sentence.startswith("NO BETTER THAN THE START FILE") is is_worse
    assert answer.steps[0].words.startswith("Keep the start file") is is_worse


def test_what_was_fitted_is_not_called_a_prediction():
    sentence = deflection_answer(_result(5e-4, None), "new.toml").sentence
    assert "that was used is met to within 0.100 mm" in sentence
    assert "predicted" not in sentence


@pytest.mark.parametrize(
    ("start", "written", "unloaded", "is_held_out", "good"),
    [
        (1.0, 0.2, (), True, True),
        (0.2, 0.2, (), True, False),
        (1.0, 0.2, (1,), True, None),
        (1.0, 0.2, (), False, None),
    ],
)
def test_responses_are_good_only_where_others_are_predicted_better_by_loaded_gears(
    start, written, unloaded, is_held_out, good
):
    error = LogErrorResult(start=start, fit=0.1, written=written)
    response = ResponseResult(
        name="xy", frequency_Hz=(1.0, 2.0), real_m_N=(1e-6, 2e-6), imag_m_N=(0.0, 1e-6)
    )
    posture = PostureResponseResult.model_construct(
        unloaded_joints=unloaded,
        held_out=is_held_out,
        measured=(response,),
        start=(response,),
        written=(response,),
    )
    result = ResponseFitResult.model_construct(
        refusal="",
        converged=True,
        error=LogErrorResult(start=1.0, fit=0.1, written=0.1),
        held_out=error if is_held_out else None,
        residual=0.1,
        noise=0.1,
        postures=(posture,),
        parameters=(),
    )
    answer = response_answer(result, "new.toml")
    assert answer.good is good
    is_worse = is_held_out and written >= start
    assert answer.sentence.startswith("NO BETTER THAN THE START FILE") is is_worse
    assert answer.steps[0].words.startswith("Keep the start file") is is_worse
    assert "force along y" in answer.picture
    assert answer.steps[is_worse].command == "elastic-robot init cell --robot new.toml"
