"""Reading a TOML file against a pydantic schema, with messages for the person who wrote the file.

Used at the desk and by the build only: the FMU needs no pydantic.
"""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any, TypeVar

import tomlkit
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
)
from tomlkit.exceptions import TOMLKitError

from coupling.errors import one_of, reason_of
from coupling.files.bounded_file import read_bounded
from elastic_robot.errors import ElasticRobotError


class Schema(BaseModel):
    """Base of file schemas: no unknown keys, no silent conversion of types, no NaN."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, allow_inf_nan=False, defer_build=True
    )


# A finite number above zero.
Positive = Annotated[float, Field(gt=0.0)]

Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]

# No case and no robot is larger [bytes].
_MAX_BYTES = 64_000_000

SchemaT = TypeVar("SchemaT", bound=BaseModel)
DocumentT = TypeVar("DocumentT", bound=dict[str, Any])


def load_toml(path: Path, error: type[Exception]) -> dict[str, Any]:
    """Parse a TOML file; `error` is raised with the file's name if that fails."""
    return _parse(path, error, tomllib.loads)


def document(path: Path, error: type[Exception]) -> tomlkit.TOMLDocument:
    """Parse a TOML file to be edited, its comments and its order kept; errors as `load_toml`."""
    return _parse(path, error, tomlkit.parse)


def _parse(path: Path, error: type[Exception], parse: Callable[[str], DocumentT]) -> DocumentT:
    content = read_bounded(path, _MAX_BYTES, error)
    try:
        # Editors of Windows begin a text with a mark of its encoding.
        parsed = parse(content.decode("utf-8-sig").replace("\r\n", "\n"))
        _require_numbers(parsed)
    # Of the syntax, the encoding, or an integer of thousands of digits.
    except (ValueError, TOMLKitError) as cause:
        hint = ": write / in paths" if "Unescaped '\\'" in str(cause) else ""
        raise error(f"{path}: is not valid TOML: {reason_of(cause)}{hint}") from cause
    except RecursionError as cause:
        raise error(
            f"{path}: is not valid TOML: expected arrays and tables some levels deep, got hundreds of"
            " levels: look for brackets that are not closed"
        ) from cause
    return parsed


# Top-level tables that no file of the kind does without.
_TABLES_OF_KIND = {"robot file": {"tcp", "joint"}, "case": {"robot", "part", "process"}}


def require_kind(data: dict[str, Any], kind: str, path: Path, error: type[Exception]) -> None:
    """Refuse a robot file where a case is needed, and the other way round.

    Args:
        kind: "robot file" or "case": the needed one.
    """
    for other, tables in _TABLES_OF_KIND.items():
        if other != kind and tables <= data.keys() and not _TABLES_OF_KIND[kind] & data.keys():
            raise error(f"{path}: expected a {kind}, got a {other}")


def _require_numbers(parsed: dict[str, Any]) -> None:
    """Refuse integers beyond those of TOML, which nothing could compute with or print."""
    values: list[Any] = [parsed]
    while values:
        match values.pop():
            case dict() as table:
                values += table.values()
            case list() as array:
                values += array
            case int() as number if not -(2**63) <= number < 2**63:
                raise ValueError("expected integers of at most 64 bits, got a larger one")


def _from_folder(value: object, info: ValidationInfo) -> object:
    """Return the path that a text means in the folder of the file it stands in."""
    folder: Path = (info.context or {}).get("folder", Path())
    if not isinstance(value, str):
        return value
    try:
        path = (folder / value).resolve()
        path.exists()
    except (
        OSError,
        RuntimeError,
        ValueError,
    ) as cause:  # too long, links in a circle, null characters
        raise ValueError(
            f"expected the path of a file, got {value!r}: {reason_of(cause)}"
        ) from cause
    return path


# The path of a file, absolute or relative to the folder of the file that names it.
FilePath = Annotated[Path, BeforeValidator(_from_folder)]


def validate(
    data: dict[str, Any],
    schema: type[SchemaT],
    error: type[Exception],
    where: str,
    folder: Path | None = None,
) -> SchemaT:
    """Validate parsed data against a schema.

    Args:
        error: Exception class for every problem; its message names the file, the place, what was
            expected and what was got.
        folder: Folder in which relative paths begin; the working folder unless given.
    """
    try:
        return schema.model_validate(data, context={"folder": folder or Path()})
    except ValidationError as cause:
        problems = [f"{where}: {problem(item, schema)}" for item in cause.errors()]
        raise error("\n".join(problems)) from cause


_CLOSE_KEY = re.compile(r"did you mean '(\w+)'\?$")
# The unit at the end of a key.
_UNIT = re.compile(r"(?:_(?:mm|cm|um|m|inch|deg|rad|g|kg|N|kN|Nm|Pa|MPa|GPa|s|ms|min|Hz|rpm))+$")
# What pydantic says of a value, and the noun that it means.
_AS_A_NOUN = {
    r"^Input should be (?=greater|less)": "a number ",
    r"^Input should be ": "",
    r"^\w+ should have (.*) after validation, not .*": r"\1",
    r"^a valid dictionary.*": "a table",
}


def problem(item: Any, schema: type[BaseModel]) -> str:
    """Return one sentence for one pydantic error."""
    place = list(item["loc"])
    if item["type"] == "extra_forbidden":
        *parents, key = place
        sentence = one_of(_keys_at(schema, parents), key, kind="unknown key ")
        close = _CLOSE_KEY.search(sentence)
        stem = _UNIT.sub("", str(key))
        is_same = (
            close is not None and stem not in (key, close[1]) and stem == _UNIT.sub("", close[1])
        )
        return f"{_join(parents)}{sentence}{' Convert the value to its unit' if is_same else ''}"
    if item["type"] == "missing":
        *parents, key = place
        return f"{_join(parents)}key {key!r} is missing"
    cause = item.get("ctx", {}).get("error")
    if item["type"] == "value_error" and isinstance(cause, ValueError | ElasticRobotError):
        return f"{_join(place)}{cause}"
    expected = item["msg"]
    for said, noun in _AS_A_NOUN.items():
        expected = re.sub(said, noun, expected)
    got = item["ctx"]["actual_length"] if item["type"] == "too_long" else repr(item["input"])
    is_quoted = item["type"] in ("float_type", "int_type") and isinstance(item["input"], str)
    hint = ": write it without quotation marks and unit" if is_quoted else ""
    return f"{_join(place)}expected {expected}, got {got}{hint}"


def _join(place: Sequence[str | int]) -> str:
    """('joint', 1, 'mass') -> 'joint 2: mass: ' (people count from one)."""
    words: list[str] = []
    for part in place:
        if isinstance(part, int) and words:
            words[-1] += f" {part + 1}"
        else:
            words.append(str(part))
    return "".join(f"{word}: " for word in words)


def _keys_at(schema: Any, place: Sequence[str | int]) -> list[str]:
    """Names of the fields of the sub-schema at a place."""
    for part in place:
        if isinstance(part, str):
            schema = schema.model_fields[part].annotation
        schema = model_in(schema)
    return list(schema.model_fields)


def model_in(annotation: Any) -> Any:
    """Return the model inside list[Model], Model | None and the like; None where there is none."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    for argument in getattr(annotation, "__args__", ()):
        model = model_in(argument)
        if model is not None:
            return model
    return None
