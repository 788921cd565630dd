"""What an identification shows on the terminal."""

from __future__ import annotations

from collections.abc import Iterator

from coupling.results.identified_result import IdentifiedParameterResult, IdentifiedResult

# Rows and further parameters that are listed.
_LISTED = 5
_HEAD = ("start", "fit", "95 % from", "to", "written")


def lines(found: IdentifiedResult) -> Iterator[str]:
    """Yield the lines that tell an identification.

    Args:
        found: Its figures.
    """
    size = {name: _mm(value) for name, value in found.rms_m}
    yield (
        f"{found.rows} measurements, {size['measured']} mm rms. Left by the start file"
        f" {size['start']}, by the fit {size['fit']}, in rows left out {size['left_out']} mm, rms over"
        " all components."
    )
    width = max(len(parameter.name) for parameter in found.parameters)
    yield f"{'parameter':<{width}}" + "".join(f" {word:>10}" for word in _HEAD)
    for parameter in found.parameters:
        written = _value(parameter.written) if parameter.identified else "kept"
        if parameter.added and not parameter.identified:
            written = "left out"
        yield (
            f"{parameter.name:<{width}} {_start(parameter):>10}"
            f" {_value(parameter.value):>10} {_value(parameter.low):>10}"
            f" {_value(parameter.high):>10} {written:>10}  {_why(parameter)}"
        ).rstrip()
    yield f"Condition {_value(found.condition)}." + _alike(found)
    for direction in found.unseen:
        yield f"Not seen: {direction.in_words} changes nothing measured."
    tested = [further for further in found.further if further.supported]
    if tested:
        yield "Further parameters that the data support, one by one (--add NAME, or --add supported):"
        for further in sorted(tested, key=lambda f: f.left_out_change or 0.0)[:_LISTED]:
            value = f"{_value(further.value)} {further.unit}"
            yield f"  {further.name}: {value}; {further.in_words}"
    elif found.further:
        yield f"None of {len(found.further)} further tilts and backlashes is supported."
    yield f"Worst predicted when left out: {', '.join(_row(found, name) for name in found.worst)}."
    for warning in found.warnings:
        yield f"Warning: {warning}" + "." * (not warning.endswith("?"))


def _start(parameter: IdentifiedParameterResult) -> str:
    return "none" if parameter.added else _value(parameter.start)


def _why(parameter: IdentifiedParameterResult) -> str:
    if not parameter.identified:
        return f"not identified: {parameter.reason}"
    return parameter.support.in_words if parameter.support else ""


def _alike(found: IdentifiedResult) -> str:
    pairs = [" and ".join(pair.names) for pair in found.alike]
    return f" Alike: {'; '.join(pairs)}." if pairs else ""


def _row(found: IdentifiedResult, name: str) -> str:
    (first, *_) = (row for row in found.measurements if row.name == name)
    error = sum(value**2 for value in first.left_out_error[:3]) ** 0.5
    return f"{name} ({_mm(error)} mm)"


def _mm(length: float | None) -> str:
    return "?" if length is None else f"{1e3 * length:.4g}"


def _value(value: float | None) -> str:
    return "inf" if value is None else f"{value:.4g}"
