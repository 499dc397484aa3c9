"""What varies in a study, from where to where, and by how much its machines differ, in words."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

from sprag.sentences import Amount
from sprag.service.reading.catalogue import axes_json, unit_of
from sprag.service.reading.reader import Phrase, plural
from sprag.service.reading.wording import typed_text
from sprag.service.results.calibration import plan_of
from sprag.service.results.fronts import goal_of
from sprag.worker.models import NO_PARAMETERS
from sprag.worker.planning.calibrate.plan import CALIBRATE
from sprag.worker.planning.goals.plan import GOAL

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator

    from sprag.service.reading.reader import Reading
    from sprag.worker.planning.calibrate.plan import Unknown
    from sprag.worker.planning.goals.plan import Variable
    from sprag.worker.study import Study

Text = str | Amount
#: Digits of an end.
_DIGITS: Final = 5
#: A name of a parameter or of a result in a formula.
_CODE: Final = re.compile(r"[a-z_]+(?:\.(?:[a-z_0-9]+|\*))+")


def varied(study: Study) -> Iterator[tuple[tuple[str, ...], Text]]:
    """The paths of each axis with its ends and its number of values; what a search or a calibration chooses, first.

    Drives and directions are no parameters and left out.
    """
    searched = _searched(study)
    paths = {path for one in searched for path in one.paths}
    for one in searched:
        yield one.paths, Phrase("{ends}, searched", ends=ends(one.low, one.high, unit_of(study, one.paths[0])))
    for axis in axes_json(study):
        if not NO_PARAMETERS.isdisjoint(axis["paths"]) or not paths.isdisjoint(axis["paths"]):
            continue
        text = ends(axis["least"], axis["largest"], axis["unit"])
        if study.plan is None and axis["least"] != axis["largest"]:
            text = plural("{ends}, {count} value", "{ends}, {count} values", axis["values"], ends=text)
        yield tuple(axis["paths"]), text


def _searched(study: Study) -> tuple[Variable | Unknown, ...]:
    kind = None if study.plan is None else study.plan.get("kind")
    return goal_of(study).vary if kind == GOAL else plan_of(study).unknown if kind == CALIBRATE else ()


def ends(low: float, high: float, unit: str, digits: int = _DIGITS) -> Text:
    """A range in SI, ``20 to 35 Hz``; a single value where both ends are the same."""
    if low == high:
        return Amount(low, unit, digits)
    return Phrase("{low} to {high}", low=Amount(low, unit, digits, bare=True), high=Amount(high, unit, digits))


def with_tolerance(study: Study, path: str, value: Text) -> Text:
    """A value with the tolerance of its parameter as it was written: ``0.2 mm ± 60 %``; the value without one."""
    for one in () if study.spread is None else study.spread.tolerances:
        if path in one.paths and "plus_minus" in one.about:
            return Phrase("{value} ± {tolerance}", value=value, tolerance=typed_text(str(one.about["plus_minus"])))
    return value


def names_in_files(names: Iterable[str]) -> frozenset[str]:
    """Names of parameters and results, those of all parts with ``*`` too."""
    known = frozenset(names)
    return known | {re.sub(r"\.\d+", ".*", name) for name in known}


def in_captions(text: str, names: Container[str], reading: Reading) -> str:
    """A formula with what parameters are called instead of their ``names`` in files."""
    return _CODE.sub(lambda name: reading.within(name[0]) if name[0] in names else name[0], text)
