"""Elastoplastic sheet metal: elasticity, isotropic hardening, and the metal that yields by von Mises."""

from __future__ import annotations

from typing import NamedTuple, Protocol

from coupling.sheet_fem.compiled import compile_function


class SwiftHardening(Protocol):
    """Any metal with Swift hardening."""

    @property
    def strength(self) -> float:
        """Yield stress at a total strain of 1 [Pa]."""

    @property
    def prestrain(self) -> float:
        """Strain that the metal brings along."""

    @property
    def exponent(self) -> float:
        """Hardening exponent."""


class Material(NamedTuple):
    """Metal that yields by von Mises: Hooke's law and Swift hardening, sigma_y = K (eps_0 + eps)^n.

    Hollomon's law K eps^n, which has no elastic range, is Swift's with the strain at which it
    meets Hooke's line as eps_0: see `hollomon_prestrain`.

    Attributes:
        youngs_modulus: Young's modulus, E [Pa].
        poisson_ratio: Poisson's ratio, nu.
        strength: Yield stress at a total strain of 1, K [Pa].
        prestrain: Strain that the metal brings along, eps_0.
        exponent: Hardening exponent, n; 0 is an ideally plastic metal of yield stress K.
    """

    youngs_modulus: float
    poisson_ratio: float
    strength: float
    prestrain: float
    exponent: float


def hollomon_prestrain(youngs_modulus: float, strength: float, exponent: float) -> float:
    """Return the strain at which K eps^n meets E eps.

    Example:
        >>> round(hollomon_prestrain(70e9, 180e6, 0.2), 7)
        0.0005791
    """
    return float((youngs_modulus / strength) ** (1.0 / (exponent - 1.0)))


@compile_function
def yield_stress(material: SwiftHardening, plastic_strain: float) -> tuple[float, float]:
    """Return the yield stress [Pa] and its slope over the equivalent plastic strain [Pa]."""
    total = material.prestrain + plastic_strain
    stress = material.strength * total**material.exponent
    return stress, material.exponent * stress / total
