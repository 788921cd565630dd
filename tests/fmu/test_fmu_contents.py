"""What is in the FMU of kind python: description and archive."""

from __future__ import annotations

import os
import re
import zipfile
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree.ElementTree import Element, fromstring

import fmpy.validation
import pytest

import elastic_robot
from build_fmu import main
from coupling.fmu_export.build import BuildOptions, build_fmu

PYTHON = BuildOptions("python")


@dataclass(frozen=True)
class Fmu:
    file: Path
    description: Element
    content: dict[str, bytes]
    archive: zipfile.ZipFile

    @classmethod
    def read(cls, file: Path) -> Fmu:
        archive = zipfile.ZipFile(file)
        content = {name: archive.read(name) for name in archive.namelist()}
        return cls(file, fromstring(content["modelDescription.xml"]), content, archive)

    @property
    def variables(self) -> list[Element]:
        return self.description.findall("ModelVariables/ScalarVariable")

    def of_causality(self, causality: str) -> list[int]:
        return [k for k, v in enumerate(self.variables, 1) if v.get("causality") == causality]


@pytest.fixture(scope="module")
def fmu(example, tmp_path_factory) -> Fmu:
    return Fmu.read(
        build_fmu(example, tmp_path_factory.mktemp("python") / "ElasticRobot.fmu", PYTHON)
    )


def test_fmpy_validates_it(fmu):
    assert fmpy.validation.validate_fmu(str(fmu.file)) == []


def test_every_real_has_a_defined_unit(fmu):
    defined = {u.get("name") for u in fmu.description.findall("UnitDefinitions/Unit")}
    used = [v.find("Real").get("unit") for v in fmu.variables if v.find("Real") is not None]
    assert None not in used
    assert set(used) == defined


def test_units_are_made_of_base_units(fmu):
    """m/N times N is m; N.m/rad times rad is N.m; N.m.s/rad times rad/s is N.m; all others by name."""
    units = {}
    for unit in fmu.description.findall("UnitDefinitions/Unit"):
        base = unit.find("BaseUnit")
        units[unit.get("name")] = {k: int(n) for k, n in base.attrib.items()}

    def product(*names):
        total: dict[str, int] = {}
        for name in names:
            for k, n in units[name].items():
                total[k] = total.get(k, 0) + n
        return {k: n for k, n in total.items() if n}

    assert units["1"] == {}
    assert units["N"] == {"kg": 1, "m": 1, "s": -2}
    assert product("m/N", "N") == {"m": 1}
    assert product("N.m") == product("N", "m")
    assert product("N.m/rad", "rad") == product("N.m")
    assert product("N.m.s/rad", "rad/s") == product("N.m")
    assert product("rad/s2") == {"rad": 1, "s": -2}
    assert product("m/s2") == {"m": 1, "s": -2}
    assert product("m/s") == {"m": 1, "s": -1}


def test_every_variable_is_described_and_explicit(fmu):
    texts = [v.get("description") for v in fmu.variables]
    assert all(texts)
    assert len(set(texts)) == len(texts)
    assert all(v.get("variability") and v.get("causality") for v in fmu.variables)


def test_outputs_are_reals_without_start(fmu):
    for number in fmu.of_causality("output"):
        variable = fmu.variables[number - 1]
        assert variable.get("initial") == "calculated"
        assert variable.find("Real").get("start") is None


def test_ranges_are_given_where_they_mean_something(fmu):
    ranges = {v.get("name"): v.find("Real") for v in fmu.variables if v.find("Real") is not None}
    assert float(ranges["joint[2].stiffness"].get("min")) == 0.0
    assert (float(ranges["tcp.qx"].get("min")), float(ranges["tcp.qx"].get("max"))) == (-1.0, 1.0)
    assert float(ranges["tcp.qw"].get("min")) == -1.0
    assert float(ranges["compliance.xx"].get("nominal")) < 1e-3


def test_outputs_and_initial_unknowns_are_listed_in_order_with_dependencies(fmu):
    for element in ("Outputs", "InitialUnknowns"):
        unknowns = fmu.description.findall(f"ModelStructure/{element}/Unknown")
        assert [int(u.get("index")) for u in unknowns] == fmu.of_causality("output")
        for unknown in unknowns:
            depends = [int(k) for k in unknown.get("dependencies").split()]
            assert depends == sorted(set(depends))
            # A robot starts at rest, whatever is set.
            name = fmu.variables[int(unknown.get("index")) - 1].get("name")
            # In co-simulation, the only interface here, outputs follow nothing at a communication point.
            starts_at_rest = name.startswith("deflection_rate[")
            assert bool(depends) == (element == "InitialUnknowns" and not starts_at_rest)


def test_experiment_and_identity_are_stated(fmu):
    root = fmu.description
    experiment = root.find("DefaultExperiment")
    assert float(experiment.get("stepSize")) > 0.0
    assert float(experiment.get("tolerance")) > 0.0
    for key in ("description", "author", "version", "license", "copyright", "generationTool"):
        assert root.get(key), key
    assert root.get("variableNamingConvention") == "structured"
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", root.get("generationDateAndTime"))
    assert len(root.findall("LogCategories/Category")) >= 4


def test_capabilities_are_declared(fmu):
    flags = fmu.description.find("CoSimulation").attrib
    assert flags["needsExecutionTool"] == "false"
    assert "true" not in (flags["canGetAndSetFMUstate"], flags["canSerializeFMUstate"])
    assert flags["canInterpolateInputs"] == "false"
    assert flags["canHandleVariableCommunicationStepSize"] == "true"
    assert flags["canBeInstantiatedOnlyOncePerProcess"] == "false"


def test_libraries_bear_the_identifier(fmu):
    identifier = fmu.description.find("CoSimulation").get("modelIdentifier")
    assert f"binaries/linux64/{identifier}.so" in fmu.content
    assert f"binaries/win64/{identifier}.dll" in fmu.content
    assert identifier == "ElasticRobot"


def test_archive_is_compressed_and_clean(fmu):
    assert all(info.compress_type == zipfile.ZIP_DEFLATED for info in fmu.archive.infolist())
    assert not [n for n in fmu.content if "__pycache__" in n or n.endswith(".pyc") or "\\" in n]


def test_documentation_icon_licences_and_environment_are_there(fmu):
    class Page(HTMLParser):
        text = ""

        def handle_data(self, data):
            self.text += data

    page = Page()
    page.feed(fmu.content["documentation/index.html"].decode())
    for variable in fmu.variables:
        assert variable.get("name") in page.text
    for shown in ("Frames and signs", "joint[1].tilt[2]", "inertia", "Gravity 0, 0, -9.81"):
        assert shown in page.text
    assert fmu.content["model.png"].startswith(b"\x89PNG")
    for owner in ("license", "pythonfmu"):
        assert b"MIT" in fmu.content[f"documentation/licenses/{owner}.txt"]
    line = r'python -m pip install "numpy>=[\d.]+" "scipy>=[\d.]+" "pin>=[\d.]+"'
    assert re.search(line, fmu.content["documentation/externalDependencies.txt"].decode())
    needed = fmu.content["resources/requirements.txt"].decode().split()
    assert [re.match(r"\w+", n)[0] for n in needed] == ["numpy", "scipy", "pin"]
    assert b"pinocchio" in fmu.content["resources/environment.yml"]


def test_the_model_is_the_installed_package(fmu):
    package = Path(elastic_robot.__file__).parent
    inside = {
        name.removeprefix("resources/elastic_robot/"): data
        for name, data in fmu.content.items()
        if name.startswith("resources/elastic_robot/")
    }
    installed = {
        f.relative_to(package).as_posix(): f.read_bytes()
        for f in package.rglob("*")
        if f.is_file() and "__pycache__" not in f.parts
    }
    installed.pop("coupling.py")  # the desk side
    assert inside == installed


def test_start_values_are_exact(fmu, example):
    starts = {
        v.get("name"): v.find("Real").get("start")
        for v in fmu.variables
        if v.get("causality") == "parameter" and v.find("Real") is not None
    }
    for i, joint in enumerate(example.joints, 1):
        if joint.stiffness is not None:
            assert float(starts[f"joint[{i}].stiffness"]) == joint.stiffness
            assert float(starts[f"joint[{i}].backlash"]) == joint.backlash


def test_the_same_input_gives_the_same_bytes(example, tmp_path, monkeypatch):
    one, two = (build_fmu(example, tmp_path / name, PYTHON) for name in ("1.fmu", "2.fmu"))
    assert one.read_bytes() == two.read_bytes()
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1500000000")
    dated, again = (build_fmu(example, tmp_path / name, PYTHON) for name in ("3.fmu", "4.fmu"))
    assert dated.read_bytes() == again.read_bytes() != one.read_bytes()
    stated = Fmu.read(dated).description.get("generationDateAndTime")
    assert stated == "2017-07-14T02:40:00Z"


def test_the_guid_follows_the_content(fmu, example, tmp_path):
    moon = Fmu.read(
        build_fmu(replace(example, gravity=(0.0, 0.0, -1.62)), tmp_path / "moon.fmu", PYTHON)
    )
    assert moon.description.get("guid") != fmu.description.get("guid")


def test_a_wrong_date_is_refused(tmp_path, monkeypatch, capsys):
    monkeypatch.setitem(os.environ, "SOURCE_DATE_EPOCH", "yesterday")
    assert main(["-o", str(tmp_path / "R.fmu"), "--kind", "python"]) == 2
    assert (
        "SOURCE_DATE_EPOCH: expected a whole number of seconds since 1970, got 'yesterday'"
        in capsys.readouterr().err
    )


def test_descriptions_tell_the_names_of_joints(example, tmp_path):
    joints = [replace(joint, name=f"axis_{k}") for k, joint in enumerate(example.joints)]
    named = replace(example, joints=tuple(joints))
    fmu = Fmu.read(build_fmu(named, tmp_path / "R.fmu", BuildOptions("native")))
    texts = {v.get("name"): v.get("description") for v in fmu.variables}
    for name, wanted in (
        ("joint[2].stiffness", "joint[2] (axis_1)"),
        ("joint[1].tilt[2].damping", "joint[1].tilt[2] (axis_0)"),
        ("q_cmd[6]", "drive 6 (axis_5)"),
        ("joint[3].bend.below", "joint[3] (axis_2)"),
    ):
        assert wanted in texts[name]
