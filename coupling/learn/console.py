"""What was learned, on the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from coupling.results.learned_result import LearnedResult

_HEAD = ("file", "found", "95 % from", "to", "written")


def lines(found: LearnedResult) -> Iterator[str]:
    """Yield the lines that tell what was learned.

    Args:
        found: Its figures.
    """
    for one in found.passes:
        shift = ", ".join(f"{1e6 * value:.0f}" for value in one.frame_shift_m)
        turn = ", ".join(f"{1e3 * value:.2f}" for value in one.frame_turn_rad)
        yield (
            f"{one.measured}: {one.rows} rows from {one.from_s:.2f} to {one.to_s:.2f} s of"
            f" {one.run}; its frame is off by {shift} um and {turn} mrad."
        )
    left = found.left_m
    yield (
        f"Of what is slower than {found.slow_below_Hz:g} Hz the robot file leaves"
        f" {1e6 * left.robot_file:.1f} um rms, the learned robot {1e6 * left.learned:.1f} um,"
        f" noise alone would be {1e6 * found.noise_left_m:.1f} um."
    )
    width = max(len(own.name) for own in found.parameters)
    yield f"{'parameter':<{width}}" + "".join(f" {word:>10}" for word in _HEAD)
    for own in found.parameters:
        values = (own.start, own.value, own.low, own.high)
        written = "kept" if own.written == own.start else f"{own.written:.4g}"
        reason = own.reason
        if reason:
            reason += f": moves the tool by {1e6 * own.effect_m:.2g} um"
        yield (
            f"{own.name:<{width}}"
            + "".join(f" {value:>10.4g}" for value in values)
            + f" {written:>10}  {reason}"
        ).rstrip()
    for warning in found.warnings:
        yield f"Warning: {warning}."
