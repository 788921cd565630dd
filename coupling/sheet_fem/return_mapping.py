"""Return mapping of whichever metal a sheet is of; the metal's type chooses, when code is compiled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from coupling.sheet_fem.compiled import inlined_as
from coupling.sheet_fem.material import Material
from coupling.sheet_fem.orthotropic import Yld91
from coupling.sheet_fem.von_mises import von_mises
from coupling.sheet_fem.yld91 import yld91

Metal = Material | Yld91

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
