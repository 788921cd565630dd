"""The command line: elastic-robot identify, from frequency responses and hammer tests."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np

from coupling.cli.arguments import posture_of
from coupling.cli.fitted import fitted_target, write_fitted
from coupling.errors import IdentifyError
from coupling.files.robot_file import find_robot, load_robot
from coupling.identification.response.identification import identify_from_responses
from coupling.identification.response.posture import read_posture
from coupling.report.identify_answers import response_answer
from coupling.report.response_report import response_sections, response_warnings
from coupling.report.result_report import ResultReport
from coupling.results.section import warned


def identify_responses(
    robot: str,
    files: Sequence[Path],
    hold_out: Sequence[Path],
    postures_deg: Sequence[str],
    torque_curve: str,
    output: Path | None,
    is_verbose: bool,
) -> None:
    """Identify stiffness and damping from frequency responses.

    Args:
        postures_deg: Joint angles [deg] of each file, first those to fit, then those to predict.
        output: Robot file to write; None for one in the folder results.
    """
    if torque_curve not in ("linear", "backlash"):
        raise IdentifyError(
            f"--torque-curve: expected linear or backlash beside responses, got {torque_curve}"
        )
    count = len(files) + len(hold_out)
    if len(postures_deg) != count:
        raise IdentifyError(
            f"--posture-deg: expected it once for each of {count} files of responses, those held out"
            f" last, got it {len(postures_deg)} times"
        )
    start = find_robot(robot)
    described = load_robot(start)
    joints = len(described.joints)
    angles = [np.deg2rad(posture_of(text, IdentifyError, joints)) for text in postures_deg]
    target = fitted_target(output, f"{files[0].stem}_identified")
    measured = [
        read_posture(file, q, number >= len(files))
        for number, (file, q) in enumerate(zip([*files, *hold_out], angles, strict=True))
    ]
    identified = identify_from_responses(described, torque_curve, measured)
    result = identified.result
    names = ", ".join(file.name for file in files)
    report = ResultReport(
        "identify",
        f"{names}: {described.name}",
        response_answer(result, shlex.quote(str(target))),
        partial(response_sections, result),
        warned(response_warnings(result)),
    )

    def text() -> str:
        source = f"frequency responses in {len(files)} postures: {names}"
        return identified.text(start, source, target)

    write_fitted(target, report, result, text, is_verbose)
