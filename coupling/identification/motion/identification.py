"""Identification from motion as a whole: fit, judge, predict what was held out, leave terms out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError
from coupling.identification.motion.fit import (
    MotionFit,
    fitted,
    identifiable,
    likeliest,
    narrow,
    rms,
    sized,
    unlikely,
)
from coupling.identification.motion.moved_robot import MovedRobot
from coupling.identification.motion.parameters import MotionParameter, motion_parameters
from coupling.identification.motion.problem import (
    MotionProblem,
    MovedRecording,
    Predicted,
)
from coupling.identification.motion.recording import Recording, smooth
from coupling.identification.motion.sensors import (
    SensorParameter,
    encoder_lines,
    sensor_parameters,
    torque_parameters,
)
from coupling.identification.motor_torques import torque_remarks
from elastic_robot.description import Robot

# Fits at most, each of what the one before identifies.
_MOST_ITERATIONS = 4
# Parts of a motor's torque from which on what is left is told, and no robot is written [1].
_HALF, _MORE_THAN_ALL = 0.5, 1.03


@dataclass(frozen=True)
class Judged:
    """How well a recording is predicted.

    Attributes:
        moved: The recording.
        held_out: Whether it was not fitted.
        predicted: Its prediction.
        left_wind_up: Measured less predicted wind-up, the recording's own offset and lines taken off
            [rad], (n, j); nan without encoder.
        wind_up: Rms of that [rad], (j,); nan without encoder.
        without_lines: The same with an offset alone for each encoder [rad], (j,).
        lag_alone: Rms of what a lag, fitted to the recordings that are fitted, leaves with a recording's
            own offset and lines, without a model [rad], (j,); nan without encoder.
        torque: Rms of what is left of the motors' torques over that of the torques [1], (j,).
        slow_torque: The same below the bandwidth of the motors' motion [1], (j,).
    """

    moved: MovedRecording
    held_out: bool
    predicted: Predicted
    left_wind_up: np.ndarray
    wind_up: np.ndarray
    without_lines: np.ndarray
    lag_alone: np.ndarray
    torque: np.ndarray
    slow_torque: np.ndarray


@dataclass(frozen=True)
class TermLeftOut:
    """What a recording that was held out says of a term: rms without it, beside that with it.

    Attributes:
        term: The term.
        joint: Index of the joint whose figures are told.
        wind_up: Rms of wind-up with and without it [rad]; nan without encoder.
        torque: Rms of torque with and without it, over the torques' rms [1].
        likelier: Logarithm of how much likelier the fitted recordings are with it, priors counted, to
            first order; nan if not known.  Below 2 they do not support it.
    """

    term: str
    joint: int
    wind_up: tuple[float, float]
    torque: tuple[float, float]
    likelier: float = np.nan


@dataclass(frozen=True)
class MotionIdentification:
    """What recordings identify of a robot.

    Attributes:
        robot: The start.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        first: The fit of all parameters.
        fit: The fit of those that are identifiable, and of what is known before.
        chosen: Mask of those identified among the first, (P,).
        judged: Recordings, those fitted first.
        terms: Worth of each term; none if not asked for.
        remarks: Sentences on joints whose torques the start hardly explains, or whose links lag and
            offset alone predict better.
    """

    robot: Robot
    bandwidth: float
    first: MotionFit
    fit: MotionFit
    chosen: np.ndarray
    judged: tuple[Judged, ...]
    terms: tuple[TermLeftOut, ...]
    remarks: tuple[str, ...]

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.chosen.any():
            return "nothing is identified"
        left = np.max([one.torque for one in self.judged if not one.held_out], axis=0)
        if np.median(left) > 1.0 or left.max() > _MORE_THAN_ALL:
            worst = int(left.argmax())
            return (
                f"of the torque of motor {worst + 1} {100.0 * left[worst]:.0f} % are left: are angles in"
                " rad, and torques and angles those of this joint at the gear's output, counted as in"
                " the robot file?"
            )
        return ""

    @property
    def slow_error(self) -> np.ndarray:
        """Likely size of slow errors, of one period a turn [rad], (j,); nan without encoder."""
        found = np.full(len(self.robot.joints), np.nan)
        for p in self.fit.problem.parameters:
            if isinstance(p, SensorParameter) and p.harmonic == 1:
                found[p.joint] = p.prior * p.size
        return found

    @property
    def identified_robot(self) -> Robot:
        """The robot as written."""
        identified = {
            p.name for p, own in zip(self.first.problem.parameters, self.chosen, strict=True) if own
        }
        written = np.array([p.name in identified for p in self.fit.problem.parameters])
        return self.fit.problem.robot_of(np.where(written, self.fit.x, self.fit.problem.start))


def identify_motion(
    robot: Robot,
    recordings: Sequence[Recording],
    held_out: Sequence[Recording],
    bandwidth: float,
    leave_out: bool,
) -> MotionIdentification:
    """Identify a robot from recordings of its motion.

    Args:
        robot: The start.
        recordings: Recordings that are fitted.
        held_out: Recordings that are predicted.
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        leave_out: Whether every term is left out in turn, which the last recording held out judges.

    Raises:
        IdentifyError: If a joint is rigid, encoders differ, or nothing is to be fitted.
        SimulationError: If the start cannot be simulated along them.
    """
    _require_elastic(robot)
    with_link = recordings[0].with_link
    for recording in (*recordings, *held_out):
        if recording.with_link != with_link:
            got, needed = (_links(own) for own in (recording.with_link, with_link))
            raise IdentifyError(
                f"{recording.name}: expected the links' angles that {recordings[0].name} has, {needed},"
                f" got {got}: take out of each what the other has not"
            )
    moved = tuple(MovedRecording.of(recording, bandwidth) for recording in recordings)
    others = tuple(MovedRecording.of(recording, bandwidth) for recording in held_out)
    parameters: tuple[MotionParameter, ...] = (
        *motion_parameters(robot, with_link),
        *sensor_parameters(with_link),
        *torque_parameters(robot),
    )
    if not parameters:
        raise IdentifyError(
            f"{robot.name}: expected drives or a payload in the robot file, or angles of links in the"
            " recording, got none: nothing of it can be identified from a motion"
        )
    unit = np.ones(len(robot.joints))
    with MovedRobot(robot) as fmu:
        problem = MotionProblem(fmu, robot, parameters, moved, unit, unit)
        remarks = [words for one in (*moved, *others) for words in _torque_remarks(problem, one)]
        first = fitted(problem)
        lines = _lines(first)
        moved = tuple(replace(one, lines=lines) for one in moved)
        others = tuple(replace(one, lines=lines) for one in others)
        first = likeliest(replace(problem, moved=moved), first.x)
        fit, stays = first, np.ones(len(parameters), dtype=bool)
        for _ in range(_MOST_ITERATIONS):
            own = identifiable(fit) & ~(_drowned(fit) & (fit.problem.prior == 0.0))
            if own.all() and fit is not first:
                break
            stays[np.flatnonzero(stays)[~own]] = False
            fit = fitted(sized(fit).only(own), fit.x[own])
        chosen = stays.copy()
        chosen[stays] = narrow(fit) & ~_drowned(fit)
        judged = [judge(fit.problem, one, fit.x, bandwidth, False) for one in moved]
        judged += [judge(fit.problem, one, fit.x, bandwidth, True) for one in others]
        terms = _terms(fit, judged[-1]) if leave_out and others else ()
    remarks += [words for one in judged for words in _worse(one)]
    return MotionIdentification(
        robot, bandwidth, first, fit, chosen, tuple(judged), terms, tuple(remarks)
    )


def _torque_remarks(problem: MotionProblem, moved: MovedRecording) -> tuple[str, ...]:
    """Return a sentence on each joint whose measured torque the start hardly explains."""
    torque = problem.predicted(moved, problem.start).torque
    joints, recording = range(torque.shape[1]), moved.recording
    return torque_remarks(
        recording.name,
        problem.robot,
        joints,
        recording.time,
        recording.torque,
        torque,
        moved.motion.qd,
        IdentifyError,
    )


def _links(joints: list[int]) -> str:
    return ", ".join(f"link[{i + 1}]" for i in joints) or "none"


def _worse(one: Judged) -> list[str]:
    """Return a sentence on each torque of which most is left, and link that lag predicts better."""
    words, name = "predicted" if one.held_out else "fitted", one.moved.recording.name
    torques = [
        f"{name}, {words}: {100.0 * one.torque[i]:.0f} % of the torque of motor {i + 1} are left: is its"
        " column another joint's, late, or in another unit, or what does the model lack there?"
        for i in np.flatnonzero(one.torque > _HALF)
    ]
    return torques + [
        f"{name}, {words}: {_urad(one.wind_up[i])} of motor less link {i + 1} are"
        f" left, more than {_urad(one.lag_alone[i])} of lag and offset without a robot: something"
        " of this joint is missing in the model."
        for i in one.moved.recording.with_link
        if one.wind_up[i] > one.lag_alone[i]
    ]


def _require_elastic(robot: Robot) -> None:
    rigid = [j for j, joint in enumerate(robot.joints, start=1) if joint.stiffness is None]
    if rigid:
        raise IdentifyError(
            f"{robot.name}: expected a stiffness of every joint, got none of joint {rigid[0]}"
        )


def _drowned(fit: MotionFit) -> np.ndarray:
    """Return which numbers of gears do less than half of what is left of wind-ups, (P,) of bool.

    What is left follows no model; a stiffness that is fitted to it has an interval that is too narrow.
    """
    problem, gear, left = fit.problem, [], []
    for moved in problem.moved:
        predicted = problem.predicted(moved, fit.x)
        gear.append(predicted.shares["gear"])
        left.append(problem.left(moved, predicted)[0])
    small = np.std(np.vstack(gear), axis=0) < 0.5 * rms(np.vstack(left))
    own = [p.of_gear for p in problem.parameters]
    return np.array(own) & small[[p.joint for p in problem.parameters]]


def _lines(fit: MotionFit) -> tuple[tuple[float, ...], ...]:
    """Return the lines of every joint's encoder."""
    problem = fit.problem
    left = [problem.left(one, problem.predicted(one, fit.x))[0] for one in problem.moved]
    found: list[tuple[float, ...]] = [()] * len(problem.robot.joints)
    for i in problem.moved[0].recording.with_link:
        angles = [one.recording.link[:, i] for one in problem.moved]
        found[i] = encoder_lines([own[:, i] for own in left], angles)
    return tuple(found)


def judge(
    problem: MotionProblem, moved: MovedRecording, x: np.ndarray, bandwidth: float, held_out: bool
) -> Judged:
    """Return how well a recording is predicted.

    Args:
        x: Values as the fit counts, parts of usual sizes [1], (P,).
        bandwidth: Bandwidth of the motors' smoothed motion [Hz].
        held_out: Whether it was not fitted.
    """
    predicted = problem.predicted(moved, x)
    wind_up, torque = problem.left(moved, predicted)
    apart = moved.recording.wind_up - predicted.wind_up
    measured = moved.recording.torque
    size = np.maximum(rms(measured), 1e-300)
    slow = smooth(torque, moved.recording.step, bandwidth)
    return Judged(
        moved,
        held_out,
        predicted,
        wind_up,
        rms(wind_up),
        np.std(apart, axis=0),
        _lag_alone(problem, moved),
        rms(torque) / size,
        rms(slow) / size,
    )


def _urad(angle: float) -> str:
    return f"{1e6 * angle:.3g} urad"


def _lag_alone(problem: MotionProblem, moved: MovedRecording) -> np.ndarray:
    """Return the rms [rad], (j,), that a lag fitted to a problem's recordings leaves of a wind-up."""
    left = np.full(moved.motion.q.shape[1], np.nan)
    for i in moved.recording.with_link:

        def parts(one: MovedRecording, i: int = i) -> tuple[np.ndarray, np.ndarray]:
            rate, wind_up = one.motion.qd[:, i], one.recording.wind_up[:, i]
            return one.without_own(rate, i), one.without_own(wind_up, i)

        rates, wind_ups = map(np.concatenate, zip(*map(parts, problem.moved), strict=True))
        lag = rates @ wind_ups / max(rates @ rates, 1e-300)
        rate, wind_up = parts(moved)
        left[i] = rms(wind_up - lag * rate)
    return left


def _terms(fit: MotionFit, judged: Judged) -> tuple[TermLeftOut, ...]:
    """Return what each term of a fit is worth, by the others' answer to first order."""
    problem, found = fit.problem, []
    least = unlikely(problem, fit.x)
    for term in dict.fromkeys(p.term for p in problem.parameters):
        own = np.array([p.term == term for p in problem.parameters])
        none = np.array([p.inward(p.none) if p.none else 0.0 for p in problem.parameters])
        x = np.where(own, none, fit.x)
        rest = fit.blocks.only(~own, x - fit.x)
        x[~own] += rest.step
        x = np.clip(x, *problem.bounds)
        without = judge(problem, judged.moved, x, 1.0, True)
        joint = next(p.joint for p in problem.parameters if p.term == term)
        found.append(
            TermLeftOut(
                term,
                joint,
                (float(judged.wind_up[joint]), float(without.wind_up[joint])),
                (float(judged.torque[joint]), float(without.torque[joint])),
                unlikely(problem, x) - least,
            )
        )
    for i, lines in enumerate(judged.moved.lines):
        if lines:
            pair = (float(judged.wind_up[i]), float(judged.without_lines[i]))
            same = (float(judged.torque[i]),) * 2
            found.append(TermLeftOut(f"lines of the encoder {i + 1}", i, pair, same))
    return tuple(found)
