"""The correction as a run reports it: what the method says, and what only the whole run knows.

A method knows its own iterations. That the process answers one path differently, or that a motor which
is not simulated lacks torque, is found behind it.
"""

from __future__ import annotations

from dataclasses import replace

from coupling.path.deviation import measure
from coupling.path.length_text import format_um
from coupling.run.check import CheckedCommand
from coupling.run.cut_check import CUT_STABILITY
from coupling.run.repeated_evaluation import WITHOUT_END, RepeatedAnswers
from coupling.run.simulated_motor_torques import MOTOR_TORQUES, motor_warnings
from coupling.solve.correction import Correction
from coupling.solve.outcome import Outcome
from elastic_robot.fmi.interface import IDEAL


def final_correction(command: CheckedCommand, answers: RepeatedAnswers) -> Correction:
    """Return the correction of a command with the outcome, reason and evaluations of the whole run."""
    correction = command.correction
    if chattering := _chattering(command):
        return replace(correction, outcome=Outcome.CHATTERS, reason=chattering)
    return replace(
        correction,
        evaluations=correction.evaluations + answers.evaluations,
        outcome=Outcome.ROBOT_FAILED
        if (lacking := _lacking_torque(command))
        else correction.outcome,
        reason=lacking or _reason(command, answers),
    )


def _chattering(command: CheckedCommand) -> str:
    """Return that the cut chatters, and what would not, empty where it does not.

    Then it is the cut that is at fault, whatever the iteration has come to.
    """
    stability = command.finding_of(CUT_STABILITY).stability
    if stability is None or stability.stable:
        return ""
    return (
        f"{stability.sentence[:1].lower()}{stability.sentence[1:]}; stable would be"
        f" {stability.alternative}; the iteration: {command.correction.reason}"
    )


def _lacking_torque(command: CheckedCommand) -> str:
    """Return which motor of a converged command lacks torque, empty where none does.

    What a limit costs that is in the simulation its deviation tells.
    """
    case = command.case
    if command.kind == "couple" or not command.correction.converged:
        return ""
    unlimited = [
        motors if case.mode == "quasistatic" or placed.drive == IDEAL else None
        for placed, motors in zip(case.robots, command.finding_of(MOTOR_TORQUES), strict=True)
    ]
    warnings = motor_warnings(case.robots, unlimited)
    return (
        f"the command exceeds a motor's torque: {warnings[0]}: slow down the path"
        if warnings
        else ""
    )


def _reason(command: CheckedCommand, answers: RepeatedAnswers) -> str:
    """Return why the method ended, with what the process answers differently where that counts."""
    correction, repeated = command.correction, answers.repeatability
    if repeated is None or repeated.identical or correction.outcome not in WITHOUT_END:
        return correction.reason
    if not repeated.disturbs:
        return f"{correction.reason}; and {repeated.sentence()}"
    if command.kind == "couple":
        remainder, what = correction.consistency, "the path still changes by up to"
    else:
        remainder = measure(correction.achieved, correction.desired).maximum
        what = "the deviation is up to"
    return f"{repeated.sentence()}; {what} {format_um(remainder)} um"
