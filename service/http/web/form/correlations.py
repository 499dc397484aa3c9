"""The rows of the form about correlations of tolerances."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from sprag.service.http.web.form.entries import Values, plain, text_of
from sprag.service.http.web.form.parts import PARTS, filled
from sprag.service.http.web.form.tolerances import with_batch

_PART = PARTS["correlations"]


def correlations_of(values: Mapping[str, str]) -> dict[str, Any]:
    """The part of a spec about correlations; empty where the form has none."""
    items = [_item(values, index) for index in filled(values, "correlations")] if with_batch(values) else []
    return {"correlations": items} if items else {}


def _item(values: Mapping[str, str], index: int) -> dict[str, Any]:
    given = {entry: values.get(f"{_PART.pointer}/{index}/{entry}", "").strip() for entry in _PART.entries}
    coefficient = given["coefficient"]
    found = {"between": [given["between/0"], given["between/1"]]}
    return {**found, **({"coefficient": plain(coefficient)} if coefficient else {})}


def correlation_values(spec: Mapping[str, Any]) -> Values:
    """The form's values for the correlations of a spec; raises ValueError where the form cannot show them."""
    items = spec.get("correlations", [])
    if len(items) > _PART.most:
        raise ValueError("the form has no fields for so many correlations")
    found: Values = {"correlations": str(len(items))} if items else {}
    for index, item in enumerate(items):
        first, second = item["between"]
        given = {"between/0": first, "between/1": second, "coefficient": text_of(item["coefficient"])}
        found |= {f"{_PART.pointer}/{index}/{entry}": text for entry, text in given.items()}
    return found


def field_of_correlation(pointer: str, values: Mapping[str, str]) -> str:
    """The field for a fault at ``pointer``, which begins with ``/correlations``."""
    rows = filled(values, "correlations")
    found = re.match(r"/correlations/(\d+)(/coefficient)?", pointer)
    if found is None or int(found[1]) >= len(rows):
        return _PART.pointer
    return f"{_PART.pointer}/{rows[int(found[1])]}" + (found[2] or "/between/0")
