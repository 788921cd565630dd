"""Whether a response is one to its path: an author's mistake is an error that names the process."""

from __future__ import annotations

from numbers import Real

import numpy as np

from coupling.errors import ProcessError
from coupling.path.histories import ToolPath
from coupling.process.authors_code import authors_code
from coupling.process.base import Process, ProcessResponse, own_blocks

# Rounding of a stiffness, over its largest entry.
_ROUNDING = 1e-9


def evaluate_validated(process: Process, path: ToolPath, name: str) -> ProcessResponse:
    """Return a process's answer to a path.

    Args:
        process: The process, most likely the user's own.
        name: Its name, as the case file has it.

    Raises:
        ProcessError: If it has no answer, fails, or gives what is no answer to the path.
    """
    with authors_code(lambda what: ProcessError(f"the process {name} failed: {what}")):
        response = process.evaluate(path)
    problem = _problem(response, path)
    if problem:
        raise ProcessError(f"the process {name} gave an invalid result: {problem}")
    return response


def _problem(response: object, path: ToolPath) -> str:
    """Return what is wrong with an answer to a path, empty if nothing is."""
    if not isinstance(response, ProcessResponse):
        return f"expected a ProcessResponse, got {type(response).__name__}"
    problem = find_misfit(response, path)
    if problem:
        return problem
    if response.wrench.spring is not None:
        return "wrench: expected no spring, which the coupling adds: state the stiffness instead"
    if response.stiffness is None:
        return ""
    size = float(np.abs(response.stiffness).max())
    tool_blocks = own_blocks(response.stiffness)
    skew = np.abs(tool_blocks - tool_blocks.swapaxes(-1, -2)).max()
    lowest = float(np.linalg.eigvalsh(tool_blocks).min())
    if skew > _ROUNDING * size or lowest < -_ROUNDING * size:
        return (
            "stiffness: expected symmetric matrices without negative eigenvalues for what a tool feels"
            " of its own displacement, got ones that differ from their transposes by up to"
            f" {skew:.3g} N/m, with an eigenvalue of {lowest:.3g} N/m"
        )
    return ""


def find_misfit(response: ProcessResponse, path: ToolPath) -> str:
    """Return what in an answer does not fit its path, empty if nothing: sizes, times, period."""
    expected = (*path.pose.shape[:2], 6)
    if response.wrench.before.shape != expected:
        return (
            f"wrench: expected shape {expected}, (tools, samples, 6) of the path, got"
            f" {response.wrench.before.shape}"
        )
    if not np.array_equal(response.wrench.instants, path.time):
        return (
            "wrench: expected the times of the path, one that is a jump twice, got times of its own"
        )
    period = response.period
    if period is not None and not (isinstance(period, Real) and 0.0 < period < np.inf):
        return f"period: expected a time > 0 [s], or None, got {period!r}"
    if response.stiffness is None:
        return ""
    tools, samples = path.pose.shape[:2]
    whole = (samples, 3 * tools, 3 * tools)
    shape = np.shape(response.stiffness)
    if shape != whole:
        return f"stiffness: expected shape {whole}, (samples, 3 tools, 3 tools), got {shape}"
    if not np.all(np.isfinite(response.stiffness)):
        return "stiffness: expected finite values, got one that is not finite"
    return ""
