"""Transients of one machine over time: run-up from rest, a step of the load, coasting with the drive switched off."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.machine_shaft import transient_kernel as kernel
from sprag_study.engine.machine_shaft.columns import Columns
from sprag_study.engine.machine_shaft.machine import Machine, check_structure
from sprag_study.engine.machine_shaft.panels import Panels
from sprag_study.engine.machine_shaft.simulate import Solved, attempts, settle
from sprag_study.engine.machine_shaft.spec import MachineSpec
from sprag_study.engine.machine_shaft.transient_bench import Bench, Cycle
from sprag_study.engine.machine_shaft.transient_causes import ROUGH_LOAD, cause_of
from sprag_study.engine.machine_shaft.transient_course import COLUMNS, RESULTS, Course, Transient
from sprag_study.engine.machine_shaft.transient_run import OUTCOMES, Run
from sprag_study.engine.outcome import Trajectory
from sprag_study.sentences import Sentence

Floats = NDArray[np.float64]

_NAMES, _UNITS = tuple(name for name, _ in COLUMNS), tuple(unit for _, unit in COLUMNS)
_HALVINGS = 8


def _speeds(solved: Solved, panels: Panels) -> Floats | None:
    """Speeds of the case at the nodes of other panels; None where no torque follows the speed."""
    if solved.omega is None or not np.isfinite(solved.decomposition.start[0]):
        return None
    own, angles = solved.decomposition.panels, panels.angles.ravel()
    found = own.at_rows(solved.omega, np.zeros(len(angles), dtype=np.int64), own.locate(0, angles))
    return np.ascontiguousarray(found.reshape(panels.angles.shape))


def _bench(model: MachineSpec, row: Columns, course: Course) -> tuple[Bench | None, Cycle | None, Ending]:
    """The machine on panels that resolve the cycle before and after; without one where a field is not resolved."""
    if not np.isnan(Machine(model, row).unassembled()[0]):
        return None, None, Ending.CANNOT_ASSEMBLE
    with np.errstate(all="ignore"):
        *_, (_, solved) = attempts(model, row)
        settle(model, row, solved)
    ending, d = ENDINGS[int(solved.endings[0])], solved.decomposition
    if ending in {Ending.NEGATIVE_INERTIA, Ending.QUADRATURE_NOT_REACHED, Ending.NEAR_SINGULAR}:
        return None, None, ending
    if ending is not Ending.OK and course.kind != "run-up":
        return None, None, ending
    cuts = np.unique(d.panels.cuts[0])[None, :]
    for _ in range(_HALVINGS):
        panels = Panels(cuts)
        bench = Bench(model, row, panels, float(d.start[0]), _speeds(solved, panels))
        after = bench.steady(course.load)
        if after is None:
            break
        rough = bench.panels.roughness(after.energy) > 1e-11 * bench.panels.largest(after.energy)[:, None]
        if not rough.any():
            break
        cuts = np.sort(np.concatenate([cuts, bench.panels.middles(rough)], axis=1), axis=1)
    return bench, after, ending


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
    bench, after, ending = _bench(model, row, course)
    if bench is None:
        return _nothing(ending, Sentence(ending.sentence))
    before = None if course.kind == "run-up" else bench.steady(1.0)
    if course.kind == "coasting" or (not bench.motor and (course.kind == "load-step" or ending is Ending.UNSTABLE)):
        after = None
    run = Run(bench, course, before, after)
    if not run.loads:
        return _nothing(ending, ROUGH_LOAD)
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
