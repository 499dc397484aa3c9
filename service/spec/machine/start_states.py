"""The check of the states in which clutches begin, over all cases of a spec."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.service.spec.derive import layout
from sprag_study.service.spec.fields import base_pointer
from sprag_study.worker.derived import blocks, involved
from sprag_study.worker.models.vibration_drive.start_states import impossible_starts

if TYPE_CHECKING:
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.service.spec.report import Report
    from sprag_study.worker.study import Axis, Combine, Study

_STATE = ".initial_clutch"
#: Of a pendulum: what decides whether its clutch can begin in a state.
_OWN = ("initial_clutch", "initial_windup", "initial_speed", "backlash")


def check_starts(report: Report, machine: Machine, axes: tuple[Axis, ...], combine: Combine) -> None:
    """Record every clutch that cannot begin in the state that it is given, in some case."""
    given = {*machine.values, *(path for axis in axes for path in axis.paths)}
    pendulums = [path.removesuffix(_STATE) for path in sorted(given) if path.endswith(_STATE)]
    for pendulum in pendulums:
        _check_pendulum(report, machine, layout(machine, axes, combine), pendulum)


def _check_pendulum(report: Report, machine: Machine, study: Study, pendulum: str) -> None:
    known = {*study.base, *study.column_paths}
    laws = [path for path in known if path.startswith((f"{pendulum}.clutch.", "clutch."))]
    wanted = ["shaft.initial_speed", *(f"{pendulum}.{name}" for name in _OWN), *laws]
    paths = [path for path in wanted if path in known]
    part = involved(study, paths)
    fixed = {path: study.base[path] for path in paths if path in study.base}
    for cases in blocks(part):
        varied = part.columns(cases)
        for found in impossible_starts({**fixed, **{path: varied[path] for path in paths if path in varied}}):
            values = part.case_parameters(cases[found.case])
            where = [f"{path} = {values[path]:.10g}" for path in part.axis_paths]
            report.fault(
                _pointer(study, found.path, f"{pendulum}{_STATE}"),
                found.code,
                f"{found.path} " * (found.path in part.column_paths)
                + found.message
                + (f", first with {', '.join(where[:4])}" if where else ""),
                found.value,
                allowed=found.allowed,
                unit=machine.parameters[found.path].unit,
            )
            return


def _pointer(study: Study, path: str, state: str) -> str:
    """Where a spec gives an initial value; where its default does not fit the state, where it gives that."""
    for name in (path, state):
        axis = study.axis_of(name)
        if axis is not None:
            return f"/axes/{axis}"
        if name in study.derive:
            return f"/derive/{name}"
        if name in study.base:
            return base_pointer(name)
    raise AssertionError(state)
