"""The fields of the form by which drives differ: "±" beside each parameter, its distribution, number of drives."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from sprag_study.service.http.web.form.entries import Values, list_of, list_text, names_of, plain, text_of
from sprag_study.service.http.web.form.fields import Field, described
from sprag_study.service.http.web.form.machine import entries
from sprag_study.service.languages import _
from sprag_study.service.reading.wording import words
from sprag_study.service.spec.draws.described import DISTRIBUTION
from sprag_study.service.spec.fields import expanded
from sprag_study.service.spec.kinds.tolerances import DRAWS

#: Fields of a spec that this part of the form shows.
FIELDS: Final = ("tolerances", "drives", "seed", "draws")
#: The box by which the form has them.
BATCH: Final = "batch"
#: Beginning of the names of these fields.
OWN: Final = "/tolerances/"
#: The order of the tolerances in a spec that was cloned: another one would draw other drives.
ORDER: Final = f"{OWN}order"
_NORMAL: Final = DISTRIBUTION.values[0]
#: The form's choice of a distribution by which the field "±" contains measured values.
MEASURED: Final = "values"


def with_batch(values: Mapping[str, str]) -> bool:
    """Whether the form asks about a batch of drives."""
    return values.get(BATCH) == "on"


def drive_fields() -> list[Field]:
    """The fields for the number of drives, the seed and how they are drawn."""
    return [replace(described(DRAWS[name], ""), label=_(words(name))) for name in FIELDS[1:]]


def distributions() -> list[tuple[str, str]]:
    """The distributions and their labels."""
    return [*((name, _(words(name).lower())) for name in DISTRIBUTION.values), (MEASURED, _("measured values: a list"))]


def tolerances_of(values: Mapping[str, str]) -> dict[str, Any]:
    """The part of a spec about a batch of drives; empty where the form does not ask about one."""
    if not with_batch(values):
        return {}
    items = []
    for name, plus_minus in _filled(values):
        path = name.removeprefix(OWN).replace("/", ".")
        others = names_of(values.get(f"{name}/with", ""))
        items.append(
            {
                "path": [path, *others] if others else path,
                **_spread(plus_minus, values.get(f"{name}/distribution", _NORMAL)),
                **({"shared": True} if others else {}),
            }
        )
    settings = {name: plain(values[f"/{name}"]) for name in FIELDS[1:] if values.get(f"/{name}", "").strip()}
    return {"tolerances": items, **settings}


def _spread(text: str, distribution: str) -> dict[str, Any]:
    """How the drives differ: measured values, or a distance from the nominal value with its distribution."""
    if distribution == MEASURED:
        return {"values": list_of(text)}
    return {"plus_minus": plain(text), **({} if distribution == _NORMAL else {"distribution": distribution})}


def _filled(values: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """The parameters with a tolerance, in their order: name of the part, and the text of the field."""
    names = [own_name(field) for field in _tolerant(values)]
    first = {name: place for place, name in enumerate(names_of(values.get(ORDER, "")))}
    for name in sorted(names, key=lambda name: first.get(name, len(first))):
        text = values.get(f"{name}/plus_minus", "").strip()
        if text:
            yield name, text


def _tolerant(values: Mapping[str, str]) -> list[str]:
    """Names of the fields of the machine that can have a tolerance."""
    return [entry.name for entry in entries(values) if entry.tolerant]


def own_name(field: str) -> str:
    """Beginning of the names of the fields for the tolerance of the parameter at the pointer ``field``."""
    return OWN + field.removeprefix("/base/")


def field_of_tolerance(pointer: str, values: Mapping[str, str]) -> str:
    """The field for a fault at ``pointer``, which begins with ``/tolerances``."""
    names = [name for name, _ in _filled(values)]
    found = re.match(r"/tolerances/(\d+)", pointer)
    return f"{names[int(found[1])]}/plus_minus" if found and int(found[1]) < len(names) else BATCH


def tolerance_values(spec: Mapping[str, Any], values: Mapping[str, str]) -> Values:
    """The form's values for the tolerances of a spec, whose machine has these ``values``; raises ValueError where the
    form cannot show them.
    """
    if "tolerances" not in spec:
        return {}
    found: Values = {BATCH: "on"} | {f"/{name}": text_of(spec[name]) for name in FIELDS[1:] if name in spec}
    shown = {field.removeprefix("/base/").replace("/", "."): field for field in _tolerant(values)}
    order: list[str] = []
    for item in spec["tolerances"]:
        given = item["path"] if isinstance(item["path"], list) else [item["path"]]
        paths = [own for path in given for own in (expanded(path, shown) or [path])]
        groups = [paths] if item.get("shared") else [[path] for path in paths]
        for first, *others in groups:
            if first not in shown:
                raise ValueError(f"the form has no field for the tolerance of {first}")
            name = own_name(shown[first])
            order.append(name)
            measured = list_text(item.get("values", ()))
            found[f"{name}/plus_minus"] = measured or text_of(item["plus_minus"])
            found[f"{name}/distribution"] = MEASURED if measured else item.get("distribution", _NORMAL)
            if others:
                found[f"{name}/with"] = ", ".join(others)
    return found | {ORDER: " ".join(order)}
