"""The page of the office's own springs, clutches and motors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Query
from starlette.responses import RedirectResponse, Response

from sprag.service.faults import Fault, FaultError
from sprag.service.http.context import Context, Ctx
from sprag.service.http.problems import api_error
from sprag.service.http.routers import page_router
from sprag.service.http.threads import in_thread
from sprag.service.http.web.form.entries import Faults, Values
from sprag.service.http.web.form.values import Form
from sprag.service.http.web.templates import page
from sprag.service.http.work import Attended
from sprag.service.jobs import checks
from sprag.service.json_text import to_bytes
from sprag.service.reading.faults import message
from sprag.service.reading.units import examples
from sprag.service.reading.wording import words
from sprag.service.spec.components import (
    COEFFICIENTS,
    KINDS,
    Component,
    fields_of,
    kind_of,
    needed,
    require_component,
)
from sprag.service.storage.errors import ComponentNotFoundError
from sprag.worker.limits import MAX_COMPONENTS

router = page_router()


@dataclass(frozen=True, slots=True)
class _Column:
    """A field of a kind on the page; ``unit`` is "" where it has none of its own."""

    name: str
    label: str
    unit: str
    example: str
    choices: tuple[str, ...] = ()
    required: bool = False


def _columns(kind: str) -> list[_Column]:
    found = []
    for name, parameter in fields_of(kind).items():
        must = name in needed(kind, {})
        if parameter is None:
            found.append(_Column(name, words(name), "", "", tuple(kind_of(kind).ways), must))
        elif name == COEFFICIENTS:
            found.append(_Column(name, words(name), "", "0; 200; 0; 20000", (), must))
        else:
            shown = "" if parameter.unit == "1" else examples(parameter.unit)[0]
            found.append(_Column(name, words(name), parameter.unit, shown, (), must))
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
    try:
        if csv:
            given = await work.check(checks.components, to_bytes({"csv": values.get("csv", "")}), "json")
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
        found.setdefault(where, []).append(message(fault))
    return found


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
            (kind_of(kind), _columns(kind), [record for record in records if record.component.kind == kind])
            for kind in KINDS
        ],
        values=values,
        faults=faults,
        read=read,
    )
