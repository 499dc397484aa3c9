"""The fields of the form by which drives differ: "±" beside each parameter, its distribution, number of drives."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, Final

from sprag_study.service.http.web.form.entries import list_of, list_text, names_of, plain, text_of
from sprag_study.service.http.web.form.fields import Field, described
from sprag_study.service.http.web.form.machine import entries
from sprag_study.service.http.web.form.walk import Filled
from sprag_study.service.languages import _
from sprag_study.service.reading.wording import words
from sprag_study.service.spec.draws.described import DISTRIBUTION
from sprag_study.service.spec.fields import base_path, expanded
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


class Tolerances:
    """The tolerances of a batch of drives: fields beside those of the machine."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        items: list[dict[str, Any]] = []
        form.fields["/tolerances"] = BATCH
        for name, text in _filled(form.values):
            form.fields[f"/tolerances/{len(items)}"] = f"{name}/plus_minus"
            path, others = name.removeprefix(OWN).replace("/", "."), names_of(form.values.get(f"{name}/with", ""))
            spread = _spread(text, form.values.get(f"{name}/distribution", _NORMAL))
            items.append({"path": [path, *others], **spread, "shared": True} if others else {"path": path, **spread})
        return {"tolerances": items}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`, of a machine that the form shows already."""
        shown = {base_path(name): name for name in _tolerant(form.values)}
        order: list[str] = []
        for given in item.get("tolerances", ()):
            listed = given["path"] if isinstance(given["path"], list) else [given["path"]]
            paths = [path for pattern in listed for path in (expanded(pattern, shown) or [pattern])]
            for first, *others in [paths] if given.get("shared") else [[path] for path in paths]:
                if first not in shown:
                    raise ValueError(f"the form has no field for the tolerance of {first}")
                name = own_name(shown[first])
                order.append(name)
                measured = list_text(given.get("values", ()))
                form.values[f"{name}/plus_minus"] = measured or text_of(given["plus_minus"])
                form.values[f"{name}/distribution"] = MEASURED if measured else given.get("distribution", _NORMAL)
                form.values |= {f"{name}/with": ", ".join(others)} if others else {}
        form.values |= {ORDER: " ".join(order)} if order else {}
        return {"tolerances"}


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
