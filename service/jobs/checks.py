"""Functions for the checking processes, which read and evaluate user input and can be ended at any time.

Their answers are small, or bytes ready to be sent or stored, so that the service stays responsive.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.service.faults import FaultError, parameter_error
from sprag_study.service.jobs.preview import preview_json
from sprag_study.service.jobs.start_from import with_start
from sprag_study.service.jobs.submission import Submission, hash_of, submission
from sprag_study.service.json_text import to_bytes
from sprag_study.service.reading import units
from sprag_study.service.results.fits import fit_json, read_fit
from sprag_study.service.results.regimes import UNSETTLED
from sprag_study.service.results.selection import locate_axes
from sprag_study.service.schedules.fields import ScheduleFields, change_fields, read_fields
from sprag_study.service.spec.components import Component, read_components
from sprag_study.service.spec.document import load_spec, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.spec.labels import StudyChange, read_change
from sprag_study.service.spec.longer import longer_spec, runs_over_time
from sprag_study.service.spec.machine.shaft_check import compile_elsewhere
from sprag_study.service.spec.narrow import narrowed_spec, swept_axis
from sprag_study.service.spec.report import SpecError
from sprag_study.service.spec.saved_views import View, ViewChange, read_view, read_view_change
from sprag_study.service.spec.stored import accepted
from sprag_study.service.views.explore import selection_spec
from sprag_study.service.views.library import Library
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence
    from datetime import datetime

    from sprag_study.sentences import WarningText
    from sprag_study.service.results.explore import ExploreQuery
    from sprag_study.service.spec.text import Format
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

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


def preview(library: Library, content: bytes, form: Format, finish: datetime | None, now: datetime) -> bytes:
    """The preview of the spec in a request's body, as JSON text; raises SpecError."""
    store = library.store
    parsed = parse_spec(with_start(store, load_spec(content, form)))
    left = None if finish is None else (finish - now).total_seconds()
    return to_bytes(preview_json(parsed, store.dispatchers.chunking, store.reuse.count(parsed.study), left))


def components(content: bytes, form: Format) -> list[Component]:
    """The components in a request's body; raises SpecError."""
    return read_components(load_spec(content, form))


def new_study(
    library: Library,
    content: bytes,
    form: Format,
    fresh: bool,
    finish: datetime | None,
    now: datetime,
    given: Mapping[str, object],
) -> Submission:
    """The study of the spec in a request's body; raises SpecError."""
    store = library.store
    parsed = parse_spec(with_start(store, load_spec(content, form)))
    return submission(parsed, store, now, fresh, finish, given)


def extended_study(
    library: Library,
    study_id: str,
    content: bytes,
    form: Format,
    finish: datetime | None,
    now: datetime,
    given: Mapping[str, object],
    warnings: Sequence[WarningText] = (),
) -> Submission:
    """A study extended by the body of a request, with ``warnings`` about how that was written.

    Raises SpecError and StudyNotFoundError.
    """
    store = library.store
    study = store.studies.study(study_id)
    parsed = parse_extended(accepted(store.studies.spec(study_id), study), study, load_spec(content, form))
    parsed = replace(parsed, warnings=(*warnings, *parsed.warnings))
    return submission(parsed, store, now, finish_by=finish, given=given)


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
    library: Library,
    study_id: str,
    kind: str | tuple[int, ...],
    at_most: int | None,
    now: datetime,
    given: Mapping[str, object],
) -> Submission:
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
    parsed = parse_spec(longer_spec(accepted(store.studies.spec(study_id), study), study, cases, at_most))
    return submission(parsed, store, now, given=given)


def narrowed_study(
    library: Library,
    study_id: str,
    steps: int,
    at: Sequence[tuple[str, str]],
    now: datetime,
    given: Mapping[str, object],
) -> Submission:
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
    parsed = parse_spec(narrowed_spec(accepted(store.studies.spec(study_id), study), study, cases, steps, fixed))
    return submission(parsed, store, now, given=given)


def selected_study(
    library: Library, study_id: str, query: ExploreQuery, now: datetime, given: Mapping[str, object]
) -> Submission:
    """The first cases of a selection as points; raises SelectionError, FaultError, SpecError and StudyNotFoundError."""
    return submission(parse_spec(selection_spec(library, study_id, query)), library.store, now, given=given)


def clutch_fit(content: bytes, form: Format) -> bytes:
    """The report of the fit described in a request's body, as JSON text; raises SpecError."""
    return to_bytes(fit_json(read_fit(load_spec(content, form))))


def schedule_body(
    library: Library, content: bytes, form: Format, now: datetime, old: ScheduleFields | None = None
) -> ScheduleFields:
    """`schedule_fields` of the body of a request."""
    return schedule_fields(library, load_spec(content, form), now, old)


def only_pauses(content: bytes, form: Format) -> bool:
    """Whether the body of a change of a schedule does no more than pause or resume it; such a body is short."""
    if len(content) > _SHORT:
        return False
    try:
        data = load_spec(content, form)
    except SpecError:
        return False
    return isinstance(data, Mapping) and set(data) <= _PAUSING


def study_change(content: bytes, form: Format) -> StudyChange:
    """The change of what people write about a study, as the body of a request has it; raises SpecError."""
    return read_change(load_spec(content, form))


def saved_view(content: bytes, form: Format) -> View:
    """The view in a request's body; raises SpecError."""
    return read_view(load_spec(content, form))


def saved_view_change(content: bytes, form: Format, page: str) -> ViewChange:
    """The change of a view of ``page`` in a request's body; raises SpecError."""
    return read_view_change(load_spec(content, form), page)


def body_hash(content: bytes, form: Format) -> str:
    """`hash_of` the body of a request; raises SpecError when it cannot be read."""
    return hash_of(load_spec(content, form))


def schedule_fields(library: Library, data: object, now: datetime, old: ScheduleFields | None = None) -> ScheduleFields:
    """The fields of a new schedule, or of an ``old`` one with changes; raises SpecError.

    Its studies start from the end of a case as it is now: the schedule stays complete when that study is deleted.
    """
    if isinstance(data, Mapping) and "spec" in data:
        try:
            data = {**data, "spec": with_start(library.store, data["spec"])}
        except SpecError as error:
            raise SpecError(replace(fault, where=f"/spec{fault.where}") for fault in error.faults) from error
    return read_fields(data, now) if old is None else change_fields(old, data, now)
