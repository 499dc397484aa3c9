"""The inputs in which several studies differ, as people read them."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

from sprag.service.answers.differing import differing
from sprag.service.exports.inputs import inputs as every_input
from sprag.service.languages import N_
from sprag.service.languages import gettext as _
from sprag.service.reading.catalogue import shown_values, unit_of
from sprag.service.reading.reader import model_title, plural
from sprag.service.reading.wording import number, unit_text
from sprag.service.results.shown_inputs import choice_name, in_words, run_settings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from sprag.service.exports.inputs import Input
    from sprag.service.reading.reader import Reading
    from sprag.worker.study import Axis, Study

#: Characters of an input in the table.
_LONGEST: Final = 120
#: Of an axis with more values, the first ones and the last are listed.
_MOST_VALUES: Final = 12
_DIGITS: Final = 8
#: Parts of a spec that are shown as what the study has of them, defaults included.
_READ: Final = frozenset({"axes", "base", "combine", "derive", "model", "run"})
_COMBINED: Final = {"grid": N_("every combination (grid)"), "zip": N_("value by value (zip)")}
_NONE: Final = "–"


@dataclass(frozen=True, slots=True)
class DifferingInput:
    """An input in which studies differ: its path in the spec, what it is called, and the value of each study."""

    path: str
    caption: str
    values: list[str]


@dataclass(frozen=True, slots=True)
class ReadStudy:
    """A study with its spec, and how its numbers and names are read: in its own units, by the names of its model."""

    study: Study
    spec: Mapping[str, Any]
    reading: Reading


@dataclass(frozen=True, slots=True)
class _Cell:
    """An input of one study: what it is called there, what it is compared by (None where it varies), and its text."""

    caption: str
    value: object
    text: str


def differing_inputs(compared: Sequence[ReadStudy]) -> list[DifferingInput]:
    """Axes, model, machine and run of the studies as their pages show them, other inputs as they were written."""
    rows = [row for part in (_axes, _general, _machine, _run) for row in _rows([dict(part(one)) for one in compared])]
    for pointer, values in differing([one.spec for one in compared]).items():
        path = pointer[1:].replace("/", ".").replace("~1", "/").replace("~0", "~")
        if pointer.split("/")[1] not in _READ:
            rows.append(DifferingInput(path, path, [_written(value) for value in values]))
    return rows


def _rows(cells: Sequence[Mapping[str, _Cell]]) -> Iterator[DifferingInput]:
    """The inputs, by path of each study, that are not the same in all of them; the axes say what only varies."""
    for path in dict.fromkeys(path for own in cells for path in own):
        found = [own.get(path) for own in cells]
        values = [None if cell is None else cell.value for cell in found]
        if any(value != values[0] for value in values):
            captions = dict.fromkeys(cell.caption for cell in found if cell is not None)
            yield DifferingInput(path, " / ".join(captions), [_NONE if cell is None else cell.text for cell in found])


def _axes(one: ReadStudy) -> Iterator[tuple[str, _Cell]]:
    """What varies."""
    for axis in one.study.axes:
        name = " = ".join(axis.paths)
        caption = _("{name}, varied", name=one.reading.caption(name))
        yield name, _Cell(caption, axis.array.tobytes(), _values(one.study, axis, one.reading))


def _values(study: Study, axis: Axis, reading: Reading) -> str:
    unit, values = unit_of(study, axis.paths[0]), shown_values(study, axis)
    shown = [number(reading.value(value, unit), _DIGITS) for value in values.tolist()]
    if len(shown) > _MOST_VALUES:
        shown = [*shown[: _MOST_VALUES - 2], "…", shown[-1]]
    text = f"{'; '.join(shown)} {unit_text(reading.unit(unit))}".strip()
    if values.size <= _MOST_VALUES:
        return text
    return f"{text} ({reading.say(plural('{count} value', '{count} values', values.size))})"


def _general(one: ReadStudy) -> Iterator[tuple[str, _Cell]]:
    """The model, and how several axes go together."""
    yield "model", _Cell(_("Model"), one.study.model, model_title(one.study.model))
    if len(one.study.axes) > 1:
        how = one.study.combine
        yield "combine", _Cell(_("Combine"), how, _(_COMBINED[how]))


def _machine(one: ReadStudy) -> Iterator[tuple[str, _Cell]]:
    """Numbers and choices of the machine."""
    for item in every_input(one.study, one.spec):
        caption = one.reading.caption(item.path) if item.unit else choice_name(item)
        yield f"base.{item.path}", _Cell(caption, item.value, _text(item, one.reading))


def _text(item: Input, reading: Reading) -> str:
    if item.varies:
        return _("varies")
    if isinstance(item.value, str):
        return item.value if item.origin == "derived" else str(in_words(item))
    return reading.quantity(item.value, item.unit, _DIGITS)


def _run(one: ReadStudy) -> Iterator[tuple[str, _Cell]]:
    """The settings of the run."""
    for label, text, item in run_settings(one.study, one.spec, one.reading):
        yield f"run.{item.path}", _Cell(label, str(item.value), text)


def _written(value: object) -> str:
    """A value of a spec as text, long lists shortened."""
    if value is None:
        return _NONE
    text = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …"
