"""The inputs in which several studies differ, as people read them."""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

from sprag_study.service.exports.inputs import inputs as every_input
from sprag_study.service.languages import N_
from sprag_study.service.languages import gettext as _
from sprag_study.service.reading.catalogue import shown_values, unit_of
from sprag_study.service.reading.part_names import part_name, upper_first
from sprag_study.service.reading.reader import Phrase, joined, model_title, plural, term
from sprag_study.service.reading.wording import number, typed_text, unit_text
from sprag_study.service.results.calibration import plan_of
from sprag_study.service.results.fronts import goals_of, limits_of
from sprag_study.service.results.selection import tolerance_of
from sprag_study.service.results.shown_inputs import choice_name, in_words, run_settings
from sprag_study.service.results.varied import (
    formula_text,
    in_captions,
    names_in_files,
    varied,
    with_distribution,
)
from sprag_study.service.spec.described import Described
from sprag_study.service.spec.kinds.calibrate import CALIBRATE as CALIBRATION
from sprag_study.service.spec.kinds.goal import GOAL as SEARCH
from sprag_study.service.spec.kinds.refine import REFINE as REFINEMENT
from sprag_study.worker import models
from sprag_study.worker.directions import SWEEP, direction
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.goals.plan import GOAL
from sprag_study.worker.planning.refine_plan import REFINE, ErrorBound, RefinePlan

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from sprag_study.service.exports.inputs import Input
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.varied import Text
    from sprag_study.worker.study import Axis, Study

#: Characters of an input in the table.
_LONGEST: Final = 120
#: Values of an axis that are listed, and those that are where the ends and numbers of values are the same.
_LISTED: Final = 5
_MOST_VALUES: Final = 12
_DIGITS: Final = 8
#: Parts of a spec that are read from the study, defaults included.
_READ: Final = frozenset({
    "sprag", "name", "notes", "tags", "axes", "base", "combine", "derive", "model", "run",
    "goal", "refine", "calibrate", "tolerances",
})  # fmt: skip
#: Settings of a study that chooses its own cases, by its part of the spec.
_SETTINGS: Final = {"refine": REFINEMENT, "goal": SEARCH, "calibrate": CALIBRATION}
#: How drives are drawn.
_DRAWS: Final = frozenset({"seed", "draws"})
_NONE: Final = "–"


@dataclass(frozen=True, slots=True)
class DifferingInput:
    """An input in which studies differ: its path in the spec, what it is called, and the value of each study."""

    path: str
    caption: str
    values: list[str]


@dataclass(frozen=True, slots=True)
class ReadStudy:
    """A study with its spec, what it is in words, and how it is read: in its own units, by the names of its model."""

    study: Study
    spec: Mapping[str, Any]
    reading: Reading
    about: Phrase


@dataclass(frozen=True, slots=True)
class _Cell:
    """An input of one study: what it is called there, what it is compared by, its text, and a longer one."""

    caption: str
    value: object
    text: str
    full: str = ""


#: Inputs of one study by their paths.
_Cells: TypeAlias = "Iterator[tuple[str, _Cell]]"


def differing_inputs(compared: Sequence[ReadStudy]) -> list[DifferingInput]:
    """What the studies are, their machines with what varies, what they search or refine, their runs."""
    shared = frozenset[str].intersection(*(frozenset(one.spec) for one in compared))
    parts = (_general, _machine, _asked, partial(_settings, shared=shared), _run, partial(_further, shared=shared))
    return list(_merged(row for part in parts for row in _rows([dict(part(one)) for one in compared])))


def _merged(rows: Iterable[DifferingInput]) -> Iterator[DifferingInput]:
    """Rows with one caption of which no study has two, such as the crank of different mechanisms, are one row."""
    found: dict[str, list[DifferingInput]] = {}
    for row in rows:
        alike = found.setdefault(row.caption, [])
        for place, other in enumerate(alike):
            if all(_NONE in pair for pair in zip(row.values, other.values, strict=True)):
                both = [b if a == _NONE else a for a, b in zip(other.values, row.values, strict=True)]
                alike[place] = replace(other, values=both)
                break
        else:
            alike.append(row)
    return (row for alike in found.values() for row in alike)


def _rows(cells: Sequence[Mapping[str, _Cell]]) -> Iterator[DifferingInput]:
    """The inputs, by path of each study, that are not the same in all of them."""
    for path in dict.fromkeys(path for own in cells for path in own):
        found = [own.get(path) for own in cells]
        values = [None if cell is None else cell.value for cell in found]
        if all(value == values[0] for value in values):
            continue
        captions = dict.fromkeys(cell.caption for cell in found if cell is not None)
        texts = [_NONE if cell is None else cell.text for cell in found]
        if len(set(texts)) < len({repr(value) for value in values}):  # different ones are told apart
            texts = [_NONE if cell is None else cell.full or cell.text for cell in found]
        yield DifferingInput(path, " / ".join(captions), texts)


def _general(one: ReadStudy) -> _Cells:
    """The model, what the study is and how several axes go together, and which axis is swept."""
    study, reading = one.study, one.reading
    yield "model", _Cell(_("Model"), study.model, model_title(study.model))
    about = upper_first(reading.say(one.about))
    if study.combine == "zip" and study.plan is None:
        about = ", ".join(filter(None, (about, _("value by value"))))
    yield "study", _Cell(_("Kind of study"), about, about or _NONE)
    if study.sweep is not None:
        ways = [value for axis in study.axes if SWEEP in axis.paths for value in axis.array.tolist()]
        text = reading.say(joined(", ", (term(direction(value)) for value in ways)))
        yield "sweep", _Cell(_("Swept"), (study.sweep, ways), f"{reading.caption(study.sweep)}: {text}")


def _machine(one: ReadStudy) -> _Cells:
    """What varies, the other numbers, and the choices of the machine, each with its tolerance."""
    study, reading = one.study, one.reading
    axes = {axis.paths: axis for axis in study.axes} if study.plan is None else {}
    known, every = set[str](), every_input(study, one.spec)
    for paths, ends in varied(study):
        text: Text = ends
        full, value = "", str(joined("", [ends])).encode()
        if (axis := axes.get(paths)) is not None:
            listed = _values(study, axis, reading)
            text, full, value = (listed if len(axis) <= _LISTED else ends), listed, axis.array.tobytes()
        for path in paths:
            known.add(path)
            yield path, _toleranced(one, path, _Cell(reading.caption(path), value, _said(text, reading), full), text)
    for item in every:
        if item.path not in known:
            caption = reading.caption(item.path) if item.unit else choice_name(item)
            text = _text(item, reading)
            yield item.path, _toleranced(one, item.path, _Cell(caption, item.value, text), text)


def _toleranced(one: ReadStudy, path: str, cell: _Cell, text: Text) -> _Cell:
    """The input with the tolerance of its parameter, if it has one."""
    tolerance = tolerance_of(one.study, path)
    if tolerance is None:
        return cell
    said = _said(with_distribution(one.study, path, text), one.reading)
    return replace(cell, value=(cell.value, repr(tolerance.about)), text=said, full="")


def _said(text: Text, reading: Reading) -> str:
    return reading.say(joined("", [text]))


def _values(study: Study, axis: Axis, reading: Reading) -> str:
    """The values of an axis; of many the first ones and the last."""
    unit, values = unit_of(study, axis.paths[0]), shown_values(study, axis).tolist()
    said = [number(reading.value(value, unit), _DIGITS) for value in values]
    if len(said) > _MOST_VALUES:
        said = [*said[: _MOST_VALUES - 2], "…", said[-1]]
    text = f"{'; '.join(said)} {unit_text(reading.unit(unit))}".strip()
    if len(values) <= _MOST_VALUES:
        return text
    return f"{text} ({reading.say(plural('{count} value', '{count} values', len(values)))})"


def _text(item: Input, reading: Reading) -> str:
    if item.varies:
        return _("varies")
    if isinstance(item.value, str):
        return f"= {formula_text(item, reading)}" if item.origin == "derived" else str(in_words(item))
    return reading.quantity(item.value, item.unit, _DIGITS)


def _error_of(study: Study, reading: Reading, name: str, bound: ErrorBound) -> str:
    """The error of one result, for people."""
    unit = next(info.unit for info in models.study_results(study) if info.name == name)
    text = reading.quantity(bound.value, unit, _DIGITS) if bound.absolute else f"{number(100.0 * bound.value, 4)} %"
    return f"{reading.caption(name)} {text}"


def _asked(one: ReadStudy) -> _Cells:
    """What is searched, refined or calibrated."""
    study, reading = one.study, one.reading
    if study.kind == GOAL:
        texts = {
            "goal.best": (N_("Goals"), goals_of(study)),
            "goal.subject_to": (N_("Limits"), limits_of(study)),
        }
        for path, (caption, said) in texts.items():
            if said:
                text = reading.say(joined("; ", said))
                yield path, _Cell(_(caption), text, text)
    elif study.kind == REFINE:
        refined = RefinePlan.from_json(study.plan or {})
        text = ", ".join(map(reading.caption, refined.results))
        yield "refine.results", _Cell(_("Refined results"), text, text)
        share = f"{number(100.0 * refined.error, 4)} %"
        errors = [_error_of(study, reading, name, bound) for name, bound in refined.errors.items()]
        text = "; ".join([share, *errors])
        yield "refine.error", _Cell(_("Largest error"), text if errors else refined.error, text)
        included = {axis.paths[0]: axis.include for axis in refined.adaptive if axis.include}
        text = "; ".join(
            f"{reading.caption(path)} {reading.quantity(value, unit_of(study, path), _DIGITS)}"
            for path, values in included.items() for value in values
        )  # fmt: skip
        if included:
            yield "refine.include", _Cell(_("Included values"), text, text)
    elif study.kind == CALIBRATE:
        values = sum(len(own.values) for own in plan_of(study).measured)
        csv = one.spec["calibrate"]["measured"]["csv"]
        yield "calibrate.measured", _Cell(_("Measured values"), csv, number(values))


def _settings(one: ReadStudy, shared: Collection[str]) -> _Cells:
    """How studies of the same kind choose their cases."""
    for part, record in _SETTINGS.items():
        for name, field in record.fields.items() if part in shared else ():
            if isinstance(field, Described) and field.label and name != "error":
                given = one.spec[part].get(name, field.default)
                text = _NONE if given is None else typed_text(str(given))
                yield f"{part}.{name}", _Cell(_(field.label), text, text)


def _run(one: ReadStudy) -> _Cells:
    """The settings of the run."""
    for label, text, item in run_settings(one.study, one.spec, one.reading):
        yield f"run.{item.path}", _Cell(label, str(item.value), text)


def _further(one: ReadStudy, shared: Collection[str]) -> _Cells:
    """What else is written; how drives are drawn only where all studies draw some."""
    names = names_in_files([*one.study.base, *one.study.axis_paths])
    for name, value in one.spec.items():
        if name not in _READ and (name not in _DRAWS or name in shared):
            written = value if isinstance(value, str) else json.dumps(value, ensure_ascii=False)
            text = in_captions(written, names, one.reading)
            yield name, _Cell(part_name(name), repr(value), text if len(text) <= _LONGEST else f"{text[:_LONGEST]} …")
