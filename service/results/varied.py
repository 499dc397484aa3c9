"""What varies in a study, from where to where, and by how much its machines differ, in words."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from sprag_study.sentences import Amount, Named
from sprag_study.service.languages import _
from sprag_study.service.reading.catalogue import axes_json, shown_values, unit_of
from sprag_study.service.reading.reader import CODES, Phrase, joined, plural, term
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.calibration import plan_of
from sprag_study.service.results.fronts import goal_of
from sprag_study.service.results.selection import deviation_text, tolerance_of, with_tolerance
from sprag_study.worker.models import NO_PARAMETERS
from sprag_study.worker.planning.calibrate.plan import CALIBRATE
from sprag_study.worker.planning.goals.plan import GOAL

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator, Mapping, Sequence

    from sprag_study.service.exports.inputs import Input
    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.planning.calibrate.plan import Unknown
    from sprag_study.worker.planning.goals.plan import Variable
    from sprag_study.worker.study import Axis, Study

Text = str | Amount
#: Digits of an end.
_DIGITS: Final = 5
#: Values of an axis that are listed where they are not evenly divided.
_LISTED: Final = 8
#: Difference of evenly divided values from those that are written, as a share of the range.
_EVEN: Final = 1e-9
#: A name of a parameter or of a result in a formula.
_CODE: Final = re.compile(r"[a-z_]+(?:\.(?:[a-z_0-9]+|\*))+")
#: A name with its exponent, or a number with its unit, in a formula.
_TERM: Final = re.compile(
    rf"(?P<name>{_CODE.pattern})(?:\s*\^\s*(?P<power>\d)(?![\d.]))?"
    r"|(?<![\w.^])(?P<number>\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)"
    r"(?P<unit>\s*[A-Za-zµ°]+(?:\^-?\d)?(?:[*/][A-Za-zµ°]+(?:\^-?\d)?)*(?![\w.(]))?"
)
_RAISED: Final = str.maketrans("0123456789", "⁰¹²³⁴⁵⁶⁷⁸⁹")


def varied(study: Study) -> Iterator[tuple[tuple[str, ...], Text]]:
    """The paths of each axis with its ends and its number of values; what a search or a calibration chooses, first.

    Drives and directions are no parameters and left out.
    """
    searched = _searched(study)
    paths = {path for one in searched for path in one.paths}
    for one in searched:
        unit, catalogue = unit_of(study, one.paths[0]), getattr(one, "values", ())
        said = listed(catalogue, unit) if catalogue else ends(one.low, one.high, unit)
        yield one.paths, Phrase("{ends}, searched", ends=said)
    for own, axis in zip(study.axes, axes_json(study), strict=True):
        if not NO_PARAMETERS.isdisjoint(axis["paths"]) or not paths.isdisjoint(axis["paths"]):
            continue
        text = ends(axis["least"], axis["largest"], axis["unit"])
        if study.plan is None and axis["least"] != axis["largest"]:
            values = shown_values(study, own).tolist()
            text = (
                plural("{ends}, {count} value", "{ends}, {count} values", len(values), ends=text)
                if is_even(values) and not isinstance(axis["unit"], Named)
                else listed(values, axis["unit"])
            )
        yield tuple(axis["paths"]), text


def is_even(values: Sequence[float]) -> bool:
    """Whether values are evenly divided between the first and the last one, as a range with their number is read."""
    even = np.linspace(values[0], values[-1], len(values))
    return bool(np.allclose(values, even, rtol=0.0, atol=_EVEN * abs(values[-1] - values[0])))


def values_text(study: Study, axis: Axis, reading: Reading) -> str:
    """How many values an axis has; those of a short one that are not evenly divided."""
    values = shown_values(study, axis).tolist()
    unit = unit_of(study, axis.paths[0])
    if isinstance(unit, Named) and len(values) <= _LISTED:
        return "; ".join(unit.names[int(value)] for value in values)
    if study.plan is not None or not NO_PARAMETERS.isdisjoint(axis.paths) or is_even(values):
        return number(len(values))
    if len(values) > _LISTED:
        return _("{count}, unequal", count=number(len(values)))
    return "; ".join(number(reading.value(value, unit), _DIGITS) for value in values)


def listed(values: Sequence[float], unit: str, digits: int = _DIGITS) -> Text:
    """Values in SI that are not evenly divided: ``0; 0.1; 0.4 N·m``; of many their number and ends."""
    if len(values) > _LISTED:
        return plural("{count} value from {ends}, unequal", "{count} values from {ends}, unequal", len(values),
                      ends=ends(min(values), max(values), unit, digits))  # fmt: skip
    *first, last = values
    return joined("; ", [*(Amount(value, unit, digits, bare=True) for value in first), Amount(last, unit, digits)])


def _searched(study: Study) -> tuple[Variable | Unknown, ...]:
    return goal_of(study).vary if study.kind == GOAL else plan_of(study).unknown if study.kind == CALIBRATE else ()


def ends(low: float, high: float, unit: str, digits: int = _DIGITS) -> Text:
    """A range in SI, ``20 to 35 Hz``; a single value where both ends are the same."""
    if low == high:
        return Amount(low, unit, digits)
    return Phrase("{low} to {high}", low=Amount(low, unit, digits, bare=True), high=Amount(high, unit, digits))


def with_distribution(study: Study, path: str, value: Text) -> Text:
    """The same with the distribution of the parameter: ``0.2 mm ± 60 %, normal``."""
    one = tolerance_of(study, path)
    return value if one is None else joined(", ", (with_tolerance(study, path, value), *_distribution(one.about)))


def tolerances_of(study: Study) -> Iterator[tuple[tuple[str, ...], Phrase]]:
    """The parameters of each tolerance, and how they differ from drive to drive: ``± 60 %, normal``."""
    for one in study.tolerances:
        parts = [deviation_text(one.about)] if "plus_minus" in one.about else []
        yield one.paths, joined(", ", (*parts, *_distribution(one.about)))


def _distribution(about: Mapping[str, Any]) -> Iterator[Phrase]:
    if "values" in about:
        yield plural("{count} measured value", "{count} measured values", int(about["values"]))
    elif "distribution" in about:
        yield term(str(about["distribution"]))


def names_in_files(names: Iterable[str]) -> frozenset[str]:
    """Names of parameters and results, those of all parts with ``*`` too."""
    known = frozenset(names)
    return known | {re.sub(r"\.\d+", ".*", name) for name in known}


def in_captions(text: str, names: Container[str], reading: Reading) -> str:
    """A formula with what parameters are called instead of their ``names`` in files."""
    return _CODE.sub(lambda name: reading.within(name[0]) if name[0] in names else name[0], text)


def formula_text(item: Input, reading: Reading) -> str:
    """The formula of a derived parameter as it was written: ``1.1 · (arm of the mass, pendulum 1)² + 5·10⁻⁴ kg·m²``.

    Its quantities keep their units. By code names it is the formula that can be typed.
    """
    return formula_in_words(item.formula, reading)


def formula_in_words(formula: str, reading: Reading) -> str:
    """A formula as `formula_text` prints it."""
    if reading.names == CODES:
        return formula
    text = _TERM.sub(lambda found: _term(found, reading), formula)
    return text.replace("*", "·").replace(" - ", " − ")


def _term(found: re.Match[str], reading: Reading) -> str:
    if found["name"]:
        said = reading.within(found["name"])
        return f"({said}){found['power'].translate(_RAISED)}" if found["power"] else f"({said})"
    unit = unit_text((found["unit"] or "").strip())
    return " ".join(filter(None, (number(float(found["number"]), 12), unit)))
