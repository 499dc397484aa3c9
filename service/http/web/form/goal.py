"""Bare numbers of the limits of a search, in the units that the page shows beside their results."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from sprag_study.service.http.web.form.entries import Values
from sprag_study.service.http.web.form.machine import model_name
from sprag_study.service.http.web.form.parts import count_of
from sprag_study.service.http.web.form.spec import PARTS
from sprag_study.service.reading.numbers import in_language, parse_number
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.reading.units import exact_quantity
from sprag_study.worker import models
from sprag_study.worker.models.parameters import general_path

if TYPE_CHECKING:
    from sprag_study.service.reading.reader import Reading


def with_shown_units(values: Values, reading: Reading) -> None:
    """Give each bare number of a limit the unit that the page shows beside the name of its result."""
    for row, unit in _limits(values):
        own = [name for name in ("value", "within") if values.get(f"{row}/{name}", "").strip()]
        texts = with_last_unit([values[f"{row}/{name}"] for name in own])
        if reading.unit(unit) == unit:
            continue
        for name, text in zip(own, texts, strict=True):
            # A percentage is a share of the value there.
            if parse_number(in_language(text)) is not None and not (name == "within" and unit == "1"):
                values[f"{row}/{name}"] = reading.typed(text, unit)


def with_own_units(values: Mapping[str, str], reading: Reading) -> Values:
    """A form whose limits are not taken in the shown units: those that are bare numbers in SI have their unit."""
    shown = dict(values)
    for row, unit in _limits(values):
        if reading.unit(unit) == unit:
            continue
        for name in ("value",) if unit == "1" else ("value", "within"):
            number = parse_number(in_language(values.get(f"{row}/{name}", "")))
            if number is not None and math.isfinite(number):
                shown[f"{row}/{name}"] = exact_quantity(number, unit, "%" if unit == "1" else unit)
    return shown


def _limits(values: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """The rows of limits on numbers, with the SI unit of their result."""
    units = {entry.name: entry.unit for entry in models.result_catalogue(model_name(values)) if entry.kind == "real"}
    for index in range(count_of(values, "subject_to")):
        row = f"{PARTS['subject_to'].pointer}/{index}"
        name = general_path(values.get(f"{row}/result", ""))
        if name in units:
            yield row, units[name]
