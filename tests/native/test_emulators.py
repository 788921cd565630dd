"""Native FMUs for other platforms, made here and run in emulators; `make emulators` asks for them."""

import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from emulators import EMULATORS
from native_fmu import NativeFmu, run_master
from places import TESTS

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.native_standards import STANDARDS
from coupling.native.compiler import PLATFORMS, SOURCES, zig
from coupling.native.core_library import core_library
from coupling.native.desk_library import desk_library

# Root of the emulated system's own libraries (Debian's libc6-arm64-cross).
AARCH64_ROOT = Path("/usr/aarch64-linux-gnu")
MAGIC = {
    "linux64": b"\x7fELF",
    "aarch64-linux": b"\x7fELF",
    "win64": b"MZ",
    "darwin64": b"\xcf\xfa\xed\xfe",
    "aarch64-darwin": b"\xcf\xfa\xed\xfe",
}
needs_wine = pytest.mark.skipif(
    not EMULATORS or shutil.which("wine") is None,
    reason="run by `make emulators`; needs ziglang and wine",
)


def _compile(target: str, file: Path, *sources: Path | str) -> None:
    flags = ["-target", target, "-std=c99", "-O1", "-fno-sanitize=all", f"-I{SOURCES / 'fmi'}"]
    command = [*zig(), *flags, "-o", str(file), *map(str, sources)]
    subprocess.run(command, cwd=file.parent, check=True)


def _in_wine(folder: Path, *command: str) -> str:
    done = subprocess.run(
        [str(shutil.which("wine")), *command],
        cwd=folder,
        env={**os.environ, "WINEPREFIX": str(folder / "wine"), "WINEDEBUG": "-all"},
        capture_output=True,
        text=True,
        timeout=240,
    )
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    return done.stdout


@pytest.mark.skipif(not EMULATORS, reason="run by `make emulators`; needs ziglang")
@pytest.mark.parametrize("name", PLATFORMS)
def test_libraries_for_other_platforms_are_made_here(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for library in (core_library, desk_library):
        assert library(PLATFORMS[name]).read_bytes().startswith(MAGIC[name])
    assert not list(tmp_path.iterdir())  # nothing is left where it was asked for


@pytest.mark.skipif(
    not EMULATORS or shutil.which("qemu-aarch64") is None or not AARCH64_ROOT.is_dir(),
    reason="run by `make emulators`; needs ziglang, qemu-user and libc6-arm64-cross",
)
def test_the_aarch64_library_gives_the_same_poses_in_an_emulator(native, host, example, tmp_path):
    """Other instructions and another libm round otherwise: 1e-10 m after 100 steps."""
    name = "aarch64-linux"
    other = NativeFmu(
        build_fmu(example, tmp_path / "A.fmu", BuildOptions("native", (name,))),
        tmp_path / "fmu",
        platform=name,
    )
    target = PLATFORMS[name].target.rpartition(".2.")[0]
    _compile(target, tmp_path / "host", TESTS / "native" / "host.c", "-lm")
    emulated = [str(shutil.which("qemu-aarch64")), "-L", str(AARCH64_ROOT), str(tmp_path / "host")]
    found, expected = (
        np.loadtxt(run_master(f, command, "run").splitlines(), delimiter=",")
        for f, command in ((other, emulated), (native, [str(host)]))
    )
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-10)


WINDOWS_HOST = """
#include <stdio.h>
#include <stdlib.h>
#include <windows.h>
#include "fmi2Functions.h"
int main(int count, char **arguments)
{
    HMODULE library = LoadLibraryA(arguments[1]);
    fmi2CallbackFunctions none = {0};
    fmi2ValueReference z = (fmi2ValueReference)atoi(arguments[4]);
    double value = 0.0;
    fmi2Component robot;
    (void)count;
    if (library == NULL)
        return 1;
#define GET(name) name##TYPE *name##_ = (name##TYPE *)(void *)GetProcAddress(library, #name)
    GET(fmi2Instantiate);
    GET(fmi2SetupExperiment);
    GET(fmi2EnterInitializationMode);
    GET(fmi2ExitInitializationMode);
    GET(fmi2DoStep);
    GET(fmi2GetReal);
    robot = fmi2Instantiate_("r", fmi2CoSimulation, arguments[2], arguments[3], &none, 0, 0);
    if (robot == NULL)
        return 2;
    fmi2SetupExperiment_(robot, 0, 0.0, 0.0, 0, 0.0);
    fmi2EnterInitializationMode_(robot);
    fmi2ExitInitializationMode_(robot);
    for (int k = 0; k < 100; k++)
        if (fmi2DoStep_(robot, 0.004 * k, 0.004, 1) != fmi2OK)
            return 3;
    fmi2GetReal_(robot, &z, 1, &value);
    printf("%.17g\\n", value);
    return 0;
}
"""


@needs_wine
def test_the_windows_library_runs_in_wine(native, example, tmp_path):
    """Height of the TCP at rest after 100 steps, as here to 1e-12 m."""
    other = NativeFmu(
        build_fmu(example, tmp_path / "W.fmu", BuildOptions("native", ("win64",))),
        tmp_path / "fmu",
        platform="win64",
    )
    (tmp_path / "host.c").write_text(WINDOWS_HOST)
    _compile(PLATFORMS["win64"].target, tmp_path / "host.exe", tmp_path / "host.c")
    library = f"Z:{other.library}".replace("/", "\\")
    resources = f"file:///Z:{other.folder / 'resources'}"
    z = str(other.references["tcp.z"])
    said = _in_wine(tmp_path, str(tmp_path / "host.exe"), library, other.guid, resources, z)
    slave = native.started(q=[0.0] * 6)
    for k in range(100):
        slave.doStep(0.004 * k, 0.004)
    assert float(said) == pytest.approx(native.get(slave, "tcp.z")[0], abs=1e-12)


@needs_wine
def test_a_windows_path_of_the_resources_is_taken_in_wine(pair, tmp_path):
    """With backslashes and one at the end, as FMI 3.0 wants it there; the same random calls."""
    sources = [TESTS / "native" / "fuzz_steps.c", *STANDARDS["3"].sources()]
    _compile(PLATFORMS["win64"].target, tmp_path / "fuzz.exe", "-DFMI=3", *sources)
    resources = f"Z:{pair.folder3 / 'resources'}/".replace("/", "\\")
    said = _in_wine(tmp_path, "fuzz.exe", pair.description.guid, resources, "200")
    assert said.startswith("200 calls")
