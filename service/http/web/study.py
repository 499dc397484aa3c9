"""The sheet of one study and what its buttons do."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence
from sprag_study.service import formats
from sprag_study.service.http import views
from sprag_study.service.http.context import Context, Ctx, StudyId
from sprag_study.service.http.current import current
from sprag_study.service.http.prefix import here
from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.figures.fits import fits_of, has_measured_clutch
from sprag_study.service.http.web.form.values import changed_meanwhile
from sprag_study.service.http.web.saved_views import saved_here, view_actions
from sprag_study.service.http.web.sheet.chart import has_chart
from sprag_study.service.http.web.sheet.drawer import drawer_of, map_pairs, with_query
from sprag_study.service.http.web.sheet.side import trust_of
from sprag_study.service.http.web.sheet.view import sheet_of
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.jobs import checks
from sprag_study.service.json_text import timestamp
from sprag_study.service.languages import N_
from sprag_study.service.reading.directions import ends_in_words
from sprag_study.service.reading.part_names import part_name
from sprag_study.service.reading.reader import meanings, reading_for
from sprag_study.service.results.defaults import no_curves
from sprag_study.service.results.regimes import DOUBTFUL
from sprag_study.service.results.shown_inputs import inputs, run_settings, varying
from sprag_study.service.spec.fields import base_path
from sprag_study.service.spec.narrow import narrowed_cases
from sprag_study.service.storage.studies.records import Kinds
from sprag_study.service.views.headline import is_small
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_CASES, NARROW_STEPS
from sprag_study.worker.states import TRANSITIONS, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from starlette.datastructures import QueryParams

    from sprag_study.service.answers.studies import ClutchFitReport
    from sprag_study.service.http.web.figures.fit import FitChart
    from sprag_study.service.http.web.form.entries import Faults, Values
    from sprag_study.service.http.web.sheet.view import Sheet
    from sprag_study.worker.study import Study

router = page_router()

#: Actions on a study and the labels of their buttons.
VERBS: Final = {
    "pause": N_("Pause"),
    "resume": N_("Resume"),
    "cancel": N_("Cancel the rest"),
    "retry": N_("Run failed cases again"),
}
_EVENTS: Final = {
    "pause": StudyEvent.PAUSE,
    "resume": StudyEvent.RESUME,
    "cancel": StudyEvent.CANCEL,
    "retry": StudyEvent.RETRY,
}


def study_frame(context: Context, study_id: str) -> dict[str, Any]:
    """The common part of all pages about a study: the study as in the API, its actions, the related pages."""
    (record, progress), study = context.store.studies.look(study_id), context.store.studies.study(study_id)
    # Counting kinds takes time in proportion to the rows, so only the page that shows them does it.
    spec, choice = context.store.studies.spec(study_id), current().choice
    shown = views.detail(record, progress, study, spec, Kinds({}, {}), ())
    tabs = [
        ("", N_("Sheet")),
        ("/matters", N_("What matters")),
    ]
    return {
        "study": shown,
        "live": not StudyState(shown["state"]).terminal,
        "verbs": {verb: VERBS[verb] for verb in _verbs(StudyState(shown["state"]), record.ok < record.done)},
        "tabs": [*tabs, ("/rows", N_("Rows"))],
        "endings": meanings(models.ENDING_SENTENCES),
        "formats": list(formats.MEDIA_TYPES),
        "now": timestamp(datetime.now(UTC)),
        "choice": choice,
        "reading": reading_for(study, spec, choice),
        "saved": (saved := context.store.views.all(study_id)),
        "views_of": lambda part: saved_here(saved, part, study_id),
    }


def _verbs(state: StudyState, some_failed: bool) -> list[str]:
    possible = [verb for verb, event in _EVENTS.items() if (state, event) in TRANSITIONS]
    return [verb for verb in possible if verb != "retry" or some_failed]


@router.get("/studies/{study_id:study}")
async def study_page(context: Ctx, work: Attended, study_id: StudyId) -> Response:
    """The sheet of a study."""
    return await shown_study(context, work, study_id)


async def shown_study(
    context: Context,
    work: Work,
    study_id: str,
    further: Values | None = None,
    wrong: Faults | None = None,
    labels: Values | None = None,
    untaken: Faults | None = None,
) -> Response:
    """The page of a study; ``further`` is what its form for an extension has, with what is ``wrong`` there by field.

    ``labels`` is what its form for name, notes and tags has, where somebody else changed them after it was shown, or
    with what is ``untaken`` of it.
    """
    spec = await in_thread(context.store.studies.spec, study_id)
    study = await in_thread(context.store.studies.study, study_id)
    fits = await work.check(fits_of, spec, study) if has_measured_clutch(spec) else {}
    cases = here(f"/studies/{study_id}/cases/")
    asked = (context.library, study_id, work.request.query_params.multi_items(), current().choice, cases)
    sheet = await (in_thread(sheet_of, *asked) if is_small(study) else work.check(sheet_of, *asked))
    extension = {"further": further or {}, "wrong": wrong or {}, "labels": labels or {}, "untaken": untaken or {}}
    if labels and not untaken:
        extension["changed_meanwhile"] = changed_meanwhile()
    return await in_thread(_study_page, context, study_id, fits, sheet, work.request.query_params, extension)


def _study_page(
    context: Context,
    study_id: str,
    fits: Mapping[str, tuple[ClutchFitReport, FitChart]],
    sheet: Sheet,
    given: QueryParams,
    extension: Mapping[str, Any],
) -> Response:
    study = context.store.studies.study(study_id)
    frame = study_frame(context, study_id)
    kinds = context.store.rows.kinds(study_id)
    single = study.cases == 1 and study.plan is None
    first = context.store.rows.case(study_id, 0) if single else None
    progress = context.store.studies.progress(study_id)
    return page(
        "study.html",
        status=_status(sheet, extension),
        **frame,
        **extension,
        sheet=sheet,
        has_chart=has_chart(study),
        faults=sheet.faults,
        trust=trust_of(study_id, progress, kinds),
        settled=models.is_settled(study.run),
        without=no_curves(study) if study.cases > 1 and study.plan is None and progress.done else "",
        **drawer_of(study, study_id, sheet, given, frame["saved"]),
        origins=context.store.rows.origins(study_id),
        view_actions=view_actions(),
        only_row=None if first is None else first.results.items(),
        units={info.name: info.unit for info in models.study_results(study)},
        inputs=inputs(study, frame["study"]["spec"], frame["reading"]),
        varying=varying(study, frame["study"]["spec"], frame["reading"]),
        run=run_settings(study, frame["study"]["spec"], frame["reading"]),
        fits={part_name(base_path(pointer)): fit for pointer, fit in fits.items()},
        regimes=kinds.regimes,
        regime_meanings=meanings(models.REGIME_SENTENCES),
        flags={flag: count for flag, count in kinds.flags.items() if flag not in models.REGIME_SENTENCES},
        flag_meanings=meanings(models.flags_of(study.model)),
        ends_of=ends_in_words,
        to_run_longer=(*DOUBTFUL, models.NOT_SETTLED),
        narrowed=_narrowed(context, study, study_id) if models.JUMPED in kinds.flags else 0,
    )


def _status(sheet: Sheet, extension: Mapping[str, Any]) -> int:
    """The status of the page: whether one of its forms is refused, or its labels were changed meanwhile."""
    if extension["untaken"] or sheet.faults or extension["wrong"]:
        return 422
    return 412 if extension["labels"] else 200


def _narrowed(context: Context, study: Study, study_id: str) -> int:
    """Cases of the sweep with smaller steps where the motion jumps; 0 where it cannot be run, or not yet."""
    record = context.store.studies.get(study_id)
    if record.done < record.cases:
        return 0
    count = narrowed_cases(study, context.store.rows.cases_of_kind(study_id, flag=models.JUMPED))
    return count if count <= MAX_CASES else 0


@router.get("/studies/{study_id:study}/curves")
def curves_page(request: Request, study_id: StudyId) -> Response:
    """The former page of curves, whose choices the sheet has."""
    return RedirectResponse(with_query(f"/studies/{study_id}", request.query_params.multi_items()), status_code=308)


@router.get("/studies/{study_id:study}/map")
def map_page(request: Request, study_id: StudyId) -> Response:
    """The former page of a map, whose choices the sheet has: the axis upwards has another name there."""
    return RedirectResponse(
        with_query(f"/studies/{study_id}", map_pairs(request.query_params.multi_items())), status_code=308
    )


@router.get("/studies/{study_id:study}/delete")
def delete_page(context: Ctx, study_id: StudyId) -> Response:
    """The confirmation page for deleting a study, with everything that is deleted."""
    record = context.store.studies.get(study_id)
    return page("delete.html", study=views.summary(record), ended=record.over, days=context.settings.restore_days)


@router.post("/studies/{study_id:study}/delete")
def delete(context: Ctx, study_id: StudyId, at_once: bool = False) -> Response:
    """Delete the study and show the list of the remaining ones."""
    context.store.studies.delete(study_id, at_once=at_once)
    return RedirectResponse("/" if at_once else f"/?done=delete&changed={study_id}", status_code=303)


def _not_settled(flags: Mapping[str, int]) -> dict[str, int]:
    """The flags whose cases benefit from a longer run."""
    return {flag: count for flag, count in flags.items() if flag == models.NOT_SETTLED}


@router.post("/studies/{study_id:study}/longer/{kind}")
async def run_longer(context: Ctx, work: Attended, study_id: StudyId, kind: str) -> Response:
    """The button beside the count of a regime or a flag: submit a study of its cases with more time to settle."""

    def find() -> Mapping[str, int]:
        study, kinds = context.store.studies.study(study_id), context.store.rows.kinds(study_id)
        return kinds.regimes if models.is_settled(study.run) else _not_settled(kinds.flags)

    counts = await in_thread(find)
    if kind not in counts:
        raise ApiError("not-found", Sentence("This study has no such case."))
    # Pressed twice, it submits one study, unless more cases of this kind have finished.
    key = f"longer-{study_id}-{kind}-{counts[kind]}"
    record = await work.submit(checks.longer_study, study_id, kind, key=key)
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


@router.post("/studies/{study_id:study}/narrow")
async def narrow(context: Ctx, work: Attended, study_id: StudyId) -> Response:
    """The button beside the count of jumps: submit the sweep once more, with smaller steps there."""
    revision = (await in_thread(context.store.studies.get, study_id)).revision
    # Pressed twice, it submits one study.
    record = await work.submit(checks.narrowed_study, study_id, NARROW_STEPS, key=f"narrow-{study_id}-{revision}")
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


@router.post("/studies/{study_id:study}/{verb}")
def act(context: Ctx, study_id: StudyId, verb: str) -> Response:
    """A button of the page: perform the action and show the page again."""
    wishes = {
        "pause": context.store.studies.pause,
        "resume": context.store.studies.resume,
        "cancel": context.store.studies.cancel,
        "retry": context.store.studies.retry,
    }
    if verb not in wishes:
        raise ApiError("not-found", Sentence("Unknown action."))
    wishes[verb](study_id)
    return RedirectResponse(f"/studies/{study_id}", status_code=303)
