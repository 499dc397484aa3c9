"""Tasks and results of all models."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.engine.endings import ENDINGS
from sprag_study.worker.directions import SWEEP
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from numpy.typing import NDArray

    from sprag_study.worker.study import Study


#: Paths of axes that are not parameters of a machine.
NO_PARAMETERS: Final = frozenset({DRIVE, SWEEP})


@dataclass(frozen=True, slots=True)
class FurtherRows:
    """Further rows of cases that have several.

    Attributes
    ----------
    of : int64 array, shape (rows,)
        Position in the chunk of the case of each row.
    flags : list of str, length rows
    values : float64 array, shape (rows, results)
        As those of the `ChunkResult`. All of them ended ok.
    """

    of: NDArray[np.int64]
    flags: list[str]
    values: NDArray[np.float64]


class WorkerEnding(StrEnum):
    """Endings given by the worker to cases that the engine did not run, or from which it did not return."""

    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    CANCELLED = "cancelled"
    INVALID = "invalid_parameters"


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """The result of a run of consecutive cases.

    Attributes
    ----------
    first : int
        Number of the first case.
    endings : list of str, length ``count``
        Names of the endings, keys of `ENDING_SENTENCES`.
    flags : list of str, length ``count``
        Names of the flags of each case joined by commas; "" where there is none.
    values : float64 array, shape (count, results), C-contiguous
        Results in the order of `result_infos`, SI units; NaN where a result could not be computed.
    further : FurtherRows or None
        Further rows of some of the cases, for a variant whose cases can have several.
    """

    first: int
    endings: list[str]
    flags: list[str]
    values: NDArray[np.float64]
    further: FurtherRows | None = None

    @property
    def count(self) -> int:
        """Number of cases."""
        return len(self.endings)


#: Name of the field in `Study.run` that asks for loads as results.
LOADS: Final = "loads"


def has_loads(run: Mapping[str, Any]) -> bool:
    """Whether the results of a run have the loads of its machines."""
    return bool(run.get(LOADS, False))


def chunk_result(first: int, codes: NDArray[np.int8], flags: list[str], values: NDArray[np.float64]) -> ChunkResult:
    """The result from the engine's arrays: ``codes`` (count,) of its endings, ``values`` (count, results)."""
    endings = [ENDINGS[code].value for code in codes.tolist()]
    # Adding zero makes negative zeros positive, because databases do not preserve their sign.
    return ChunkResult(first, endings, flags, np.ascontiguousarray(values, dtype=np.float64) + 0.0)


@dataclass(frozen=True, slots=True)
class KernelShape:
    """Identifies the compiled kernel of a case: its model, and plain values that only the model interprets."""

    model: str
    key: tuple[int | float | str, ...] = ()


@dataclass(frozen=True, slots=True)
class ChunkTask:
    """Consecutive cases as sent to a process: only their own columns, however large the study is.

    ``columns`` maps flat spec paths to SI numbers, or to arrays of shape (count,) where they vary. ``run`` and
    ``structure`` are those of the study. ``refused``, shape (count,), marks cases that are not to be run; then
    ``results`` is the number of their results. ``lines``, shape (lines, steps), are the lines of a sweep: positions of
    cases in the task in the order in which they are run; ``along`` is the column that is swept.
    """

    first: int
    count: int
    shape: KernelShape
    run: dict[str, Any]
    columns: dict[str, float | NDArray[np.float64]]
    structure: dict[str, Any] | None = None
    refused: NDArray[np.bool_] | None = None
    results: int = 0
    lines: NDArray[np.int64] | None = None
    along: str | None = None


def run_accepted(task: ChunkTask, run: Callable[[ChunkTask], ChunkResult], ending: str) -> ChunkResult:
    """Run the cases of a task that are not refused; the others have that ending and no results."""
    assert task.refused is not None
    rows = np.flatnonzero(~task.refused)
    endings, flags = [ending] * task.count, [""] * task.count
    values = np.full((task.count, task.results), np.nan)
    if rows.size:
        columns = {
            path: column[rows] if isinstance(column, np.ndarray) else column for path, column in task.columns.items()
        }
        found = run(replace(task, first=0, count=rows.size, columns=columns, refused=None))
        values[rows] = found.values
        for row, one, flag in zip(rows.tolist(), found.endings, found.flags, strict=True):
            endings[row], flags[row] = one, flag
        if found.further is not None:
            further = replace(found.further, of=rows[found.further.of])
            return ChunkResult(task.first, endings, flags, values, further)
    return ChunkResult(task.first, endings, flags, values)


def case_machine(study: Study, case: int) -> dict[str, float]:
    """Every parameter of one case, SI: the base with what the case has for itself. IndexError outside the study."""
    machine = {**study.base, **study.case_parameters(case)}
    return {path: value for path, value in machine.items() if path not in study.beside}


@dataclass(frozen=True, slots=True)
class Extent:
    """The independent variable of instantaneous values, from 0 to ``end``.

    Attributes
    ----------
    along : str
        "time" of the run, or "angle" of the shaft.
    unit : str
        Its SI unit.
    end : float
    period : float
        Length of "1 period" in that unit.
    begin : float
        Start of the part that is returned by default.
    """

    along: str
    unit: str
    end: float
    period: float
    begin: float = 0.0
