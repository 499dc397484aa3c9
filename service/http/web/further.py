"""What a study's page does as the commands do: change its priority, and extend it by values or cases."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from fastapi import Request
from starlette.responses import RedirectResponse, Response

from sprag_study.sentences import Sentence, WarningText
from sprag_study.service.faults import FaultError, parameter_error
from sprag_study.service.http.context import Ctx, StudyId
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.web.form.entries import Faults, Values, doubtful, items_of, list_of
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.sheet.drawer import with_query
from sprag_study.service.http.web.study import shown_study
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.languages import _
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.spec.text import Body
from sprag_study.worker.limits import MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.faults import Fault

router = page_router()


@router.post("/studies/{study_id:study}/priority")
def change_priority(context: Ctx, study_id: StudyId, values: Form) -> Response:
    """The field of a study that has not ended: among waiting studies the highest priority runs first."""
    text = values.get("priority", "").strip()
    number = parse_number(text)
    if number is None or not abs(number) <= MAX_PRIORITY or number != int(number):
        allowed = Sentence("a whole number from {low} to {high}", low=-MAX_PRIORITY, high=MAX_PRIORITY)
        raise parameter_error("priority", "out-of-range", "is not a priority", text, allowed)
    context.store.studies.prioritize(study_id, int(number))
    return RedirectResponse(f"/studies/{study_id}", status_code=303)


@router.post("/studies/{study_id:study}/extend")
async def extend(context: Ctx, work: Attended, study_id: StudyId, values: Form) -> Response:
    """The form for further values of the axes, or further cases: submit the extended study.

    Where it is not valid, the page of the study again, with what is wrong beside the fields.
    """
    try:
        content = json.dumps(_addition(values), sort_keys=True).encode()
        # Pressed twice, it submits one study.
        key = f"extend-{study_id}-{hashlib.sha256(content).hexdigest()[:32]}"
        record = await work.submit(checks.extended_study, study_id, Body(content), _doubts(values), key=key)
    except FaultError as error:
        if not error.faults:
            raise
        return await shown_study(context, work, study_id, values, _wrong(values, error.faults))
    if record.id == study_id:
        return await shown_study(context, work, study_id, values, {"": [_("The study has all of these cases.")]})
    point = values.get("point", "").strip()
    return RedirectResponse(with_query(f"/studies/{record.id}", [("point", point)] if point else []), status_code=303)


@router.get("/studies/{study_id:study}/extend")
@router.get("/studies/{study_id:study}/labels")
def extension_form(request: Request, study_id: StudyId) -> Response:
    """The page of the study, from the address that a refused extension or a refused name has."""
    query = request.url.query
    return RedirectResponse(f"/studies/{study_id}{f'?{query}' if query else ''}", status_code=303)


def _wrong(values: Values, faults: Sequence[Fault]) -> Faults:
    """What is wrong with an extension, by field of its form; under "" what is about none of them."""
    axes, found = _axes(values), Faults()
    for fault in faults:
        part, _slash, index = (fault.where or "").strip("/").partition("/")
        place = index.partition("/")[0]
        if part == "axes" and place.isdigit() and int(place) < len(axes):
            field = f"axis:{axes[int(place)]['path']}"
        else:
            field = {"cases": "points", "points": "points", "name": "name", "generations": "generations"}.get(part, "")
        found.setdefault(field, []).append(message(fault))
    return found


def _axes(values: Values) -> list[dict[str, Any]]:
    """The further values of axes in a form."""
    return [
        {"path": name.removeprefix("axis:"), "values": entries}
        for name, text in values.items()
        if name.startswith("axis:") and (entries := list_of(text))
    ]


def _doubts(values: Values) -> list[WarningText]:
    """Points of bare numbers that are taken as decimal; the spec warns of those with units."""
    lists = {name.removeprefix("axis:"): text for name, text in values.items() if name.startswith("axis:")}
    read = [(path, items_of(text), list_of(text)) for path, text in lists.items()]
    return [note for path, items, entries in read for note in doubtful(items, entries, ["/axes"] * len(items), path)]


def _addition(values: Values) -> dict[str, Any]:
    """The extension that the form describes; FaultError unless it is of values, of cases or of generations."""
    if "generations" in values:
        text = values["generations"].strip()
        number = parse_number(text)
        return {"generations": text if number is None else int(number) if number == int(number) else number}
    axes = _axes(values)
    points = values.get("points", "").strip()
    if bool(axes) == bool(points):
        wanted = "give further values of axes, or further cases, and not both"
        raise parameter_error("", "exactly-one", wanted, allowed="values, or a table of cases")
    named = {"name": name} if (name := values.get("name", "").strip()) else {}
    return {**({"axes": axes} if axes else {"cases": [{"points": points}]}), **named}
