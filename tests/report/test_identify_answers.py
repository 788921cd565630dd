"""First screen of an identification from deflections: a file that is no better is not called good."""

from __future__ import annotations

import pytest

from coupling.report.identify_answers import deflection_answer
from coupling.results.identified_result import IdentifiedResult, RmsResult


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
    assert ("keep it" in answer.reason) == (good is None)


def test_what_was_fitted_is_not_called_a_prediction():
    sentence = deflection_answer(_result(5e-4, None), "new.toml").sentence
    assert "that was used is met to within 0.100 mm" in sentence
    assert "predicted" not in sentence
