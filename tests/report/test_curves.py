"""Pictures of curves on first screens: points stand where their values say, and nothing spoils them."""

import re

import numpy as np
import pytest

from coupling.report.curves import SvgCurve, curves


def _points(svg: str) -> np.ndarray:
    (path,) = re.findall(r'<path d="M([^"]*)" class="curve"', svg)
    return np.array([point.split() for point in path.split("L")], float)


def _grid(svg: str, kind: str) -> list[float]:
    return [float(place) for place in re.findall(rf'<path d="M{kind}" class="grid"', svg)]


def test_points_stand_on_the_lines_of_their_numbers():
    x, y = np.array([0.0, 2.0, 10.0]), np.array([-100.0, 0.0, 200.0])
    svg = curves([SvgCurve("measured", "ink", x, y)], "time [s]", "force [N]")
    across = _grid(svg, r"([\d.]+) \d+V\d+")
    assert _points(svg)[:, 0] == pytest.approx([across[0], across[1], across[-1]])
    upright = _grid(svg, r"\d+ ([\d.]+)H\d+")
    assert _points(svg)[[0, 2], 1] == pytest.approx([upright[0], upright[-1]])
    assert all(f">{number}<" in svg for number in (0, 2, 10, -100, 200))


def test_a_power_law_is_straight_on_logarithmic_axes():
    x = np.geomspace(1.0, 100.0, 30)
    svg = curves([SvgCurve("", "ink", x, 3.0 * x**-2)], "f [Hz]", "um/N", logarithmic=True)
    points = _points(svg)
    line = np.polynomial.Polynomial.fit(*points.T, 1)
    assert np.abs(line(points[:, 0]) - points[:, 1]).max() < 0.1


@pytest.mark.parametrize("logarithmic", [False, True])
@pytest.mark.parametrize(
    "values", [[], [0.0], [np.nan, np.inf], [-1.0, -2.0], [5.0, 5.0, 5.0], [1e-300, 1e300]]
)
def test_no_values_spoil_the_picture(values, logarithmic):
    y = np.array(values)
    svg = curves(
        [SvgCurve("<b>", "ink", np.arange(1.0, len(y) + 1), y)], "", "", logarithmic=logarithmic
    )
    assert "nan" not in svg
    assert "inf" not in svg
    assert "&lt;b&gt;" in svg


def test_a_peak_among_a_hundred_thousand_points_is_drawn():
    x = np.linspace(0.0, 1.0, 100_000)
    y = np.where(np.arange(len(x)) == 54_321, 1.0, 0.0)
    svg = curves([SvgCurve("", "ink", x, y)], "", "")
    assert len(svg) < 20_000
    assert _points(svg)[:, 1].min() == pytest.approx(min(_grid(svg, r"\d+ ([\d.]+)H\d+")))
