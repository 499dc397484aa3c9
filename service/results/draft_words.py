"""A study that is not submitted yet, as a sentence: what varies, how many cases, how they end, how long it takes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount
from sprag_study.service.languages import gettext
from sprag_study.service.reading.catalogue import shown_values, unit_of
from sprag_study.service.reading.reader import Phrase, plural
from sprag_study.service.reading.wording import number
from sprag_study.worker.models import NO_PARAMETERS, SETTLED

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import Preview
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Axis, Study

#: Axes that are described one by one; of more only the number is stated.
_MOST_AXES: Final = 4
_DIGITS: Final = 4


def draft_words(study: Study, spec: Mapping[str, Any], preview: Preview, reading: Reading) -> str:
    """The sentence, in the units and names of a reader."""
    parts = {"what": _what(study, spec, reading), "cases": _cases(study, preview, reading), "ends": _ends(study)}
    return gettext("{what}; {cases}{ends}.").format(**parts)


def _what(study: Study, spec: Mapping[str, Any], reading: Reading) -> str:
    if "goal" in spec:
        results = len(spec["goal"]["best"])
        return reading.say(plural("The best designs by {count} result", "The best designs by {count} results", results))
    axes = [axis for axis in study.axes if NO_PARAMETERS.isdisjoint(axis.paths)]
    if not axes:
        return gettext("One machine, nothing varies")
    names = ", ".join(_axis(study, axis, reading) for axis in axes) if len(axes) <= _MOST_AXES else ""
    count = reading.say(plural("{count} axis", "{count} axes", len(axes)))
    if study.combine == "zip" and len(axes) > 1:
        count = gettext("{axes}, value by value", axes=count)
    return f"{count}: {names}" if names else count


def _axis(study: Study, axis: Axis, reading: Reading) -> str:
    values, path = shown_values(study, axis), axis.paths[0]
    unit = unit_of(study, path)
    least, largest = float(values.min()), float(values.max())
    name = " = ".join(reading.within(path) for path in axis.paths)
    name += ":" if name[-1:].isdigit() else ""  # "stage 1: 500 to 5000"
    if values.size == 1:
        return f"{name} {reading.quantity(least, unit, _DIGITS)}"
    ends = Phrase("{low} to {high}", low=Amount(least, unit, _DIGITS, bare=True), high=Amount(largest, unit, _DIGITS))
    many = plural("{count} value", "{count} values", int(values.size))
    count = Phrase("refined") if study.plan is not None else many
    return f"{name} {reading.say(ends)} ({reading.say(count)})"


def _cases(study: Study, preview: Preview, reading: Reading) -> str:
    most = preview["most_cases"]
    count = plural("{count} case", "{count} cases", most)
    if preview["most_rounds"] > 1:
        count = plural("at most {count} case", "at most {count} cases", most)
    if study.spread is None:
        return reading.say(count)
    drives = study.spread.drives
    text = plural(
        "{cases}, each place with the nominal machine and {count} drawn one",
        "{cases}, each place with the nominal machine and {count} drawn ones",
        drives,
        cases=count,
    )
    return reading.say(text)


def _ends(study: Study) -> str:
    if not study.run:
        return ""
    if study.run.get("until") == SETTLED:
        return gettext(", run until the motion is settled")
    time = study.run.get("duration")
    if time is None:
        return ""
    return gettext(", run for {time}", time=f"{number(float(time[0]), _DIGITS)} {gettext(time[1])}")
