"""The wheel: what it puts beside other people's packages, and that FMUs can be built from it."""

import os
import subprocess
import sys
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest
from emulators import EMULATORS
from imports import imported_packages
from places import ROOT

import elastic_robot
from coupling.check.new_case import STARTS
from coupling.files.robot_file import shipped_robots
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from coupling.native.compiler import PLATFORMS, host_platform, zig
from coupling.native.core_library import library_name
from coupling.native.desk_library import desk_library_name

DESK = "elastic_robot/coupling/"
SHIPPED = f"{DESK}native/fmu_src/"
LIBRARIES = f"{DESK}native/libraries/"
COMMAND = ("-m", "elastic_robot.coupling.cli")
# Run before all else in the Python that uses the wheel: there is no Zig.
WITHOUT_ZIG = "import sys; sys.modules['ziglang'] = None"
# Modules of other people that have the name of the checkout's folder.
OTHER = "raise ImportError('expected elastic_robot.coupling, got the coupling of somebody else')"


@pytest.fixture(scope="module")
def wheel(tmp_path_factory) -> Path:
    """With the library for this machine; `make emulators` makes one with all."""
    if zig() is None:
        pytest.skip("needs ziglang")
    return make_wheel(tmp_path_factory.mktemp("wheel"), [host_platform().name])


def make_wheel(folder: Path, platforms: Sequence[str]) -> Path:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    environment = {**os.environ, "ELASTIC_ROBOT_PLATFORMS": ",".join(platforms)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (file,) = folder.iterdir()
    return file


@pytest.fixture(scope="module")
def site(wheel, tmp_path_factory) -> Path:
    """Unpacked once, so that Python compiles it once."""
    return install(wheel, tmp_path_factory.mktemp("installed") / "site")


@pytest.fixture(scope="module")
def names(wheel) -> set[str]:
    with zipfile.ZipFile(wheel) as archive:
        return set(archive.namelist())


def test_one_name_stands_beside_other_peoples(names):
    about = f"elastic_robot_fmu-{elastic_robot.__version__}.dist-info"
    assert {name.partition("/")[0] for name in names} == {"elastic_robot", about}
    assert "elastic_robot/py.typed" in names


def test_every_module_of_the_desk_side_is_there_and_no_other(names):
    modules = {file.relative_to(ROOT).as_posix() for file in (ROOT / "coupling").rglob("*.py")}
    ours = {name for name in names if name.startswith(DESK) and name.endswith(".py")}
    data = tuple(f"{DESK}{place}" for place in ("native/fmu_src/", "files/examples/"))
    assert {name for name in ours if not name.startswith(data)} == {
        f"elastic_robot/{name}" for name in modules
    }
    assert "elastic_robot/coupling.py" not in names


def test_its_modules_and_their_examples_import_no_coupling_of_somebody_else(wheel):
    with zipfile.ZipFile(wheel) as archive:
        sources = [archive.read(n).decode() for n in archive.namelist() if n.endswith(".py")]
    assert all("coupling" not in imported_packages(source) for source in sources)


def test_every_module_can_be_imported_beside_others_of_that_name(site, tmp_path):
    """One in the user's folder, one among the installed packages; each fails if it is imported."""
    load_all = """
import importlib, pkgutil, sys
sys.modules["precice"] = None
import elastic_robot.coupling
package = elastic_robot.coupling
for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
    if "__main__" not in module.name and ".fmu_src" not in module.name:
        importlib.import_module(module.name)
assert "coupling" not in sys.modules
print(len([name for name in sys.modules if name.startswith("elastic_robot.coupling.")]))
"""
    (tmp_path / "coupling.py").write_text(OTHER)
    (tmp_path / "load_all.py").write_text(load_all)
    said = run_installed(site, tmp_path, ["load_all.py"], "")
    assert int(said) > 300


def test_a_study_sends_its_classes_to_workers_and_takes_theirs(site, tmp_path):
    run_installed(site, tmp_path, [*COMMAND, "init", "cell", "--process", "measured"], "")
    study = ["study", "cell/case.toml", "-o", "out", "--samples", "19", "--workers", "2"]
    run_installed(site, tmp_path, [*COMMAND, *study], os.environ["PATH"])
    assert (tmp_path / "out" / "samples.csv").is_file()


def test_what_goes_into_fmus_is_there_once(names):
    """All of fmu_src: the model as a package, the rest as data."""
    sources = {
        file.relative_to(ROOT / "fmu_src").as_posix()
        for file in (ROOT / "fmu_src").rglob("*")
        if file.is_file() and "__pycache__" not in file.parts
    }
    sources.remove("elastic_robot/coupling.py")
    model = {name for name in sources if name.startswith("elastic_robot/")}
    assert {f"{SHIPPED}native/fmi/fmi2.c", f"{SHIPPED}process_slave.py"} <= names
    assert {
        name for name in names if name.startswith("elastic_robot/") and not name.startswith(DESK)
    } == model
    assert {name for name in names if name.startswith(SHIPPED)} == {
        SHIPPED + name for name in sources - model
    }


def test_every_shipped_robot_is_there(names):
    assert {f"{DESK}files/robots/{name}.toml" for name in shipped_robots()} <= names


def test_a_first_case_can_be_made_from_it(site, names, tmp_path):
    """Without the checkout: the examples are in it, for every process."""
    folder = f"{DESK}files/examples"
    for start in STARTS.values():
        cases = [name for name in (start.case, start.cell) if name]
        assert {f"{folder}/cases/{name}.toml" for name in cases} <= names
        assert {f"{folder}/{own.example}" for own in start.files} <= names
    command = [*COMMAND, "init", "first", "--process", "external"]
    assert "Next: elastic-robot check first/case.toml" in run_installed(site, tmp_path, command, "")


def test_it_is_for_every_machine_and_python(wheel):
    """Libraries are data that each FMU takes along, not modules of this machine's Python."""
    assert wheel.name.endswith("-py3-none-any.whl")


@pytest.mark.parametrize("kind", KINDS)
def test_an_fmu_built_from_it_is_that_of_the_checkout(site, example, tmp_path, monkeypatch, kind):
    """Byte for byte, from a folder that holds nothing of the project; native without a compiler."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    here = host_platform().name
    command = [*COMMAND, "build", "--kind", kind, "--platforms", here, "-o", "Installed.fmu"]
    said = run_installed(site, tmp_path, command, "" if kind == "native" else os.environ["PATH"])
    assert here in said
    ours = build_fmu(example, tmp_path / "Checkout.fmu", BuildOptions(kind, (here,)))
    assert (tmp_path / "Installed.fmu").read_bytes() == ours.read_bytes()


@pytest.mark.skipif(not EMULATORS, reason="run by `make emulators`; needs ziglang")
def test_a_wheel_of_all_platforms_builds_for_all_without_a_compiler(tmp_path):
    wheel = make_wheel(tmp_path / "wheel", [])
    with zipfile.ZipFile(wheel) as archive:
        found = {name for name in archive.namelist() if name.startswith(LIBRARIES)}
    names = (library_name, desk_library_name)
    assert found == {f"{LIBRARIES}{name(p)}" for p in PLATFORMS.values() for name in names}
    command = [*COMMAND, "build", "-o", "R.fmu"]
    said = run_installed(install(wheel, tmp_path / "site"), tmp_path, command, "")
    assert f"R.fmu: built for {', '.join(PLATFORMS)}" in said
    with zipfile.ZipFile(tmp_path / "R.fmu") as archive:
        inside = {name for name in archive.namelist() if name.startswith("binaries/")}
    assert inside == {f"binaries/{p.name}/ElasticRobot{p.suffix}" for p in PLATFORMS.values()}


def install(wheel: Path, site: Path) -> Path:
    """Unpack a wheel where there is no Zig, beside a module of somebody else."""
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(site)
    (site / "sitecustomize.py").write_text(WITHOUT_ZIG)
    (site / "coupling.py").write_text(OTHER)
    return site


def run_installed(site: Path, folder: Path, command: Sequence[str], path: str) -> str:
    """Run this Python on an unpacked wheel, with programs of PATH; return what it says."""
    environment = {**os.environ, "PYTHONPATH": str(site), "PATH": path}
    done = subprocess.run(
        [sys.executable, *command], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    return done.stdout
