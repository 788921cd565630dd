"""Dependencies of outputs in co-simulation are what the FMU does at a communication point."""

from __future__ import annotations

import fmpy
import pytest
from fmpy.validation import validate_fmu

from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions, build_fmu

KINDS = {
    "native-2": BuildOptions("native"),
    "native-3": BuildOptions("native", fmi="3"),
}


@pytest.mark.parametrize("dependencies", ["point", "step"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_output_follows_an_input_at_once_and_the_derivative_over_the_step_answers(
    example, tmp_path, run_host, kind, dependencies
):
    """In both modes; the list says so, or on request what outputs follow over a step."""
    known = KINDS[kind]
    options = BuildOptions(known.kind, fmi=known.fmi, dependencies=dependencies)
    file = build_fmu(example, tmp_path / "R.fmu", options)
    assert validate_fmu(str(file)) == []
    run_host("feedthrough", file, int(dependencies == "step"))


def test_a_force_on_the_tool_closes_no_loop_in_what_importers_read(example, tmp_path):
    """Outputs that a process or a display takes follow no load; FMIKit reads lists with kinds only."""
    file = build_fmu(example, tmp_path / "R.fmu", KINDS["native-2"])
    description = fmpy.read_model_description(str(file))
    for unknown in description.outputs:
        name, depends = unknown.variable.name, unknown.dependencies
        assert len(unknown.dependenciesKind or []) == len(depends), name
        if not name.startswith(("compliance", "contact.f")):
            assert not any(d.name.startswith(("force", "moment", "anchor")) for d in depends), name


def test_other_words_for_dependencies_are_refused():
    with pytest.raises(BuildError, match="dependencies: expected one of point, step, got 'none'"):
        BuildOptions(dependencies="none")
