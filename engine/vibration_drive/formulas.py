"""Equations (1) to (3) of docs/theory.md, each written once.

They take terms, from which ``equations`` generates the kernel, or numbers in the compiled event code, or in Python
arrays.
"""

from collections.abc import Sequence
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine.taylor.straight import Term

_Value = TypeVar("_Value", float, Term, NDArray[np.float64])
_Pair = tuple[_Value, _Value]


def base_series(
    acc_x: _Value, acc_y: _Value, nu: _Value, sin: _Value, cos: _Value, sin_chi: _Value, cos_chi: _Value
) -> tuple[_Pair[_Value], _Pair[_Value]]:
    """First two coefficients of x'' = -d nu^2 cos(nu t) and of y'' = -b nu^2 sin(nu t + chi), equation (2).

    ``acc_x`` and ``acc_y`` are d nu^2 and b nu^2 in m/s^2, ``sin`` and ``cos`` those of nu t.
    """
    x = (-acc_x * cos, acc_x * nu * sin)
    y = (-acc_y * (sin * cos_chi + cos * sin_chi), -acc_y * nu * (cos * cos_chi - sin * sin_chi))
    return x, y


def harmonic_series(
    x_cos: _Value, x_sin: _Value, y_cos: _Value, y_sin: _Value, rate: _Value, sin: _Value, cos: _Value
) -> tuple[_Pair[_Value], _Pair[_Value]]:
    """First two coefficients of the acceleration of the base by one of its harmonics in x and y.

    The acceleration is ``x_cos cos + x_sin sin`` in m/s^2, and likewise in y; ``sin`` and ``cos`` are those of the
    harmonic's angle, which grows by ``rate`` in rad/s.
    """
    x = (x_cos * cos + x_sin * sin, rate * (x_sin * cos - x_cos * sin))
    y = (y_cos * cos + y_sin * sin, rate * (y_sin * cos - y_cos * sin))
    return x, y


def ramped_series(
    x_cos: _Value,
    x_sin: _Value,
    y_cos: _Value,
    y_sin: _Value,
    motion: tuple[_Value, _Value],
    sin: _Value,
    cos: _Value,
) -> tuple[_Pair[_Value], _Pair[_Value]]:
    """First two coefficients of the acceleration of the base in x and y by a part of its motion whose angle theta is
    ramped.

    The displacement is ``x_cos cos theta + x_sin sin theta`` in m, and likewise in y. ``motion`` holds theta' in rad/s
    and the constant theta'' in rad/s^2, ``sin`` and ``cos`` are those of theta.
    """
    rate, slope = motion
    square = rate * rate
    third, cube = slope * rate * 3.0, square * rate
    x, y = x_cos * cos + x_sin * sin, y_cos * cos + y_sin * sin
    turned_x, turned_y = x_sin * cos - x_cos * sin, y_sin * cos - y_cos * sin
    return (
        (slope * turned_x - square * x, -(third * x + cube * turned_x)),
        (slope * turned_y - square * y, -(third * y + cube * turned_y)),
    )


def drive(x: Sequence[_Value], y: Sequence[_Value], sin: Sequence[_Value], cos: Sequence[_Value], k: int) -> _Value:
    """Coefficient k of the base's drive x'' cos phi + y'' sin phi in m/s^2, from the series of its factors."""
    if k == 0:
        return x[0] * cos[0] + y[0] * sin[0]
    value = x[1] * cos[k - 1] + y[1] * sin[k - 1]
    for j in range(2, k + 1):
        value = value + x[j] * cos[k - j] + y[j] * sin[k - j]
    return value + x[0] * cos[k] + y[0] * sin[k]


def free_acceleration(
    ml: _Value,
    weight: _Value,
    spring: _Value,
    damping: _Value,
    phi: _Value,
    w: _Value,
    sin: _Value,
    driven: _Value,
) -> _Value:
    """A coefficient of a pendulum's acceleration without its clutch in rad/s^2, equation (1) divided by J.

    ``ml``, ``weight``, ``spring`` and ``damping`` are M l, M l g, c a^2 and lambda divided by J; the others are the
    same coefficient of the angle, the speed, the angle's sine and the drive. The weight is kept apart from the drive,
    so that a base at rest drives nothing, not even by a rounding error. What is known first is added first: the time of
    a step depends on the chain of operations from one order to the next, more than on their number.
    """
    return -damping * w - spring * phi + weight * sin + ml * driven


def resistance(linear: _Value, quadratic: _Value, speed: _Value, square: _Value) -> _Value:
    """Torque in N*m that resists the shaft by its speed (rad/s), beside the dry load; or a coefficient of its series.

    ``linear`` and ``quadratic`` are lambda_e + k_1 and k_2, ``square`` is the same coefficient of the speed's square:
    the shaft never turns back, so it is that of omega |omega| too.
    """
    return linear * speed + quadratic * square


def beyond(end: _Value, rate: _Value, over: _Value) -> _Value:
    """Energy in J that a clutch stores beyond its data, where law (3) goes on straight.

    ``end`` and ``rate`` are torque and slope at the end of the data, ``over`` is the windup in rad beyond it.
    """
    return over * (end + rate * 0.5 * over)
