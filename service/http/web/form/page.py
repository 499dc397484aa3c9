"""The form for a new study: empty, from an example or a clone; checked while it is filled in; submitted."""

from __future__ import annotations

import hashlib
import json
import secrets
from collections.abc import Mapping
from typing import Annotated, Any, Final

from fastapi import Query, Request
from starlette.responses import RedirectResponse, Response

from sprag.sentences import Place, Sentence
from sprag.service.faults import FaultError
from sprag.service.http.context import Context, Ctx, study_with
from sprag.service.http.problems import ApiError, api_error
from sprag.service.http.reading import CHOICE
from sprag.service.http.respond import json_response
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.views import preset_of
from sprag.service.http.web.form import study_check
from sprag.service.http.web.form.cases import kinds, methods
from sprag.service.http.web.form.check import Checked, message
from sprag.service.http.web.form.columns import take_columns
from sprag.service.http.web.form.components import component_groups, take_component
from sprag.service.http.web.form.entries import Values
from sprag.service.http.web.form.fields import (
    FORM_MODEL,
    Groups,
    categories,
    degree_field,
    path_choices,
    pendulum,
    refine_fields,
    result_choices,
    run_fields,
    search_fields,
    sections,
)
from sprag.service.http.web.form.goal import GOAL_DEFAULTS, LIMITS
from sprag.service.http.web.form.own_machine import laboratory_address
from sprag.service.http.web.form.parts import PARTS, add_part, add_row, copy, count_of, drop, drop_row
from sprag.service.http.web.form.shaft import blocks, is_shaft, shaft_paths
from sprag.service.http.web.form.shaft_spec import base_of
from sprag.service.http.web.form.spec import (
    FORMULA,
    REFINE_DEFAULTS,
    clutch_pointers,
    is_search,
    pendulums_of,
    spec_of,
    values_of,
    with_clutch_defaults,
)
from sprag.service.http.web.form.tolerances import OWN, distributions, drive_fields, own_name, with_batch
from sprag.service.http.web.form.undo import history_of, remember, undo
from sprag.service.http.web.form.values import Form
from sprag.service.http.web.templates import fragment, page, spec_text
from sprag.service.http.work import Attended, Work
from sprag.service.jobs.submission import Submission, take_in
from sprag.service.languages import gettext
from sprag.service.presets import preset_names
from sprag.service.reading.reader import Reading
from sprag.service.spec.design import design_spec
from sprag.service.spec.document import UNNAMED
from sprag.service.spec.report import SpecError
from sprag.service.spec.stored import accepted
from sprag.worker import models
from sprag.worker.models import MAX_PENDULUMS

router = page_router()

#: Initial values of an empty form.
EMPTY_FORM: Final[Values] = {
    "pendulums": "1",
    "asks": "axes",
    "axes": "1",
    "/combine": "grid",
    **{f"/run/{name}": run_fields()[name].default for name in ("until", "at_most", "tolerance", "reset")},
    "/base/clutch/kind": "law",
    "/axes/0/way": "linspace",
    **REFINE_DEFAULTS,
    **GOAL_DEFAULTS,
}
#: Initial values of an empty form of a machine shaft.
EMPTY_SHAFT: Final[Values] = {
    **{name: text for name, text in EMPTY_FORM.items() if not name.startswith(("/run/", "/base/", "pendulums"))},
    "model": models.MACHINE_SHAFT,
    "/base/mechanism": "slider_crank",
    "/base/operation": "steps",
    "/refine/results": "irregularity",
}
#: Beginnings of the fields of the other question, which the page keeps though it does not show them.
_OF_AXES: Final = ("/axes/", "/refine/", "/combine", "/sample/", "/points", "/exclude/")
_OF_SEARCH: Final = ("/goal/",)
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
) -> Response:
    """The form, empty or filled in from an example or from another study, or one case of it, alone or along a
    parameter.
    """
    spec = await in_thread(_start, context, preset, clone, case, along)
    if spec is None:
        if model not in models.model_names():
            known = ", ".join(models.model_names())
            raise ApiError("not-found", Sentence("Unknown model; known models: {models}.", models=known))
        values = _empty(mode, model)
        return form_page(request, values, None, fields="/text" not in values or mode == "text")
    fields = True
    try:
        values = values_of(spec)
    except ValueError:
        fields = mode == "text"
    if mode == "text" or not fields:
        values = {"/text": spec_text(spec), "format": "json"}
    if clone is not None and case is None and "/name" in values:
        values["/name"] = f"{values['/name']} (copy)"
    checked = await look_over(context, work, values)
    return await in_thread(form_page, request, values, checked, fields=fields)


def _empty(mode: str, model: str) -> Values:
    """The values of a form that begins with nothing."""
    if mode == "text":
        return {"/text": "", "format": "json"}
    if model not in {FORM_MODEL, models.MACHINE_SHAFT}:
        return {"/text": spec_text({"sprag": 1, "model": model, "base": {}, "axes": []}), "format": "json"}
    return dict(EMPTY_SHAFT) if model == models.MACHINE_SHAFT else with_clutch_defaults(dict(EMPTY_FORM))


def _start(
    context: Context, preset: str | None, clone: str | None, case: int | None = None, along: str | None = None
) -> dict[str, Any] | None:
    if clone is not None and case is not None:
        study = study_with(context, clone, case)
        known = along is None or (along in study.base and along not in study.derive)
        return design_spec(accepted(context.store.spec(clone), study), study, case, along if known else None)
    if clone is not None:
        name = context.store.get_study(clone).name
        spec = accepted(context.store.spec(clone), context.store.study(clone))
        # A study that was given another name is cloned under that.
        return spec if spec.get("name", UNNAMED) == name else {**spec, "name": name}
    if preset is None:
        return None
    if preset not in preset_names():
        raise ApiError(
            "not-found", Sentence("Unknown example; known examples: {examples}.", examples=", ".join(preset_names()))
        )
    found: dict[str, Any] = preset_of(preset)["spec"]
    return found


@router.post("/new")
async def send_form(context: Ctx, work: Attended, request: Request, values: Form) -> Response:
    """Perform the pressed button: check the form, add or remove parts, or submit the study."""
    wanted = values.pop("do", "check")
    if wanted == "undo":
        undo(values)
        return await in_thread(form_page, request, values, await look_over(context, work, values))
    before = _as_sent(values)
    share_clutches(values)
    if wanted == "submit":
        checked, made = await work.check(study_check.form_study, context.library, values, context.store.clock.now())
        return await in_thread(_submit, context, request, values, checked, made)
    reshape(values, wanted)
    if wanted == "take-component":
        take_component(values, await in_thread(context.store.components))
    taken = wanted == "take-columns"
    faults = await in_thread(take_columns, values, _choices(values)) if taken else {}
    remember(values, before)
    checked = await look_over(context, work, values)
    checked.faults.update(faults)
    if wanted == "laboratory" and checked.preview is not None:
        try:
            address = await work.check(laboratory_address, checked.spec)
        except SpecError as error:
            reading = Reading(checked.spec["model"])
            text = "; ".join(f"{reading.place(Place(item.where or ''))}: {message(item)}" for item in error.faults)
            checked.faults.setdefault("", []).append(
                gettext("The laboratory cannot show this machine: {text}", text=text)
            )
        else:
            return RedirectResponse(address, status_code=303)
    return await in_thread(form_page, request, values, checked)


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
    return RedirectResponse(f"/studies/{record.id}", status_code=303)


@router.post("/new/check")
async def check(context: Ctx, work: Attended, request: Request, values: Form) -> Response:
    """The live preview: faults by field, and the panel with cases, time, size, warnings and fits."""
    checked = await look_over(context, work, values)

    def answer() -> dict[str, Any]:
        return {
            "faults": checked.faults,
            "panel": fragment("_form_panel.html", checked=checked, address=_address(request)),
            "sketch": fragment("_linkage.html", drawings=checked.sketch) if checked.sketch else "",
            "fits": {
                pointer: fragment("_form_fit.html", fit=fit, chart=chart, pointer="")
                for pointer, (fit, chart) in checked.fits.items()
            },
        }

    return json_response(await in_thread(answer))


async def look_over(context: Context, work: Work, values: Mapping[str, str]) -> Checked:
    """Check a form, given by fields or as text."""
    return await work.check(study_check.form, context.library, values, context.store.clock.now(), CHOICE.get())


def reshape(values: Values, wanted: str) -> None:
    """Add or remove a pendulum or a row of a part, as the pressed button requests; the other fields are kept."""
    action, _, index = wanted.partition(" ")
    verb, _, part = action.partition("-")
    if action == "add-pendulum":
        count = pendulums_of(values)
        if count < MAX_PENDULUMS:
            copy(values, f"/base/pendulums/{count - 1}/", f"/base/pendulums/{count}/")
            copy(values, f"{OWN}pendulums/{count - 1}/", f"{OWN}pendulums/{count}/")
            _adapt_formulas(values, count)
        values["pendulums"] = str(min(count + 1, MAX_PENDULUMS))
    elif action == "drop-pendulum":
        count = pendulums_of(values)
        drop(values, f"/base/pendulums/{count - 1}/")
        drop(values, f"{OWN}pendulums/{count - 1}/")
        values["pendulums"] = str(max(count - 1, 1))
    elif action == "add-parts":
        add_part(values)
    elif part in PARTS and verb == "add":
        add_row(values, part)
    elif part in PARTS and verb == "drop" and index.isdigit():
        drop_row(values, part, int(index))


def share_clutches(values: Values) -> None:
    """Initialise own laws from the common one, and the common one from the first, so that no input is lost."""
    common, first = "/base/clutch/", "/base/pendulums/0/clutch/"
    own = values.get("clutches") == "own"
    if own and f"{common}kind" in values:
        for index in range(pendulums_of(values)):
            copy(values, common, f"/base/pendulums/{index}/clutch/")
        drop(values, common)
    elif not own and f"{common}kind" not in values and f"{first}kind" in values:
        copy(values, first, common)
        for index in range(pendulums_of(values)):
            drop(values, f"/base/pendulums/{index}/clutch/")


def _adapt_formulas(values: Values, index: int) -> None:
    """Let the formulas of a copied pendulum use its own parameters."""
    for name, text in list(values.items()):
        if name.startswith(f"/base/pendulums/{index}/") and FORMULA in text:
            values[name] = text.replace(f"pendulums.{index - 1}.", f"pendulums.{index}.")


def form_page(
    request: Request, values: Values, checked: Checked | None, status: int = 200, *, fields: bool = True
) -> Response:
    """The page with the form filled in with ``values``; ``checked`` is None where they were not checked.

    ``fields`` is False where the form has no fields for the study, so that its spec is shown as text.
    """
    text_mode, shaft = "/text" in values, is_shaft(values)
    model = models.MACHINE_SHAFT if shaft else FORM_MODEL
    return page(
        "new_text.html" if text_mode else "new.html",
        status=status,
        values=values,
        with_fields=fields,
        faults={} if checked is None else checked.faults,
        checked=checked or Checked({}),
        begun=checked is not None,
        address=_address(request),
        key=values.get("key") or secrets.token_hex(8),
        shaft=shaft,
        blocks=blocks(values) if shaft else [],
        sections=[] if shaft else sections(),
        pendulums=[pendulum(index) for index in range(0 if text_mode or shaft else pendulums_of(values))],
        most_pendulums=MAX_PENDULUMS,
        parts=PARTS,
        rows={name: range(0 if text_mode else count_of(values, name)) for name in PARTS},
        search=is_search(values),
        kept=_kept(values),
        choices=[] if text_mode else _choices(values),
        components=[] if text_mode else component_groups(request.app.state.context.store.components(), shaft=shaft),
        undoable=bool(history_of(values)),
        presets=[preset for preset in map(preset_of, preset_names()) if text_mode or _fits_form(preset, shaft=shaft)],
        most_coefficients=models.MAX_COEFFICIENTS,
        run=run_fields(),
        refine=refine_fields(),
        limits=LIMITS,
        categories=categories(),
        search_fields=search_fields(),
        goals=result_choices(pendulums_of(values), numbers=True, model=model),
        limited=result_choices(pendulums_of(values), model=model),
        degree_field=degree_field,
        batch=with_batch(values),
        own_name=own_name,
        drive_fields=drive_fields(),
        distributions=distributions(),
        sample_methods=methods(),
        exclusion_kinds=kinds(),
    )


async def spec_in_form(work: Work, spec: dict[str, Any]) -> Response:
    """A spec in the form, or as text where the form cannot show it."""
    fields = True
    try:
        values = values_of(spec)
    except ValueError:
        values, fields = {"/text": spec_text(spec), "format": "json"}, False
    checked = await look_over(work.context, work, values)
    return await in_thread(form_page, work.request, values, checked, fields=fields)


def _choices(values: Values) -> Groups:
    """The parameters that can vary, by group."""
    if is_shaft(values):
        return shaft_paths(base_of(values, {}))
    laws = {pointer: _coefficients(values, pointer) for pointer in clutch_pointers(values)}
    prefixes = {pointer.removeprefix("/base/").replace("/", ".") + ".": count for pointer, count in laws.items()}
    return path_choices(pendulums_of(values), prefixes)


def _as_sent(values: Values) -> Values:
    """The form before its buttons change it; sharing or separating the clutches is undone with what it moves."""
    own, has_common = values.get("clutches") == "own", "/base/clutch/kind" in values
    moved = own == has_common and not is_shaft(values) and "/text" not in values
    return {**values, **({"clutches": "common" if own else "own"} if moved else {})}


def _kept(values: Values) -> Values:
    """The fields that the form does not show, so that what was entered is there when it does."""
    others: tuple[str, ...] = _OF_AXES if is_search(values) else _OF_SEARCH
    if not with_batch(values):
        others = (*others, *_OF_BATCH)
    if is_shaft(values):
        shown = {entry.name for block in blocks(values) for entry in block.entries}
        return {
            name: text for name, text in values.items()
            if name.startswith(others) or (name.startswith("/base/") and name not in shown)
        }  # fmt: skip
    return {name: text for name, text in values.items() if name.startswith(others)}


def _fits_form(preset: Mapping[str, Any], *, shaft: bool) -> bool:
    if preset["spec"]["model"] != (models.MACHINE_SHAFT if shaft else FORM_MODEL):
        return False
    try:
        return bool(values_of(preset["spec"]))
    except ValueError:
        return False


def _coefficients(values: Values, pointer: str) -> int:
    """Number of coefficients that an axis can vary: none for a fitted law."""
    if values.get(f"{pointer}/kind", "law") != "law":
        return 0
    found = spec_of({**values, "axes": "0"})[0]["base"]
    parts = pointer.split("/")
    clutch = found["clutch"] if len(parts) == 3 else found["pendulums"][int(parts[3])]["clutch"]
    return len(clutch.get("coefficients", ()))


def _address(request: Request) -> str:
    """The address of the service as the browser used it."""
    return f"{request.url.scheme}://{request.headers.get('host', request.url.netloc)}"
