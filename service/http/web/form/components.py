"""Components of the office's own, taken into the fields of a form."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.http.web.form.fields import Choice, Groups
from sprag_study.service.http.web.form.machine import BASE, form_of, rows_of
from sprag_study.service.languages import gettext
from sprag_study.service.reading.numbers import whole_number
from sprag_study.service.storage.components import ComponentRecord
from sprag_study.worker.models.form import Rows


def component_groups(
    values: Mapping[str, str], records: Sequence[ComponentRecord]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """Id and name of the components that a machine of the form can have, by kind."""
    groups = (
        (kind.title, [(record.id, record.component.name) for record in records if record.component.kind == kind.name])
        for kind in form_of(values).components
    )
    return [(title, group) for title, group in groups if group]


def component_choices(values: Mapping[str, str], records: Sequence[ComponentRecord]) -> Groups:
    """The kinds of components that can vary in a machine of the form, those of which there are some."""
    kinds = [kind for kind in form_of(values).components if any(one.component.kind == kind.name for one in records)]
    found = [Choice(kind.name, gettext(kind.title), "1") for kind in kinds]
    return [(gettext("Components"), found)] if found else []


def component_names(records: Sequence[ComponentRecord]) -> dict[str, str]:
    """The names of the components of each kind, as a field of a form has them."""
    names: dict[str, list[str]] = {}
    for one in records:
        names.setdefault(one.component.kind, []).append(one.component.name)
    return {kind: "; ".join(own) for kind, own in names.items()}


def rows_with_components(values: Mapping[str, str]) -> Rows | None:
    """The list of which one row can take a component; None where there is none."""
    form = form_of(values)
    names = [name for kind in form.components for name in kind.fields.values()]
    return next((rows for rows in form.lists if any(name.startswith(f"{rows.at}/N/") for name in names)), None)


def take_component(values: Values, records: Iterable[ComponentRecord]) -> None:
    """Fill in the fields of the chosen component, of every row of a list or of the chosen one; nothing without a
    choice. What is common to all rows stays so, also where one is chosen.
    """
    chosen = next((record.component for record in records if record.id == values.get("component")), None)
    kind = next((kind for kind in form_of(values).components if chosen and kind.name == chosen.kind), None)
    if chosen is None or kind is None:
        return
    rows = rows_with_components(values)
    count = rows_of(values, rows) if rows else 0
    one = whole_number(values.get("component_for", ""), count)
    indices: Sequence[int] = range(count) if one is None else [one]
    choice, shared = rows.shared if rows and rows.shared else ("", "")
    rowed = values.get(f"{BASE}/{choice}") == "own"
    if not rowed and any(name.startswith(f"{shared}/") for name in kind.fields.values()):
        indices = range(count)
    for name, text in (
        *kind.sets.items(),
        *((kind.fields[name], text) for name, text in chosen.fields.items() if name in kind.fields),
    ):
        at, inside, own = name.partition("/N/")
        if not inside and rows and rowed and name.startswith(f"{shared}/"):
            at, inside, own = rows.at, "/N/", name
        values |= {f"{BASE}/{at}/{index}/{own}": text for index in indices} if inside else {f"{BASE}/{name}": text}
