"""The hybrid automaton (docs/theory.md) as one table: the guards of each state, and the targets of their crossings.

Compiled code reads the arrays made from ``TRANSITIONS`` at the end of this module; documentation and tests read the
table.
"""

from dataclasses import dataclass
from enum import IntEnum, StrEnum

import numpy as np


class Clutch(IntEnum):
    """State of one freewheel clutch."""

    FREE = 0
    TAKE_UP = 1
    ENGAGED = 2
    BEYOND = 3
    LOCKED = 4
    #: A transient state: the start of an interaction, resolved immediately to TAKE_UP, ENGAGED, LOCKED or FREE.
    START = 5


class Shaft(IntEnum):
    """State of the output shaft."""

    HELD = 0
    ROTATING = 1


class Quantity(StrEnum):
    """What a guard watches."""

    RELATIVE_SPEED = "w = phi' - phi_e'"
    WINDUP = "u = xi - delta"
    LOCK_TORQUE = "torque that keeps w = 0"
    CLUTCH_TORQUE = "torque T of the clutch"
    TOTAL_TORQUE = "sum of clutch torques"
    SHAFT_SPEED = "phi_e'"


class Threshold(IntEnum):
    """The value at which a guard fires."""

    ZERO = 1
    DATA_END = 2
    FIRST_COEFFICIENT = 3
    LOAD = 4
    #: 0 of a clutch with damping; one without it has no such guard.
    ZERO_IF_DAMPED = 5


@dataclass(frozen=True, slots=True)
class Transition:
    """One row of the automaton: in ``source``, when ``quantity`` passes ``threshold`` upward (+1) or downward (-1), go
    to ``target``.

    ``reset`` describes what is set at the crossing. ``literal_only`` rows hold under ``reset = "literal"`` alone
    (docs/theory.md): there an engaged clutch restarts when w rises through 0. Since w is positive when it engages, the
    row that leads back to the same state notes the fall of w through 0 that has to come first; it changes nothing and
    counts as no event.
    """

    source: Clutch | Shaft
    quantity: Quantity
    direction: int
    threshold: Threshold
    target: Clutch | Shaft
    reset: str
    literal_only: bool = False


TRANSITIONS: tuple[Transition, ...] = (
    Transition(Clutch.FREE, Quantity.RELATIVE_SPEED, +1, Threshold.ZERO, Clutch.START, "xi = 0"),
    Transition(Clutch.TAKE_UP, Quantity.WINDUP, +1, Threshold.ZERO, Clutch.ENGAGED, "u = 0"),
    Transition(Clutch.TAKE_UP, Quantity.RELATIVE_SPEED, -1, Threshold.ZERO, Clutch.FREE, "w = 0"),
    Transition(Clutch.ENGAGED, Quantity.WINDUP, -1, Threshold.ZERO, Clutch.FREE, "u = 0"),
    Transition(Clutch.ENGAGED, Quantity.WINDUP, +1, Threshold.DATA_END, Clutch.BEYOND, "u = u_end"),
    Transition(Clutch.ENGAGED, Quantity.RELATIVE_SPEED, -1, Threshold.ZERO, Clutch.ENGAGED, "w = 0", True),
    Transition(Clutch.ENGAGED, Quantity.RELATIVE_SPEED, +1, Threshold.ZERO, Clutch.START, "xi = 0, energy lost", True),
    Transition(
        Clutch.ENGAGED, Quantity.CLUTCH_TORQUE, -1, Threshold.ZERO_IF_DAMPED, Clutch.FREE, "T = 0, energy Pi(u) lost"
    ),
    Transition(Clutch.BEYOND, Quantity.WINDUP, -1, Threshold.DATA_END, Clutch.ENGAGED, "u = u_end"),
    Transition(Clutch.BEYOND, Quantity.RELATIVE_SPEED, -1, Threshold.ZERO, Clutch.BEYOND, "w = 0", True),
    Transition(Clutch.BEYOND, Quantity.RELATIVE_SPEED, +1, Threshold.ZERO, Clutch.START, "xi = 0, energy lost", True),
    Transition(
        Clutch.BEYOND, Quantity.CLUTCH_TORQUE, -1, Threshold.ZERO_IF_DAMPED, Clutch.FREE, "T = 0, energy Pi(u) lost"
    ),
    Transition(Clutch.LOCKED, Quantity.LOCK_TORQUE, +1, Threshold.FIRST_COEFFICIENT, Clutch.ENGAGED, "u = 0, w = 0"),
    Transition(Clutch.LOCKED, Quantity.LOCK_TORQUE, -1, Threshold.ZERO, Clutch.FREE, "w = 0"),
    Transition(Shaft.HELD, Quantity.TOTAL_TORQUE, +1, Threshold.LOAD, Shaft.ROTATING, "phi_e' = 0"),
    Transition(Shaft.ROTATING, Quantity.SHAFT_SPEED, -1, Threshold.ZERO, Shaft.HELD, "phi_e' = 0"),
)


class Band(IntEnum):
    """The guards of a clutch as edges of bands, in the order of the workspace rows ``p_w_low`` .. ``p_t_high``."""

    W_LOW = 0
    W_HIGH = 1
    U_LOW = 2
    U_HIGH = 3
    T_LOW = 4
    T_HIGH = 5


_EDGES = {
    (Quantity.RELATIVE_SPEED, -1): Band.W_LOW,
    (Quantity.RELATIVE_SPEED, +1): Band.W_HIGH,
    (Quantity.WINDUP, -1): Band.U_LOW,
    (Quantity.WINDUP, +1): Band.U_HIGH,
    (Quantity.LOCK_TORQUE, -1): Band.T_LOW,
    (Quantity.CLUTCH_TORQUE, -1): Band.T_LOW,
    (Quantity.LOCK_TORQUE, +1): Band.T_HIGH,
}


def _clutch_arrays() -> tuple[np.ndarray, np.ndarray]:
    """Arrays [literal, state, band] of threshold (0: no guard) and of target."""
    threshold = np.zeros((2, len(Clutch), len(Band)), dtype=np.int64)
    target = np.zeros_like(threshold)
    for row in TRANSITIONS:
        if isinstance(row.source, Clutch):
            edge = _EDGES[row.quantity, row.direction]
            for literal in (0, 1):
                if literal or not row.literal_only:
                    threshold[literal, row.source, edge] = row.threshold
                    target[literal, row.source, edge] = row.target
    return threshold, target


#: Guard thresholds and targets of a clutch for compiled code, shape (2, states, bands): index 0 is reset "contact", 1
#: "literal".
CLUTCH_THRESHOLD, CLUTCH_TARGET = _clutch_arrays()
