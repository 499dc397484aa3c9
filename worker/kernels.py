"""The one module of the worker that knows the engine: a study and a range of cases in, plain arrays out.

What is particular to a model (its catalogues, the shape of its results, how a study's columns become a call of the
engine) stays behind the functions of this module. The numerical kernels are imported where they are run,
so reading a catalogue loads no compiler.
"""

from __future__ import annotations

import math
import platform
import re
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, cast

import numpy as np

from engine import ENGINE_VERSION, Ending, Run, Span
from engine.run import Reset, Unit
from engine.vibration_drive.clutch import (
    ClutchFit,
    ClutchFitError,
    ClutchLaw,
    ClutchLawError,
    DegreeReport,
    check_law,
    fit_clutch,
)
from engine.vibration_drive.parameters import (
    CLUTCH_COEFFICIENT,
    CLUTCH_WINDUP_LIMIT,
    MAX_COEFFICIENTS,
    MAX_PENDULUMS,
    PARAMETERS,
    Parameter,
)
from engine.vibration_drive.results import ResultInfo
from engine.vibration_drive.results import result_infos as _vibration_drive_results

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from numpy.typing import NDArray

    from engine.vibration_drive.simulate import Trajectory
    from worker.study import Study

__all__ = [
    "CLUTCH_COEFFICIENT",
    "CLUTCH_WINDUP_LIMIT",
    "ENDING_SENTENCES",
    "ENGINE_VERSION",
    "FLAG_SENTENCES",
    "MAX_COEFFICIENTS",
    "MAX_PENDULUMS",
    "MODELS",
    "OK",
    "ChunkResult",
    "ChunkTask",
    "ClutchFit",
    "ClutchFitError",
    "ClutchLaw",
    "ClutchLawError",
    "DegreeReport",
    "KernelShape",
    "Parameter",
    "ResultInfo",
    "Run",
    "Span",
    "Trajectory",
    "WorkerEnding",
    "cache_folder",
    "check_law",
    "chunk_task",
    "coefficients",
    "discard_compiled",
    "estimate_seconds_per_case",
    "fit_clutch",
    "is_compiled",
    "kernel_source",
    "load",
    "models",
    "parameter_catalogue",
    "pendulums",
    "prepare",
    "result_infos",
    "result_shapes",
    "run_chunk",
    "run_of",
    "run_task",
    "run_trajectory",
    "shape_of",
    "study_results",
    "warm_up",
]

VIBRATION_DRIVE = "vibration-drive"
MODELS: tuple[str, ...] = (VIBRATION_DRIVE,)

OK = Ending.OK.value

#: Flag of a case some of whose clutches worked beyond the end of the measured data.
WINDUP_OUT_OF_DATA = "windup_out_of_data"
#: Flag of a case whose window shows no steady motion, and the share of the work from which on it is raised.
NOT_SETTLED = "not_settled"
SETTLED_SHARE = 0.01
FLAG_SENTENCES: dict[str, str] = {
    NOT_SETTLED: (
        "The machine's own energy changed over the window by more than 1 % of the work done: the motion had not "
        "settled, and means (the efficiency above all) are not those of steady running."
    ),
    WINDUP_OUT_OF_DATA: "Some clutch was wound up beyond the measured data; its law was continued straight there.",
}


class WorkerEnding(StrEnum):
    """Endings that the worker gives to a case, because the engine did not come back from it."""

    CRASHED = "crashed"
    TIMED_OUT = "timed_out"
    CANCELLED = "cancelled"


#: Every ending of a case, stored as its key, and the sentence a user reads.
ENDING_SENTENCES: dict[str, str] = {
    **{ending.value: ending.sentence for ending in Ending},
    WorkerEnding.CRASHED.value: (
        "The process that ran this case died, twice, with no other case beside it: the case is set aside and can be "
        "run again."
    ),
    WorkerEnding.TIMED_OUT.value: "The case did not come back within the time allowed for it, alone and twice.",
    WorkerEnding.CANCELLED.value: "The study was cancelled before this case was run.",
}

_PENDULUM = re.compile(r"pendulums\.(\d+)\.")
_COEFFICIENT = re.compile(r"(?:^|\.)clutch\.coefficients\.(\d+)$")


@dataclass(frozen=True, slots=True)
class ChunkResult:
    """What a run of consecutive cases gave.

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
    """

    first: int
    endings: list[str]
    flags: list[str]
    values: NDArray[np.float64]

    @property
    def count(self) -> int:
        """Number of cases."""
        return len(self.endings)


def models() -> tuple[str, ...]:
    """Names of the models a study may ask for."""
    return MODELS


def _require(model: str) -> None:
    if model not in MODELS:
        raise ValueError(f"unknown model {model!r}; there is: {', '.join(MODELS)}")


def parameter_catalogue(model: str) -> tuple[Parameter, ...]:
    """Every numeric parameter of ``model``: SPEC paths with ``N`` for a pendulum and ``K`` for a coefficient.

    The two entries of the clutch stand under ``clutch.``; they may also stand in each pendulum
    (``pendulums.N.clutch.``).
    Raises ValueError for an unknown model.
    """
    _require(model)
    return (*PARAMETERS, CLUTCH_COEFFICIENT, CLUTCH_WINDUP_LIMIT)


def result_shapes(model: str) -> range:
    """The numbers of pendulums for which ``model`` has a set of results."""
    _require(model)
    return range(1, MAX_PENDULUMS + 1)


def result_infos(model: str, pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of ``model`` with that many pendulums, in the order of the columns of `ChunkResult.values`."""
    _require(model)
    return _vibration_drive_results(pendulums)


def study_results(study: Study) -> tuple[ResultInfo, ...]:
    """Every result of the cases of ``study``."""
    return result_infos(study.model, pendulums(study))


def _paths(study: Study) -> Iterable[str]:
    yield from study.base
    for axis in study.axes:
        yield from axis.paths


def pendulums(study: Study) -> int:
    """Number of pendulums of the machine: one more than the largest index in the study's paths."""
    return 1 + max(int(match[1]) for path in _paths(study) if (match := _PENDULUM.match(path)))


def coefficients(study: Study) -> int:
    """Number of coefficients of the longest clutch law of the study."""
    return 1 + max((int(match[1]) for path in _paths(study) if (match := _COEFFICIENT.search(path))), default=0)


def _span(value: object) -> Span:
    number, unit = cast("tuple[float, Unit]", value)
    return Span(float(number), unit)


def run_of(study: Study) -> Run:
    """The engine's settings of the run, from the plain data of the study."""
    run = study.run
    window = cast("list[object] | None", run.get("window"))
    return Run(
        duration=_span(run["duration"]),
        window=None if window is None else (_span(window[0]), _span(window[1])),
        tolerance=float(cast("float", run["tolerance"])),
        reset=cast("Reset", run["reset"]),
    )


@dataclass(frozen=True, slots=True)
class KernelShape:
    """What decides which compiled kernel a case needs."""

    model: str
    pendulums: int
    coefficients: int
    tolerance: float


@dataclass(frozen=True, slots=True)
class ChunkTask:
    """Consecutive cases as they travel to a process: their own columns only, however large the study is.

    ``columns`` maps flat SPEC paths to SI numbers, or to arrays of shape (count,) where they vary.
    """

    first: int
    count: int
    shape: KernelShape
    run: Run
    columns: dict[str, float | NDArray[np.float64]]


def shape_of(study: Study) -> KernelShape:
    """The kernel that the cases of ``study`` need."""
    return KernelShape(study.model, pendulums(study), coefficients(study), run_of(study).tolerance)


def chunk_task(study: Study, first: int, count: int) -> ChunkTask:
    """The cases ``first`` .. ``first + count - 1`` of ``study``, ready for `run_task`."""
    columns: dict[str, float | NDArray[np.float64]] = {**study.base, **study.columns(range(first, first + count))}
    return ChunkTask(first, count, shape_of(study), run_of(study), columns)


def _flags(names: list[str], values: NDArray[np.float64]) -> list[str]:
    """Flags of every case, joined by commas."""
    column = {name: values[:, index] for index, name in enumerate(names)}
    beyond = np.column_stack([values for name, values in column.items() if name.endswith(".fraction.beyond_data")])
    work = [np.abs(column[f"power.{kind}.mean"]) for kind in ("input", "loss", "useful")]
    raised = {
        NOT_SETTLED: np.abs(column["power.stored.mean"]) > SETTLED_SHARE * np.max(work, axis=0),
        WINDUP_OUT_OF_DATA: np.any(beyond > 0.0, axis=1),
    }
    return [",".join(name for name, cases in raised.items() if cases[case]) for case in range(len(values))]


def run_task(task: ChunkTask) -> ChunkResult:
    """Run the cases of a task.

    A physical failure is an ending in the result, never an exception; what is raised here is a fault of the program.
    """
    from engine.endings import ENDING_CODES
    from engine.faults import inject
    from engine.vibration_drive.simulate import simulate

    inject(task.columns, task.count)
    batch = simulate(task.columns, task.run, cases=task.count)
    names = [ending.value for ending in ENDING_CODES]
    infos = result_infos(task.shape.model, task.shape.pendulums)
    flags = _flags([info.name for info in infos], batch.values)
    return ChunkResult(
        first=task.first,
        endings=[names[code] for code in batch.endings.tolist()],
        flags=flags,
        # Adding zero makes a negative zero positive: databases do not keep its sign.
        values=np.ascontiguousarray(batch.values, dtype=np.float64) + 0.0,
    )


def run_chunk(study: Study, first: int, count: int) -> ChunkResult:
    """Run the cases ``first`` .. ``first + count - 1`` of ``study`` here."""
    return run_task(chunk_task(study, first, count))


def run_trajectory(study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
    """Instantaneous values of one case at ``points`` equally spaced times from ``start`` to ``end`` (s)."""
    from engine.vibration_drive.simulate import trajectory

    columns = {**study.base, **study.case_parameters(case)}
    return trajectory(columns, run_of(study), np.linspace(start, end, points))


def duration_seconds(study: Study, case: int) -> float:
    """Duration of the run of one case, in s."""
    frequency = {**study.base, **study.case_parameters(case)}["excitation.frequency"]
    duration = run_of(study).duration
    return duration.value if duration.unit == "s" else duration.value / frequency


def _mean_periods(study: Study) -> float:
    """Excitation periods of a run, averaged over the cases of the study."""
    duration = run_of(study).duration
    for axis in study.axes:
        if "excitation.frequency" in axis.paths:
            frequency = math.fsum(axis.values) / len(axis.values)
            break
    else:
        frequency = study.base["excitation.frequency"]
    return duration.in_periods(frequency)


def estimate_seconds_per_case(study: Study) -> float:
    """Rough time of one case of ``study`` on one core, in s."""
    from engine.vibration_drive.simulate import estimate_seconds

    shape = shape_of(study)
    return estimate_seconds(shape.pendulums, shape.coefficients, shape.tolerance, _mean_periods(study))


def prepare() -> None:
    """Load the engine with its compiler, so that the first cases do not wait for that."""
    import engine.vibration_drive.simulate  # noqa: F401


def load(shape: KernelShape) -> None:
    """Compile the kernel of that shape into the on-disk cache, or load it from there."""
    from engine.vibration_drive.simulate import warm_up as engine_warm_up

    engine_warm_up(shape.pendulums, shape.coefficients, shape.tolerance)
    with suppress(OSError):
        _mark(shape).touch()


def is_compiled(shape: KernelShape) -> bool:
    """Whether `load` has put the kernel of that shape into the on-disk cache, on this machine and for this engine."""
    return _mark(shape).exists()


def _mark(shape: KernelShape) -> Path:
    # Code for one machine is none for another with the same home.
    parts = (shape.model, shape.pendulums, shape.coefficients, repr(shape.tolerance), platform.node())
    return cache_folder() / f"{'-'.join(map(str, parts))}.ready"


def kernel_source(pendulums: int, coefficients: int, tolerance: float) -> str:
    """Text of the generated kernel of vibration drives of that shape, for this machine; nothing is compiled."""
    from engine.vibration_drive.kernel import lane_count, order_for, source
    from engine.vibration_drive.layout import make_layout

    return source(make_layout(pendulums, coefficients, order_for(tolerance), lane_count()))


def warm_up(study: Study) -> None:
    """Compile the kernel that ``study`` needs into the on-disk cache, or load it from there."""
    load(shape_of(study))


def cache_folder() -> Path:
    """Folder of the compiled kernels, made if need be."""
    from engine.cache import cache_folder as engine_cache_folder

    return engine_cache_folder()


def discard_compiled() -> None:
    """Throw away every compiled kernel of this engine that lies in the cache on disk, because some may be damaged."""
    from engine.cache import discard

    discard()


def cache_is_wanted() -> bool:
    """Whether that folder is the one the user wants, not the stand-in for one that cannot be written."""
    from engine.cache import is_wanted

    return is_wanted(cache_folder())
