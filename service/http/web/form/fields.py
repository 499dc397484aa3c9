"""The fields of the form for a new study, made from the model's catalogue: names, letters, units, ranges, help.

The name of a field is the JSON Pointer of its value in the spec, so that each fault of the spec appears beside its
field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

from sprag.service.languages import ENGLISH, N_, _, current
from sprag.service.reading.reader import Reading
from sprag.service.reading.units import examples
from sprag.service.reading.wording import number, words
from sprag.service.spec.described import ANY_RUN, DURATION, FIT, SETTLED_RUN, Described
from sprag.service.spec.plan import goal, refine
from sprag.worker import models
from sprag.worker.models import Parameter
from sprag.worker.models.parameters import placed

#: The model that the form describes unless another is chosen.
FORM_MODEL: Final = "vibration-drive"
#: Placeholders in paths of the catalogue.
_NUMBERED: Final = frozenset({"N", "K", "NAME"})


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


def sections(model: str = FORM_MODEL) -> list[Section]:
    """A section for each part of the machine, in the order and with the titles of the model's presentation.

    Parts that it does not name follow, titled by their name. Those with indices (pendulums, clutch) have fields of
    their own.
    """
    titles = models.model_of(model).presentation.sections
    parts: dict[str, list[Parameter]] = {part: [] for part in titles}
    for entry in models.parameter_catalogue(model):
        parts.setdefault(_part(entry), []).append(entry)
    return [
        Section(
            _(titles.get(part, words(part or "other parameters"))),
            f"/base/{part}".rstrip("/"),
            tuple(field_for(e, e.path) for e in entries),
        )
        for part, entries in parts.items()
        if entries and not any(_NUMBERED & set(entry.path.split(".")) for entry in entries)
    ]


def _part(entry: Parameter) -> str:
    """The part of the machine that a parameter belongs to; "" where its path has no parts."""
    return entry.path.partition(".")[0] if "." in entry.path else ""


def pendulum(index: int) -> Section:
    """The section of one pendulum."""
    entries = [entry for entry in models.parameter_catalogue(FORM_MODEL) if entry.path.startswith("pendulums.N.")]
    fields = tuple(field_for(entry, entry.path.replace(".N.", f".{index}.")) for entry in entries)
    return Section(_("Pendulum {number}", number=index), f"/base/pendulums/{index}", fields)


def field_for(entry: Parameter, path: str) -> Field:
    """The field of a parameter at ``path`` of the base."""
    return Field(
        name="/base/" + path.replace(".", "/"),
        label=_(words(path.rsplit(".", maxsplit=1)[-1])),
        symbol=entry.symbol,
        mark=path.rsplit(".", maxsplit=1)[-1],
        unit=entry.unit,
        help=_(entry.help),
        range=range_words(entry),
        required=entry.default is None,
        default=_default_text(entry.default),
        example="" if entry.unit == "1" else examples(entry.unit)[0],
    )


def _default_text(value: float | None) -> str:
    """What a field without an entry shows; a parameter without a bound has none."""
    if value is None:
        return ""
    return number(value, 8) if math.isfinite(value) else _("none")


def run_fields() -> dict[str, Field]:
    """The fields of the run that take one text each, by name."""
    entries = [*SETTLED_RUN.values(), DURATION, *ANY_RUN.values()]
    return {entry.name: described(entry, "/run") for entry in entries}


def degree_field(pointer: str) -> Field:
    """The highest degree of the fit of a clutch at ``pointer``."""
    return described(FIT["max_degree"], pointer)


def refine_fields() -> dict[str, Field]:
    """The fields of a refinement, by name."""

    meaning = _("{what}, separated by semicolons", what=_(refine.RESULTS.help))
    own = [
        Field("/refine/results", _("Results"), "", "", "", meaning, "", True, "", "shaft.speed.mean; efficiency"),
        described(refine.ERROR, "/refine"),
        replace(
            described(refine.START, "/refine"),
            default=_("{number}, of a map {other}", number=refine.STARTS[1], other=refine.STARTS[2]),
        ),
        described(refine.FINEST, "/refine"),
        replace(described(refine.MOST, "/refine"), default=_("no bound")),
    ]
    return {field.name.rpartition("/")[2]: field for field in own}


def search_fields() -> list[Field]:
    """The fields of a search that take one number each."""
    return [described(goal.SEARCH[name], "/goal") for name in ("population", "generations", "seed")]


def described(entry: Described, pointer: str) -> Field:
    """The field of a described entry of the object at ``pointer``."""
    ends = [number(int(end)) if entry.kind in ("whole", "periods") else f"{end:g}" for end in (entry.low, entry.high)]
    between = N_("{low} to {high} periods") if entry.kind == "periods" else N_("{low} to {high}")
    limits = _(between, low=ends[0], high=ends[1]) if entry.high else entry.limits
    name = f"{pointer}/{entry.name}"
    choices = tuple((value, _(words(word) if word == value else word)) for value, word in entry.choices)
    return Field(name, _(entry.label), "", "", "", _(entry.help), limits, False, entry.default_text, "", choices)


def range_words(entry: Parameter) -> str:
    """The allowed range in a few words: ``0 … 10 m``, ``above 0 Hz, at most 100 000 Hz``; "" without limits."""
    unit = "" if entry.unit == "1" else f" {entry.unit}"
    low, high = (number(bound, 8) for bound in (entry.low, entry.high))
    if math.isinf(entry.low) or math.isinf(entry.high):
        if math.isinf(entry.low):
            return "" if math.isinf(entry.high) else _("at most {high}", high=f"{high}{unit}")
        return _("above {low}", low=f"{low}{unit}") if entry.low_open else _("at least {low}", low=f"{low}{unit}")
    if entry.low_open:
        return _("above {low}, at most {high}", low=low, high=f"{high}{unit}")
    return f"{low} … {high}{unit}"


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
                groups.setdefault(_(group), []).append(Choice(name, label_of(name, model), entry.unit))
    return list(groups.items())


def label_of(name: str, model: str = FORM_MODEL) -> str:
    """What a list of parameters or results calls one; headings of pasted columns are these in English, or paths."""
    return words(name) if current() == ENGLISH else Reading(model).caption(name)


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
    titles = models.model_of(FORM_MODEL).presentation.sections
    for entry in models.parameter_catalogue(FORM_MODEL):
        if entry.path.startswith("clutch."):
            continue
        for index in range(pendulums if ".N." in entry.path else 1):
            path = entry.path.replace(".N.", f".{index}.")
            group = words(path.rpartition(".")[0]) or titles.get("", "")
            groups.setdefault(_(group), []).append(Choice(path, label_of(path), entry.unit))
    for prefix, count in coefficients.items():
        for index in range(count):
            path = f"{prefix}coefficients.{index}"
            entry = placed(models.CLUTCH_COEFFICIENT, path)
            part = _(words(prefix.rstrip(".")))
            label = _("{part} coefficient c{number}", part=part, number=index + 1)
            groups.setdefault(part, []).append(Choice(path, label, entry.unit))
    return list(groups.items())
