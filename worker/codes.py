"""Numbers of endings, regimes and flags for formats without texts; they are stable in all files.

A number is never assigned again, even when its ending, regime or flag is no longer used.
"""

from __future__ import annotations

from typing import Final

#: Ending of a case that has not been run, where a table needs one.
PENDING: Final = "pending"

#: Number of each ending: the engine's from 0, the worker's from 100.
ENDING_CODES: Final[dict[str, int]] = {
    PENDING: -1,
    "ok": 0,
    "accuracy_not_reached": 1,
    "chatter": 2,
    "step_budget": 3,
    "diverged": 4,
    "inertia_insufficient": 5,
    "unbalanced_work": 6,
    "cannot_assemble": 7,
    "negative_inertia": 8,
    "motor_stalled": 9,
    "quadrature_not_reached": 10,
    "motor_overrun": 11,
    "near_singular": 12,
    "unstable_motion": 13,
    "crashed": 100,
    "timed_out": 101,
    "cancelled": 102,
    "invalid_parameters": 103,
}

#: Number of each regime of settled motion; "none" for a case without one.
REGIME_CODES: Final[dict[str, int]] = {
    "none": 0,
    "periodic": 1,
    "held": 2,
    "coasting": 3,
    "irregular": 4,
    "unsettled": 5,
}

#: Bit of each flag; the flags of a case are their sum.
FLAG_MASKS: Final[dict[str, int]] = {
    "windup_out_of_data": 1 << 0,
    "not_settled": 1 << 1,
    "irregular": 1 << 2,
    "unsettled": 1 << 3,
    "jumped": 1 << 4,
    "arbitrary_start": 1 << 5,
    "restarted": 1 << 6,
    "history_dependent": 1 << 7,
    "sensitive_start": 1 << 8,
}


def flags_mask(flags: str) -> int:
    """The mask of flags joined by commas; 0 for "". Raises KeyError for a flag without a number."""
    return sum(FLAG_MASKS[name] for name in flags.split(",") if name)
