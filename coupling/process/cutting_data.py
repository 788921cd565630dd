"""Cutting coefficients by material, with source and range, and from Kienzle's specific force."""

from __future__ import annotations

from dataclasses import dataclass

from coupling.process.cutting_force import CuttingCoefficients

# Chip thickness that Kienzle's specific force is given for [m].
_UNIT_CHIP = 1e-3
_HANDBOOK = "typical handbook value"
_REVIEW = "[MillingReview2021, table 5]"


@dataclass(frozen=True)
class CuttingData:
    """Coefficients of a material under a carbide end mill.

    Attributes:
        title: Name of the material, for people.
        coefficients: Cutting coefficients.
        spread: Lowest and highest K_tc that sources or tools lead to [Pa].
        speeds: Lowest and highest usual cutting speed [m/s].
        source: Source of the coefficients.
    """

    title: str
    coefficients: CuttingCoefficients
    spread: tuple[float, float]
    speeds: tuple[float, float]
    source: str


def _data(
    title: str,
    megapascal: tuple[float, float, float],
    newton_per_mm: tuple[float, float, float],
    spread: tuple[float, float],
    speeds: tuple[float, float],
    source: str,
) -> CuttingData:
    """Return data from MPa, N/mm and m/min."""
    K_tc, K_rc, K_ac = (1e6 * value for value in megapascal)
    K_te, K_re, K_ae = (1e3 * value for value in newton_per_mm)
    return CuttingData(
        title,
        CuttingCoefficients(K_tc, K_rc, K_ac, K_te, K_re, K_ae),
        (1e6 * spread[0], 1e6 * spread[1]),
        (speeds[0] / 60.0, speeds[1] / 60.0),
        source,
    )


# Carbide; edges sharp. Ranges are those of the sources, or of handbooks.
MATERIALS = {
    "aluminium-7075": _data(
        "7075-T6", (767, 169, 222), (27.7, 26.6, 0.7), (600, 1320), (150, 3000), _REVIEW
    ),
    "aluminium-6082": _data(
        "6082-T6", (631, 99, 273), (13, 10, 2.8), (500, 800), (150, 3000), _REVIEW
    ),
    "aluminium-3.1325": _data(
        "3.1325 (2017A)", (750, 250, 200), (15, 15, 2), (600, 1000), (150, 2000), _HANDBOOK
    ),
    "steel-1.0503": _data(
        "1.0503 (C45)", (1900, 700, 450), (30, 45, 3), (1500, 2400), (60, 400), _HANDBOOK
    ),
    "steel-1.7225": _data(
        "1.7225 (42CrMo4)", (2200, 850, 500), (40, 60, 4), (1800, 2800), (50, 300), _HANDBOOK
    ),
    "steel-1.4301": _data(
        "1.4301 (stainless)", (2300, 950, 500), (40, 60, 5), (1900, 2900), (40, 250), _HANDBOOK
    ),
    "titanium-Ti6Al4V": _data(
        "Ti6Al4V", (1750, 500, 600), (25, 45, 3), (1400, 2200), (20, 150), _HANDBOOK
    ),
    "cfrp": _data(
        "CFRP, quasi-isotropic; along the fibres less, against them more",
        (450, 300, 50),
        (15, 30, 2),
        (150, 1000),
        (60, 800),
        _HANDBOOK,
    ),
}


def of_kienzle(
    specific_force: float, exponent: float, radial: float, axial: float, chip: float
) -> CuttingCoefficients:
    """Return the tangent to F = kc1.1 b h (h / 1 mm)^-m at a chip thickness.

    Args:
        specific_force: Specific cutting force kc1.1 [Pa].
        exponent: Exponent m [1].
        radial, axial: Radial and axial force by the tangential one [1].
        chip: Chip thickness h at which both forces and slopes are one [m].

    Example:
        >>> steel = of_kienzle(1.7e9, 0.25, 0.4, 0.2, chip=1e-4)
        >>> force = steel.K_tc * 1e-4 + steel.K_te  # [N/m]
        >>> bool(abs(force - 1.7e9 * 1e-4 * 0.1**-0.25) < 1e-6 * force)
        True
    """
    secant = specific_force * (chip / _UNIT_CHIP) ** -exponent
    cut, edge = (1.0 - exponent) * secant, exponent * secant * chip
    return CuttingCoefficients(cut, radial * cut, axial * cut, edge, radial * edge, axial * edge)
