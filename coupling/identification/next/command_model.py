"""Robot models that commands are computed for, and how far the real robot may be from each of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from coupling.identification.next.contraction import Responses, chosen
from coupling.identification.next.history import History
from coupling.identification.next.options import NextOptions
from coupling.identification.runs.learning import Learned
from coupling.identification.runs.parameters import factors_between, prior_of
from coupling.results.next_result import Contraction
from elastic_robot.chain import build_chain

# Sampled robots, for the contraction; pairs on opposite sides, so that their mean is the model.
_PAIRS = 8
# Postures of the path at which the robots' responses are compared.
_POSTURES = 5
# Standard deviation of the log factor of a damping that is not learned.
_DAMPING = 0.3


@dataclass(frozen=True)
class CommandModel:
    """A robot model that a command is computed for.

    Attributes:
        name: Name, in words.
        x: Log factors of the parameters [1], (P,).
        run_count: Number of runs before its first command; 0 of the file's.
        samples: Log factors of robots within its uncertainty [1], (s, P).
        contraction: Filter and gain of learning along the path with it.
    """

    name: str
    x: np.ndarray
    run_count: int
    samples: np.ndarray
    contraction: Contraction

    @property
    def has_parameters(self) -> bool:
        """Whether its parameters were learned."""
        return bool(np.any(self.x))


def file_model(history: History, options: NextOptions) -> CommandModel:
    """Return the robot of the file, with the uncertainty of files."""
    start = history.start
    samples = _sampled(start, np.diag(prior_of(history.parameters) ** 2), options.seed)
    return _model(history, "of the robot file", 0, start, samples, options)


def model_of_run(history: History, number: int, options: NextOptions) -> CommandModel:
    """Return the robot that a run was computed for."""
    x, forecast = history.factors_of(number), history.runs[number].source.forecast
    if np.allclose(x, history.start, rtol=0.0, atol=1e-9):
        return file_model(history, options)
    first = next(
        k
        for k in range(len(history.runs))
        if np.allclose(x, history.factors_of(k), rtol=0.0, atol=1e-9)
    )
    names = [parameter.name for parameter in history.parameters]
    if forecast is not None and forecast.robots and set(forecast.robots[0]) == set(names):
        samples = np.log([[robot[name] for name in names] for robot in forecast.robots])
    else:
        samples = _sampled(x, np.diag(prior_of(history.parameters) ** 2), options.seed)
    name = f"of {history.runs[first].source.folder.name}"
    return _model(history, name, first, x, samples, options)


def learned_model(history: History, learned: Learned, options: NextOptions) -> CommandModel:
    """Return the robot that was learned, with the uncertainty of that."""
    x = factors_between(history.parameters, learned.robot)
    count = len(x)
    covariance = learned.fit.covariance[:count, :count]
    deviation = np.sqrt(np.diag(covariance))
    scale = np.minimum(learned.spread.deviation, prior_of(history.parameters)) / deviation
    samples = _sampled(x, scale[:, None] * covariance * scale, options.seed)
    return _model(history, "learned now", len(history.runs), x, samples, options)


def _model(
    history: History,
    name: str,
    run_count: int,
    x: np.ndarray,
    samples: np.ndarray,
    options: NextOptions,
) -> CommandModel:
    """Return a robot with the filter of learning along the path that goes with it."""
    source = history.runs[0].source
    stiffness, damping = _factors(history, samples - x, options.seed)
    joints = source.stored.joints.q[0]
    rows = np.linspace(0, len(joints) - 1, _POSTURES).astype(int)
    responses = Responses.of(history.robot_at(x), joints[rows], stiffness, damping)
    contraction = chosen(responses, cutoff=options.cutoff)
    return CommandModel(name, x, run_count, samples, contraction)


def _factors(history: History, logs: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return factors of stiffness and damping of robots by elastic coordinate, (s, m) each."""
    count = build_chain(history.sources[0].robot).elastic_count
    samples = np.random.default_rng(seed).standard_normal((len(logs), count)).clip(-2.0, 2.0)
    factors = {"stiffness": np.zeros((len(logs), count)), "damping": _DAMPING * samples}
    for k, parameter in enumerate(history.parameters):
        if parameter.kind in factors:
            factors[parameter.kind][:, parameter.coordinate] = logs[:, k]
    return np.exp(factors["stiffness"]), np.exp(factors["damping"])


def _sampled(x: np.ndarray, covariance: np.ndarray, seed: int) -> np.ndarray:
    """Return log factors of robots about a model, (2 pairs, P)."""
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    samples = np.random.default_rng(seed).standard_normal((_PAIRS, len(x))).clip(-2.0, 2.0)
    change = (samples * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
    return np.concatenate([x + change, x - change])
