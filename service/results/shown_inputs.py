"""Every input of a study as its page and report show it: parameters by part, choices, settings of the run."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.exports.inputs import inputs as every_input
from sprag_study.service.exports.inputs import run_inputs
from sprag_study.service.languages import N_, _, decimal, gettext, grouped, ngettext
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.part_names import NUMBERED, lower_first, part_name, run_name
from sprag_study.service.reading.wording import number, unit_text, words
from sprag_study.service.results.varied import formula_text, values_text
from sprag_study.service.spec.described import ANY_RUN, DURATION, SETTLED_RUN
from sprag_study.service.spec.machine.shaft import MEAN_SPEED_IS
from sprag_study.service.spec.machine.shaft_parts import EFFICIENCY_IS
from sprag_study.worker.models.parameters import parameter_of
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.exports.inputs import Input
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

_RUN: Final = {entry.name: entry for entry in (*SETTLED_RUN.values(), DURATION, *ANY_RUN.values())}
_NUMBER: Final = re.compile(rf"({'|'.join(NUMBERED)})\.(\d+)\.")
#: What values of choices are called where their own words do not say it.
_CALLED: Final = {entry.name: dict(entry.choices) for entry in (MEAN_SPEED_IS, EFFICIENCY_IS)}
_YES_NO: Final = {"true": N_("yes"), "false": N_("no")}
_COUNT: Final = re.compile(r"(\d+) (period|revolution)s?")


def inputs(study: Study, spec: Mapping[str, Any], reading: Reading) -> list[tuple[str, list[dict[str, Any]]]]:
    """Every parameter of the base by section, with letter, value, unit and origin."""
    sections: dict[str, list[dict[str, Any]]] = {}
    for item in every_input(study, spec):
        entry = parameter_of(study, item.path)
        section, _dot, name = item.path.rpartition(".")
        symbol = f"c_{int(name) + 1}" if name.isdigit() else "" if entry is None else entry.symbol
        derived = item.origin == "derived"  # a formula has its units
        value = formula_text(item, reading) if derived else in_words(item)
        shown = replace(item, value=value, unit="" if derived else item.unit)
        code = item.value if _is_code(item.value) and not derived else ""
        sections.setdefault(section, []).append({"name": name, "symbol": symbol, "item": shown, "code": code})
    return [(part_name(section), rows) for section, rows in sections.items()]


def varying(study: Study, spec: Mapping[str, Any], reading: Reading) -> tuple[list[str], list[tuple[str, str]]]:
    """The values of each axis; the path and the formula of each derived parameter."""
    derived = [(item.path, formula_text(item, reading)) for item in every_input(study, spec) if item.formula]
    return [values_text(study, axis, reading) for axis in study.axes], derived


def choice_name(item: Input) -> str:
    """What a choice of the machine is called: ``How the resistance is given, part 1``."""
    text = _(item.description) if item.description else _(words(item.path))
    text = text[:1].upper() + text[1:]
    numbered = _NUMBER.match(item.path)
    return f"{text}, {lower_first(_(NUMBERED[numbered[1]], number=ordinal(numbered[2])))}" if numbered else text


def in_words(item: Input) -> float | str | None:
    """The value of an input: a choice in words, a count with its unit, a number as it is."""
    if not isinstance(item.value, str):
        return item.value
    name = item.path.rpartition(".")[2]
    if name in _CALLED:
        return gettext(_CALLED[name][item.value])
    if _COUNT.fullmatch(item.value):
        return _counted(item.value)
    parts = item.value.split(", ")
    return ", ".join(gettext(part) if " " in part or part == "none" else _in_words(part) for part in parts)


def _in_words(name: str) -> str:
    if name in _YES_NO:
        return gettext(_YES_NO[name])
    return lower_first(gettext(words(name))) if _is_code(name) else name


def _is_code(value: float | str | None) -> bool:
    return isinstance(value, str) and re.fullmatch("[a-z_]+", value) is not None


def _counted(text: str) -> str:
    """``60 periods``, ``1 revolution``; any other text as it is."""
    found = _COUNT.fullmatch(text)
    if found is None:
        return text
    count = int(found[1])
    if found[2] == "period":
        return ngettext("{n} period", "{n} periods", count, n=grouped(count))
    return ngettext("{n} revolution", "{n} revolutions", count, n=grouped(count))


def run_settings(study: Study, spec: Mapping[str, Any], reading: Reading) -> list[tuple[str, str, Input]]:
    """The settings of the run: what each is called, its value as ``reading`` says, and the setting."""
    found = []
    for item in run_inputs(study, spec):
        entry = _RUN.get(item.path)
        value = str(item.value)
        known = {} if entry is None else dict(entry.choices)
        text = _(known[value]) if value in known else _run_value(study, item, reading)
        found.append((run_name(study.model, item.path), text, item))
    return found


def _run_value(study: Study, item: Input, reading: Reading) -> str:
    """The value of a setting of the run that is not a choice."""
    value = study.run[item.path]
    if isinstance(value, bool):
        return gettext(_YES_NO[str(value).lower()])
    if value is None:  # the window
        return gettext(str(item.value))
    if isinstance(value, Mapping):
        ranges = [_range(study, path, ends, reading) for path, ends in value["ranges"].items()]
        return _("{count}, seed {seed}: {ranges}", count=grouped(value["count"]), seed=value["seed"],
                 ranges="; ".join(ranges))  # fmt: skip
    if isinstance(value, list | tuple):
        return _time(*value) if isinstance(value[-1], str) else _window(*value)
    return number(value, 8) if isinstance(value, float) else _counted(str(item.value))


def _range(study: Study, path: str, ends: Sequence[float], reading: Reading) -> str:
    """What a start value is called, and its range: ``Initial speed of the shaft 0 to 30 rad/s``."""
    unit = unit_of(study, path)
    said = _("{low} to {high}", low=number(reading.value(ends[0], unit)), high=reading.quantity(ends[1], unit))
    return f"{reading.caption(path)} {said}"


def _window(start: tuple[float, str], end: tuple[float, str]) -> str:
    """From a time of the run to another: ``40 to 60 periods``."""
    if start[1] != end[1]:
        return _("{low} to {high}", low=_time(*start), high=_time(*end))
    first, last = (decimal(f"{time:g}") for time, _unit in (start, end))
    if end[1] == "periods":
        return _("{low} to {high} periods", low=first, high=last)
    return _("{low} to {high}", low=first, high=_time(*end))


def _time(value: float, unit: str) -> str:
    """A time of the run: ``60 periods``, ``2.5 s``."""
    text = decimal(f"{value:g}")
    if unit == "periods":
        return ngettext("{n} period", "{n} periods", value, n=text)
    if unit == "revolutions":
        return ngettext("{n} revolution", "{n} revolutions", value, n=text)
    return f"{text} {unit_text(unit)}"
