"""Functions for the checking processes, which read and evaluate user input and can be ended at any time.

Their answers are small, or bytes ready to be sent or stored, so that the service stays responsive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final, TypeVar

import numpy as np

from sprag_study.service.faults import FaultError, parameter_error
from sprag_study.service.jobs.preview import preview_json
from sprag_study.service.jobs.start_from import completed
from sprag_study.service.jobs.submission import Order, Submission, submission
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading import units
from sprag_study.service.results.fits import fit_json, read_fit
from sprag_study.service.results.regimes import UNSETTLED
from sprag_study.service.results.selection import locate_axes
from sprag_study.service.schedules.fields import ScheduleFields, change_fields, read_fields
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.longer import longer_spec, runs_over_time
from sprag_study.service.spec.machine.shaft_check import compile_elsewhere
from sprag_study.service.spec.narrow import narrowed_spec, swept_axis
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.stored import accepted
from sprag_study.service.views.explore import selection_spec
from sprag_study.service.views.library import Library
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from sprag_study.sentences import WarningText
    from sprag_study.service.results.explore import ExploreQuery
    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.spec.text import Body
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

R = TypeVar("R")

#: Fields of a schedule by which it is paused and resumed, and the most bytes of a body with them.
_PAUSING: Final = frozenset({"enabled", "paused_until"})
_SHORT: Final = 200


def prepare() -> None:
    """Prepare a checking process: load this module and the units, and leave missing kernels to other processes.

    Typst and the machine shaft's kernels are loaded on first use, outside the time limit of the request, so that a
    replacement process starts sooner.
    """
    units.load()
    compile_elsewhere()


def begin(library: Library) -> None:
    """First task of a checking process: open the ``library`` and load the engine, so that no client waits for that."""
    library.store.ping()
    models.prepare()


def of_body(read: Callable[..., R], body: Body, *args: Any) -> R:
    """What ``read`` makes of the data in the body of a request, and of ``args``; raises SpecError and as it does."""
    return read(body.data(), *args)


def preview(library: Library, body: Body, finish: datetime | None, now: datetime) -> bytes:
    """The preview of the spec in a request's body, as JSON text; raises SpecError."""
    store, parsed = library.store, new_study(library, body)
    left = None if finish is None else (finish - now).total_seconds()
    return to_bytes(preview_json(parsed, store.dispatchers.chunking, store.reuse.count(parsed.study), left))


def submitted(order: Order, study: Callable[..., ParsedSpec], library: Library, *args: Any) -> Submission:
    """The submission of the ``study`` that one of the functions below makes of ``args``; raises as it does."""
    return submission(study(library, *args), library.store, order)


def new_study(library: Library, body: Body) -> ParsedSpec:
    """The study of the spec in a request's body; raises SpecError."""
    return parse_spec(completed(library.store, body.data()))


def extended_study(library: Library, study_id: str, body: Body, warnings: Sequence[WarningText] = ()) -> ParsedSpec:
    """A study extended by the body of a request, with ``warnings`` about how that was written.

    It is the old one where no case is new, unless it gets another name. Raises SpecError and StudyNotFoundError.
    """
    study = library.store.studies.study(study_id)
    addition = body.data()
    spec = accepted(library.store.studies.spec(study_id), study)
    parsed = parse_extended(spec, study, addition, _came_to(library.store, study_id) if study.plan else None)
    named = isinstance(addition, Mapping) and "name" in addition
    nothing_new = study.plan is None and parsed.study.cases == study.cases and not named
    return replace(
        parsed, warnings=(*warnings, *parsed.warnings), same_as=study_id if nothing_new else "", follows=not named
    )


def _came_to(store: Store, study_id: str) -> int | None:
    """How many generations a search has come to that is over; None of one that still runs."""
    rounds = store.studies.rounds(study_id)
    if not rounds or not (rounds[-1].summary.get("phase") == "ended" or store.studies.get(study_id).over):
        return None
    generation: int | None = rounds[-1].summary.get("generation")
    return generation


def _refuse_without_time(study: Study) -> None:
    if not runs_over_time(study):
        raise FaultError("wrong-state", "The cases of this study are computed over one cycle: none runs longer.")


def kind_to_run_longer(store: Store, study_id: str, regime: str | None) -> str:
    """The regime or flag of the cases to run longer; FaultError where no case has it, or none can."""
    study, kinds = store.studies.study(study_id), store.rows.kinds(study_id)
    _refuse_without_time(study)
    if models.is_settled(study.run):
        if (wanted := regime or UNSETTLED) in kinds.regimes:
            return wanted
        raise parameter_error(
            "regime", "unknown-name", "no case of this study has it", wanted, ", ".join(kinds.regimes)
        )
    if regime is not None:
        raise parameter_error("regime", "unknown-name", "runs of a given time have no regime", regime, "no `regime`")
    if models.NOT_SETTLED in kinds.flags:
        return models.NOT_SETTLED
    raise parameter_error("regime", "unknown-name", "no case of this study has the flag `not_settled`")


def longer_study(
    library: Library, study_id: str, kind: str | tuple[int, ...], at_most: int | None = None
) -> ParsedSpec:
    """The cases of a study with that regime, or with that flag where there are no regimes, with more time to settle.

    Or the cases of those numbers. There must be at least one. Raises SpecError, StudyNotFoundError, FaultError where
    cases do not run over time, and IndexError for numbers of cases that there are not.
    """
    store = library.store
    study = store.studies.study(study_id)
    _refuse_without_time(study)
    if isinstance(kind, str):
        named = {"regime" if models.is_settled(study.run) else "flag": kind}
        cases = store.rows.cases_of_kind(study_id, **named)
    else:
        cases = np.array(kind, dtype=np.int64)
    spec = longer_spec(accepted(store.studies.spec(study_id), study), study, cases, at_most)
    return replace(parse_spec(spec), follows=True)


def narrowed_study(library: Library, study_id: str, steps: int, at: Sequence[tuple[str, str]] = ()) -> ParsedSpec:
    """The sweep of a study once more, with smaller steps where the motion jumps, at some values of its other axes.

    Raises FaultError where there is no jump, SelectionError, SpecError and StudyNotFoundError.
    """
    store = library.store
    study, record = store.studies.study(study_id), store.studies.get(study_id)
    if study.sweep is None:
        raise FaultError("wrong-state", "The study is not a sweep: it has no jumps to narrow.")
    if record.done < record.cases:
        raise FaultError("wrong-state", f"Only {record.done:,} of {record.cases:,} cases have been run.")
    fixed = {axis: index for axis, (_, index) in locate_axes(study, at).items()}
    if swept_axis(study) in fixed:
        raise parameter_error("at", "conflict", "names the swept axis", study.sweep, "values of the other axes")
    cases = store.rows.cases_of_kind(study_id, flag=models.JUMPED)
    indices = study.indices(cases)
    for axis, index in fixed.items():
        cases, indices = cases[indices[axis] == index], tuple(one[indices[axis] == index] for one in indices)
    if not cases.size:
        raise FaultError("wrong-state", "No case of the study has the flag jumped" + (" there." if fixed else "."))
    spec = narrowed_spec(accepted(store.studies.spec(study_id), study), study, cases, steps, fixed)
    return replace(parse_spec(spec), follows=True)


def selected_study(library: Library, study_id: str, query: ExploreQuery) -> ParsedSpec:
    """The first cases of a selection as points; raises SelectionError, FaultError, SpecError and StudyNotFoundError."""
    return parse_spec(selection_spec(library, study_id, query))


def clutch_fit(data: object) -> bytes:
    """The report of the fit that ``data`` describes, as JSON text; raises SpecError."""
    return to_bytes(fit_json(read_fit(data)))


def only_pauses(body: Body) -> bool:
    """Whether the body of a change of a schedule does no more than pause or resume it; such a body is short."""
    if len(body.content) > _SHORT:
        return False
    try:
        data = body.data()
    except SpecError:
        return False
    return isinstance(data, Mapping) and set(data) <= _PAUSING


def schedule_fields(data: object, library: Library, now: datetime, old: ScheduleFields | None = None) -> ScheduleFields:
    """The fields of a new schedule, or of an ``old`` one with changes; raises SpecError.

    Its studies start from the end of a case as it is now: the schedule stays complete when that study is deleted.
    """
    if isinstance(data, Mapping) and "spec" in data:
        try:
            data = {**data, "spec": completed(library.store, data["spec"])}
        except SpecError as error:
            raise SpecError(replace(fault, where=f"/spec{fault.where}") for fault in error.faults) from error
    return read_fields(data, now) if old is None else change_fields(old, data, now)
