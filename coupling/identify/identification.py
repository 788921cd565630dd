"""Identification as a whole: fit, judge every parameter, look for further ones, tell all of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from coupling.errors import IdentifyError, one_of
from coupling.identify.accuracy import Intervals, intervals, left_out
from coupling.identify.elastic import Candidate, Elasticity, candidates
from coupling.identify.fit import Fit, fitted
from coupling.identify.judge import Judged, judged
from coupling.identify.measurements import Measurements
from coupling.identify.noise import Noise
from coupling.identify.prediction import Model, candidate_columns
from coupling.identify.separable import Separability, separability
from coupling.identify.support import CommonLoss, Support, common_loss, support
from elastic_robot.description import Robot
from elastic_robot.errors import ElasticRobotError

# Sizes of a further parameter that are worth a test [rad/(N m), rad].
_SIZE = {True: 1e-9, False: 1e-6}
SUPPORTED = "supported"
# A robot that is off by more than so many times what the start file is is not written.
_WORSE = 1.2


@dataclass(frozen=True)
class Options:
    """How to identify.

    Attributes:
        torque_curve: A name of `TORQUE_CURVES`.
        noise: Standard deviations.
        loss: A name of `LOSSES`.
        add: Names of candidates to add to the robot, or `SUPPORTED` for all that are supported.
    """

    noise: Noise
    torque_curve: str = "backlash"
    loss: str = "squares"
    add: tuple[str, ...] = ()


@dataclass(frozen=True)
class Further:
    """A parameter that the robot does not have, tested beside those that it has.

    Attributes:
        candidate: Which.
        value: Its compliance [rad/(N m)] or half width [rad] beside the others.
        support: Whether the data support it.
    """

    candidate: Candidate
    value: float
    support: Support


@dataclass(frozen=True)
class Identification:
    """What measurements tell of a robot.

    Attributes:
        measured: The measurements.
        fit: The fit of all parameters.
        added: Names of parameters that the start file does not have.
        intervals: 95 % intervals of all of them.
        parameters: Verdict on each.
        written: Values of p in the robot as written: those of the start where not identified, beside
            them identified ones that fit best within their intervals, (P,).
        left_out: Errors of rows predicted by a fit of all others [m, rad], (k, r).
        rms_start, rms_written: Of the start's and the written robot's error [m]; nan where one finds
            no rest.
        separability: What postures and loads can tell.
        further: Parameters that were tested beside.
        loss: What every row lacks.
        warnings: In sentences.
    """

    measured: Measurements
    fit: Fit
    added: tuple[str, ...]
    intervals: Intervals
    parameters: tuple[Judged, ...]
    written: np.ndarray
    left_out: np.ndarray
    rms_start: float
    rms_written: float
    separability: Separability
    further: tuple[Further, ...]
    loss: CommonLoss | None
    warnings: tuple[str, ...]

    @property
    def residual(self) -> np.ndarray:
        """Measured less predicted deflections [m, rad], (k, r)."""
        return self.measured.deflection - self.fit.prediction.deflection

    @property
    def refusal(self) -> str:
        """Why no robot should be written, in words; "" where one may be."""
        if not self.fit.converged:
            return f"the fit has not converged: {self.fit.reason}"
        if not any(parameter.identified for parameter in self.parameters):
            return "nothing is identified"
        if self.rms_written > _WORSE * self.rms_start:
            return (
                f"with the values that would be kept the robot would be off by {1e3 * self.rms_written:.3g}"
                f" mm rms, the start file is by {1e3 * self.rms_start:.3g} mm"
            )
        return ""

    @property
    def robot(self) -> Robot:
        """The robot as written; an added tilt that is not identified is not in it."""
        return self.fit.elasticity.described(self.written)

    def worst(self, count: int = 5) -> list[int]:
        """Return the rows that the others predict worst, the worst first."""
        size = np.linalg.norm(self.left_out[:, :3], axis=1)
        return [int(k) for k in np.argsort(-size, kind="stable")[:count]]


def rms(errors: np.ndarray) -> float:
    """Return the root mean square over all components of positions [m], of (k, r)."""
    return float(np.sqrt(np.mean(errors[:, :3] ** 2)))


def identify(robot: Robot, measured: Measurements, options: Options) -> Identification:
    """Identify a robot's elasticity.

    Args:
        robot: The start: joints that give way, and values that are kept where the data do not tell.
        measured: The measurements.
        options: Noise, torque curve, loss, parameters to add.

    Raises:
        IdentifyError: If nothing can be identified at all, or no candidate has an added name.
    """
    if not measured.wrench.any():
        raise IdentifyError("loads: expected a force or moment in at least one row, got none")
    if not Elasticity.of(robot, options.torque_curve).names:
        raise IdentifyError(f"{robot.name}: expected an elastic joint or tilt, got a rigid robot")
    added: list[str] = []
    for name in options.add:
        if name != SUPPORTED:
            robot = _with(robot, measured, options, name)
            added.append(_own_name(robot, name))
    found = _once(robot, measured, options, tuple(added))
    while SUPPORTED in options.add:
        best = [further for further in found.further if further.support.supported]
        if not best:
            break
        chosen = min(best, key=lambda further: further.support.within)
        robot = chosen.candidate.added_to(robot, chosen.value)
        added.append(_own_name(robot, chosen.candidate.name))
        found = _once(robot, measured, options, tuple(added))
    return found


def _with(robot: Robot, measured: Measurements, options: Options, name: str) -> Robot:
    """Return the robot with a candidate, at the value that fits beside the others."""
    known = {candidate.name: candidate for candidate in candidates(robot, options.torque_curve)}
    if name not in known:
        raise IdentifyError(f"--add: {one_of([SUPPORTED, *known], name)}")
    elasticity = Elasticity.of(robot, options.torque_curve)
    fit = fitted(elasticity, measured, options.torque_curve, options.noise, options.loss)
    (further,) = _further(fit, measured, options, [known[name]])
    return known[name].added_to(robot, further.value)


def _own_name(robot: Robot, name: str) -> str:
    """Return the parameter's name of a candidate that a robot has now."""
    joint, _, what = name.partition(".")
    if what == "backlash":
        return name
    number = int(joint.removeprefix("joint[").removesuffix("]"))
    return f"{joint}.tilt[{len(robot.joints[number - 1].tilt)}].stiffness"


def _once(
    robot: Robot, measured: Measurements, options: Options, added: tuple[str, ...]
) -> Identification:
    elasticity = Elasticity.of(robot, options.torque_curve)
    fit = fitted(elasticity, measured, options.torque_curve, options.noise, options.loss)
    known = options.noise.known
    sure = intervals(fit.problem, fit.weight, fit.values, known)
    tested = np.flatnonzero(~elasticity.is_torsion)
    supports = {
        int(j): support(fit.problem, int(j), fit.weight, options.loss, len(tested)) for j in tested
    }
    telling = separability(fit.rigid, elasticity.names)
    parameters = judged(fit, sure, supports, telling)
    identified = np.array([p.identified for p in parameters])
    kept = elasticity.start.copy()
    for j, name in enumerate(elasticity.names):
        if name in added and not identified[j]:
            kept[j] = elasticity.least[j]
    written = _beside(fit, identified, kept, sure)
    errors = np.einsum("kij,kj->ki", fit.unwhiten, left_out(fit.problem, options.loss))
    model = Model(elasticity, measured, options.torque_curve)
    further = _further(fit, measured, options, candidates(robot, options.torque_curve))
    white = np.linalg.inv(fit.unwhiten)
    found = Identification(
        measured,
        fit,
        added,
        sure,
        parameters,
        written,
        errors,
        _rms_of(model, elasticity.start, measured),
        _rms_of(model, written, measured),
        telling,
        tuple(further),
        common_loss(fit.problem, fit.weight, white, fit.prediction.deflection),
        (),
    )
    return replace(found, warnings=tuple(_warnings(found, options)))


def _beside(fit: Fit, identified: np.ndarray, kept: np.ndarray, sure: Intervals) -> np.ndarray:
    """Return the values to write: kept ones, and beside them those that fit best in their intervals.

    Where nothing that is kept acts together with what is identified, these are the fit's.

    Args:
        fit: The fit.
        identified: Which parameters are, (P,).
        kept: Values of the others, (P,).
        sure: Intervals.
    """
    written = np.where(identified, fit.values, kept)
    if identified.all() or not identified.any():
        return written
    problem = fit.problem.weighted(fit.weight)
    rest = problem.residual(np.where(identified, 0.0, kept))
    own = replace(problem.only(identified), target=rest)
    written[identified] = own.within(sure.low[identified], sure.high[identified])
    return written


def _further(
    fit: Fit, measured: Measurements, options: Options, found: Sequence[Candidate]
) -> list[Further]:
    """Return candidates tested one by one beside the parameters of a fit."""
    robot, results, whole = fit.elasticity.robot, [], []
    for candidate in found:
        try:
            whole.append((candidate, candidate_columns(robot, options.torque_curve, [candidate], measured)))
        except ElasticRobotError:  # it would move no inertia
            continue
    white = np.linalg.inv(fit.unwhiten)
    for candidate, columns in whole:
        column = (white @ columns)[:, :, 0]
        problem = fit.problem.also(column, _SIZE[candidate.axis is not None])
        tested = support(problem, len(fit.values), fit.weight, options.loss, len(whole))
        value = float(problem.weighted(fit.weight).solve()[-1])
        results.append(Further(candidate, value, tested))
    return results


def _rms_of(model: Model, values: np.ndarray, measured: Measurements) -> float:
    try:
        return rms(measured.deflection - model.predict(values).deflection)
    except IdentifyError:
        return float("nan")


def _warnings(found: Identification, options: Options) -> list[str]:
    """Return what the user should look at."""
    measured, fit, telling = found.measured, found.fit, found.separability
    said = []
    if not fit.converged:
        said.append(f"the fit has not converged: {fit.reason}")
    idle = [n for n, w in zip(measured.names, measured.wrench, strict=True) if not w.any()]
    if idle:
        said.append(f"rows without a load: {', '.join(idle[:5])}{' ..' * (len(idle) > 5)}")
    if np.abs(measured.q).max() > 4.0 * np.pi:
        said.append(f"an angle is {np.abs(measured.q).max():.3g} rad: are they in degrees?")
    size = rms(measured.deflection) / max(rms(fit.prediction.deflection * 0.0 + _start(found)), 1e-300)
    if not 0.02 < size < 50.0:
        said.append(
            f"deflections are {size:.3g} times those of the start file: are they in m and loads in N?"
        )
    along = float(np.sum(measured.deflection[:, :3] * _start(found)[:, :3]))
    if along < 0.0:
        said.append(
            "deflections go against what the start file predicts: is the load that on the robot, in base"
            " axes, and the deflection loaded less unloaded?"
        )
    if telling.condition > 30.0:
        said.append(
            f"the parameters pull against each other, condition {telling.condition:.0f}: hardly told"
            f" apart are {'; '.join(d.in_words() for d in telling.weak)}"
        )
    for name, row in zip(fit.elasticity.names, found.intervals.rests_on, strict=True):
        if row >= 0:
            said.append(f"{name} rests on {measured.names[row]} alone")
    if options.noise.known and found.intervals.freedom > 0:
        if found.intervals.scale > 1.5:
            said.append(
                f"residuals are {found.intervals.scale:.2g} times what the standard deviations say: the"
                " model lacks something, or they are too small"
            )
        elif found.intervals.scale < 0.6:
            said.append(
                f"residuals are {found.intervals.scale:.2g} times what the standard deviations say: they"
                " are too large"
            )
    if found.loss is not None and found.loss.suspicion():
        said.append(found.loss.suspicion())
    if found.rms_written > 1.2 * rms(found.residual):
        said.append(
            f"with the values that were kept the robot as written is off by {1e3 * found.rms_written:.3g}"
            f" mm rms, the fit by {1e3 * rms(found.residual):.3g} mm: measure what was not identified, or"
            " leave tilts that are not supported out of the start file"
        )
    return said


def _start(found: Identification) -> np.ndarray:
    """Return what the start values predict in the rigid posture, (k, r)."""
    white, rigid = found.fit.unwhiten, found.fit.rigid
    return np.einsum("kij,kj->ki", white, rigid.columns @ rigid.start)
