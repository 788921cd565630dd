"""What all models of JSON files share: how they are written, read, and found damaged."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any, ClassVar, Self, get_args

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
)

from coupling.errors import reason_of
from coupling.files.toml_file import model_in, problem

# What ends a key: the unit of its value.
_UNIT = re.compile(r"(_(m|rad|s|s2|N|Nm|Hz|deg|relative))+$")
_MISSING = object()


class From(str):
    """What a key tells of an object, where that is not the attribute of its name without the unit.

    An attribute or a method; after a dot one of that, or None where there is none.
    """


class ResultPart(BaseModel):
    """Base of all tables of a JSON file; keys of later versions are passed over.

    Its fields are the keys of the file, in their order; those in `sparse` are left out without a value.
    """

    model_config = ConfigDict(frozen=True, populate_by_name=True)
    sparse: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def of(cls, *sources: object, **known: object) -> Self:
        """Return the table that tells of objects, with tables of their attributes in it.

        A number that is not finite is None where that may stand.

        Args:
            sources: The objects; an attribute is the first one's that has it.
            known: Values of keys that are no attributes.

        Example:
            >>> from types import SimpleNamespace
            >>> class SpringResult(ResultPart):
            ...     rest_m: float
            ...     limit_N: float | None
            ...     name: str
            >>> SpringResult.of(SimpleNamespace(rest=0.1, limit=np.inf), name="left")
            SpringResult(rest_m=0.1, limit_N=None, name='left')
        """
        for key, field in cls.model_fields.items():
            if key not in known:
                paths = (source for source in field.metadata if isinstance(source, From))
                known[key] = _attribute(sources, next(paths, _UNIT.sub("", key)))
        values = {key: value for key, value in known.items() if value is not _MISSING}
        fields = cls.model_fields
        return cls(**{k: _converted(source, fields[k].annotation) for k, source in values.items()})

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        return {k: v for k, v in values.items() if v is not None or k not in self.sparse}


def _attribute(sources: Sequence[object], path: str) -> object:
    """Return an attribute, or what a method returns, of the first source that has it."""
    name, *inner = path.split(".")
    owned = (getattr(source, name, _MISSING) for source in sources)
    value = next((attribute for attribute in owned if attribute is not _MISSING), _MISSING)
    for name in inner:
        value = None if value is None else getattr(value, name)
    return value() if callable(value) else value


def _converted(value: object, kind: object) -> object:
    """Return a value as a key of a kind holds it."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, float) and type(None) in get_args(kind):
        return value if np.isfinite(value) else None
    if isinstance(value, Path):
        return str(value)
    part = model_in(kind)
    if part is None or value is None or isinstance(value, part):
        return value
    if isinstance(value, tuple | list):
        return tuple(_converted(item, part) for item in value)
    return part.of(value)


class ResultFile(ResultPart):
    """Base of whole files.

    Attributes:
        what: Content of a file, for messages.
    """

    what: ClassVar[str]

    def text(self) -> str:
        """Return the content of the file."""
        return json.dumps(self.model_dump(by_alias=True), indent=1)

    @classmethod
    def read(cls, file: Path, error: type[Exception], advice: str = "") -> Self:
        """Read a file.

        Args:
            error: Exception class for every problem; its message says where, and what was expected.
            advice: Advice where the file cannot be read.
        """
        try:
            return cls.model_validate_json(file.read_bytes(), strict=True)
        except OSError as cause:
            ending = f": {advice}" if advice else ""
            raise error(f"{file}: cannot be read: {reason_of(cause)}{ending}") from cause
        except ValidationError as cause:
            first = cause.errors()[0]
            if first["type"] == "json_invalid":
                raise error(f"{file}: is not valid JSON: {first['ctx']['error']}") from cause
            raise error(
                f"{file}: expected {cls.what}, got damaged ones: {problem(first, cls)}"
            ) from cause
