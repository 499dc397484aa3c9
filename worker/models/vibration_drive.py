"""What is particular to vibration drives: how a study's columns become a call of their engine."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, cast

import numpy as np

from engine import Run, Span
from engine.vibration_drive.parameters import (
    CLUTCH_COEFFICIENT,
    CLUTCH_WINDUP_LIMIT,
    MAX_PENDULUMS,
    PARAMETERS,
    Parameter,
)
from engine.vibration_drive.results import ResultInfo
from engine.vibration_drive.results import result_infos as _engine_results
from worker.models.common import ChunkResult, ChunkTask, Extent, KernelShape, Trajectory

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

    from engine.run import Reset, Unit
    from worker.study import Study

MODEL = "vibration-drive"

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

_PENDULUM = re.compile(r"pendulums\.(\d+)\.")
_COEFFICIENT = re.compile(r"(?:^|\.)clutch\.coefficients\.(\d+)$")


def catalogue() -> tuple[Parameter, ...]:
    """See `worker.models.parameter_catalogue`."""
    return (*PARAMETERS, CLUTCH_COEFFICIENT, CLUTCH_WINDUP_LIMIT)


def shapes() -> range:
    """The numbers of pendulums for which there is a set of results."""
    return range(1, MAX_PENDULUMS + 1)


def result_infos(pendulums: int) -> tuple[ResultInfo, ...]:
    """Every result of a drive with that many pendulums."""
    return _engine_results(pendulums)


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


def shape_of(study: Study) -> KernelShape:
    """The kernel that the cases of ``study`` need."""
    return KernelShape(MODEL, pendulums(study), coefficients(study), run_of(study).tolerance)


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
    """Run the cases of a task."""
    from engine.endings import ENDING_CODES
    from engine.vibration_drive.simulate import simulate

    assert task.run is not None
    batch = simulate(task.columns, task.run, cases=task.count)
    names = [ending.value for ending in ENDING_CODES]
    infos = result_infos(task.shape.pendulums)
    return ChunkResult(
        first=task.first,
        endings=[names[code] for code in batch.endings.tolist()],
        flags=_flags([info.name for info in infos], batch.values),
        # Adding zero makes a negative zero positive: databases do not keep its sign.
        values=np.ascontiguousarray(batch.values, dtype=np.float64) + 0.0,
    )


def run_trajectory(study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
    """Instantaneous values at ``points`` equally spaced times from ``start`` to ``end`` (s)."""
    from engine.vibration_drive.simulate import trajectory

    columns = {**study.base, **study.case_parameters(case)}
    made = trajectory(columns, run_of(study), np.linspace(start, end, points))
    return Trajectory(made.times, made.names, made.units, made.values, made.states, made.ending.value)


def duration_seconds(study: Study, case: int) -> float:
    """Duration of the run of one case, in s."""
    duration = run_of(study).duration
    return duration.value if duration.unit == "s" else duration.value / _frequency(study, case)


def _frequency(study: Study, case: int) -> float:
    return {**study.base, **study.case_parameters(case)}["excitation.frequency"]


def extent(study: Study, case: int) -> Extent:
    """The run of one case; its periods are those of the excitation."""
    return Extent("time", "s", duration_seconds(study, case), 1.0 / _frequency(study, case))


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


def estimate_compile_seconds(shape: KernelShape) -> float:
    """Rough time of compiling the kernel of that shape, in s: 7 s for one pendulum, 13 s for eight on one core."""
    return 7.0 + 0.9 * (shape.pendulums - 1)


def prepare() -> None:
    """Load the engine with its compiler."""
    import engine.vibration_drive.simulate  # noqa: F401


def load(shape: KernelShape) -> None:
    """Compile the kernel of that shape into the on-disk cache, or load it from there."""
    from engine.vibration_drive.simulate import warm_up

    warm_up(shape.pendulums, shape.coefficients, shape.tolerance)


def kernel_source(pendulums: int, coefficients: int, tolerance: float) -> str:
    """Text of the generated kernel of vibration drives of that shape, for this machine; nothing is compiled."""
    from engine.vibration_drive.kernel import lane_count, order_for, source
    from engine.vibration_drive.layout import make_layout

    return source(make_layout(pendulums, coefficients, order_for(tolerance), lane_count()))
