"""The table of estimated parameters: start, fit, 95 % interval, what is written."""

from __future__ import annotations

from collections.abc import Sequence

from coupling.results.parameter_result import ParameterResult
from coupling.results.section import Table


def parameter_table(
    parameters: Sequence[ParameterResult], remarks: Sequence[str] | None = None
) -> Table:
    """Return a row for each parameter.

    Args:
        remarks: Sentences on those that are identified; None for none.
    """
    columns = ("parameter", "start", "fit", "95 % from", "to", "written", "unit", "")
    remarks = [""] * len(parameters) if remarks is None else remarks
    return Table(columns, [_row(*pair) for pair in zip(parameters, remarks, strict=True)])


def _row(parameter: ParameterResult, remark: str) -> tuple[str, ...]:
    fit = (parameter.value, parameter.low, parameter.high)
    is_fitted = any(number is not None for number in fit)
    return (
        parameter.name,
        "none" if parameter.start is None else in_digits(parameter.start),
        *(in_digits(number) if is_fitted else "" for number in fit),
        _written_value(parameter),
        parameter.unit,
        remark if parameter.identified else f"not identified: {parameter.reason}",
    )


def _written_value(parameter: ParameterResult) -> str:
    if not parameter.identified and parameter.written in (None, parameter.start):
        return "left out" if parameter.start is None else "kept"
    return "" if parameter.written is None else in_digits(parameter.written)


def in_digits(value: float | None) -> str:
    """Return a number in four digits; None is infinite."""
    return "\u221e" if value is None else f"{value:.4g}"
