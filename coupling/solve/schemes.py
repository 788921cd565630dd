"""The schemes of the coupling by name."""

from __future__ import annotations

from functools import partial

from coupling.solve.relaxation import Aitken, Anderson, ConstantRelaxation, Restarting
from coupling.solve.robin import Robin
from coupling.solve.scheme import SchemeBuilder

SCHEMES: dict[str, SchemeBuilder] = {
    "robin": Robin,
    "constant": ConstantRelaxation,
    "aitken": partial(Restarting, Aitken),
    "anderson": partial(Restarting, Anderson),
}
