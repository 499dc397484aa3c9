"""The page of one study: its progress, mechanical characteristic, inputs and actions."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from starlette.datastructures import QueryParams
from starlette.responses import RedirectResponse, Response

from sprag.sentences import Sentence
from sprag.service import formats
from sprag.service.figures import pictures
from sprag.service.http import views
from sprag.service.http.context import Context, Ctx, StudyId
from sprag.service.http.current import current
from sprag.service.http.problems import ApiError
from sprag.service.http.reading import address_pairs, file_pairs
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.figures.fits import fits_of, has_measured_clutch
from sprag.service.http.web.form.values import changed_meanwhile
from sprag.service.http.web.held import fixed_choices
from sprag.service.http.web.saved_views import report_figures, saved_here, view_actions
from sprag.service.http.web.study_answers import AnswersOnPage, answers_view
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended, Work
from sprag.service.jobs import checks
from sprag.service.jobs.submission import take_in
from sprag.service.json_text import timestamp
from sprag.service.languages import N_, _
from sprag.service.reading.directions import ends_in_words
from sprag.service.reading.reader import Reading, meanings, reading_for
from sprag.service.results.choice import map_query, pairs_of
from sprag.service.results.defaults import caption, drawn_numbers, main_query, no_curves, varying_axes
from sprag.service.results.refined_maps import map_plan
from sprag.service.results.regimes import DOUBTFUL, ORDER, counted
from sprag.service.results.shown_inputs import inputs, run_settings
from sprag.service.spec.narrow import narrowed_cases
from sprag.service.storage.studies.records import Kinds
from sprag.service.views.headline import is_small, usual_query
from sprag.worker import models
from sprag.worker.limits import MAX_CASES, NARROW_STEPS
from sprag.worker.models.starts import has_starts
from sprag.worker.planning.calibrate.plan import CALIBRATE
from sprag.worker.planning.goals.plan import GOAL
from sprag.worker.states import TRANSITIONS, StudyEvent, StudyState

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.service.answers.studies import ClutchFitReport
    from sprag.service.http.web.figures.fit import FitChart
    from sprag.service.http.web.form.entries import Faults, Values
    from sprag.service.results.curves import CurveQuery
    from sprag.worker.study import Study

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
    varying = len(varying_axes(study))
    grid = study.combine == "grid" and varying > 1
    mapped = grid or map_plan(study) is not None
    tabs = [
        ("", N_("Overview")),
        *([("/curves", N_("Curves"))] if main_query(study, models.study_results(study)) is not None else []),
        *([("/map", N_("Map"))] if mapped else []),
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
    """One study: its progress, answers, mechanical characteristic and inputs."""
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
    fits = (
        await work.check(fits_of, spec, await in_thread(context.store.studies.study, study_id))
        if has_measured_clutch(spec)
        else {}
    )
    usual, many = await in_thread(_usual_curves, context, study_id)
    asked = (context.library, study_id, work.request.query_params.multi_items(), usual, current().choice)
    view = await (work.check(answers_view, *asked) if many else in_thread(answers_view, *asked))
    extension = {"further": further or {}, "wrong": wrong or {}, "labels": labels or {}, "untaken": untaken or {}}
    if labels and not untaken:
        extension["changed_meanwhile"] = changed_meanwhile()
    return await in_thread(_study_page, context, study_id, fits, view, usual, extension)


def _usual_curves(context: Context, study_id: str) -> tuple[CurveQuery | None, bool]:
    """The curves that are shown first, and whether reading the answers of the study takes long."""
    return usual_query(context.library, study_id), not is_small(context.store.studies.study(study_id))


def _study_page(
    context: Context,
    study_id: str,
    fits: Mapping[str, tuple[ClutchFitReport, FitChart]],
    view: AnswersOnPage,
    usual: CurveQuery | None,
    extension: Mapping[str, Any],
) -> Response:
    study = context.store.studies.study(study_id)
    frame = study_frame(context, study_id)
    query = view.query or usual
    first = context.store.rows.case(study_id, 0) if query is None and study.cases == 1 else None
    kinds = context.store.rows.kinds(study_id)
    return page(
        "study.html",
        status=_status(view, extension),
        **frame,
        **extension,
        origins=context.store.rows.origins(study_id),
        tab="",
        shown=models.presentation_of(study),
        answers=view,
        faults=view.faults,
        fixed=[]
        if view.query is None
        else fixed_choices(study, (view.query.x, *view.query.by), view.query.at, frame["reading"]),
        **_main_figure(study, study_id, query, view, frame["reading"]),
        view_actions=view_actions(),
        report_figures=report_figures(study, study_id, frame["saved"]),
        orders=orders_address(study, study_id),
        regime_maps=regime_maps(study, study_id),
        only_row=None if first is None else first.results.items(),
        units={info.name: info.unit for info in models.study_results(study)},
        inputs=inputs(study, frame["study"]["spec"]),
        run=run_settings(study, frame["study"]["spec"], frame["reading"]),
        fits=fits,
        regimes=kinds.regimes,
        counts=counted(kinds.regimes),
        regime_meanings=meanings(models.REGIME_SENTENCES),
        flags={flag: count for flag, count in kinds.flags.items() if flag not in models.REGIME_SENTENCES},
        flag_meanings=meanings(models.flags_of(study.model)),
        ends_of=ends_in_words,
        to_run_longer=(*DOUBTFUL, models.NOT_SETTLED),
        narrowed=_narrowed(context, study, study_id) if models.JUMPED in kinds.flags else 0,
    )


def _status(view: AnswersOnPage, extension: Mapping[str, Any]) -> int:
    """The status of the page: whether one of its forms is refused, or its labels were changed meanwhile."""
    if extension["untaken"] or view.faults or extension["wrong"]:
        return 422
    return 412 if extension["labels"] else 200


def _narrowed(context: Context, study: Study, study_id: str) -> int:
    """Cases of the sweep with smaller steps where the motion jumps; 0 where it cannot be run, or not yet."""
    record = context.store.studies.get(study_id)
    if record.done < record.cases:
        return 0
    count = narrowed_cases(study, context.store.rows.cases_of_kind(study_id, flag=models.JUMPED))
    return count if count <= MAX_CASES else 0


def _has_goal(study: Study) -> bool:
    return study.plan is not None and study.plan["kind"] == GOAL


def _calibrates(study: Study) -> bool:
    return study.plan is not None and study.plan["kind"] == CALIBRATE


def _drawable(points: int) -> bool:
    """Whether a picture can show so many points."""
    return points <= pictures.MAX_PICTURE_POINTS


def _main_figure(
    study: Study, study_id: str, query: CurveQuery | None, view: AnswersOnPage, reading: Reading
) -> dict[str, Any]:
    """The addresses of the figure on the page, of its picture and of the page where others are chosen; its caption."""
    chosen, in_file = address_pairs(current().choice), file_pairs()
    own = urlencode(chosen)
    picture = f"format=svg&{urlencode(in_file)}"
    if _has_goal(study):
        return {
            "heading": _("Designs"),
            "figure": f"/studies/{study_id}/figures/front?{own}",
            "picture": f"{views.study_address(study_id)}/front?{picture}" if _drawable(study.cases) else None,
            "others": f"/studies/{study_id}/rows",
            "kind": _("Designs"),
            "invitation": _("More on the page"),
            "caption": _("Every design of the search; grey ones are outside the limits"),
        }
    if _calibrates(study):
        return {
            "heading": _("Calibration"),
            "figure": f"/studies/{study_id}/figures/calibration?columns=2&{own}",
            "picture": f"{views.study_address(study_id)}/calibration?{picture}",
            "others": f"/studies/{study_id}/calibration",
            "kind": _("Calibration"),
            "invitation": _("More on the page"),
            "caption": _("Measured points on the fitted curve, and the residuals"),
        }
    if query is None:
        return {
            "heading": "",
            "without": "" if study.cases == 1 or study.plan is not None else no_curves(study),
            "figure": None,
            "picture": None,
            "others": None,
            "kind": "",
            "invitation": "",
            "caption": None,
        }
    return _chosen_figure(study, study_id, query, view, reading)


def _chosen_figure(
    study: Study, study_id: str, query: CurveQuery, view: AnswersOnPage, reading: Reading
) -> dict[str, Any]:
    """The curves of a query, or the map of a study that refines one, as of `_main_figure`."""
    chosen, in_file = address_pairs(current().choice), file_pairs()
    mapped = map_query(study, models.study_results(study), QueryParams()) if map_plan(study) is not None else None
    if mapped is not None:
        kind, pairs, more = "map", pairs_of(mapped), ("kind", "heatmap")
        text = _(
            "{z} over {x} and {y}",
            z=reading.caption(mapped.z), x=reading.within(mapped.x), y=reading.within(mapped.y),
        )  # fmt: skip
        drawable = True
    else:
        kind, pairs, more = "curves", pairs_of(query), ("columns", "2")
        text = caption(study, query).said(reading)
        drawable = _drawable(drawn_numbers(study, query))
    picture = f"{views.study_address(study_id)}/{kind}?{urlencode([*pairs, ('format', 'svg'), *in_file])}"
    figure = f"/studies/{study_id}/figures/{kind}?{urlencode([*pairs, more, *chosen])}"
    if view.figure is not None:  # with the answers on the curves
        figure, picture = view.figure, view.picture or picture
    return {
        "heading": models.presentation_of(study).heading,
        "figure": figure,
        "picture": picture if drawable else None,
        "others": f"/studies/{study_id}/{kind}?{urlencode(pairs)}",
        "kind": _("Map") if mapped is not None else _("Curves"),
        "invitation": _("Choose others with"),
        "caption": text,
    }


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
    now = context.store.clock.now()
    made = await work.check(checks.longer_study, context.library, study_id, kind, None, now, {})
    # Pressed twice, it submits one study, unless more cases of this kind have finished.
    key = f"longer-{study_id}-{kind}-{counts[kind]}"
    record = await in_thread(take_in, context.store, made, key)
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


@router.post("/studies/{study_id:study}/narrow")
async def narrow(context: Ctx, work: Attended, study_id: StudyId) -> Response:
    """The button beside the count of jumps: submit the sweep once more, with smaller steps there."""
    now, revision = context.store.clock.now(), (await in_thread(context.store.studies.get, study_id)).revision
    made = await work.check(checks.narrowed_study, context.library, study_id, NARROW_STEPS, (), now, {})
    # Pressed twice, it submits one study.
    record = await in_thread(take_in, context.store, made, f"narrow-{study_id}-{revision}")
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


def orders_address(study: Study, study_id: str) -> str | None:
    """URL of the map of the periods after which motions repeat; None where there is none."""
    return _map_address(study, study_id, ORDER) if models.is_settled(study.run) else None


def regime_maps(study: Study, study_id: str) -> list[tuple[str, str]]:
    """Text and URL of each map of how many motions cases have; none of cases with one start."""
    if not has_starts(study.run):
        return []
    shown = ((N_("number of motions"), "regime.count"), (N_("share of the rarest motion"), "regime.share.least"))
    addresses = [(_(text), _map_address(study, study_id, name)) for text, name in shown]
    return [(text, address) for text, address in addresses if address is not None]


def _map_address(study: Study, study_id: str, z: str) -> str | None:
    """URL of the map of a result; None where no two parameters span one."""
    query = map_query(study, models.study_results(study), QueryParams({"z": z}))
    if query is None or map_plan(study) is not None:
        return None
    return f"/studies/{study_id}/map?{urlencode(pairs_of(query))}"
