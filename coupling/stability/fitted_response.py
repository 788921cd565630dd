"""Modes of a tool from its measured response, by vector fitting.

    H(s) = sum of r_i / (s - p_i)

with poles that are moved until a second fit of H times a rational function finds them unmoved
[Gustavsen1999].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.optimize import nnls

from coupling.errors import StabilityError
from coupling.modes.measured_response import MeasuredResponse, other_readings
from coupling.stability.structure import ToolMode

# Modes at most, and how often their poles are moved.
_MOST, _ROUNDS = 6, 30
# A fit is good whose error is this part of the response, rms, and no fit may be worse than the last.
_GOOD, _WORST, _GOOD_READING = 0.02, 0.3, 0.15
# Modes that move the tip by less than this part of the softest one are noise.
_SIGNIFICANT = 1e-3
# Stiffness of the softest mode of a tool, slender ones and those of heavy spindles included [N/m].
_SOFTEST, _STIFFEST = 1e5, 1e10


def fitted_modes(responses: Sequence[MeasuredResponse], where: str) -> list[ToolMode]:
    """Return the modes of a tool, alike across its axis, from its direct responses.

    Args:
        responses: Measured responses, of which those named xx and yy count, or their mean.
        where: Name of the file, for messages.

    Raises:
        StabilityError: If none is direct, or no few modes follow them.
    """
    direct = [response for response in responses if response.name in ("xx", "yy")]
    if not direct:
        raise StabilityError(
            f"{where}: expected a direct response of the tool, xx or yy, got"
            f" {', '.join(response.name for response in responses)}"
        )
    frequency = direct[0].frequency
    low, high = (
        max(each.frequency[0] for each in direct),
        min(each.frequency[-1] for each in direct),
    )
    frequency = frequency[(frequency >= low) & (frequency <= high)]
    if len(frequency) < 2:
        bands = [f"{each.frequency[0]:.4g} to {each.frequency[-1]:.4g} Hz" for each in direct]
        raise StabilityError(
            f"{where}: expected xx and yy at the same frequencies, got {' and '.join(bands)}: leave one"
            " out"
        )
    compliance = np.mean(
        [np.interp(frequency, each.frequency, each.compliance) for each in direct], axis=0
    )
    error, modes = _few_modes(frequency, compliance)
    if error <= _WORST and _is_of_tool(modes):
        return modes
    read = ""
    for words, (reading,) in other_readings([MeasuredResponse("xx", frequency, compliance)]):
        other_error, other_modes = _few_modes(frequency, reading.compliance)
        if other_error < _GOOD_READING and _is_of_tool(other_modes):
            read = f"; modes of a tool follow it if {words}"
            break
    if error > _WORST:
        raise StabilityError(
            f"{where}: expected a response that {_MOST} modes at most follow, got one that they miss by"
            f" {100.0 * error:.0f} %{read}: correct it, or give [[stability.tool_mode]] instead"
        )
    softest = min(mode.stiffness for mode in modes)
    raise StabilityError(
        f"{where}: expected a softest mode of {_SOFTEST:g} to {_STIFFEST:g} N/m, as tools have, got"
        f" {softest:.3g} N/m{read}: its unit is displacement over force, m/N"
    )


def _is_of_tool(modes: Sequence[ToolMode]) -> bool:
    """Return whether a tool may have modes, by the stiffness of the softest one."""
    return bool(modes) and _SOFTEST <= min(mode.stiffness for mode in modes) <= _STIFFEST


def _few_modes(frequency: np.ndarray, compliance: np.ndarray) -> tuple[float, list[ToolMode]]:
    """Return the error of the best fit of a response, over it, and the modes of that fit."""
    best: tuple[float, list[ToolMode]] = 1.0, []
    for count in range(1, _MOST + 1):
        if 4 * count > len(frequency):
            break
        fit = _fit(2j * np.pi * frequency, compliance, count)
        if fit is not None and fit[0] < best[0]:
            best = fit
        if best[0] < _GOOD:
            break
    return best


def _fit(s: np.ndarray, compliance: np.ndarray, count: int) -> tuple[float, list[ToolMode]] | None:
    """Return the error of a fit of so many modes, over the response, and the modes."""
    weight = 1.0 / np.maximum(np.abs(compliance), 0.05 * np.abs(compliance).max())
    omega = np.geomspace(s.imag[0], s.imag[-1], count + 2)[1:-1]
    poles = omega * (-0.02 + 1j)
    for _ in range(_ROUNDS):
        poles_next = _relocate_poles(s, compliance, weight, poles)
        if len(poles_next) != count:
            return None
        is_at_rest = np.allclose(poles_next, poles, rtol=1e-8)
        poles = poles_next
        if is_at_rest:
            break
    # Modes without a part that is in phase with the velocity: r / (s^2 + 2 zeta omega s + omega^2).
    size, ratio = np.abs(poles), -poles.real / np.abs(poles)
    shape = 1.0 / (s[:, None] ** 2 + 2.0 * ratio * size * s[:, None] + size**2)
    system = weight[:, None] * shape
    rows = np.vstack([system.real, system.imag])
    values = np.concatenate([(weight * compliance).real, (weight * compliance).imag])
    # The tip goes where it is pushed: no mode has a negative stiffness.
    scale = float(np.linalg.norm(values))
    lengths = np.linalg.norm(rows, axis=0)
    share = nnls(rows / lengths, values / scale)[0] * scale / lengths
    error = float(np.linalg.norm(rows @ share - values) / np.linalg.norm(values))
    soft = share / size**2
    is_significant = soft > _SIGNIFICANT * soft.max(initial=0.0)
    if not is_significant.any():
        return None
    modes = [
        ToolMode(float(w / (2.0 * np.pi)), float(np.clip(zeta, 1e-4, 0.99)), float(1.0 / each))
        for w, zeta, each in zip(
            size[is_significant], ratio[is_significant], soft[is_significant], strict=True
        )
    ]
    return error, modes


def _relocate_poles(
    s: np.ndarray, compliance: np.ndarray, weight: np.ndarray, poles: np.ndarray
) -> np.ndarray:
    """Return poles in the upper half plane, moved once, as zeros of the fitted scaling function."""
    direct, mirrored = 1.0 / (s[:, None] - poles), 1.0 / (s[:, None] - poles.conj())
    basis = np.hstack([direct + mirrored, 1j * (direct - mirrored)])
    system = weight[:, None] * np.hstack(
        [basis, np.ones((len(s), 1)), -compliance[:, None] * basis]
    )
    values = weight * compliance
    solution, *_ = np.linalg.lstsq(
        np.vstack([system.real, system.imag]),
        np.concatenate([values.real, values.imag]),
        rcond=None,
    )
    scaling = solution[-2 * len(poles) :]
    blocks = np.zeros((2 * len(poles), 2 * len(poles)))
    count = len(poles)
    blocks[:count, :count] = blocks[count:, count:] = np.diag(poles.real)
    blocks[:count, count:], blocks[count:, :count] = np.diag(poles.imag), -np.diag(poles.imag)
    drive = np.append(np.full(count, 2.0), np.zeros(count))
    zeros = np.linalg.eigvals(blocks - np.outer(drive, scaling))
    upper = zeros[zeros.imag > 1e-6 * np.abs(zeros)]
    stable = -np.abs(upper.real) + 1j * upper.imag
    return stable[np.argsort(stable.imag)]
