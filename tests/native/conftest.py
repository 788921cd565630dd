"""The example robot's native FMU of FMI 2.0 and masters in C, once for all tests."""

from pathlib import Path

import pytest
from native_fmu import SANITIZERS, NativeFmu, build_master
from native_pair import Pair, make_pair

from coupling.fmu_export.build import BuildOptions, build_fmu
from coupling.fmu_export.native_standards import STANDARDS
from coupling.native.compiler import compile_library, host_platform


@pytest.fixture(scope="session")
def native(example, tmp_path_factory) -> NativeFmu:
    folder = tmp_path_factory.mktemp("native")
    return NativeFmu(
        build_fmu(example, folder / "Robot.fmu", BuildOptions("native")), folder / "fmu"
    )


@pytest.fixture(scope="session")
def host(tmp_path_factory) -> Path:
    """The master tests/native/host.c."""
    return build_master("host", tmp_path_factory.mktemp("host") / "host")


@pytest.fixture(scope="session")
def pair(example, tmp_path_factory) -> Pair:
    """The example robot of both versions of FMI."""
    return make_pair(example, tmp_path_factory.mktemp("pair"))


@pytest.fixture(scope="session")
def sanitized() -> Path:
    """The library of both versions of FMI, under address and undefined-behaviour sanitizers.

    Programs that are linked with it find the core's own functions as well.  It is compiled once.
    """
    sources = dict.fromkeys(file for own in STANDARDS.values() for file in own.sources())
    flags = (*SANITIZERS, "-fvisibility=default")
    return compile_library(host_platform(), list(sources), flags)
