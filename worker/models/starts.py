"""Studies whose cases have many starts (docs/theory.md, "Coexisting motions").

The run of such a study has "starts": ``{"count": 32, "seed": 1, "ranges": {path: [low, high]}, "values": {path: [31
numbers]}}``, all in SI. Start 0 is the case's own; ``values`` has the initial values of the others.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

#: Name of the starts in `Study.run`.
STARTS: Final = "starts"


def has_starts(run: Mapping[str, Any]) -> bool:
    """Whether the cases of a run have many starts."""
    return STARTS in run


def count_of(run: Mapping[str, Any]) -> int:
    """Number of starts of each case."""
    return int(run[STARTS]["count"]) if has_starts(run) else 1


def further_starts(run: Mapping[str, Any]) -> dict[str, NDArray[np.float64]]:
    """Initial values (SI) of the starts from 1 on, by path: arrays of shape (count - 1,)."""
    return {path: np.array(values, dtype=np.float64) for path, values in run[STARTS]["values"].items()}


def at_start(study: Study, case: int, start: int) -> Study:
    """The study of a single case from one of its starts only.

    Raises IndexError where there is no such case or start.
    """
    count = count_of(study.run)
    if not 0 <= start < count:
        raise IndexError(f"the starts of this study are 0 .. {count - 1}")
    base = {**study.base, **study.case_parameters(case)}
    if start:
        base |= {path: float(values[start - 1]) for path, values in further_starts(study.run).items()}
    run = {name: value for name, value in study.run.items() if name != STARTS}
    return replace(
        study, base={path: base[path] for path in study.base}, run=run, axes=(), combine="grid", derive={}, spread=None,
        plan=None, components=(),
    )  # fmt: skip


def motion_of(study: Study, case: int, start: int | None) -> tuple[Study, int]:
    """A study, and the number in it, by whose run a case goes on from one of its starts; None for the case itself.

    A case of a sweep starts from the cases before it, and has no other starts.
    """
    return (study, case) if start is None or study.sweep is not None else (at_start(study, case, start), 0)
