"""The part of the spec that depends on the model: how base and run are read, and their JSON Schemas.

A model that is not registered is described by its catalogue of parameters: plain numbers and no run.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.spec.axes.axes import varied_values
from sprag_study.service.spec.derive import case_table, layout
from sprag_study.service.spec.described import SHAFT_RUN, Record
from sprag_study.service.spec.fields import base_pointer
from sprag_study.service.spec.machine.choices import drive_choices, shaft_choices
from sprag_study.service.spec.machine.clutch import check_laws
from sprag_study.service.spec.machine.drive import Drive, drive_record, read_drive
from sprag_study.service.spec.machine.part import SpecPart, read_plain
from sprag_study.service.spec.machine.shaft import SHAFT, check_shaft, read_shaft
from sprag_study.service.spec.machine.start_states import check_starts
from sprag_study.service.spec.run import RUN, read_run, refuse_run
from sprag_study.service.spec.schema.quantity import plain_schema
from sprag_study.service.spec.warnings import warn_machine_shaft, warn_vibration_drive
from sprag_study.worker import models
from sprag_study.worker.derived import distinct_values
from sprag_study.worker.models import machine_shaft
from sprag_study.worker.models.common import LOADS
from sprag_study.worker.models.vibration_drive.settled import CYCLIC_LOAD, STRIBECK_LOAD, STRIBECK_SPEED

if TYPE_CHECKING:
    from sprag_study.service.spec.kinds.draft import Draft
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.study import Axis, Combine

    Axes = tuple[Axis, ...]


def _drive_run(run: Node, axes: Axes | None, combine: Combine) -> dict[str, Any]:
    path, machine = "excitation.frequency", run.machine
    if path in machine.derive and axes is not None and not run.report.faults:
        settings = read_run(run, distinct_values(layout(machine, axes, combine), path))
    else:
        settings = read_run(run, varied_values(path, axes, machine.values))
    if models.is_settled(settings) and (CYCLIC_LOAD in machine.derive or _swings(machine, axes)):
        _refuse_settling(run)
    return settings


def _refuse_settling(run: Node) -> None:
    message = Sentence(
        "cannot last until the motion is settled: a load that swings with the angle of the shaft ({path}) does not "
        "repeat with the vibration",
        path=CYCLIC_LOAD,
    )
    run.refuse("conflict", message, None, allowed=N_("a `duration`, such as 200 periods, or no cyclic load"))


def _swings(machine: Machine, axes: Axes | None) -> bool:
    """Whether the load of some case swings with the angle of the shaft."""
    return bool((varied_values(CYCLIC_LOAD, axes, machine.values) > 0.0).any())


def _drive_check(draft: Draft) -> None:
    report, machine, axes, combine = draft.spec.report, draft.spec.machine, draft.axes or (), draft.combine
    assert isinstance(machine, Drive)
    _check_drawn(draft)
    _check_stribeck(draft)
    for k, axis in enumerate(axes):
        states = [path for path in axis.paths if path.endswith(".initial_clutch")]
        if states and (axis.array % 1.0).any():
            report.fault(
                f"/axes/{k}", "invalid-choice",
                Sentence("has values of {path} that are not the number of a state", path=states[0]),
                allowed=machine.parameters[states[0]].help,
            )  # fmt: skip
    if not report.faults:
        check_starts(report, machine, axes, combine)
    for clutch in machine.clutches:
        if report.faults or not any(path.startswith(clutch.prefix) for path in machine.derive):
            check_laws(report, [clutch], axes, combine)
        else:
            study = layout(machine, axes, combine)
            paths = [path for path in study.column_paths if path.startswith(clutch.prefix)]
            check_laws(report, [clutch], case_table(study, paths), "zip", "/derive")


def _check_drawn(draft: Draft) -> None:
    """Refuse settled motion where the load of some drawn drive swings with the angle of the shaft."""
    if draft.spread is None or not models.is_settled(draft.run):
        return
    for k, tolerance in enumerate(draft.spread.tolerances):
        if CYCLIC_LOAD in tolerance.paths and (draft.spread.array[:, k] > 0.0).any():
            _refuse_settling(draft.spec["run"])


def _check_stribeck(draft: Draft) -> None:
    """Refuse a Stribeck load without the speed at which it falls."""
    machine, axes = draft.spec.machine, draft.axes or ()
    given = {*machine.values, *machine.derive, *(path for axis in axes for path in axis.paths)}
    if draft.axes is None or STRIBECK_LOAD not in given or STRIBECK_SPEED in given:
        return
    drawn = draft.spread is not None and any(STRIBECK_LOAD in one.paths for one in draft.spread.tolerances)
    if drawn or STRIBECK_LOAD in machine.derive or varied_values(STRIBECK_LOAD, axes, machine.values).any():
        message = Sentence("is required with a Stribeck load ({path}): it has fallen to 1/e there", path=STRIBECK_LOAD)
        entry = machine.parameters[STRIBECK_SPEED]
        draft.spec.report.fault(
            base_pointer(STRIBECK_SPEED), "required", message, allowed=range_sentence(entry), unit=entry.unit
        )


_SHAFT_RUN: Final = Record(
    SHAFT_RUN, "which results the cases have; a machine shaft is solved for its whole cycle at once"
)


def _shaft_run(run: Node, *_: object) -> dict[str, Any]:
    if run.given and not isinstance(run.value, Mapping):
        return refuse_run(run)
    node = run[LOADS]
    for field in run.parts():
        if field.pointer != node.pointer:
            field.refuse(
                "not-used",
                "belongs to the vibration drive: a machine shaft is solved for its whole cycle at once",
                allowed=N_("`loads` only"),
            )
    if not SHAFT_RUN[LOADS].read(run):
        return {}
    structure = run.machine.structure
    joints = 0 if structure is None else len(machine_shaft.joints_in(structure))
    if joints > machine_shaft.MAX_JOINTS:
        message = Sentence(
            "are results of machines with {most} joints at most, and this one has {count}",
            most=machine_shaft.MAX_JOINTS, count=joints,
        )  # fmt: skip
        node.refuse("out-of-range", message, allowed=N_("no `loads`, or fewer joints"))
    return {LOADS: True}


_PARTS = {
    models.VIBRATION_DRIVE: SpecPart(
        read_base=read_drive,
        base=drive_record,
        read_run=_drive_run,
        run=RUN,
        check=_drive_check,
        warn=warn_vibration_drive,
        choices=drive_choices,
    ),
    models.MACHINE_SHAFT: SpecPart(
        read_base=read_shaft,
        base=lambda: SHAFT,
        check_base=check_shaft,
        read_run=_shaft_run,
        run=_SHAFT_RUN,
        warn=warn_machine_shaft,
        choices=shaft_choices,
    ),
}


def part_of(model: str) -> SpecPart:
    """The part of ``model``; ValueError for an unknown model."""
    if model in _PARTS:
        return _PARTS[model]
    catalogue = models.parameter_catalogue(model)
    return SpecPart(partial(read_plain, catalogue=catalogue), partial(plain_schema, catalogue))
