"""A file of any kind that is damaged anywhere is refused in one sentence with its place."""

import functools
import importlib
import json
import pkgutil
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from coupling import results
from coupling.errors import ResultError
from coupling.results.base import ResultFile
from coupling.results.parameter_result import FitResult
from coupling.results.run_result import RunResult
from coupling.results.run_state import RunState

for module in pkgutil.iter_modules(results.__path__, f"{results.__name__}."):
    importlib.import_module(module.name)
KINDS = [
    k for k in (*ResultFile.__subclasses__(), *FitResult.__subclasses__()) if k is not FitResult
]


def example(schema: dict, known: dict) -> object:
    """Return content with a value for every key that a JSON schema requires."""
    if "$ref" in schema:
        return example(known[schema["$ref"].rsplit("/", 1)[1]], known)
    if "anyOf" in schema:
        return example(schema["anyOf"][0], known)
    if "const" in schema or "enum" in schema:
        return schema.get("const", schema.get("enum", [None])[0])
    match schema["type"]:
        case "object" if "properties" in schema:
            return {key: example(own, known) for key, own in schema["properties"].items()}
        case "object":
            return {"name": example(schema["additionalProperties"], known)}
        case "array" if "prefixItems" in schema:
            return [example(own, known) for own in schema["prefixItems"]]
        case "array":
            return [example(schema["items"], known)] * schema.get("minItems", 1)
        case kind:
            return {"string": "a", "number": 0.5, "integer": 1, "boolean": True, "null": None}[kind]


@functools.cache
def text_of(kind: type[ResultFile]) -> str:
    """Return the text of a file of this kind."""
    schema = kind.model_json_schema()
    return json.dumps(example(schema, schema.get("$defs", {})))


def whole(kind: type[ResultFile]) -> dict:
    """Return the content of a file of this kind."""
    return json.loads(text_of(kind))


def places(content: object, before: tuple = ()) -> list[tuple]:
    """Return the place of every value in a content."""
    pairs = content.items() if isinstance(content, dict) else enumerate(content)
    found = []
    for key, value in pairs:
        found.append((*before, key))
        if isinstance(value, dict | list):
            found += places(value, (*before, key))
    return found


def refused(kind: type[ResultFile], file: Path, told: str) -> None:
    with pytest.raises(ResultError) as caught:
        kind.read(file, ResultError, "look")
    text = str(caught.value)
    assert text.startswith(f"{file}: ")
    assert told in text
    assert "\n" not in text


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_and_more_keys_are_passed_over(kind, tmp_path):
    file, content = tmp_path / "file.json", whole(kind)
    file.write_text(json.dumps(content | {"of_a_later_version": [1]}))
    read = kind.read(file, ResultError)
    assert read_alike(json.loads(read.text()), content)
    assert read == kind.read(_written(tmp_path / "again.json", read), ResultError)


def read_alike(found: object, content: object) -> bool:
    """Whether a content is found, but for sentences that are made of the rest."""
    if isinstance(content, dict):
        return all(read_alike(found[key], own) for key, own in content.items())
    if isinstance(content, list):
        return len(found) == len(content) and all(map(read_alike, found, content))
    return found == content


def _written(file: Path, content: ResultFile) -> Path:
    file.write_text(content.text())
    return file


@pytest.mark.parametrize("kind", KINDS)
@given(data=st.data())
@settings(deadline=None, max_examples=60)
def test_a_value_of_another_type_is_named(kind, data, tmp_path_factory):
    content = whole(kind)
    *parents, key = place = data.draw(st.sampled_from(places(content)))
    owner = content
    for part in parents:
        owner = owner[part]
    owner[key] = {"found": []} if isinstance(owner[key], list) else [{"found": 7}]
    file = tmp_path_factory.getbasetemp() / "damaged.json"
    file.write_text(json.dumps(content))
    refused(kind, file, f"expected {kind.what}, got damaged ones: {place[0]}")


@pytest.mark.parametrize("kind", KINDS)
def test_every_key_that_is_needed_is_missed(kind, tmp_path):
    for key in [k for k, field in kind.model_fields.items() if field.is_required()]:
        content = whole(kind)
        del content[key]
        (tmp_path / "file.json").write_text(json.dumps(content))
        refused(kind, tmp_path / "file.json", f"key {key!r} is missing")


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_cut_off_or_not_there_or_no_json_is_said(kind, tmp_path):
    file, text = tmp_path / "file.json", json.dumps(whole(kind))
    refused(kind, file, "cannot be read: No such file or directory: look")
    for damaged in (text[: len(text) // 2], text[:-1], "", "no JSON"):
        file.write_text(damaged)
        refused(kind, file, "is not valid JSON: ")
    for other in ("[]", "7", "null"):
        file.write_text(other)
        refused(kind, file, f"expected {kind.what}, got damaged ones: ")


def test_the_keys_in_the_page_of_the_run_folder_are_those_of_the_models():
    page = Path(__file__).parents[2].joinpath("docs", "run_folder.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ((?:`\w+`(?:, )?)+) \|", page, flags=re.MULTILINE)
    named = {key for row in rows for key in re.findall(r"`(\w+)`", row)}
    assert len(named) > 20
    assert named <= {*RunResult.model_fields, *RunState.model_fields}
    assert [key for key in RunState.model_fields if f"`{key}`" not in page] == []
