"""What a first screen says, for claims about its words."""

import re

from coupling.cli.console import console
from coupling.report.result_report import ResultReport
from coupling.report.terminal import print_report
from coupling.results.section import Answer

# What a visitor would have to look up.
GLOSSARY = re.compile(
    r"inverse|converge|\brms\b|quasi-static|robin|spline|wind-up|urad|TCP|FMU|exposure|Sobol|quantile|factor",
    re.I,
)


def words_of(answer: Answer) -> str:
    """Return all that a first screen says in words."""
    words = [answer.sentence, answer.reason, *(step.words for step in answer.steps)]
    words += [f"{figure.label} {figure.value} {figure.note}" for figure in answer.figures]
    return " ".join(words)


def printed(answer: Answer) -> list[str]:
    """Return the lines that the terminal shows of it."""
    with console.capture() as capture:
        print_report(console, ResultReport("", "", answer, list), False)
    return capture.get().splitlines()
