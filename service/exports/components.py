"""The catalogue of components as a CSV file, which the service also reads."""

from __future__ import annotations

from collections.abc import Iterable
from decimal import Decimal
from typing import Final, Literal

from sprag_study.service.exports.text import DECIMAL_NUMBER, typed_lines
from sprag_study.service.spec.components import COLUMNS, KINDS, Component, fields_of
from sprag_study.service.spec.csv_text import escape

ComponentFormat = Literal["json", "csv"]
COMPONENT_FORMATS: Final[dict[ComponentFormat, str]] = {"json": "application/json", "csv": "text/csv; charset=utf-8"}


def components_csv(components: Iterable[Component]) -> bytes:
    """A row for each component, with quantities as they were written."""
    names = list(dict.fromkeys(name for kind in KINDS for name in fields_of(kind)))
    rows = ([one.kind, escape(one.name), escape(one.note), *(_quantity(one.fields.get(name, "")) for name in names)]
            for one in components)  # fmt: skip
    return typed_lines([[*COLUMNS, *names], *rows])


def _quantity(text: str) -> object:
    """A quantity as it was written; a bare number is one."""
    return Decimal(text) if DECIMAL_NUMBER.fullmatch(text) else text
