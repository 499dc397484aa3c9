"""The form for a new study: empty, from an example or a clone; checked while it is filled in; submitted."""

from __future__ import annotations

import hashlib
import json
import re
import secrets
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Annotated, Any, Final

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence
from sprag_study.service.faults import FaultError
from sprag_study.service.figures.drawings import rough_drawings
from sprag_study.service.http.context import Context, Ctx, study_with
from sprag_study.service.http.current import current
from sprag_study.service.http.problems import ApiError, api_error
from sprag_study.service.http.respond import json_response
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.views import preset_of
from sprag_study.service.http.web.form.beginning import beginning, examples_of
from sprag_study.service.http.web.form.check import Checked, checked_form, submitted_form
from sprag_study.service.http.web.form.columns import take_columns
from sprag_study.service.http.web.form.components import (
    component_choices,
    component_groups,
    component_names,
    rows_with_components,
    take_component,
)
from sprag_study.service.http.web.form.entries import Values, plain, text_of
from sprag_study.service.http.web.form.fields import (
    FORM_MODEL,
    Choice,
    Groups,
    categories,
    refine_fields,
    result_choices,
    run_fields,
    sample_field,
    search_fields,
)
from sprag_study.service.http.web.form.goal import with_own_units, with_shown_units
from sprag_study.service.http.web.form.live import live_answer, named_numbers
from sprag_study.service.http.web.form.machine import BASE, choices_of, entries, form_of, model_name
from sprag_study.service.http.web.form.machine_spec import base_of, values_of_base
from sprag_study.service.http.web.form.own_machine import own_spec
from sprag_study.service.http.web.form.parts import count_of, parts_of, reshape, share, unshared
from sprag_study.service.http.web.form.sent import changed_kinds, kept_numbers, let_vary, settle
from sprag_study.service.http.web.form.sheet import Sheet, sheet_of
from sprag_study.service.http.web.form.spec import (
    CONDITIONS,
    GOAL_DEFAULTS,
    LIMITS,
    REFINE_DEFAULTS,
    is_refined,
    is_search,
    quantities_of,
    values_of,
)
from sprag_study.service.http.web.form.tolerances import BATCH, OWN, distributions, drive_fields, own_name, with_batch
from sprag_study.service.http.web.form.undo import history_of, remember, undo
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.templates import fragment, page, spec_text
from sprag_study.service.http.web.way_in import origin
from sprag_study.service.http.work import Attended, Work
from sprag_study.service.jobs.submission import Submission, take_in
from sprag_study.service.languages import _
from sprag_study.service.presets import preset_names
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.reading.quantities import Units, preferred
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.together import split_list
from sprag_study.service.reading.units import QuantityError, parse_quantity
from sprag_study.service.spec.design import design_spec
from sprag_study.service.spec.document import UNNAMED
from sprag_study.service.spec.fields import base_path, base_pointer
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.service.spec.stored import accepted
from sprag_study.worker import models

router = page_router()

#: Beginnings of the fields of the other question, which the page keeps though it does not show them.
_OF_AXES: Final = ("/axes/", "/refine/", "/combine", "/sample/", "/points", "/exclude/")
_OF_SEARCH: Final = ("/goal/",)
#: What an address can ask, with the values that it has.
_ASKED: Final = {"asks": ("axes", "goal", "match"), BATCH: ("on", "")}
_OF_BATCH: Final = (OWN, "/drives", "/seed", "/draws", "/correlations/")


@router.get("/new")
async def new_study(
    context: Ctx,
    work: Attended,
    request: Request,
    preset: Annotated[str | None, Query(max_length=80)] = None,
    clone: Annotated[str | None, Query(max_length=80)] = None,
    case: Annotated[int | None, Query(ge=0)] = None,
    along: Annotated[str | None, Query(max_length=200)] = None,
    mode: Annotated[str, Query(max_length=10)] = "form",
    model: Annotated[str, Query(max_length=40)] = FORM_MODEL,
    begin: Annotated[str, Query(max_length=10)] = "",
    source: Annotated[str | None, Query(max_length=80, alias="from")] = None,
) -> Response:
    """The form: the first example of a model as it is drawn, empty, an example, or a variant of another study or of one
    case of it, alone or along a parameter.
    """
    clone = clone or source
    given = dict(request.query_params)
    spec = await in_thread(_start, context, given, model, preset, clone, case, along)
    if spec is None:
        if model not in models.model_names():
            known = ", ".join(models.model_names())
            raise ApiError("not-found", Sentence("Unknown model; known models: {models}.", models=known))
        if mode == "text":
            return form_page(request, {"/text": "", "format": "json"}, None)
        if begin == "empty":
            return await in_thread(form_page, request, empty(model), None)
        spec = {**without_cases(await in_thread(beginning, model)), "axes": []}
        spec.pop("name", None)
    values, fields = _shown(spec, text=mode == "text")
    if clone is None and preset is None and "/text" not in values:
        values |= {
            name: text_of(int(number) if number.is_integer() else number)
            for name, number in _read_numbers(values).items()
        }
    if clone is not None and case is None and "/name" in values:
        values["/name"] = f"{values['/name']} (copy)"
    if clone is not None and "/text" not in values:
        values["from"] = clone
    if "/text" not in values:
        _set(values, given, request.query_params.getlist("vary"), along if clone is None else None)
    # The page is there at once; its script asks for what is not computed yet.
    checked = await look_over(context, work, values) if context.ready.is_set() else None
    return await in_thread(form_page, request, values, checked, fields=fields)


def _set(values: Values, given: Mapping[str, str], vary: list[str], along: str | None) -> None:
    """Put the question and the numbers of an address into a form, by their paths, and let those vary that it names."""
    values |= {name: given[name] for name, known in _ASKED.items() if given.get(name) in known}
    known = {entry.name: entry for entry in entries(values, hidden=True)}
    for path, text in given.items():
        name = base_pointer(path)
        listed, _slash, place = name.rpartition("/")
        if name in known:
            values[name] = text
        elif listed in known:
            items = split_list(values.get(listed, ""))
            if (at := whole_number(place, len(items))) is not None:
                items[at] = text
                values[listed] = "; ".join(items)
    paths = [choice.path for _group, group in _choices(values) for choice in group]
    asked = named_numbers(model_name(values), along, paths) if along else []
    for path in dict.fromkeys((*vary, *asked)):
        let_vary(values, path)


def empty(model: str) -> Values:
    """The values of a form of ``model`` that begins with nothing."""
    values: Values = {
        "model": model,
        "asks": "axes",
        "axes": "0",
        "/combine": "grid",
        **REFINE_DEFAULTS,
        **GOAL_DEFAULTS,
    }
    form = form_of(values)
    values |= {rows.name: str(rows.least) for rows in form.lists if rows.least}
    if form.with_run:
        values |= {
            f"/run/{name}": run_fields(form)[name].default for name in ("until", "at_most", "tolerance", "reset")
        }
    values_of_base({}, values)
    return {**values, **form.new}


def _start(
    context: Context,
    given: Mapping[str, str],
    model: str,
    preset: str | None,
    clone: str | None,
    case: int | None = None,
    along: str | None = None,
) -> dict[str, Any] | None:
    if clone is not None and case is not None:
        study = study_with(context, clone, case)
        known = along is None or (along in study.base and along not in study.derive)
        return design_spec(accepted(context.store.studies.spec(clone), study), study, case, along if known else None)
    if clone is not None:
        name = context.store.studies.get(clone).name
        spec = accepted(context.store.studies.spec(clone), context.store.studies.study(clone))
        # A study that was given another name is cloned under that.
        return spec if spec.get("name", UNNAMED) == name else {**spec, "name": name}
    if given.get("base") and model in models.model_names():
        return {**own_spec(given, model), "axes": []}
    machine = given.get("machine", "")
    if preset is None and not machine:
        return None
    preset = preset or machine
    if preset not in preset_names():
        raise ApiError(
            "not-found", Sentence("Unknown example; known examples: {examples}.", examples=", ".join(preset_names()))
        )
    found: dict[str, Any] = preset_of(preset)["spec"]
    return {**without_cases(found), "axes": []} if machine else found


@router.post("/new")
async def send_form(context: Ctx, work: Attended, request: Request, values: Form) -> Response:
    """Perform the pressed button: check the form, add or remove parts, or submit the study."""
    wanted = values.pop("do", "check")
    if wanted == "undo":
        undo(values)
        settle(values, with_ticks=False)
        with_shown_units(values, _reading(values))  # what was typed before is in the shown units too
        return await in_thread(form_page, request, values, await look_over(context, work, values))
    before, kinds, kept = values, changed_kinds(values), dict[str, str]()
    if "/text" not in values:
        before, kept = unshared(_without_ticks(values | kinds)), kept_numbers(values)
        _settle(values)
        share(values)
    if wanted == "submit":
        checked, made = await work.check(submitted_form, context.library, values, context.store.clock.now())
        return await in_thread(_submit, context, request, values, checked, made)
    reshape(values, wanted)
    if wanted == "take-component":
        take_component(values, await in_thread(context.store.components.all))
    opened = _opened(values, wanted, kinds)
    taken = wanted == "take-columns"
    faults = await in_thread(take_columns, values, _choices(values)) if taken else {}
    remember(values, before)
    checked = await look_over(context, work, values)
    checked.faults.update(faults)
    checked.say_beside(kept)
    shown = await live_answer(work, values) if wanted == "live" else None
    answer = None if shown is None else shown["answer"]
    return await in_thread(form_page, request, values, checked, live=answer, opened=opened)


def _opened(values: Values, wanted: str, kinds: Mapping[str, str]) -> str:
    """A field of the part of the machine that was added or has another kind; "" for none."""
    name = wanted.removeprefix("add-")
    part = parts_of(values).get(name) if name != wanted else None
    return next(iter(kinds), "") if part is None else f"{part.pointer}/{count_of(values, name) - 1}/"


def _submit(context: Context, request: Request, values: Values, checked: Checked, made: Submission | None) -> Response:
    if made is None:
        return form_page(request, values, checked, status=422)
    # A form that is sent twice by a second click is one study; changed and sent again, it is another.
    text = json.dumps([checked.spec, values.get("finish_by", "")], sort_keys=True)
    key = f"form-{values.get('key', '')[:64]}-{hashlib.sha256(text.encode()).hexdigest()[:32]}"
    key = "".join(character for character in key if "!" <= character <= "~")
    try:
        record = take_in(context.store, made, key)
    except FaultError as error:
        checked.faults.setdefault("", []).append(error.detail)
        return form_page(request, values, checked, status=api_error(error).type.status)
    asked = f"/calibrate?study={record.id}" if values.get("asks") == "match" else f"/studies/{record.id}"
    return RedirectResponse(asked, status_code=303)


@router.post("/new/check")
async def check(context: Ctx, work: Attended, request: Request, values: Form) -> Response:
    """The live preview: faults and warnings by field, and the panel with cases, time, size and fits."""
    kept = dict[str, str]()
    if "/text" not in values:
        kept = kept_numbers(values)
        _settle(values)
    checked = await look_over(context, work, values)
    checked.say_beside(kept)

    def answer() -> dict[str, Any]:
        sheet = None if "/text" in values else _sheet(request, values, checked, _choices(values))
        return {
            "faults": checked.faults,
            "beside": checked.beside,
            "run": checked.run,
            "panel": fragment("_form_panel.html", checked=checked, address=origin(request)),
            "pictures": [] if sheet is None else sheet.pictures,
            "spans": {} if sheet is None else sheet.spans,
            "rows": "" if sheet is None else f"{len(sheet.rows)}{' refined' if is_refined(values) else ''}",
            "fits": {
                pointer: fragment("_form_fit.html", fit=fit, chart=chart, pointer="")
                for pointer, (fit, chart) in checked.fits.items()
            },
        }

    return json_response(await in_thread(answer))


async def look_over(context: Context, work: Work, values: Mapping[str, str]) -> Checked:
    """Check a form, given by fields or as text."""
    return await work.check(checked_form, context.library, values, context.store.clock.now(), current().choice)


def form_page(
    request: Request,
    values: Values,
    checked: Checked | None,
    status: int = 200,
    *,
    fields: bool = True,
    live: str | None = None,
    opened: str = "",
) -> Response:
    """The page with the form filled in with ``values``; ``checked`` is None where they were not checked.

    ``fields`` is False where the form has no fields for the study, so that its spec is shown as text; ``opened`` is a
    field of the part of the machine that is open.
    """
    template = "new_text.html" if "/text" in values else "new.html"
    return page(template, status=status, with_fields=fields, live=live, **sheet_form(request, values, checked, opened))


def sheet_form(request: Request, values: Values, checked: Checked | None, opened: str = "") -> dict[str, Any]:
    """What the templates of a form are filled with, also those of its parts: ``_machine.html``, ``_varies.html`` and
    ``_drawer.html``, beside the macros of ``_fields.html`` imported with their context; ``opened`` as of `form_page`.
    """
    begun, checked = checked is not None, checked or Checked({})
    text_mode, model, own = "/text" in values, model_name(values), form_of(values)
    reading = _reading(values)
    values = values if text_mode else with_own_units(values, reading)
    parts = parts_of(values)
    records = () if text_mode else request.app.state.context.store.components.all()
    choices = [] if text_mode else [*_choices(values), *component_choices(values, records)]
    sheet = None if text_mode else _sheet(request, values, checked, choices, opened)
    rows = {} if text_mode else {name: range(count_of(values, name)) for name in parts}

    def results(*, numbers: bool = False) -> Groups:
        groups = result_choices(reading, lambda name: len(rows.get(name, ())), numbers=numbers)
        asked = [Choice(name, name, "") for name in quantities_of(values)]
        return [*groups, *([(_("Quantities"), asked)] if asked else [])]

    return {
        "values": values,
        "faults": checked.faults,
        "checked": checked,
        "begun": begun,
        "address": origin(request),
        "key": values.get("key") or secrets.token_hex(8),
        "model": model,
        "standard": model == FORM_MODEL,
        "form": own,
        "models": [(name, _called(name)) for name in models.model_names() if name != model],
        "sheet": sheet,
        "parts": parts,
        "rows": rows,
        "search": is_search(values),
        "refined": is_refined(values),
        "kept": _kept(values),
        "choices": choices,
        "components": [] if text_mode else component_groups(values, records),
        "component_names": component_names(records),
        "component_rows": rows_with_components(values),
        "undoable": bool(history_of(values)),
        "presets": [preset_of(name) for name in (preset_names() if text_mode else examples_of(model))],
        "run": run_fields(form_of(values)),
        "refine": refine_fields(),
        "limits": LIMITS,
        "categories": categories(model),
        "search_fields": search_fields(),
        "goals": results(numbers=True),
        "limited": results(),
        "batch": with_batch(values),
        "own_name": own_name,
        "drive_fields": drive_fields(),
        "distributions": distributions(),
        "sample": sample_field(),
        "conditions": CONDITIONS,
    }


def _reading(values: Values) -> Reading:
    """The reading of a form: the units of a workshop for those as they were typed."""
    model, choice = model_name(values), current().choice
    return Reading(model, Units(preferred(choice.units, model)), choice.names)


def _settle(values: Values) -> None:
    """Read units and ticks into the fields that they are about, and bare numbers of limits in the units shown."""
    settle(values)
    with_shown_units(values, _reading(values))


def _sheet(request: Request, values: Values, checked: Checked, choices: Groups, opened: str = "") -> Sheet:
    """The sheet of a form; a machine that has faults is drawn as far as its numbers are known."""
    model, before = model_name(values), None
    if source := values.get("from"):
        try:
            before = values_of(request.app.state.context.store.studies.spec(source))
        except (FaultError, ValueError):
            before = None
    return sheet_of(
        values,
        checked.sketch or rough_drawings(model, _to_draw(values)),
        choices,
        current().choice.units,
        tolerant=with_batch(values),
        faulty=checked.faults,
        before=before,
        begun=_begun(model),
        wanted=opened,
    )


def _numbers(values: Values) -> dict[str, float]:
    """The numbers of a form (SI, by path) that can be read."""
    return {base_path(name): value for name, value in _read_numbers(values).items()}


def _to_draw(values: Values) -> dict[str, float]:
    """The numbers of a form (SI, by path), in the place of required ones that cannot be read those of the example."""
    known, begun = _numbers(values), _numbers(_begun(model_name(values)))
    paths = {base_path(entry.name): entry.field.required for entry in entries(values) if entry.tolerant}
    return {path: known.get(path, begun.get(path, 0.0) if required else 0.0) for path, required in paths.items()}


def _read_numbers(values: Values) -> dict[str, float]:
    """The numbers of a form that can be read (SI), by the name of their field."""
    found = {}
    for entry in entries(values):
        if entry.tolerant and (text := values.get(entry.name, "").strip()):
            with suppress(QuantityError):
                found[entry.name] = parse_quantity(plain(text), entry.field.unit or "1")
    return found


@lru_cache(maxsize=8)
def _begun(model: str) -> Values:
    """The form of the example of a model."""
    return values_of(beginning(model))


def _without_ticks(values: Values) -> Values:
    """A form as it was before its ticks were pressed."""
    found = dict(values)
    settle(found, with_ticks=False)
    with_shown_units(found, _reading(found))
    return found


def _shown(spec: dict[str, Any], *, text: bool = False) -> tuple[Values, bool]:
    """The values of the form for a spec, as ``text`` or where it has no fields for it; whether it has, if it is to."""
    if not text:
        with suppress(ValueError):
            return values_of(spec), True
    return {"/text": spec_text(spec), "format": "json"}, text


async def spec_in_form(work: Work, spec: dict[str, Any]) -> Response:
    """A spec in the form, or as text where the form cannot show it."""
    values, fields = _shown(spec)
    checked = await look_over(work.context, work, values)
    return await in_thread(form_page, work.request, values, checked, fields=fields)


def _called(model: str) -> str:
    """What a model is called in a sentence."""
    shown = models.model_of(model).presentation
    return shown.form.called or shown.title or model


def _choices(values: Values) -> Groups:
    """The parameters that can vary, by group; what follows from others is a number too."""
    numbers = {name: re.sub(r"(^|;)\s*=[^;]*", r"\1 1", text) for name, text in values.items()}
    return choices_of(values, base_of(numbers, {}))


def _kept(values: Values) -> Values:
    """The fields that the form does not show, so that what was entered is there when it does."""
    others: tuple[str, ...] = _OF_AXES if is_search(values) else _OF_SEARCH
    if not with_batch(values):
        others = (*others, *_OF_BATCH)
    shown = {entry.name for entry in entries(values, hidden=True)}
    return {
        name: text for name, text in values.items()
        if name.startswith(others) or (name.startswith(f"{BASE}/") and name not in shown)
    }  # fmt: skip
