"""Components of the office as people read them."""

from __future__ import annotations

from typing import Final

from sprag_study.service.languages import gettext
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.quantities import TYPED, Units, preferred, read_units, typed_unit
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.units import QuantityError, parse_quantity
from sprag_study.service.reading.wording import typed_text
from sprag_study.service.spec.components import (
    COEFFICIENTS,
    Component,
    fields_of,
    kind_of,
    list_text,
    model_of_kind,
)
from sprag_study.worker.models.parameters import placed

#: Digits of a number that somebody typed.
_DIGITS: Final = 8


def shown_fields(component: Component, choice: str) -> dict[str, str]:
    """The fields of a component: quantities in the units of the ``choice``, choices by what they are called."""
    kind, shown = component.kind, dict[str, str]()
    for name, text in component.fields.items():
        parameter = fields_of(kind).get(name)
        if parameter is None:
            shown[name] = gettext(kind_of(kind).titles.get(text, text))
        elif name == COEFFICIENTS:
            each = enumerate(list_text(text))
            shown[name] = "; ".join(
                _printed(kind, choice, item, placed(parameter, f"{COEFFICIENTS}.{index}").unit) for index, item in each
            )
        else:
            shown[name] = _printed(kind, choice, text, parameter.unit)
    return shown


def _printed(kind: str, choice: str, text: str, si: str) -> str:
    """A quantity in the unit of the page; "as typed" in the one that somebody wrote, if quantities are shown in it."""
    model, number = model_of_kind(kind), parse_number(text)
    try:
        value = parse_quantity(text if number is None else number, si)
        units = preferred(choice, model)
        if read_units(choice)[0] == TYPED:
            units = {si: typed_unit(text, si) or si}
        return Reading(model, Units(units)).quantity(value, si, _DIGITS)
    except QuantityError:  # kept by an earlier release
        return typed_text(text)
