"""Return mapping by von Mises in plane stress, and of whichever metal a sheet is of."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.sheet_fem.compiled import compile_function, inlined_as
from coupling.sheet_fem.material import Material, yield_stress
from coupling.sheet_fem.orthotropic import Yld91
from coupling.sheet_fem.yld91 import yld91

# Stress beyond the yield stress, relative to it, from which one more iteration of Newton's method ends
# the return mapping: it leaves the square of that.
_CONVERGED = 1e-7
# What is on the yield surface after an increment, to this share of the stress, begins the next one
# elastic: rounding does not choose between two tangents.
_ON_SURFACE = 1e-9
_MAX_ITERATIONS = 50
Metal = Material | Yld91


@compile_function
def von_mises(
    material: Material,
    strain: np.ndarray,
    plastic: np.ndarray,
    stress: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> None:
    """Return mapping of one layer, projected to plane stress [SimoTaylor1986].

    Arguments as of `return_mapping.plane_stress`, strain (3,) [1].
    """
    E, nu = material.youngs_modulus, material.poisson_ratio
    G = 0.5 * E / (1.0 + nu)
    bulk = E / (1.0 - nu)  # stress 11 + 22 per strain 11 + 22
    sum_ = bulk * (strain[0] + strain[1] - plastic[0] - plastic[1])
    difference = 2.0 * G * (strain[0] - strain[1] - plastic[0] + plastic[1])
    shear = G * (strain[2] - plastic[2])
    a_sum = sum_ * sum_ / 6.0
    a_difference = 0.5 * difference * difference + 2.0 * shear * shear
    before = plastic[3]
    xi = a_sum + a_difference  # stress deviator squared
    q = np.sqrt(1.5 * xi)  # von Mises stress
    limit, slope = yield_stress(material, before)
    multiplier = 0.0
    after = before
    c_sum, c_difference = bulk / 3.0, 2.0 * G
    if q > (1.0 + _ON_SURFACE) * limit:
        # The deviator falls with 1 + c multiplier, c a mean of both: so the stress beyond the yield
        # stress, times that, is nearly a straight line.  It begins where what the trial strain has
        # beyond the yield strain is all plastic.
        c = (c_sum * a_sum + c_difference * a_difference) / xi
        limit, slope = yield_stress(material, before + (q - limit) / (1.5 * c))
        multiplier = max(q / limit - 1.0, 0.0) / c
        low, high = 0.0, np.inf
        for _ in range(_MAX_ITERATIONS):
            d_sum = 1.0 + c_sum * multiplier
            d_difference = 1.0 + c_difference * multiplier
            part_sum = a_sum / (d_sum * d_sum)
            part_difference = a_difference / (d_difference * d_difference)
            q = np.sqrt(1.5 * (part_sum + part_difference))
            q_slope = (
                -1.5
                / q
                * (c_sum * part_sum / d_sum + c_difference * part_difference / d_difference)
            )
            fall = 1.0 + c * multiplier
            after = before + 2.0 / 3.0 * multiplier * q
            limit, slope = yield_stress(material, after)
            excess = q - limit
            beyond_slope = q_slope - slope * 2.0 / 3.0 * (q + multiplier * q_slope)
            if excess > 0.0:
                low = multiplier
            else:
                high = multiplier
            multiplier -= excess * fall / (c * excess + fall * beyond_slope)
            if abs(excess) <= _CONVERGED * limit:
                break
            if not low < multiplier < high:
                multiplier = 0.5 * (low + high) if np.isfinite(high) else 2.0 * low + 1.0 / c
        d_sum = 1.0 + c_sum * multiplier
        d_difference = 1.0 + c_difference * multiplier
        sum_ /= d_sum
        difference /= d_difference
        shear /= d_difference
        xi = sum_ * sum_ / 6.0 + 0.5 * difference * difference + 2.0 * shear * shear
        after = before + multiplier * np.sqrt(2.0 / 3.0 * xi)
    stress[0] = 0.5 * (sum_ + difference)
    stress[1] = 0.5 * (sum_ - difference)
    stress[2] = shear
    # Flow direction P sigma.
    p0 = sum_ / 6.0 + 0.5 * difference
    p1 = sum_ / 6.0 - 0.5 * difference
    p2 = 2.0 * shear
    new_plastic[0] = plastic[0] + multiplier * p0
    new_plastic[1] = plastic[1] + multiplier * p1
    new_plastic[2] = plastic[2] + multiplier * p2
    new_plastic[3] = after
    m_sum = bulk / (1.0 + c_sum * multiplier)
    m_difference = 2.0 * G / (1.0 + c_difference * multiplier)
    m_shear = 0.5 * m_difference
    tangent[0, 0] = tangent[1, 1] = 0.5 * (m_sum + m_difference)
    tangent[0, 1] = tangent[1, 0] = 0.5 * (m_sum - m_difference)
    tangent[0, 2] = tangent[1, 2] = tangent[2, 0] = tangent[2, 1] = 0.0
    tangent[2, 2] = m_shear
    if multiplier > 0.0:
        n0 = tangent[0, 0] * p0 + tangent[0, 1] * p1
        n1 = tangent[1, 0] * p0 + tangent[1, 1] * p1
        n2 = m_shear * p2
        hardening = 2.0 * xi * slope / (3.0 - 2.0 * slope * multiplier)
        alpha = 1.0 / (p0 * n0 + p1 * n1 + p2 * n2 + hardening)
        tangent[0, 0] -= alpha * n0 * n0
        tangent[1, 1] -= alpha * n1 * n1
        tangent[2, 2] -= alpha * n2 * n2
        tangent[0, 1] -= alpha * n0 * n1
        tangent[1, 0] = tangent[0, 1]
        tangent[0, 2] -= alpha * n0 * n2
        tangent[2, 0] = tangent[0, 2]
        tangent[1, 2] -= alpha * n1 * n2
        tangent[2, 1] = tangent[1, 2]


# What brings a layer's stress back to the yield surface of each type of metal.
RETURN_MAPPINGS: dict[type, Callable[..., None]] = {Material: von_mises, Yld91: yld91}


def plane_stress(
    material: Metal,
    strain: np.ndarray,
    plastic: np.ndarray,
    stress: np.ndarray,
    tangent: np.ndarray,
    new_plastic: np.ndarray,
) -> None:
    """Return mapping of one layer in plane stress.

    Vectors are (11, 22, 12); strains carry the engineering shear 2 eps_12.

    Args:
        material: Sheet metal.
        strain: Logarithmic strain [1], (3,).
        plastic: Plastic strain and equivalent plastic strain before [1], (4,).
        stress: Written [Pa], (3,).
        tangent: Written, d stress / d strain [Pa], (3, 3).
        new_plastic: Written: `plastic` after [1], (4,).
    """
    RETURN_MAPPINGS[type(material)](material, strain, plastic, stress, tangent, new_plastic)


@inlined_as(plane_stress)
def _return_mapping(material, strain, plastic, stress, tangent, new_plastic):  # type: ignore[no-untyped-def]
    return RETURN_MAPPINGS[material.instance_class].py_func  # type: ignore[attr-defined]
