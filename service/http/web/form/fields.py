"""The fields of the form for a new study, made from the model's catalogue: names, letters, units, ranges, help.

The name of a field is the JSON Pointer of its value in the spec, so that each fault of the spec appears beside its
field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from sprag.service.results.wording import number, words
from sprag.service.spec.described import ANY_RUN, DURATION, FIT, SETTLED_RUN, Described
from sprag.service.spec.fields import placed
from sprag.service.spec.plan import goal, refine
from sprag.service.spec.units import example
from sprag.worker import models
from sprag.worker.models import Parameter

#: The model that the form describes unless another is chosen.
FORM_MODEL: Final = "vibration-drive"
_SECTIONS: Final = {"excitation": "Vibration of the base", "shaft": "Output shaft", "gravity": "Surroundings"}


@dataclass(frozen=True, slots=True)
class Field:
    """One field: ``name`` is its JSON Pointer, ``mark`` its letter in the sketch ("" where it is not shown there)."""

    name: str
    label: str
    symbol: str
    mark: str
    unit: str
    help: str
    range: str
    required: bool
    default: str
    example: str
    choices: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Section:
    """Fields that belong together."""

    title: str
    pointer: str
    fields: tuple[Field, ...]


def sections() -> list[Section]:
    """The sections beside those of the pendulums and the clutch."""
    catalogue = models.parameter_catalogue(FORM_MODEL)
    found = []
    for name, title in _SECTIONS.items():
        entries = [entry for entry in catalogue if entry.path.split(".")[0] == name]
        found.append(Section(title, f"/base/{name}", tuple(field_for(entry, entry.path) for entry in entries)))
    return found


def pendulum(index: int) -> Section:
    """The section of one pendulum."""
    entries = [entry for entry in models.parameter_catalogue(FORM_MODEL) if entry.path.startswith("pendulums.N.")]
    fields = tuple(field_for(entry, entry.path.replace(".N.", f".{index}.")) for entry in entries)
    return Section(f"Pendulum {index}", f"/base/pendulums/{index}", fields)


def field_for(entry: Parameter, path: str) -> Field:
    """The field of a parameter at ``path`` of the base."""
    text = example(entry.unit).split('"')
    return Field(
        name="/base/" + path.replace(".", "/"),
        label=words(path.rsplit(".", maxsplit=1)[-1]),
        symbol=entry.symbol,
        mark=path.rsplit(".", maxsplit=1)[-1],
        unit=entry.unit,
        help=entry.help,
        range=range_words(entry),
        required=entry.default is None,
        default=_default_text(entry.default),
        example=text[1] if len(text) > 1 else "",
    )


def _default_text(value: float | None) -> str:
    """What a field without an entry shows; a parameter without a bound has none."""
    if value is None:
        return ""
    return number(value, 8) if math.isfinite(value) else "none"


def run_fields() -> dict[str, Field]:
    """The fields of the run that take one text each, by name."""
    entries = [*SETTLED_RUN.values(), DURATION, *ANY_RUN.values()]
    return {entry.name: described(entry, "/run") for entry in entries}


def degree_field(pointer: str) -> Field:
    """The highest degree of the fit of a clutch at ``pointer``."""
    return described(FIT["max_degree"], pointer)


def refine_fields() -> dict[str, Field]:
    """The fields of a refinement, by name."""

    meaning = f"{refine.RESULTS.help}, separated by semicolons"
    own = [
        Field("/refine/results", "Results", "", "", "", meaning, "", True, "", "shaft.speed.mean; efficiency"),
        described(refine.ERROR, "/refine"),
        replace(described(refine.START, "/refine"), default=f"{refine.STARTS[1]}, of a map {refine.STARTS[2]}"),
        described(refine.FINEST, "/refine"),
        replace(described(refine.MOST, "/refine"), default="no bound"),
    ]
    return {field.name.rpartition("/")[2]: field for field in own}


def search_fields() -> list[Field]:
    """The fields of a search that take one number each."""
    return [described(goal.SEARCH[name], "/goal") for name in ("population", "generations", "seed")]


def described(entry: Described, pointer: str) -> Field:
    """The field of a described entry of the object at ``pointer``."""
    ends = [number(int(end)) if entry.kind in ("whole", "periods") else f"{end:g}" for end in (entry.low, entry.high)]
    unit = " periods" if entry.kind == "periods" else ""
    limits = f"{ends[0]} to {ends[1]}{unit}" if entry.high else entry.limits
    name = f"{pointer}/{entry.name}"
    return Field(name, entry.label, "", "", "", entry.help, limits, False, entry.default_text, "", entry.choices)


def range_words(entry: Parameter) -> str:
    """The allowed range in a few words: ``0 … 10 m``, ``above 0 Hz, at most 100 000 Hz``; "" without limits."""
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    low, high = (number(bound, 8) for bound in (entry.low, entry.high))
    if math.isinf(entry.low) or math.isinf(entry.high):
        if math.isinf(entry.low):
            return "" if math.isinf(entry.high) else f"at most {high}{unit}"
        return f"{'above' if entry.low_open else 'at least'} {low}{unit}"
    return f"above {low}, at most {high}{unit}" if entry.low_open else f"{low} … {high}{unit}"


@dataclass(frozen=True, slots=True)
class Choice:
    """A parameter that can vary or a result that can be asked for: its path or name, its label and its unit."""

    path: str
    label: str
    unit: str


Groups = list[tuple[str, list[Choice]]]


def result_choices(pendulums: int, *, numbers: bool = False, model: str = FORM_MODEL) -> Groups:
    """The results that a search can ask for, by group; with ``numbers`` no categories."""
    groups: dict[str, list[Choice]] = {}
    for entry in models.result_catalogue(model):
        for index in range(pendulums if ".N." in entry.name else 1):
            name = entry.name.replace(".N.", f".{index}.")
            parts = name.split(".")
            group = words(".".join(parts[:2] if parts[0] == "pendulums" else parts[:1]))
            if not (numbers and entry.kind == "category"):
                groups.setdefault(group, []).append(Choice(name, words(name), entry.unit))
    return list(groups.items())


def categories() -> tuple[str, ...]:
    """The values of the results that are categories."""
    return tuple(value for entry in models.result_catalogue(FORM_MODEL) for value in entry.categories)


def path_choices(pendulums: int, coefficients: dict[str, int]) -> Groups:
    """The parameters that can vary, by group.

    Parameters
    ----------
    pendulums : number of pendulums
    coefficients : prefix of a clutch law's paths ("clutch.", "pendulums.0.clutch.") -> number of its coefficients
    """
    groups: dict[str, list[Choice]] = {}
    for entry in models.parameter_catalogue(FORM_MODEL):
        if entry.path.startswith("clutch."):
            continue
        for index in range(pendulums if ".N." in entry.path else 1):
            path = entry.path.replace(".N.", f".{index}.")
            group = words(path.rpartition(".")[0]) or "Surroundings"
            groups.setdefault(group, []).append(Choice(path, words(path), entry.unit))
    for prefix, count in coefficients.items():
        for index in range(count):
            path = f"{prefix}coefficients.{index}"
            entry = placed(models.CLUTCH_COEFFICIENT, path)
            choice = Choice(path, f"{words(prefix.rstrip('.'))} coefficient c{index + 1}", entry.unit)
            groups.setdefault(words(prefix.rstrip(".")), []).append(choice)
    return list(groups.items())
