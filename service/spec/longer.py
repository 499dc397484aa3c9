"""A study of the unsettled cases of another study, with more time for each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.spec.axes.blocks import as_axes, chosen, first_rows
from sprag_study.service.spec.component_axes import axis_item, keeps_components, with_base
from sprag_study.service.spec.fields import renamed
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.run import SETTLED_FIELDS, TIMED_FIELDS
from sprag_study.worker.limits import MAX_RUN_PERIODS, MAX_SETTLED_PERIODS
from sprag_study.worker.models import SETTLED, is_settled
from sprag_study.worker.spread import DRIVE
from sprag_study.worker.study import Axis

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.worker.study import Study

#: Default factor on the periods of a search or the duration of a run.
TIMES: Final = 4
_SUFFIX: Final = ", longer"


def runs_over_time(study: Study) -> bool:
    """Whether cases run for a time, which can be longer; a machine shaft, for instance, is computed over its cycle."""
    return is_settled(study.run) or "duration" in study.run


def longer_spec(
    spec: Mapping[str, Any], study: Study, cases: NDArray[np.int64], at_most: int | None = None
) -> dict[str, Any]:
    """The spec of a study of these cases only (of a sweep: of all), run for (settled motion: at most) ``at_most``
    excitation periods each.

    Parameters
    ----------
    spec : the study's own spec
    study : the same in SI numbers; one whose cases run over time (`runs_over_time`)
    cases : numbers of cases, at least one
    at_most : by default `TIMES` times as many as the study allows
    """
    if is_settled(study.run):
        most = min(TIMES * study.run["at_most"], MAX_SETTLED_PERIODS) if at_most is None else at_most
        run = {key: value for key, value in spec.get("run", {}).items() if key not in TIMED_FIELDS}
        run |= {"until": SETTLED, "at_most": f"{most} periods"}
    else:
        times = (*SETTLED_FIELDS, *TIMED_FIELDS)
        run = {key: value for key, value in spec.get("run", {}).items() if key not in times}
        run |= _longer_run(study, at_most)
    if study.sweep is not None:  # every case depends on those before it in its line
        return {**spec, "name": renamed(study.name, _SUFFIX), "run": run}
    axes = [axis_item(spec, study, axis, axis.values) for axis in _listed(study, cases)]
    spec = spec if keeps_components(study) else with_base(spec)
    return {**without_cases(spec), "name": renamed(study.name, _SUFFIX), "run": run, "combine": "zip", "axes": axes}


def _listed(study: Study, cases: NDArray[np.int64]) -> tuple[Axis, ...]:
    """The cases as zipped axes, each once; a parameter with a tolerance has the value of the case's drive."""
    columns = study.columns(cases)
    if study.spread is None:
        return tuple(Axis(axis.paths, columns[axis.paths[0]]) for axis in study.axes)
    apart = {DRIVE, *study.derive, *(study.component_paths if keeps_components(study) else study.beside)}
    own = {path: column for path, column in columns.items() if path not in apart}
    return as_axes(chosen(own, first_rows(own)))


def _longer_run(study: Study, periods: int | None) -> dict[str, Any]:
    """A longer run of a given time, evaluated at its end: over the same length as before, or over its last third."""
    (number, unit), window = study.run["duration"], study.run["window"]
    if periods is not None:
        number, unit = float(periods), "periods"
    else:
        number = min(TIMES * number, MAX_RUN_PERIODS) if unit == "periods" else TIMES * number
    run: dict[str, Any] = {"duration": f"{number!r} {unit}"}
    if window and window[0][1] == window[1][1] == unit and (length := window[1][0] - window[0][0]) < number:
        run["window"] = [f"{number - length!r} {unit}", f"{number!r} {unit}"]
    return run
