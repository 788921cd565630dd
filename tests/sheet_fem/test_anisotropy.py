"""Yld91 against its definition by principal values, von Mises and closed forms."""

import tomllib

import numpy as np
import pytest
from places import CASES
from scipy.optimize import minimize_scalar
from scipy.spatial.transform import Rotation

pytest.importorskip("numba")

from coupling.path.frame import Frame
from coupling.process import PROCESSES
from coupling.sheet_fem.forming import SheetModel
from coupling.sheet_fem.material import Material, yield_stress
from coupling.sheet_fem.mesh import SheetMesh
from coupling.sheet_fem.orthotropic import Yld91
from coupling.sheet_fem.return_mapping import RETURN_MAPPINGS, Metal, plane_stress
from coupling.toolpaths import Task
from coupling.toolpaths.part import tool_path

ALUMINIUM = Material(70e9, 0.33, 180e6, 0.00057, 0.229)
IDEAL = Material(70e9, 0.33, 100e6, 1.0, 0.0)
BENCHMARK = tomllib.loads((CASES / "bm3.toml").read_text())["process"]
ONES = (1.0,) * 6
MEASURED = tuple(BENCHMARK["anisotropy"])
STRONG = (0.6, 1.5, 1.2, 1.0, 1.0, 1.4)
SHEETS = [(ONES, 8), (MEASURED, 8), (MEASURED, 6), (STRONG, 2), (STRONG, 8), (STRONG, 20)]
METALS = [ALUMINIUM, *(Yld91.of(ALUMINIUM, *sheet) for sheet in SHEETS)]


def turned_into_the_sheet(c, stress) -> np.ndarray:
    """Return the tensor S of the definition, as [Barlat1991] has it: A, B, C times a, b, c."""
    (a, b, c_, _, _, h), (xx, yy, xy) = c, stress
    A, B, C = yy, -xx, xx - yy
    return np.array(
        [
            [(c_ * C - b * B) / 3.0, h * xy, 0.0],
            [h * xy, (a * A - c_ * C) / 3.0, 0.0],
            [0.0, 0.0, (b * B - a * A) / 3.0],
        ]
    )


def effective_stress(c, m: int, stress) -> float:
    """Return the effective stress from principal values."""
    s = np.linalg.eigvalsh(turned_into_the_sheet(c, stress))
    size = np.abs(s).max()
    differences = (s - np.roll(s, 1)) / size
    return float(size * (0.5 * np.sum(np.abs(differences) ** m)) ** (1.0 / m))


def normal(c, m: int, stress) -> np.ndarray:
    """Return the gradient of the effective stress, by the principal axes of S, (3,)."""
    values, axes = np.linalg.eigh(turned_into_the_sheet(c, stress))
    s = effective_stress(c, m, stress)
    ahead, behind = values - np.roll(values, -1), values - np.roll(values, 1)
    slopes = 0.5 * ((ahead / s) ** (m - 1) + (behind / s) ** (m - 1))
    by_tensor = axes @ np.diag(slopes) @ axes.T
    units = (turned_into_the_sheet(c, unit) for unit in np.eye(3))
    return np.array([np.sum(by_tensor * unit) for unit in units])


def hooke(metal: Metal, stress) -> np.ndarray:
    E, nu = metal.youngs_modulus, metal.poisson_ratio
    xx, yy, xy = stress
    return np.array([xx - nu * yy, yy - nu * xx, 2.0 * (1.0 + nu) * xy]) / E


def returned(metal: Metal, strain, plastic=(0.0, 0.0, 0.0, 0.0)):
    stress, tangent, after = np.empty(3), np.empty((3, 3)), np.empty(4)
    plane_stress(metal, np.array(strain), np.array(plastic), stress, tangent, after)
    return stress, tangent, after


def uniaxial(degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([c * c, s * s, c * s])


def states(count: int):
    """Return strains of 1e-6 to 0.3, also along corners and axes, and histories of different age."""
    rng = np.random.default_rng(7)
    special = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (1, -1, 0), (1, -0.5, 0), (-0.5, 1, 0)]
    for k in range(count):
        direction = np.array(special[k % 7], float) if k % 3 == 0 else rng.normal(size=3)
        direction += (k % 2) * 1e-9 * rng.normal(size=3)
        strain = 10.0 ** rng.uniform(-6.0, np.log10(0.3)) * direction / np.linalg.norm(direction)
        age = 10.0 ** rng.uniform(-6.0, 0.0) * (k % 5 > 0)
        plastic = np.append(0.3 * age * rng.normal(size=3), age)
        yield (strain + plastic[:3] if k % 4 else strain), plastic


@pytest.mark.parametrize("exponent", [2, 4])
def test_an_isotropic_sheet_of_exponent_2_or_4_is_von_mises(exponent):
    metal = Yld91.of(ALUMINIUM, ONES, exponent)
    for strain, plastic in states(300):
        for found, expected in zip(
            returned(metal, strain, plastic), returned(ALUMINIUM, strain, plastic), strict=True
        ):
            np.testing.assert_allclose(found, expected, atol=2e-10 * np.max(np.abs(expected)))


@pytest.mark.parametrize(("c", "m"), SHEETS)
def test_what_yields_is_on_the_surface_and_what_does_not_is_inside(c, m):
    """By the definition; steps of 1e-6 to 0.3 at once, from any history; hardening and ideal."""
    yielded = 0
    for base in (ALUMINIUM, IDEAL):
        metal = Yld91.of(base, c, m)
        for strain, plastic in states(400):
            stress, _, after = returned(metal, strain, plastic)
            limit, _ = yield_stress(base, after[3])
            over = effective_stress(c, m, stress) / limit - 1.0
            assert over < 1e-10
            if after[3] > plastic[3]:
                assert over > -1e-10
                yielded += 1
    assert yielded > 300


@pytest.mark.parametrize(("c", "m"), SHEETS)
def test_plastic_strain_is_normal_to_the_surface_and_the_rest_is_elastic(c, m):
    """Its work is that of the effective stress and strain, as s is homogeneous."""
    metal = Yld91.of(ALUMINIUM, c, m)
    for strain, plastic in states(200):
        stress, _, after = returned(metal, strain, plastic)
        flow = after - plastic
        np.testing.assert_allclose(
            hooke(metal, stress) + after[:3], strain, atol=1e-13 + 1e-12 * np.max(np.abs(strain))
        )
        if flow[3] > 0.0:
            size = flow[3] + 1e-5 * plastic[3]  # what rounding of the sum leaves of the flow
            np.testing.assert_allclose(flow[:3], flow[3] * normal(c, m, stress), atol=1e-9 * size)
            assert stress @ flow[:3] == pytest.approx(
                effective_stress(c, m, stress) * flow[3], abs=1e-9 * size * np.max(np.abs(stress))
            )


def of_differences(*differences: float, m: int) -> float:
    return float((0.5 * np.sum(np.abs(differences) ** m)) ** (1.0 / m))


@pytest.mark.parametrize(("c", "m"), [(STRONG, 8), (MEASURED, 8), (STRONG, 6)])
@pytest.mark.parametrize("stress", ["rolling", "transverse", "equibiaxial", "shear"])
def test_yield_stresses_follow_closed_forms(c, m, stress):
    """Elastic a millionth below, plastic a millionth above."""
    a, b, g, _, _, h = np.array(c) / 3.0
    direction, ratio = {
        "rolling": ((1, 0, 0), of_differences(b + 2 * g, b - g, 2 * b + g, m=m)),
        "transverse": ((0, 1, 0), of_differences(a + 2 * g, a - g, 2 * a + g, m=m)),
        "equibiaxial": ((1, 1, 0), of_differences(b - a, 2 * a + b, 2 * b + a, m=m)),
        "shear": ((0, 0, 1), of_differences(6 * h, 3 * h, 3 * h, m=m)),
    }[stress]
    metal = Yld91.of(IDEAL, c, m)
    at_yield = hooke(metal, np.array(direction) * IDEAL.strength / ratio)
    assert returned(metal, (1.0 - 1e-6) * at_yield)[2][3] == 0.0
    assert returned(metal, (1.0 + 1e-6) * at_yield)[2][3] > 0.0


@pytest.mark.parametrize("m", [2, 6, 8, 20])
def test_plane_strain_of_an_isotropic_sheet_is_hosford_s(m):
    """Incompressible also elastically: sigma_2 = sigma_1 / 2, sigma_1 (1/2 + 2^-m)^(1/m) = sigma_y."""
    metal = Yld91.of(IDEAL._replace(poisson_ratio=0.5 - 1e-9), ONES, m)
    first = IDEAL.strength / (0.5 + 0.5**m) ** (1.0 / m)
    stress, _, _ = returned(metal, (0.3, 0.0, 0.0))
    np.testing.assert_allclose(stress, [first, 0.5 * first, 0.0], rtol=1e-6, atol=1.0)


@pytest.mark.parametrize("degrees", [0.0, 15.0, 45.0, 70.0, 90.0])
@pytest.mark.parametrize(("c", "m"), [(ONES, 8), (MEASURED, 8), (STRONG, 6)])
def test_lankford_s_value_in_every_direction(c, m, degrees):
    """Tension at an angle to x: width over thickness strain, from the gradient of the definition."""
    metal = Yld91.of(ALUMINIUM, c, m)
    direction, plastic = uniaxial(degrees), 0.05
    tension = direction / effective_stress(c, m, direction)
    limit, _ = yield_stress(ALUMINIUM, plastic)
    n = normal(c, m, tension)
    stress, _, after = returned(metal, hooke(metal, limit * tension) + plastic * n)
    np.testing.assert_allclose(stress, limit * tension, atol=1e-8 * limit)

    def width_over_thickness(strain) -> float:
        across = uniaxial(degrees + 90.0)
        return float((across @ strain) / -(strain[0] + strain[1]))

    r = width_over_thickness(after[:3])
    assert r == pytest.approx(width_over_thickness(n), rel=1e-7)
    if c == ONES:
        assert r == pytest.approx(1.0, rel=1e-7)
    if degrees == 0.0:
        _, b, g = np.array(c[:3]) / 3.0
        a = c[0] / 3.0
        d12, d23, d31 = (x ** (m - 1) for x in (2 * g + b, b - g, -2 * b - g))
        yy = -d12 * (2 * g + a) + d23 * (2 * a + g) + d31 * (g - a)
        xx = d12 * (2 * g + b) + d23 * (b - g) - d31 * (2 * b + g)
        assert r == pytest.approx(-yy / (xx + yy), rel=1e-7)


@pytest.mark.parametrize("metal", METALS)
def test_tangent_is_the_derivative_of_the_stress(metal):
    """Central differences where neither side crosses the yield stress; symmetric to the last bit."""
    tried = 0
    for strain, plastic in states(120):
        _, tangent, after = returned(metal, strain, plastic)
        assert np.array_equal(tangent, tangent.T)
        step = 1e-6 * max(np.max(np.abs(strain - plastic[:3])), 1e-5)
        sides = [
            [returned(metal, strain + side * step * unit, plastic) for side in (1.0, -1.0)]
            for unit in np.eye(3)
        ]
        yields = {side[2][3] > plastic[3] for pair in sides for side in pair}
        if yields != {after[3] > plastic[3]}:
            continue
        numeric = np.column_stack([(p[0] - m[0]) / (2.0 * step) for p, m in sides])
        np.testing.assert_allclose(tangent, numeric, atol=1e-5 * metal.youngs_modulus)
        tried += 1
    assert tried > 80


def test_every_type_of_metal_is_tried():
    assert {type(metal) for metal in METALS} == set(RETURN_MAPPINGS)


def test_an_isotropic_sheet_answers_in_the_axes_of_the_strain():
    """Turned strains give turned stresses, also where principal values cross."""
    metal = Yld91.of(ALUMINIUM, ONES, 8)
    for strain, _ in states(60):
        tensor = np.array([[strain[0], 0.5 * strain[2]], [0.5 * strain[2], strain[1]]])
        xx, yy, xy = returned(metal, strain)[0]
        for angle in (0.3, 1.2, 2.5):
            c, s = np.cos(angle), np.sin(angle)
            Q = np.array([[c, -s], [s, c]])
            turned = Q @ tensor @ Q.T
            found = returned(metal, (turned[0, 0], turned[1, 1], 2.0 * turned[0, 1]))[0]
            expected = Q @ np.array([[xx, xy], [xy, yy]]) @ Q.T
            np.testing.assert_allclose(
                [[found[0], found[2]], [found[2], found[1]]],
                expected,
                atol=1e-9 * np.max(np.abs(expected)),
            )


def plunged(metal: Metal, x: float = 0.0, y: float = 0.0):
    """Return the equilibrium under a tool 0.4 mm deep in a sheet of 30 mm."""
    sheet = SheetModel(SheetMesh((0.03, 0.03), (8, 8), 1e-3), metal)
    above, below = (sheet.sphere(np.array([x, y, z]), 5e-3) for z in (5.5e-3, 5.1e-3))
    return sheet.equilibrium(sheet.flat(), (above,), (below,), sheet.everywhere())


def test_a_plunge_of_exponent_2_is_that_of_von_mises():
    found = plunged(Yld91.of(ALUMINIUM, ONES, 2), 3e-3, 1e-3)
    expected = plunged(ALUMINIUM, 3e-3, 1e-3)
    assert expected.state.plastic[..., 3].max() > 1e-3
    np.testing.assert_allclose(found.forces, expected.forces, rtol=1e-6)
    assert found.iterations <= expected.iterations + 1


def test_a_sheet_rolled_along_y_is_one_rolled_along_x_turned_round():
    """Exchanged: c1 and c2, c4 and c5, the tool's x and y."""
    c1, c2, c3, c4, c5, c6 = STRONG
    along_x = plunged(Yld91.of(ALUMINIUM, STRONG, 8), 4e-3, 1e-3)
    along_y = plunged(Yld91.of(ALUMINIUM, (c2, c1, c3, c5, c4, c6), 8), 1e-3, 4e-3)
    other = plunged(Yld91.of(ALUMINIUM, STRONG, 8), 1e-3, 4e-3)
    np.testing.assert_allclose(along_y.forces[0], along_x.forces[0, [1, 0, 2]], atol=2e-3)
    assert abs(other.forces[0, 2] - along_x.forces[0, 2]) > 0.5


def test_coefficients_of_two_halve_the_yield_stress():
    """Without hardening; with it the plastic strain counts twice as well."""
    twice = Yld91.of(IDEAL, (2.0,) * 6, 8)
    half = Yld91.of(IDEAL._replace(strength=0.5 * IDEAL.strength), ONES, 8)
    for strain, _ in states(30):
        for found, expected in zip(
            returned(twice, strain)[:2], returned(half, strain), strict=False
        ):
            np.testing.assert_allclose(found, expected, atol=1e-9 * np.max(np.abs(expected)))


def test_the_benchmark_s_tension_along_x_comes_near_its_measured_strength():
    """R_m 198 MPa [Neto2016], from the largest force of tension along the rolling direction."""
    x = np.array([1.0, 0.0, 0.0])
    metal = Material(
        BENCHMARK["youngs_modulus_Pa"],
        BENCHMARK["poisson_ratio"],
        BENCHMARK["strength_Pa"],
        BENCHMARK["prestrain"],
        BENCHMARK["hardening_exponent"],
    )
    m = BENCHMARK["yield_exponent"]
    ratio = effective_stress(MEASURED, m, x)
    assert ratio == pytest.approx(1.059, abs=5e-4)
    sheet, n = Yld91.of(metal, MEASURED, m), normal(MEASURED, m, x)

    def force(plastic: float) -> float:
        stress = yield_stress(metal, plastic)[0] / ratio
        strain = hooke(metal, stress * x) + plastic * n
        return float(returned(sheet, strain)[0][0] * np.exp(-strain[0]))

    largest = -minimize_scalar(lambda e: -force(e), bounds=(0.0, 0.4), method="bounded").fun
    assert largest == pytest.approx(198e6, rel=0.015)


UPRIGHT = Frame(np.zeros(3), Rotation.identity())
PLUNGE = tool_path(
    UPRIGHT, np.arange(3.0), np.array([[2e-3, 1e-3, 1e-3], [2e-3, 1e-3, -3e-4], [2e-3, 1e-3, 1e-3]])
)
ALONG_X = {
    "yield_criterion": "yld91",
    "anisotropy": [0.6, 1.5, 1.2, 1.0, 1.0, 1.4],
    "yield_exponent": 8,
}


def process(**changes):
    data = tomllib.loads((CASES / "cone_fem.toml").read_text())["process"]
    data |= {"sheet_size_m": [0.03, 0.03], "element_m": 0.005} | changes
    return PROCESSES["sheet-fem"].model_validate(data).process(Task(UPRIGHT, PLUNGE))


def test_the_case_s_keys_reach_the_metal():
    """Of exponent 2 and ones the force is that of von Mises, of others it is not."""
    plain = process().evaluate(PLUNGE).wrench.wrench[0, 1]
    mises = process(**ALONG_X | {"anisotropy": [1.0] * 6, "yield_exponent": 2})
    np.testing.assert_allclose(
        mises.evaluate(PLUNGE).wrench.wrench[0, 1], plain, rtol=1e-5, atol=1e-9
    )
    other = process(**ALONG_X).evaluate(PLUNGE).wrench.wrench[0, 1]
    assert abs(other[2] - plain[2]) > 0.01 * plain[2]


def test_every_key_of_the_criterion_is_another_identity():
    tables = [
        {},
        ALONG_X,
        ALONG_X | {"yield_exponent": 6},
        ALONG_X | {"anisotropy": [0.6, 1.5, 1.2, 1.0, 1.0, 1.4000001]},
    ]
    assert len({process(**table).identity for table in tables}) == len(tables)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"yield_criterion": "hill"}, "yield_criterion"),
        ({"anisotropy": [1.0] * 6}, "anisotropy: expected yield_criterion"),
        ({"yield_exponent": 8}, "yield_exponent: expected yield_criterion"),
        (ALONG_X | {"yield_exponent": 7}, "yield_exponent(.|\n)*multiple of 2"),
        (ALONG_X | {"yield_exponent": 0}, "yield_exponent(.|\n)*greater than or equal to 2"),
        (ALONG_X | {"yield_exponent": 22}, "yield_exponent(.|\n)*less than or equal to 20"),
        (ALONG_X | {"anisotropy": [1.0] * 5}, "anisotropy(.|\n)*at least 6"),
        (ALONG_X | {"anisotropy": [1.0, 1.0, 0.0, 1.0, 1.0, 1.0]}, "greater than or equal to 0.1"),
        (ALONG_X | {"anisotropy": [1e300] * 6}, "less than or equal to 10"),
        ({"yield_criterion": "yld91", "yield_exponent": 8}, "anisotropy: expected beside"),
        ({"yield_criterion": "yld91", "anisotropy": [1.0] * 6}, "yield_exponent: expected beside"),
    ],
)
def test_keys_that_do_not_fit_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        process(**changes)
