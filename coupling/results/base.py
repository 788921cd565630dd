"""What all models of JSON files share: writing, reading, damage, and how a notebook shows them."""

from __future__ import annotations

import json
import math
from functools import singledispatch
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainSerializer,
    SerializerFunctionWrapHandler,
    ValidationError,
    model_serializer,
)

from coupling.errors import reason_of
from coupling.files.toml_file import problem

# A number that may be infinite, which is null in the file.
Unbounded = Annotated[
    float,
    BeforeValidator(lambda value: math.inf if value is None else value),
    PlainSerializer(lambda value: value if math.isfinite(value) else None),
]


def finite(value: float) -> float | None:
    """Return a number as it is stored, None where it is infinite or not known."""
    return float(value) if math.isfinite(value) else None


class ResultPart(BaseModel):
    """Base of all that is computed and stored in a JSON file; keys of later versions are passed over.

    Its fields are the keys of the file, in their order, under their alias where they have one; the keys
    in `sparse` are left out without a value.
    """

    model_config = ConfigDict(frozen=True, populate_by_name=True, defer_build=True)
    sparse: ClassVar[tuple[str, ...]] = ()

    @model_serializer(mode="wrap")
    def _written(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        values: dict[str, Any] = handler(self)
        return {k: v for k, v in values.items() if v is not None or k not in self.sparse}


class ResultFile(ResultPart):
    """Base of whole files."""

    what: ClassVar[str]

    def text(self) -> str:
        """Return the content of the file."""
        return json.dumps(self.model_dump(by_alias=True), indent=1)

    @classmethod
    def read(cls, file: Path, error: type[Exception], advice: str = "") -> Self:
        """Read a file.

        Args:
            error: Exception class for every problem; its message says where, and what was expected.
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


@singledispatch
def html_of(shown: object) -> str | None:
    """Return an object as HTML; None where nothing tells how it looks.

    The module `report.notebook` tells it of results.
    """
    return None


class Shown:
    """Base of what a notebook shows as HTML."""

    def _repr_html_(self) -> str | None:
        return html_of(self)
