"""Components of the office's own, taken into the fields of a form."""

from __future__ import annotations

from collections.abc import Iterable

from sprag.service.http.web.form.entries import Values
from sprag.service.http.web.form.shaft import DRIVE, is_shaft
from sprag.service.http.web.form.spec import clutch_pointers, pendulums_of
from sprag.service.languages import N_
from sprag.service.spec.components import CHARACTERISTIC, CLUTCH, KINDS, MOTOR, SPRING, Component
from sprag.service.storage.components import ComponentRecord

_TITLES = {SPRING: N_("Springs"), CLUTCH: N_("Clutches"), MOTOR: N_("Motors")}


def component_groups(records: Iterable[ComponentRecord], *, shaft: bool) -> list[tuple[str, list[tuple[str, str]]]]:
    """Id and name of the components that a machine of the form can have, by kind."""
    found: dict[str, list[tuple[str, str]]] = {}
    for record in records:
        if (record.component.kind == MOTOR) == shaft:
            found.setdefault(record.component.kind, []).append((record.id, record.component.name))
    return [(_TITLES[kind], found[kind]) for kind in KINDS if kind in found]


def take_component(values: Values, records: Iterable[ComponentRecord]) -> None:
    """Fill in the fields of the chosen component, of every pendulum or of the chosen one; nothing without a choice."""
    chosen = next((record.component for record in records if record.id == values.get("component")), None)
    if chosen is None or (chosen.kind == MOTOR) != is_shaft(values):
        return
    one = values.get("component_for", "")
    count = pendulums_of(values)
    indices = [int(one)] if one.isdecimal() and int(one) < count else list(range(count))
    if chosen.kind == MOTOR:
        fields = {name: text for name, text in chosen.fields.items() if name != CHARACTERISTIC}
        values |= {DRIVE: chosen.fields[CHARACTERISTIC]}
        values |= {f"/base/drive/motor/{name}": text for name, text in fields.items()}
    elif chosen.kind == CLUTCH:
        _take_clutch(values, chosen, indices)
    else:
        for index in indices:
            values |= {f"/base/pendulums/{index}/{name}": text for name, text in chosen.fields.items()}


def _take_clutch(values: Values, chosen: Component, indices: list[int]) -> None:
    """The law of a clutch; a law for all pendulums stays one for all, also where one pendulum is chosen."""
    law = {name: text for name, text in chosen.fields.items() if name != "backlash"}
    pointers = clutch_pointers(values)
    shared = pointers == ["/base/clutch"]
    for pointer in pointers if shared else [f"/base/pendulums/{index}/clutch" for index in indices]:
        values |= {f"{pointer}/kind": "law", f"{pointer}/windup_limit": ""}
        values |= {f"{pointer}/{name}": text for name, text in law.items()}
    if "backlash" in chosen.fields:
        for index in indices if not shared else range(pendulums_of(values)):
            values[f"/base/pendulums/{index}/backlash"] = chosen.fields["backlash"]
