"""Finding the process that a case names: a shipped model, or a class in a Python file."""

from __future__ import annotations

import importlib.util
import inspect
import sys
from pathlib import Path
from types import ModuleType

from coupling.errors import CaseError, one_of
from coupling.process import PROCESSES
from coupling.process.authors_code import authors_code
from coupling.process.base import ProcessSchema


def find_process(model: str, folder: Path) -> tuple[str, type[ProcessSchema]]:
    """Return a model's full name and its table.

    Args:
        model: "isf-force-law" and the like, or "my_process.py:MyTable".
        folder: Folder in which relative files begin.

    Raises:
        CaseError: If there is none of that name, or its file cannot be imported.
    """
    if model in PROCESSES:
        return model, PROCESSES[model]
    name, separator, table = model.partition(".py:")
    if not separator:
        raise CaseError(
            one_of(
                PROCESSES, model, also=" or a class in a file of your own (my_process.py:MyTable)"
            )
        )
    file = (folder / f"{name}.py").resolve()
    if not file.is_file():
        raise CaseError(f"expected the Python file of the process, got {file}, which is not there")
    module = _import_file(file)
    schema = getattr(module, table, None)
    is_table = isinstance(schema, type) and issubclass(schema, ProcessSchema)
    if schema is None or not is_table or inspect.isabstract(schema):
        raise CaseError(
            f"{file}: expected a class {table} derived from elastic_robot.coupling.process.ProcessTable,"
            f" with a method process(task), got {'none' if schema is None else schema}"
        )
    return f"{file}:{table}", schema


def _import_file(file: Path) -> ModuleType:
    name = f"own_process_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their module up by name
    with authors_code(lambda what: CaseError(f"{file}: cannot be imported: {what}")):
        spec.loader.exec_module(module)
    return module
