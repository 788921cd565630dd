"""The next command of a robot that was measured: what is learned of the passes, and by which move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from coupling.errors import LearnError
from coupling.events import Progress, Watch, unwatched
from coupling.learn.causes import Cause, causes, largest, no_parameters
from coupling.learn.contraction import GAIN, Contraction, Responses, chosen
from coupling.learn.history import FrameKnown, History, Size
from coupling.learn.learning import Learned, Options, learn
from coupling.learn.moves import Judgement, Model, Move, moves, next_repeating
from coupling.learn.parameters import factors_between, prior_of, robot_with
from coupling.learn.problem import Frame
from coupling.learn.repeating import Repeating
from coupling.learn.source import Source
from coupling.run.models import Models
from elastic_robot.chain import build_chain
from elastic_robot.description import Robot

KINDS = ("auto", "parameters", "path", "both")
# Robots that are possible, for contraction and forecast; pairs on opposite sides, so that their mean is
# the robot itself.
_PAIRS = 8
# Postures of the path at which the robots' responses are compared.
_POSTURES = 5
# Standard deviation of the log factor of a damping that is not learned.
_DAMPING = 0.3
# Passes from which parameters are learned without being told to: the second one where the first told
# nothing.
_LEARNED_FROM = 2
# Turns of parameters and of what they do not explain; variance of what is left by that of noise, below
# which there is nothing else in it; a turn that does not lower it to this part is the last.
_TURNS, _NOISE, _LESS = 3, 1.5, 0.9
# What parameters are learned with where the frame is not known better.
_FRAME = Frame()


@dataclass(frozen=True)
class NextOptions:
    """How the next command is found.

    Attributes:
        known: What is known of the measuring frame.
        move: One of `KINDS`.
        cutoff: Cutoff of learning along the path that is asked for [Hz]; None: the highest that
        contracts. seed: Of the robots that are possible.
    """

    known: FrameKnown = field(default_factory=FrameKnown)
    move: str = "auto"
    cutoff: float | None = None
    seed: int = 1

    @property
    def absolute(self) -> bool:
        """Whether the deviation's constant counts: the frame is said to be known."""
        return bool(np.isfinite(self.known.shift))


@dataclass(frozen=True)
class Plan:
    """How the next command is to be computed.

    Attributes:
        history: The passes.
        moves: All moves, the best one first.
        move: The one that is taken.
        judgement: The last pass beside the best one.
        repeating: What is corrected along the path; None: nothing.
        learned: What was learned of the parameters now; None where that was not asked for.
        options: How it was found.
        causes: What it may be that the model has not, the largest first.
    """

    history: History
    moves: tuple[Move, ...]
    move: Move
    judgement: Judgement
    repeating: Repeating | None
    learned: Learned | None
    options: NextOptions
    causes: tuple[Cause, ...] = ()

    @property
    def contraction(self) -> Contraction:
        """Gain and filter of learning along the path."""
        return self.move.model.contraction

    @property
    def told_from(self) -> int:
        """Number of the pass that the next one is told from."""
        back = self.judgement.worse or self.judgement.again
        return self.judgement.best if back else self.judgement.last

    def left(self, size: Size) -> float:
        """Return the rms of a deviation [m]: less a constant where the frame is not known."""
        return size.rms if self.options.absolute else size.rms_less_constant


def plan(
    sources: Sequence[Source], options: NextOptions, models: Models, watch: Watch = unwatched
) -> Plan:
    """Return how the next command of a robot is to be computed.

    Args:
        sources: Runs and what was measured under their commands, in their order.
        options: How.
        models: What simulates robots.
        watch: Told how far the work is.

    Raises:
        LearnError: If the runs and measurements do not belong together, or the move or cutoff that is
            asked for is not to be had.
    """
    watch(Progress("comparing what was measured", 0, 1))
    history = History.of(sources, options.known, models)
    known = [_file_model(history, options), *_earlier_models(history, options)]
    learned = None
    wanted = options.move in ("parameters", "both")
    if wanted or (options.move == "auto" and len(known) == 1 and len(sources) <= _LEARNED_FROM):
        learned = _learned(history, options, models, watch)
        if not learned.refusal:
            known.append(_learned_model(history, learned, options))
        elif wanted and len(known) == 1:
            raise LearnError(f"--move {options.move}: no parameters are told: {learned.refusal}")
    judgement = Judgement.of(history, options.absolute)
    ranked = moves(history, known, options.absolute)
    offered = [own for own in ranked if options.move in ("auto", own.kind)]
    if judgement.worse:
        # Back to the best command: its own robot, and what was learned along the path with that.
        x = history.robot_of(judgement.best)
        offered = [
            own
            for own in ranked
            if own.learns_path and np.allclose(own.model.x, x, rtol=0.0, atol=1e-9)
        ]
    if not offered:
        raise LearnError(f"--move {options.move}: expected a robot with parameters that are told")
    move = offered[0]
    found = next_repeating(history, move, judgement)
    number = judgement.best if judgement.worse else judgement.last
    follows = largest(causes(history, move.model.x, number))
    return Plan(history, tuple(ranked), move, judgement, found, learned, options, follows)


def _learned(history: History, options: NextOptions, models: Models, watch: Watch) -> Learned:
    """Return what the passes tell of the parameters, behind what no parameter explains.

    The two hide each other: a fit takes hysteresis or an error of a gear for parameters, and a wrong
    backlash looks like these.  So they are found by turns, parameters first, until noise alone is left
    or no less.
    """
    shift, turn = options.known.shift, options.known.turn
    frame = Frame(min(shift, _FRAME.shift), min(turn, _FRAME.turn))
    own = Options(np.isinf(turn), seed=options.seed, known=frame)
    told = [
        replace(run.source, seen=replace(run.source.seen, position=run.told))
        for run in history.runs
    ]
    best = learn(told, replace(own, start=history.start), models, watch)
    for _ in range(_TURNS):
        if best.fit.left_over.over < _NOISE:
            break
        x = best.fit.z[: len(history.start)]
        cleaned = _cleaned(history, x)
        if cleaned is None:
            break
        after = learn(cleaned, replace(own, start=x), models, watch)
        if after.fit.left_over.over > _LESS * best.fit.left_over.over:
            break
        best = after
    return best


def _cleaned(history: History, x: np.ndarray) -> list[Source] | None:
    """Return runs and what was measured less what no parameter explains; None where nothing is such."""
    cleaned, some = [], False
    for number, run in enumerate(history.runs):
        found = causes(history, x, number)
        moved = no_parameters(found, run.source.seen.time + run.clock)
        some = some or bool(np.any(moved))
        seen = replace(run.source.seen, position=run.told - moved)
        cleaned.append(replace(run.source, seen=seen))
    return cleaned if some else None


def _file_model(history: History, options: NextOptions) -> Model:
    deviation = prior_of(history.parameters)
    robots = _possible(history.start, np.diag(deviation**2), options.seed)
    return _model(history, "of the robot file", history.start, 0, robots, options)


def _earlier_models(history: History, options: NextOptions) -> list[Model]:
    """Return the robots of the runs that were computed for another one than the file's."""
    found: list[Model] = []
    for number, run in enumerate(history.runs):
        x = history.robot_of(number)
        known = [history.start, *(own.x for own in found)]
        if any(np.allclose(x, own, rtol=0.0, atol=1e-9) for own in known):
            continue
        names = [own.name for own in history.parameters]
        told = run.source.forecast
        if told is not None and all(set(own) == set(names) for own in told.robots):
            robots = np.log([[own[name] for name in names] for own in told.robots])
        else:
            robots = _possible(x, np.diag(prior_of(history.parameters) ** 2), options.seed)
        found.append(_model(history, f"of {run.source.folder.name}", x, number, robots, options))
    return found


def _learned_model(history: History, learned: Learned, options: NextOptions) -> Model:
    x = factors_between(history.parameters, learned.robot)
    count = len(x)
    covariance = learned.fit.covariance[:count, :count]
    own = np.sqrt(np.diag(covariance))
    scale = np.minimum(learned.spread.deviation, prior_of(history.parameters)) / own
    robots = _possible(x, scale[:, None] * covariance * scale, options.seed)
    return _model(history, "learned now", x, len(history.runs), robots, options)


def _model(
    history: History, name: str, x: np.ndarray, since: int, robots: np.ndarray, options: NextOptions
) -> Model:
    """Return a robot with the filter of learning along the path that goes with it."""
    source = history.runs[0].source
    robot = robot_with(source.robot, history.parameters, x)
    stiffness, damping = _factors(history, robot, robots - x, options.seed)
    joints = source.stored.joints.q[0]
    rows = np.linspace(0, len(joints) - 1, _POSTURES).astype(int)
    responses = Responses.of(robot, joints[rows], stiffness, damping)
    return Model(name, x, since, robots, chosen(responses, GAIN, options.cutoff))


def _factors(
    history: History, robot: Robot, logs: np.ndarray, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return factors of stiffness and damping of robots by elastic coordinate, (s, m) each."""
    count = build_chain(robot).elastic_count
    drawn = np.random.default_rng(seed).standard_normal((len(logs), count)).clip(-2.0, 2.0)
    found = {"stiffness": np.zeros((len(logs), count)), "damping": _DAMPING * drawn}
    for k, own in enumerate(history.parameters):
        if own.kind in found:
            found[own.kind][:, own.coordinate] = logs[:, k]
    return np.exp(found["stiffness"]), np.exp(found["damping"])


def _possible(x: np.ndarray, covariance: np.ndarray, seed: int) -> np.ndarray:
    """Return log factors of robots that are possible, (2 pairs, P)."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    drawn = np.random.default_rng(seed).standard_normal((_PAIRS, len(x))).clip(-2.0, 2.0)
    off = (drawn * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return np.concatenate([x + off, x - off])
