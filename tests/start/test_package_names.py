"""`elastic_robot.coupling` in a checkout: its folder `coupling`, loaded once under both names."""

from __future__ import annotations

import importlib
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import coupling
import elastic_robot.coupling
from coupling.path.frame import Frame


def test_every_module_is_the_same_by_both_names():
    """Imported in a fresh process by the long name first, as users do."""
    done = run("""
import importlib, pkgutil, sys
import elastic_robot.coupling
for module in pkgutil.walk_packages(elastic_robot.coupling.__path__, "elastic_robot.coupling."):
    if "__main__" not in module.name:
        assert importlib.import_module(module.name).__name__ == module.name[len("elastic_robot."):]
for name, module in list(sys.modules.items()):
    if name.startswith("elastic_robot.coupling"):
        assert module is sys.modules[name.removeprefix("elastic_robot.")], name
""")
    assert done.returncode == 0, done.stderr


def test_instances_and_pickles_are_of_one_class():
    from elastic_robot.coupling.path.frame import Frame as LongFrame

    assert LongFrame is Frame
    frame = LongFrame.of_rpy([1.0, 2.0, 3.0], [0.0, 0.0, 0.0])
    installed = pickle.dumps(frame, protocol=0).replace(
        b"ccoupling.path", b"celastic_robot.coupling.path"
    )
    assert b"elastic_robot.coupling" in installed  # as a wheel writes it
    for pickled in (pickle.dumps(frame), installed):
        assert isinstance(pickle.loads(pickled), Frame)


def test_a_module_keeps_its_spec():
    module = importlib.import_module("elastic_robot.coupling.files.toml_file")
    assert module.__spec__.name == module.__name__ == "coupling.files.toml_file"
    assert elastic_robot.coupling is coupling


def test_a_module_that_is_not_there_is_not_found():
    assert importlib.util.find_spec("elastic_robot.coupling.nothing") is None
    with pytest.raises(ModuleNotFoundError, match=r"elastic_robot\.coupling\.nothing"):
        importlib.import_module("elastic_robot.coupling.nothing")


def test_python_runs_its_modules():
    command = [sys.executable, "-m", "elastic_robot.coupling.cli", "--version"]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.stdout.startswith("elastic-robot "), done.stderr


def test_a_file_that_python_finds_in_place_of_the_folder_is_named(tmp_path):
    (tmp_path / "coupling.py").write_text("")
    done = run("import elastic_robot.coupling", tmp_path)
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: coupling: expected {coupling.__file__}, got {tmp_path}")
    assert "rename or uninstall that, or install the wheel" in last


def test_the_desk_side_is_no_part_of_the_model():
    from elastic_robot.fingerprint import model_files

    package = Path(elastic_robot.__file__).parent
    names = {file.name for file in model_files(package)}
    assert "robot.py" in names
    assert "coupling.py" not in names
    assert (package / "coupling.py").is_file()


def run(code: str, folder: Path | None = None) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True)
