"""Compiled loops over the elements of arrays: of functions of one variable, and of two."""

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.compile.jit import compiled
from sprag_study.engine.elementary.angles import arccosine, arcsine, arctangent, arctangent_of, cosine, sine, tangent
from sprag_study.engine.elementary.functions import ARCCOS, ARCSIN, ARCTAN, ARCTAN2, COS, COSH, EXP, LOG, SIN, SINH, TAN
from sprag_study.engine.elementary.powers import (
    exponential,
    hyperbolic_cosine,
    hyperbolic_sine,
    hyperbolic_tangent,
    logarithm,
)
from sprag_study.engine.elementary.powers import power as power_of
from sprag_study.engine.taylor.straight import LARGEST_ANGLE

Floats = NDArray[np.float64]


@compiled
def of_one(function: int, x: Floats) -> int:
    """Replace the elements of ``x``, shape (n,), by a function of them; how many angles are beyond `LARGEST_ANGLE`."""
    beyond = 0
    if function == SIN:
        for i in range(len(x)):
            beyond += abs(x[i]) > LARGEST_ANGLE
            x[i] = sine(x[i])
    elif function == COS:
        for i in range(len(x)):
            beyond += abs(x[i]) > LARGEST_ANGLE
            x[i] = cosine(x[i])
    elif function == TAN:
        for i in range(len(x)):
            beyond += abs(x[i]) > LARGEST_ANGLE
            x[i] = tangent(x[i])
    elif function == ARCSIN:
        for i in range(len(x)):
            x[i] = arcsine(x[i])
    elif function == ARCCOS:
        for i in range(len(x)):
            x[i] = arccosine(x[i])
    elif function == ARCTAN:
        for i in range(len(x)):
            x[i] = arctangent(x[i])
    elif function == EXP:
        for i in range(len(x)):
            x[i] = exponential(x[i])
    elif function == LOG:
        for i in range(len(x)):
            x[i] = logarithm(x[i])
    elif function == SINH:
        for i in range(len(x)):
            x[i] = hyperbolic_sine(x[i])
    elif function == COSH:
        for i in range(len(x)):
            x[i] = hyperbolic_cosine(x[i])
    else:
        for i in range(len(x)):
            x[i] = hyperbolic_tangent(x[i])
    return beyond


@compiled
def of_two(function: int, x: Floats, y: Floats) -> None:
    """Replace the elements of ``x`` by a function of them and of those of ``y``, both of shape (n,)."""
    if function == ARCTAN2:
        for i in range(len(x)):
            x[i] = arctangent_of(x[i], y[i])
    else:
        for i in range(len(x)):
            x[i] = power_of(x[i], y[i])
