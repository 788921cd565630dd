"""The examples of milling: what their speeds are worth, and that they couple."""

import re

import numpy as np
import pytest
from line_case import changed_text
from places import CASES

from coupling.case.file import load_case
from coupling.process.engaged_arcs import RemovedStock
from coupling.run.cut_figures import cut_result, cut_warnings
from coupling.run.execute import run_coupling
from coupling.run.figures import shares_of
from coupling.stability.case_cut import milling_of


def shortened(speed: int, tmp_path, *changes: tuple[str, str]):
    case = tmp_path / f"milling_{speed}.toml"
    case.write_text(changed_text(CASES / case.name, *changes))
    return load_case(case)


def test_doubled_speed_at_equal_feed_takes_37_percent_off_the_force_across_the_feed(tmp_path):
    """(c/8 + r/pi) / (c/4 + r/pi) with c = 0.2 mm and r = K_te/K_tc = 0.055 mm: 0.63."""
    mean = ('force             = "tooth-passing"', 'force = "mean"')
    across = []
    for speed in (20000, 40000):
        case = shortened(speed, tmp_path, mean, ("sample_s = 0.0001", "sample_s = 0.005"))
        wrench = case.process.evaluate(case.desired).wrench.wrench[0]
        depth = -case.task.part.coordinates(case.desired.position[0])[:, 2]
        velocity = np.gradient(case.desired.position[0, :, 0], case.desired.time)
        steady = (depth > 3e-3 - 1e-9) & (velocity > 0.13333)
        assert np.count_nonzero(steady) > 20
        across.append(wrench[steady, 1].mean())
    ratio = (0.1 / 4 + 0.055 / np.pi) / (0.2 / 4 + 0.055 / np.pi)
    assert across[1] / across[0] == pytest.approx(ratio, rel=1e-3)
    assert 1.0 - across[1] / across[0] == pytest.approx(0.37, abs=0.005)


@pytest.mark.parametrize("speed", [20000, 40000])
def test_milling_case_shortened_couples_through_the_dynamic_fmu(tmp_path, speed):
    case = shortened(
        speed,
        tmp_path,
        (
            "[0.06, 0.0, -0.003], [0.14, 0.0, -0.003], [0.2, 0.0, 0.001]]",
            "[0.002, 0.0, 0.0], [0.004, 0.0, 0.0]]",
        ),
        ("blend_s  = 0.1", "blend_s = 0.01"),
        ("[0.0, 0.0, 0.001]", "[0.0, 0.0, 0.0001]"),
    )
    run = run_coupling(case)
    assert run.correction.converged, run.correction.reason
    assert case.mode == "dynamic"
    # It sags by about 1.5 mm into the work, half as deep as the case's cut.
    assert 100.0 < run.correction.response.wrench.peak_force < 1000.0
    assert shares_of(run).process.maximum > 1e-6


def test_what_the_end_of_a_cutter_removes_is_told_where_it_is_much(tmp_path):
    """A helix of three turns: a disc of 3 mm, 603 mm3 of 1593, is cut by the end; a slot has little.

    The removal rate has that share: its integral is the volume that goes from the raster.
    """
    turns = "".join(f"G3 X5 Y0 Z-{depth} I-5 J0 F600\n" for depth in (1, 2, 3))
    paths = {
        "helix": f"G0 X5 Y0 Z5\nG1 Z0 F600\n{turns}G3 X5 Y0 I-5 J0\nG0 Z10\n",
        "slot": "G0 X0 Y0 Z5\nG1 Z0 F600\nG1 X40 Z-3\nG1 X150\nG0 Z10\n",
    }
    said = {}
    for name, lines in paths.items():
        (tmp_path / f"{name}.ngc").write_text(f"G21 G90 G17 G94\nS20000 M3\n{lines}M30\n")
        text = (CASES / "milling_20000.toml").read_text().replace('engagement        = "slot"', "")
        path = f'[tool_path]\nkind = "gcode"\nfile = "{name}.ngc"\n'
        path += "rapid_m_s = 0.1\nsample_s = 0.0002\n\n"
        text = (
            text.partition("[tool_path]")[0] + path + "[process]" + text.partition("[process]")[2]
        )
        (tmp_path / f"{name}.toml").write_text(text)
        case = load_case(tmp_path / f"{name}.toml")
        cut = cut_result(case)
        assert cut is not None
        engaged = milling_of(case).engaged
        assert isinstance(engaged, RemovedStock)
        assert cut.volume_m3 == pytest.approx(engaged.removal.volume, rel=0.01)
        said[name] = [line for line in cut_warnings(case, cut) if "end of the cutter" in line]
    (line,) = said["helix"]
    assert re.search(r"process: 3[789] % of the 1[56]\d\d mm3 .* no force, torque", line)
    assert said["slot"] == []


def test_both_milling_cases_differ_in_the_speed_alone():
    texts = [(CASES / f"milling_{speed}.toml").read_text() for speed in (20000, 40000)]
    rows = [text.split("[robot]")[1].splitlines() for text in texts]
    different = [pair for pair in zip(*rows, strict=True) if pair[0] != pair[1]]
    assert len(different) == 1
    assert [re.sub(r"\D", "", row) for row in different[0]] == ["200000", "400000"]
