"""Transients of one machine over time: run-up from rest, a step of the load, coasting with the drive switched off."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import Ending
from sprag_study.engine.machine_shaft import transient_kernel as kernel
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import check_structure
from sprag_study.engine.machine_shaft.simulate import Solved
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.steady_cycles import cycles_on
from sprag_study.engine.machine_shaft.transient_bench import Bench, Cycle, bench_on, solved_case
from sprag_study.engine.machine_shaft.transient_causes import ROUGH_LOAD, cause_of
from sprag_study.engine.machine_shaft.transient_course import COLUMNS, RESULTS, Course, Transient
from sprag_study.engine.machine_shaft.transient_run import OUTCOMES, Run
from sprag_study.engine.outcome import Trajectory
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]

_NAMES, _UNITS = tuple(name for name, _ in COLUMNS), tuple(unit for _, unit in COLUMNS)
_HALVINGS = 8
#: Relative difference of mean speeds up to which two cycles are the same.
_SAME = 1e-6


def _bench(
    model: MachineSpec, row: Columns, course: Course
) -> tuple[Solved | None, Bench | None, Cycle | None, Ending]:
    """The machine on panels that resolve the cycle before and after; without one where a field is not resolved."""
    solved, ending = solved_case(model, row)
    if solved is None or (ending is not Ending.OK and course.kind != "run-up"):
        return None, None, None, ending
    cuts = np.unique(solved.decomposition.panels.cuts[0])[None, :]
    for _ in range(_HALVINGS):
        bench = bench_on(model, row, solved, cuts)
        after = bench.steady(course.load)
        if after is None:
            break
        rough = bench.panels.roughness(after.energy) > 1e-11 * bench.panels.largest(after.energy)[:, None]
        if not rough.any():
            break
        cuts = np.sort(np.concatenate([cuts, bench.panels.middles(rough)], axis=1), axis=1)
    return solved, bench, after, ending


def _led_elsewhere(model: MachineSpec, row: Columns, solved: Solved, run: Run, ending: Ending) -> Run | None:
    """The run to the steady cycle to which the shaft comes, where that is another than the one it was to come to."""
    course, bench = run.course, run.bench
    energy = 0.5 * float(np.square(run.state[kernel.ROOT]))
    other = cycles_on(bench, ending, course.load).reached_from(course.angle, energy)
    if other is None or (run.after is not None and abs(other.course.mean / run.after.mean - 1.0) < _SAME):
        return None
    bench = bench_on(model, row, solved, other.panels.cuts)
    before = None if run.before is None else bench.steady(1.0)
    return Run(bench, course, before, other.course, run.after)


def transient(model: MachineSpec, columns: Mapping[str, ArrayLike], course: Course, points: int) -> Transient:
    """Compute a transient of one case.

    Parameters
    ----------
    model : MachineSpec
    columns : mapping
        As for ``simulate``, scalars only.
    course : Course
    points : int
        Equally spaced times of the table.

    Raises
    ------
    MachineError
        If the structure is not a valid machine.
    ValueError
        If a machine without a motor is run up without a torque, or a parameter is missing or unknown.
    """
    check_structure(model)
    if course.kind == "run-up" and model.balance != "motor" and course.torque is None:
        raise ValueError("the run-up of a machine without a motor needs a torque")
    row = Columns.of(model, columns, 1)
    solved, bench, after, ending = _bench(model, row, course)
    if solved is None or bench is None:
        return _nothing(ending, Sentence(ending.sentence))
    before = None if course.kind == "run-up" else bench.steady(1.0)
    if course.kind == "coasting" or (not bench.motor and (course.kind == "load-step" or ending is Ending.UNSTABLE)):
        after = None
    run = Run(bench, course, before, after)
    if not run.loads:
        return _nothing(ending, ROUGH_LOAD)
    status, totals, _ = run.follow(np.empty(0))
    if OUTCOMES[status] == "not_reached" and bench.motor and course.kind != "coasting":
        elsewhere = _led_elsewhere(model, row, solved, run, ending)
        if elsewhere is not None:
            run = elsewhere
            status, totals, _ = run.follow(np.empty(0))
    times = np.linspace(0.0, totals[kernel.TIME], points)
    _, _, places = run.follow(times)
    # The end is known without the rounding of the interpolation.
    places[-1] = totals[kernel.ANGLE], np.sqrt(2.0 * totals[kernel.ENERGY])
    outcome = OUTCOMES[status]
    results = run.results(outcome, totals)
    cause = cause_of(course.kind, outcome, results, run.ends(totals, ending))
    return Transient(outcome, cause, results, Trajectory(times, _NAMES, _UNITS, run.values(places), {}, ending))


def _nothing(ending: Ending, cause: Sentence) -> Transient:
    """The answer where there is no motion."""
    motion = Trajectory(np.empty(0), _NAMES, _UNITS, np.empty((0, len(_NAMES))), {}, ending)
    return Transient("no_motion", cause, {name: np.nan for name, *_ in RESULTS}, motion)
