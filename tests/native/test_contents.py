"""What is in a native FMU of either version of FMI: files, sources, the library's symbols."""

import re
import shutil
import subprocess
import zipfile
from dataclasses import dataclass
from pathlib import Path

import fmpy
import fmpy.validation
import numpy as np
import pytest
from lxml import etree
from native_fmu import NativeFmu, build_master, compiled, run_master

from coupling.files.robot_file import load_robot, shipped_robots
from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.native_standards import STANDARDS
from coupling.native.compiler import SOURCES, host_platform

SCHEMAS = Path(fmpy.__file__).parent / "schema" / "fmi3"
SYSTEM = {"libc.so.6", "libm.so.6", "ld-linux-x86-64.so.2", "ld-linux-aarch64.so.1"}
WARNED = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-fPIC", "-shared")


@dataclass
class Packed:
    """An FMU with its sources, unpacked."""

    fmi: str
    file: Path
    folder: Path

    @property
    def listed(self) -> list[str]:
        """Source files that the FMU names."""
        if self.fmi == "2":
            description = etree.parse(self.folder / "modelDescription.xml")
            found = description.findall("CoSimulation/SourceFiles/File")
            of_exchange = description.findall("ModelExchange/SourceFiles/File")
            assert [e.get("name") for e in of_exchange] == [e.get("name") for e in found]
        else:
            found = etree.parse(self.folder / "sources" / "buildDescription.xml").findall(
                ".//SourceFile"
            )
        return [element.get("name") for element in found]

    @property
    def library(self) -> Path:
        platform = host_platform()
        folder = platform.name if self.fmi == "2" else platform.machine
        return self.folder / "binaries" / folder / f"ElasticRobot{platform.suffix}"


@pytest.fixture(scope="module", params=STANDARDS)
def packed(request, example, tmp_path_factory) -> Packed:
    folder = tmp_path_factory.mktemp("packed")
    fmi = request.param
    file = build_fmu(example, folder / "R.fmu", BuildOptions("native", sources=True, fmi=fmi))
    fmpy.extract(str(file), unzipdir=str(folder / "fmu"))
    return Packed(fmi, file, folder / "fmu")


def objdump(*arguments: str) -> str:
    """What objdump says; the test is skipped where there is none."""
    found = shutil.which("objdump")
    if found is None or host_platform().suffix != ".so":
        pytest.skip("needs objdump on Linux")
    return subprocess.run([found, *arguments], capture_output=True, text=True).stdout


def test_contents_are_valid_and_complete(packed):
    assert fmpy.validation.validate_fmu(str(packed.file)) == []
    with zipfile.ZipFile(packed.file) as archive:
        names = set(archive.namelist())
        licence = archive.read("documentation/licenses/fmi-headers.txt").decode()
        page = archive.read("documentation/index.html").decode()
    assert "2-Clause BSD" in licence
    assert "Modelica Association" in licence
    assert f"FMI {packed.fmi}.0" in page
    fmi, other = packed.fmi, {"2": "3", "3": "2"}[packed.fmi]
    files = {f"sources/fmi/fmi{fmi}.c", f"sources/fmi/fmi{fmi}Functions.h", "resources/robot.txt"}
    assert files <= names
    assert f"sources/fmi/fmi{other}.c" not in names
    assert packed.library.relative_to(packed.folder).as_posix() in names
    assert packed.listed == [
        source.relative_to(SOURCES).as_posix() for source in STANDARDS[fmi].sources()
    ]


def test_what_only_one_version_has(example, packed):
    if packed.fmi == "2":
        assert fmpy.read_model_description(
            str(packed.file)
        ).coSimulation.providesDirectionalDerivative
    else:
        schema = etree.XMLSchema(etree.parse(SCHEMAS / "fmi3BuildDescription.xsd"))
        schema.assertValid(etree.parse(packed.folder / "sources" / "buildDescription.xml"))


@pytest.mark.parametrize(("arrays", "stated"), [(False, "q_cmd[1]"), (True, "force[3]")])
def test_fmi_3_is_valid_and_documented_with_scalars_and_arrays(example, tmp_path, arrays, stated):
    options = BuildOptions("native", fmi="3", arrays=arrays)
    file = build_fmu(example, tmp_path / "R.fmu", options)
    assert fmpy.validation.validate_fmu(str(file)) == []
    with zipfile.ZipFile(file) as archive:
        page = archive.read("documentation/index.html").decode()
    assert [text for text in ("q_cmd[1]", "force[3]") if text in page] == [stated]


@pytest.fixture(scope="module")
def own(packed) -> Path:
    """The packed sources' library as a master makes it: listed files, all warnings, no flags of ours.

    FMI 2.0.5, 2.1.1, FMI 3.0.2, 2.2.2: functions of a shared library have no prefix, "defining the
    FMI2_OVERRIDE_FUNCTION_PREFIX precompiler macro", and its like.
    """
    plain = f"-DFMI{packed.fmi}_OVERRIDE_FUNCTION_PREFIX"
    return compiled([packed.folder / "sources"], *WARNED, plain, *packed.listed, "-lm")


def exported(library: Path) -> set[str]:
    return set(re.findall(r" g .*\.text\s.*\s(\S+)$", objdump("-T", str(library)), re.M))


def test_the_packed_sources_compile_to_the_library_by_themselves(packed, own, tmp_path):
    """And have the functions of their version of FMI, all of them."""
    if packed.fmi == "2":
        fmu = NativeFmu(packed.file, tmp_path / "fmu")
        fmu.library = own
        run_master(fmu, [str(build_master("host", tmp_path / "host"))], "run")
    else:
        header = (SOURCES / "fmi" / "fmi3Functions.h").read_text()
        wanted = set(re.findall(r"fmi3FullName\((fmi3\w+)\)", header))
        assert len(wanted) == 75
        assert wanted <= exported(own)


def test_one_library_has_the_functions_of_all_versions_and_needs_libc_and_libm_only(packed, own):
    assert set(re.findall(r"NEEDED\s+(\S+)", objdump("-p", str(packed.library)))) <= SYSTEM
    found = exported(packed.library)
    version = f"fmi{packed.fmi}"
    assert {n for n in found if n.startswith(version)} == {
        n for n in exported(own) if n.startswith(version)
    }
    assert {name[:4] for name in found} == {f"fmi{fmi}" for fmi in STANDARDS}


def test_the_core_has_no_mutable_global_state(own):
    """Nothing of its own in .data or .bss; constants that need relocation are in .data.rel.ro."""
    shown = objdump("-t", str(own))
    symbols = re.findall(r" O (\.data|\.bss)\s+\S+\s+(?:\.hidden )?(\S+)$", shown, re.M)
    linkers = {"completed.0", "__dso_handle", "__TMC_END__"}
    assert ".text" in shown
    assert {name for _, name in symbols} <= linkers


@pytest.mark.parametrize("arrays", [False, True])
def test_terminals_of_fmi3_are_valid_and_join_all_of_pose_wrench_and_spring(
    arrays, example, tmp_path
):
    """By the standard's schema; a member is a variable of the FMU, and in one terminal only."""
    fmu = build_fmu(example, tmp_path / "R.fmu", BuildOptions(fmi="3", arrays=arrays))
    with zipfile.ZipFile(fmu) as archive:
        terminals = etree.fromstring(archive.read("terminalsAndIcons/terminalsAndIcons.xml"))
        assert archive.read("terminalsAndIcons/icon.png").startswith(b"\x89PNG")
    etree.XMLSchema(etree.parse(SCHEMAS / "fmi3TerminalsAndIcons.xsd")).assertValid(terminals)
    variables = {v.name: v for v in fmpy.read_model_description(str(fmu)).modelVariables}
    members = {
        terminal.get("name"): [m.get("variableName") for m in terminal]
        for terminal in terminals.iter("Terminal")
    }
    joined = [name for names in members.values() for name in names]
    assert len(joined) == len(set(joined))
    causes = {name: {variables[m].causality for m in names} for name, names in members.items()}
    inputs = {name: {"input"} for name in ("wrench", "wrench_rate", "contact_spring")}
    assert causes == {"pose": {"output"}, **inputs}
    sizes = {name: len(names) for name, names in members.items()}
    expected = (2, 2, 2, 3) if arrays else (7, 6, 6, 12)
    assert tuple(sizes.values()) == expected


@pytest.mark.parametrize("robot", shipped_robots())
def test_eulers_method_in_500_steps_to_the_default_stop_time_stays_at_rest(robot, tmp_path):
    """As a checker without options integrates model exchange."""
    fmu = build_fmu(load_robot(shipped_robots()[robot]), tmp_path / "R.fmu")
    stop = float(fmpy.read_model_description(str(fmu)).defaultExperiment.stopTime)
    found = fmpy.simulate_fmu(
        str(fmu),
        fmi_type="ModelExchange",
        solver="Euler",
        stop_time=stop,
        step_size=stop / 500,
        output_interval=stop / 500,
        output=["tcp.x", "tcp.y", "tcp.z"],
        record_events=False,
    )
    assert len(found) == 501
    for axis in "xyz":
        assert np.ptp(found[f"tcp.{axis}"]) < 1e-9
