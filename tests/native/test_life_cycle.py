"""Calls out of their time, the end, and no instance at all; the table: tests/fmu/test_life_cycle.py."""

from __future__ import annotations

import ctypes
import re
import subprocess
import sys
from pathlib import Path

import pytest
from fmpy.fmi1 import FMICallException

from coupling.native.compiler import SOURCES, host_platform

STEP = 0.004  # [s]


def refused(capfd, call, message: str) -> None:
    with pytest.raises(FMICallException):
        call()
    assert message in capfd.readouterr().err


NO_INSTANCE = """
import ctypes, sys
library = ctypes.CDLL(sys.argv[1])
for name in sys.argv[2:]:
    print(name, getattr(library, name)(*[ctypes.c_void_p(None)] * 12), flush=True)
"""


@pytest.mark.parametrize("fmi", ["2", "3"])
def test_no_instance_is_answered_with_an_error_by_every_function(fmi, pair):
    platform = host_platform()
    folder = pair.folder2 if fmi == "2" else pair.folder3
    named = platform.name if fmi == "2" else platform.machine
    library = folder / "binaries" / named / f"ElasticRobot{platform.suffix}"
    header = Path(SOURCES, "fmi", f"fmi{fmi}Functions.h").read_text()
    found = set(re.findall(rf"fmi{fmi}FullName\((fmi{fmi}\w+)\)", header))
    exported = ctypes.CDLL(str(library))
    asked = sorted(
        name
        for name in found
        if hasattr(exported, name) and not re.search("Instantiate|GetVersion|TypesPlatform", name)
    )
    assert {f"fmi{fmi}DoStep", f"fmi{fmi}Reset", f"fmi{fmi}FreeInstance"} <= set(asked)
    done = subprocess.run(
        [sys.executable, "-c", NO_INSTANCE, str(library), *asked], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout
    answers = dict(line.split() for line in done.stdout.splitlines())
    assert answers.pop(f"fmi{fmi}FreeInstance") is not None
    assert set(answers.values()) == {"3"}, answers
