"""Sources of the FMU: layers of the core, several FMUs in one program, and as a shared library."""

import re
import shutil
import subprocess
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import fmpy
import pytest
from native_fmu import compiled, compiler
from places import TESTS
from random_robots import make_robot

from coupling.errors import BuildError
from coupling.fmu_export.build import KINDS, BuildOptions, build_fmu
from coupling.native.compiler import SOURCES

MAIN = """
#define USE(name) void run_##name(const char *token, const char *resources, unsigned z);
USE(Left)
USE(Right_One)
int main(int count, char **given)
{
    (void)count;
    run_Left(given[1], given[2], (unsigned)atoi(given[3]));
    run_Right_One(given[4], given[5], (unsigned)atoi(given[6]));
    return 0;
}
"""
INCLUDE = re.compile(r'^#include "(?:[./\w]*/)?(\w+)\.h"', re.MULTILINE)
# Each folder knows those above it in this list alone.
FOLDERS = (
    "io",
    "core/chain",
    "core/elements",
    "core/load",
    "core/step",
    "core/outputs",
    "core",
    "fmi",
)


class Packed:
    """A robot's FMU with sources, unpacked and compiled."""

    def __init__(self, robot, folder: Path, name: str, fmi: str) -> None:
        options = BuildOptions("native", sources=True, fmi=fmi, name=name)
        self.name, self.fmi, self.folder = name, fmi, folder / name
        self.file = build_fmu(robot, folder / f"{name}.fmu", options)
        fmpy.extract(str(self.file), unzipdir=str(self.folder))
        self.sources = self.folder / "sources"
        self.description = fmpy.read_model_description(str(self.folder))
        place = self.folder / "resources"
        resources = place.as_uri() if fmi == "2" else f"{place}/"
        variables = {v.name: v.valueReference for v in self.description.modelVariables}
        self.z = variables["tcp.z"]
        self.given = [self.description.guid, resources, str(self.z)]
        names = [str(f.relative_to(self.sources)) for f in sorted(self.sources.rglob("*.c"))]
        # In one file, as a linker does that leaves all names open.
        self.object = str(compiled([self.sources], "-O0", "-r", "-nostdlib", *names))


@pytest.fixture(scope="module")
def fmus(tmp_path_factory) -> list[Packed]:
    """Two robots in FMUs of either version of FMI, their sources compiled."""
    folder = tmp_path_factory.mktemp("packed")
    return [
        Packed(make_robot(k, 2 + k), folder, name, fmi)
        for k, (name, fmi) in enumerate((("Left", "2"), ("Right_One", "3")), 1)
    ]


def test_two_robots_are_linked_into_one_program(fmus, tmp_path):
    """FMI 2, 2.1.1, FMI 3, 2.2.2: "several FMUs might be present at the same time in an executable ...
    the names of the functions in different FMUs must be different": "prefixed with the model
    identifier".  One is of FMI 2, the other of FMI 3."""
    objects = []
    for fmu in fmus:
        objects.append(fmu.object)
        use = tmp_path / f"use_{fmu.name}.o"
        flags = [f"-DNAME={fmu.name}", f"-DFMI={fmu.fmi}", f"-I{fmu.sources / 'fmi'}"]
        file = str(TESTS / "native" / "static_use.c")
        command = [compiler(), "-std=c99", "-Wall", "-Wextra", "-Werror", "-c", *flags]
        subprocess.run([*command, "-o", str(use), file], check=True)
        objects.append(str(use))
    main, program = tmp_path / "main.c", tmp_path / "program"
    main.write_text(f"#include <stdlib.h>\n{MAIN}")
    subprocess.run([compiler(), "-o", str(program), str(main), *objects, "-lm"], check=True)
    command = [str(program), *fmus[0].given, *fmus[1].given]
    said = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()
    for fmu, found in zip(fmus, said, strict=True):
        result = fmpy.simulate_fmu(
            str(fmu.file),
            stop_time=0.01,
            output_interval=0.01,
            output=["tcp.z"],
            fmi_type="CoSimulation",
        )
        assert abs(float(found) - result["tcp.z"][-1]) < 1e-12
    assert said[0] != said[1]


def test_every_name_with_external_linkage_begins_with_the_identifier(fmus):
    found = shutil.which("nm")
    if found is None:
        pytest.skip("needs nm")
    for fmu in fmus:
        said = subprocess.run(
            [found, "--extern-only", "--defined-only", fmu.object], capture_output=True, text=True
        )
        names = re.findall(r"^[0-9a-f]+ [A-Z] (\S+)$", said.stdout, re.M)
        assert len(names) > 100
        assert {name for name in names if not name.startswith(f"{fmu.name}_")} == set()
        assert f"{fmu.name}_fmi{fmu.fmi}DoStep" in names


@pytest.mark.parametrize("kind", KINDS)
def test_an_fmu_has_the_name_that_it_is_given(example, tmp_path, kind):
    file = build_fmu(example, tmp_path / "any.fmu", BuildOptions(kind, name="Kuka_KR16"))
    description = fmpy.read_model_description(str(file))
    assert description.modelName == description.coSimulation.modelIdentifier == "Kuka_KR16"
    assert fmpy.validation.validate_fmu(str(file)) == []
    result = fmpy.simulate_fmu(str(file), stop_time=0.02, output=["tcp.z"], fmi_type="CoSimulation")
    assert 0.1 < abs(result["tcp.z"][-1]) < 10.0


@pytest.mark.parametrize("name", ["", "6R", "my robot", "robot-1", "ä", "x" * 65])
def test_a_name_that_c_does_not_have_is_refused(name):
    with pytest.raises(BuildError, match="name: expected up to 64 letters, digits and _"):
        BuildOptions(name=name)


def folder(file: Path) -> str:
    return file.parent.relative_to(SOURCES).as_posix()


@cache
def calls() -> dict[Path, set[Path]]:
    """The files whose functions and constants each C file needs, by nm of their objects."""
    nm = shutil.which("nm")
    if nm is None:
        pytest.skip("needs nm")

    def symbols(file: Path) -> tuple[set[str], set[str]]:
        made = compiled([SOURCES], "-O0", "-c", str(file.relative_to(SOURCES)))
        said = subprocess.run([nm, str(made)], capture_output=True, text=True, check=True).stdout
        rows = [line.split()[-2:] for line in said.splitlines()]
        defined = {name for kind, name in rows if kind in "TDRBC"}
        return defined, {name for kind, name in rows if kind == "U"}

    files = sorted(SOURCES.rglob("*.c"))
    with ThreadPoolExecutor(2) as pool:
        found = dict(zip(files, pool.map(symbols, files), strict=True))
    owner = {name: file for file, (defined, _) in found.items() for name in defined}
    return {
        file: {owner[name] for name in needed if name in owner}
        for file, (_, needed) in found.items()
    }


def test_modules_do_not_include_each_other_in_circles():
    included: dict[str, set[str]] = defaultdict(set)
    for file in SOURCES.rglob("*.[ch]"):
        included[file.stem] |= set(INCLUDE.findall(file.read_text())) - {file.stem}
    assert included["run"] >= {"load", "motors"}
    TopologicalSorter(included).prepare()


def test_objects_do_not_call_each_other_in_circles():
    needed = calls()
    assert SOURCES / "core/load/anchor.c" in needed[SOURCES / "core/load/contact_motion.c"]
    TopologicalSorter(needed).prepare()


def test_folders_call_and_include_those_below_them_alone():
    for file, needed in calls().items():
        above = {f for f in needed if FOLDERS.index(folder(f)) > FOLDERS.index(folder(file))}
        assert not above, file
    headers = {file.stem: folder(file) for file in SOURCES.rglob("*.h")}
    for file in SOURCES.rglob("*.[ch]"):
        for name in INCLUDE.findall(file.read_text()):
            assert FOLDERS.index(headers[name]) <= FOLDERS.index(folder(file)), (file, name)


def test_a_file_of_the_core_has_a_header_of_its_name():
    """Or is the kernel, written for several widths behind one header."""
    for file in SOURCES.glob("core/**/*.c"):
        assert file.with_suffix(".h").is_file() or file.stem in {"kernel_plain", "kernel_avx2"}, (
            file
        )


def test_names_of_static_functions_are_found_by_grep():
    """Several words, in one file alone; the kernel is written once for several widths."""
    files: dict[str, set[str]] = defaultdict(set)
    static = re.compile(
        r"^static (?:inline )?(?!const struct)[\w ]*?[\w*]+ \*?(\w+)\(", re.MULTILINE
    )
    for file in SOURCES.rglob("*.c"):
        if not file.stem.startswith("kernel_"):
            for name in static.findall(file.read_text()):
                files[name].add(file.name)
    assert len(files) > 300
    assert {name for name in files if "_" not in name} == set()
    assert {name: found for name, found in files.items() if len(found) > 1} == {}
