"""The page of the office's own springs, clutches and motors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated

from fastapi import Query
from starlette.responses import RedirectResponse, Response

from sprag_study.service.faults import Fault, FaultError
from sprag_study.service.http.context import Context, Ctx
from sprag_study.service.http.current import current
from sprag_study.service.http.problems import api_error
from sprag_study.service.http.routers import page_router
from sprag_study.service.http.threads import in_thread
from sprag_study.service.http.web.form.entries import Faults, Values
from sprag_study.service.http.web.form.sent import settle
from sprag_study.service.http.web.form.sheet import Quantity, quantity_of
from sprag_study.service.http.web.form.values import Form
from sprag_study.service.http.web.templates import page
from sprag_study.service.http.work import Attended
from sprag_study.service.jobs import checks
from sprag_study.service.json_text import to_bytes
from sprag_study.service.languages import gettext
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.quantities import preferred
from sprag_study.service.reading.units import examples
from sprag_study.service.reading.wording import words
from sprag_study.service.spec.components import (
    COEFFICIENTS,
    KINDS,
    Component,
    fields_of,
    kind_of,
    model_of_kind,
    needed,
    read_components,
    require_component,
)
from sprag_study.service.spec.text import Body
from sprag_study.service.storage.errors import ComponentNotFoundError
from sprag_study.service.views.components import shown_fields
from sprag_study.worker.limits import MAX_COMPONENTS
from sprag_study.worker.models.parameters import placed

router = page_router()

#: Faults whose allowed values are names of fields or choices.
_NAMING = ("unknown-field", "invalid-choice")


@dataclass(frozen=True, slots=True)
class _Column:
    """A field of a kind on the page; ``choices`` are values and what they are called."""

    name: str
    label: str
    quantity: Quantity
    example: str
    choices: Mapping[str, str] = field(default_factory=dict)
    required: bool = False


def _columns(kind: str, values: Values) -> list[_Column]:
    """The fields of a kind; ``values`` are those of its form, whose numbers have a unit beside them."""
    found, units = [], preferred(current().choice.units, model_of_kind(kind))
    for name, parameter in fields_of(kind).items():
        text, must = values.get(f"fields/{name}", ""), name in needed(kind, {})
        if parameter is None:
            found.append(_Column(name, words(name), Quantity(text), "", kind_of(kind).titles, must))
        elif name == COEFFICIENTS:
            each = "; ".join(placed(parameter, f"{COEFFICIENTS}.{index}").unit for index in range(2))
            found.append(_Column(name, words(name), Quantity(text, f"{each}; …"), "0; 200; 0; 20000", {}, must))
        else:
            shown = "" if parameter.unit == "1" else examples(parameter.unit)[0]
            found.append(_Column(name, words(name), quantity_of(text, parameter.unit, units), shown, {}, must))
    return found


@router.get("/parts")
def components_page(
    context: Ctx,
    edit: Annotated[str, Query(max_length=40)] = "",
    read: Annotated[int, Query(ge=0, le=MAX_COMPONENTS)] = 0,
) -> Response:
    """Every component by kind, and a form for each kind; that of ``edit`` has the values of this component.

    ``read`` is the number of those that a CSV text has just given.
    """
    return _page(context, _values(context, edit) if edit else {}, {}, 200, read)


def _values(context: Context, component_id: str) -> Values:
    """The form filled with a component; raises ComponentNotFoundError."""
    component = next((one.component for one in context.store.components.all() if one.id == component_id), None)
    if component is None:
        raise ComponentNotFoundError(component_id)
    fields = {f"fields/{name}": text for name, text in component.fields.items()}
    return {"kind": component.kind, "name": component.name, "note": component.note, **fields}


@router.post("/parts")
async def put_component(context: Ctx, work: Attended, values: Form) -> Response:
    """Add or replace one component, or those of a CSV text; the page again, with what is wrong, where invalid."""
    csv = values.get("do") == "csv"
    settle(values, with_ticks=False)
    try:
        if csv:
            given = await work.check(checks.of_body, read_components, Body(to_bytes({"csv": values.get("csv", "")})))
        else:
            given = [_component(values)]
        await in_thread(context.store.components.put, given)
    except FaultError as error:
        faults, status = _faults(error, csv=csv), api_error(error).type.status
        return await in_thread(_page, context, values, faults, status)
    return RedirectResponse(f"/parts?read={len(given)}" if csv else "/parts", status_code=303)


def _component(values: Values) -> Component:
    """The component of a filled form; raises SpecError."""
    fields = {name.removeprefix("fields/"): text for name, text in values.items() if name.startswith("fields/")}
    kept = {name: values.get(name, "") for name in ("kind", "name", "note")}
    return require_component({**kept, "fields": fields})


def _faults(error: FaultError, *, csv: bool) -> Faults:
    """What is wrong, by field."""
    found: Faults = {}
    for fault in error.faults or (Fault("", "conflict", error.detail),):
        where = "csv" if csv else (fault.where or "").strip("/")
        names = (fault.allowed or "").split(", ") if not csv and fault.code in _NAMING else []
        shown = replace(fault, allowed=", ".join(map(_called, names))) if names else fault
        found.setdefault(where, []).append(message(shown))
    return found


def _called(name: str) -> str:
    """What a field or a choice is called on the page."""
    titles = {choice: title for kind in KINDS for choice, title in kind_of(kind).titles.items()}
    return gettext(titles.get(name, words(name)))


@router.post("/parts/{component_id}/delete")
def delete_component(context: Ctx, component_id: str) -> Response:
    """Remove a component."""
    context.store.components.remove(component_id)
    return RedirectResponse("/parts", status_code=303)


def _page(context: Context, values: Values, faults: Faults, status: int, read: int = 0) -> Response:
    records = context.store.components.all()
    return page(
        "parts.html",
        status=status,
        kinds=[
            (
                kind_of(kind),
                _columns(kind, values if values.get("kind") == kind else {}),
                [
                    (record, shown_fields(record.component, current().choice.units))
                    for record in records
                    if record.component.kind == kind
                ],
            )
            for kind in KINDS
        ],
        values=values,
        faults=faults,
        read=read,
    )
