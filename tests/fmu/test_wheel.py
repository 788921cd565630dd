"""The wheel: what it puts beside other people's packages, and that FMUs can be built from it."""

from __future__ import annotations

import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from places import ROOT

import elastic_robot
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu

SHIPPED = "coupling/fmu_export/fmu_src/"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (file,) = folder.iterdir()
    return file


@pytest.fixture(scope="module")
def names(wheel) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_three_names_stand_beside_other_peoples(names):
    about = f"elastic_robot_fmu-{elastic_robot.__version__}.dist-info"
    top = {name.partition("/")[0] for name in names}
    assert top == {"build_fmu.py", "coupling", "elastic_robot", about}
    assert {"coupling/py.typed", "elastic_robot/py.typed"} <= names


def test_what_goes_into_fmus_is_there_once(names):
    """All of fmu_src: the model as a package, the rest as data."""
    sources = {
        file.relative_to(ROOT / "fmu_src").as_posix()
        for file in (ROOT / "fmu_src").rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    model = {name for name in sources if name.startswith("elastic_robot/")}
    assert {f"{SHIPPED}native/fmi/fmi2.c", f"{SHIPPED}process_slave.py"} <= names
    assert {name for name in names if name.startswith("elastic_robot/")} == model
    assert {name for name in names if name.startswith(SHIPPED)} == {
        SHIPPED + name for name in sources - model
    }


@pytest.mark.parametrize("kind", KINDS)
def test_an_fmu_built_from_it_is_that_of_the_checkout(wheel, example, tmp_path, monkeypatch, kind):
    """Byte for byte, from a folder that holds nothing of the project."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "site"))
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "site")
    command = [sys.executable, "-m", "build_fmu", "--kind", kind, "-o", "Installed.fmu"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    ours = build_fmu(example, tmp_path / "Checkout.fmu", BuildOptions(kind))
    assert (tmp_path / "Installed.fmu").read_bytes() == ours.read_bytes()
