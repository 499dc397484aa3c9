"""The fields of the form for a new study, made from the model's catalogue: names, letters, units, ranges, help.

The name of a field is the JSON Pointer of its value in the spec, so that each fault of the spec appears beside its
field.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from sprag_study.service.languages import N_, _, gettext
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.units import examples
from sprag_study.service.reading.wording import number, words
from sprag_study.service.spec.axes.sample import SAMPLE
from sprag_study.service.spec.described import ANY_RUN, DURATION, SETTLED_RUN, SHAFT_RUN, Described
from sprag_study.service.spec.fields import base_pointer
from sprag_study.service.spec.kinds import goal, refine
from sprag_study.worker import models
from sprag_study.worker.models import Parameter
from sprag_study.worker.models.form import Form
from sprag_study.worker.models.vocabulary import given_caption

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from sprag_study.worker.models import ResultInfo

#: The model that the form describes unless another is chosen.
FORM_MODEL: Final = "vibration-drive"


@dataclass(frozen=True, slots=True)
class Field:
    """One field: ``name`` is its JSON Pointer."""

    name: str
    label: str
    help: str = ""
    symbol: str = ""
    unit: str = ""
    range: str = ""
    required: bool = False
    default: str = ""
    example: str = ""
    choices: tuple[tuple[str, str], ...] = ()


def field_for(entry: Parameter, path: str, model: str) -> Field:
    """The field of a parameter of ``model`` at ``path`` of the base."""
    return Field(
        name=base_pointer(path),
        label=given_caption(model, path, gettext) or _(words(path.rsplit(".", maxsplit=1)[-1])),
        symbol=entry.symbol,
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


def run_fields(form: Form) -> dict[str, Field]:
    """The fields of the run of a model that take one text each, by name."""
    entries = SHAFT_RUN.values() if form.with_loads else [*SETTLED_RUN.values(), DURATION, *ANY_RUN.values()]
    return {entry.name: described(entry, "/run") for entry in entries}


def refine_fields() -> dict[str, Field]:
    """The fields of a refinement, by name."""
    entries = refine.REFINE.described
    meaning = _(
        "{what}, separated by semicolons; the error of a result follows its name, as in torque.max 0.2 N*m",
        what=_(refine.REFINE.listed["results"].help),
    )
    own = [
        Field("/refine/results", _("Results"), meaning, required=True, example="shaft.speed.mean; efficiency"),
        described(entries["error"], "/refine"),
        replace(
            described(entries["start"], "/refine"),
            default=_("{number}, of a map {other}", number=refine.STARTS[1], other=refine.STARTS[2]),
        ),
        described(entries["finest"], "/refine"),
        replace(described(entries["most"], "/refine"), default=_("no bound")),
    ]
    return {field.name.rpartition("/")[2]: field for field in own}


def search_fields() -> list[Field]:
    """The fields of a search that take one number each."""
    names = ("population", "generations", "seed", "least_gain", "fresh_drives")
    return [described(goal.GOAL.described[name], "/goal") for name in names]


def sample_field() -> Field:
    """The field for the kind of a sample."""
    return described(SAMPLE.described["sample"], "/sample")


def described(entry: Described, pointer: str) -> Field:
    """The field of a described entry of the object at ``pointer``."""
    ends = [number(int(end)) if entry.kind in ("whole", "periods") else f"{end:g}" for end in (entry.low, entry.high)]
    between = N_("{low} to {high} periods") if entry.kind == "periods" else N_("{low} to {high}")
    limits = _(between, low=ends[0], high=ends[1]) if entry.high else entry.limits
    name = f"{pointer}/{entry.name}"
    choices = [(value, _(words(word) if word == value else word)) for value, word in entry.choices]
    choices.sort(key=lambda pair: entry.default not in (None, pair[0]))
    label = _(entry.label or words(entry.name))
    return Field(name, label, _(entry.help), range=limits, default=entry.default_text, choices=tuple(choices))


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


def result_choices(reading: Reading, rows: Callable[[str], int], *, numbers: bool = False) -> Groups:
    """The results that a search can ask for, by group, as a reader knows them; with ``numbers`` no categories.

    ``rows`` is the number of rows of each list of the machine.
    """
    results = []
    for entry in models.result_catalogue(reading.model):
        first, indexed, _rest = entry.name.partition(".N.")
        results += [replace(entry, name=entry.name.replace(".N.", f".{index}."))
                    for index in range(rows(first) if indexed else 1)]  # fmt: skip
    return grouped_results(reading, (entry for entry in results if not (numbers and entry.kind == "category")))


def grouped_results(reading: Reading, results: Iterable[ResultInfo]) -> Groups:
    """Results of a study as choices, by group."""
    groups: dict[str, list[Choice]] = {}
    for entry in results:
        first, _dot, rest = entry.name.partition(".")
        index = rest.partition(".")[0]
        group = words(f"{first}.{index}") if index.isdecimal() else N_("Machine")
        groups.setdefault(_(group), []).append(
            Choice(entry.name, reading.caption(entry.name), reading.unit(entry.unit))
        )
    return list(groups.items())


def categories(model: str) -> tuple[str, ...]:
    """The values of the results that are categories."""
    return tuple(value for entry in models.result_catalogue(model) for value in entry.categories)
