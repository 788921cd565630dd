"""Start values of strings, which an FMU is built with."""

from __future__ import annotations

import fmpy
import pytest
from places import HOSTS

from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu
from elastic_robot.errors import ParameterError


@pytest.mark.parametrize("kind", ["native", "python"])
def test_start_values_are_said_and_taken_in_both_kinds_of_fmu(kind, example, tmp_path, forked):
    """What the description says is what an instance has, before and after a reset of its values."""
    strings = {"mode": "quasistatic", "trajectory": "motion.npz", "torque_curve": "linear"}
    fmu = build_fmu(example, tmp_path / "R.fmu", BuildOptions(kind, strings=strings))
    variables = fmpy.read_model_description(str(fmu)).modelVariables
    assert {v.name: v.start for v in variables if v.name in strings} == strings
    script = tmp_path / "asked.py"
    script.write_text(f"""
import sys
sys.path.append({str(HOSTS)!r})
from fmu import Fmu
fmu = Fmu(sys.argv[1])
slave = fmu.instance().slave
names = {list(strings)!r}
for _ in range(2):
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    print([v.decode() for v in slave.getString([fmu.references[name] for name in names])])
    slave.reset()
""")
    done = forked(script, fmu)
    assert done.stdout.splitlines() == [str(list(strings.values()))] * 2, done.stderr


@pytest.mark.parametrize("value", ["", "two words", "a" * 64, "line\nbreak"])
def test_a_start_value_that_is_no_word_is_refused(value):
    with pytest.raises(BuildError, match="start value of trajectory: expected 1 to 63 bytes"):
        BuildOptions(strings={"trajectory": value})


def test_a_start_value_of_no_string_or_out_of_its_choices_is_refused(example, tmp_path):
    for strings, sentence in (
        ({"speed": "fast"}, "expected a string variable, got 'speed'"),
        ({"mode": "fast"}, "mode: expected one of dynamic, quasistatic, got 'fast'"),
    ):
        with pytest.raises(ParameterError, match=sentence):
            build_fmu(example, tmp_path / "R.fmu", BuildOptions(strings=strings))
