"""The native FMU of FMI 3.0 with scalars has the variables of FMI 2.0; their numbers: test_fmi3.py."""

from __future__ import annotations

from operator import attrgetter
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.model_description import ModelVariable
from native_pair import make_pair

from build_fmu import main
from coupling.errors import BuildError
from coupling.fmu_export.build import BuildOptions


@pytest.fixture(scope="module")
def described(example, tmp_path_factory) -> dict[str, Path]:
    """Folders of the robot in both versions of FMI."""
    pair = make_pair(example, tmp_path_factory.mktemp("scalars"), arrays=False)
    return {"2": pair.folder2, "3": pair.folder3}


def variables(folder: Path) -> list[ModelVariable]:
    return fmpy.read_model_description(str(folder)).modelVariables


def test_variables_are_those_of_fmi2_to_the_reference_unit_and_start(described):
    """Time, the independent variable, is the last one."""

    def told(fmi: str) -> dict[str, tuple]:
        common = attrgetter(
            *("valueReference", "causality", "variability", "initial", "unit", "min", "max"),
            *("nominal", "description"),
        )
        kinds = {"Real": "Float64"}  # by their names in FMI 3
        return {
            v.name: (*common(v), kinds.get(v.type, v.type), str(v.start), v.shape or None)
            for v in variables(described[fmi])
        }

    two, three = told("2"), told("3")
    assert three["time"][:2] == (len(two) - 1, "independent")
    assert three == two
    text = (described["3"] / "modelDescription.xml").read_text()
    assert "<Dimension" not in text


def test_what_outputs_and_derivatives_follow_is_as_in_fmi2(described):
    """FMI 2 counts variables from one, FMI 3 names value references, which count from zero.

    Parameters are knowns of outputs and derivatives in FMI 3 alone (FMI 3.0.2, 2.4.8).
    """
    reals = [v for v in variables(described["2"]) if v.type == "Real"]
    parameters = {v.valueReference for v in reals if v.causality == "parameter"}

    def structure(fmi: str, elements: tuple[str, ...], key: str, first: int) -> list[list[int]]:
        root = ElementTree.parse(described[fmi] / "modelDescription.xml").getroot()
        found = [e for name in elements for e in root.findall(f"ModelStructure/{name}")]
        return [
            [int(k) - first for k in (e.get(key), *e.get("dependencies").split())] for e in found
        ]

    lists = [f"{name}/Unknown" for name in ("Outputs", "Derivatives", "InitialUnknowns")]
    two = structure("2", tuple(lists), "index", 1)
    names = ("Output", "ContinuousStateDerivative", "InitialUnknown")
    three = structure("3", names, "valueReference", 0)
    tuned = len(two) - len(structure("2", (lists[-1],), "index", 1))
    three[:tuned] = [[k for k in row if k not in parameters] for row in three[:tuned]]
    assert three == two
    states = [v for v in reals if v.derivative is not None]
    assert len(two) == 2 * (sum(v.causality == "output" for v in reals) + len(states))


def test_arrays_are_for_fmi3(tmp_path, capsys):
    assert main(["-o", str(tmp_path / "R.fmu"), "--arrays"]) == 2
    assert "arrays: expected FMI 3, got FMI 2: add --fmi 3" in capsys.readouterr().err
    with pytest.raises(BuildError, match="arrays"):
        BuildOptions("python", arrays=True)
