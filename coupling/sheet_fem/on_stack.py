"""Small arrays of compiled code, and symmetric matrices of 3 x 3 as plain numbers."""

from __future__ import annotations

from collections.abc import Callable
from itertools import accumulate
from math import prod
from operator import mul
from typing import Any, NamedTuple

import numba.core.cgutils
import numba.extending
import numba.np.arrayobj
import numpy as np
from numba.core import types

from coupling.sheet_fem.compiled import internal

# What numba's own arrays are made with; it has no type hints.
_cgutils: Any = numba.core.cgutils
_arrayobj: Any = numba.np.arrayobj


def _of_shape(function: Callable[..., Any]) -> Callable[[tuple[int, ...]], np.ndarray]:
    intrinsic: Any = numba.extending.intrinsic(prefer_literal=True)(function)
    return intrinsic


@_of_shape
def on_stack(typing_context: Any, shape: Any) -> Any:
    """Return an array of floats, not set, that lives as long as the compiled function that asks for it.

    numpy's are allocated one by one, which for a few numbers takes longer than what is done with them.
    The shape is a tuple that is written out; only compiled code can ask for one.

    Example:
        >>> @numba.njit
        ... def length(x: float, y: float) -> float:
        ...     vector = on_stack((2,))
        ...     vector[0], vector[1] = x, y
        ...     return np.sqrt(vector[0] ** 2 + vector[1] ** 2)
        >>> length(3.0, 4.0)
        5.0
    """
    sizes = tuple(size.literal_value for size in shape)
    array = types.Array(types.float64, len(sizes), "C")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def number(value: int) -> Any:
            return context.get_constant(types.intp, value)

        float_type = context.get_data_type(types.float64)
        item = context.get_abi_sizeof(float_type)
        strides = [*accumulate(sizes[:0:-1], mul, initial=item)][::-1]
        result = context.make_array(array)(context, builder)
        _arrayobj.populate_array(
            result,
            data=_cgutils.alloca_once(builder, float_type, size=prod(sizes)),
            shape=[number(size) for size in sizes],
            strides=[number(stride) for stride in strides],
            itemsize=number(item),
            meminfo=None,
        )
        return result._getvalue()

    return array(shape), generate


class Triple(NamedTuple):
    """A vector of (p, d, t)."""

    p: float
    d: float
    t: float


class Symmetric(NamedTuple):
    """A symmetric matrix over (p, d, t)."""

    pp: float
    pd: float
    pt: float
    dd: float
    dt: float
    tt: float


@internal
def inverse(m: Symmetric) -> Symmetric:
    """Return the inverse, of the cofactors."""
    pp, pd, pt = m.dd * m.tt - m.dt * m.dt, m.pt * m.dt - m.pd * m.tt, m.pd * m.dt - m.pt * m.dd
    over = 1.0 / (m.pp * pp + m.pd * pd + m.pt * pt)
    return Symmetric(
        over * pp,
        over * pd,
        over * pt,
        over * (m.pp * m.tt - m.pt * m.pt),
        over * (m.pd * m.pt - m.pp * m.dt),
        over * (m.pp * m.dd - m.pd * m.pd),
    )


@internal
def product(m: Symmetric, v: Triple) -> Triple:
    """Return the matrix times a vector."""
    return Triple(
        m.pp * v.p + m.pd * v.d + m.pt * v.t,
        m.pd * v.p + m.dd * v.d + m.dt * v.t,
        m.pt * v.p + m.dt * v.d + m.tt * v.t,
    )


@internal
def dot(a: Triple, b: Triple) -> float:
    """Return the scalar product."""
    return a.p * b.p + a.d * b.d + a.t * b.t


@internal
def add_scaled(a: Triple, factor: float, b: Triple) -> Triple:
    """Return a + factor b."""
    return Triple(a.p + factor * b.p, a.d + factor * b.d, a.t + factor * b.t)
