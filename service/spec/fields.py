"""Reading single fields of a spec: numbers with units and ranges, whole numbers, flags, objects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction
from typing import Any, Final

from sprag.sentences import Amount, Sentence, plural
from sprag.service.reading.catalogue import range_sentence
from sprag.service.reading.limits import one_of, quoted, span
from sprag.service.reading.texts import did_you_mean
from sprag.service.reading.units import PERIOD_NAMES, QuantityError, example, parse_exact, split_quantity, to_float
from sprag.service.spec.report import Report, join
from sprag.worker.models import Parameter

#: Fields of a spec about tolerances.
TOLERANCE_FIELDS: Final = ("tolerances", "drives", "seed", "draws", "correlations")
#: Fields of a spec that say which cases a study has.
WHICH_CASES: Final = frozenset({"axes", "combine", "exclude", "refine", "goal", "calibrate", *TOLERANCE_FIELDS})


def exact(value: object, parameter: Parameter) -> Fraction:
    """Convert ``value`` to an exact SI number; QuantityError when it is not one or out of ``parameter``'s range."""
    number = parse_exact(value, parameter.unit)
    if not parameter.accepts(to_float(number)):
        raise QuantityError("out-of-range", "is out of range")
    return number


def read_exact(report: Report, pointer: str, value: object, parameter: Parameter) -> Fraction | None:
    """Read the exact SI number of one field; None, with a fault recorded, unless it is in ``parameter``'s range."""
    if report.full:
        return None
    try:
        return exact(value, parameter)
    except QuantityError as error:
        report.fault(pointer, error.code, error.message, value, allowed=range_sentence(parameter), unit=parameter.unit)
        return None


def read_number(report: Report, pointer: str, value: object, parameter: Parameter) -> float | None:
    """As `read_exact`, rounded to the nearest double."""
    number = read_exact(report, pointer, value, parameter)
    return None if number is None else to_float(number)


def read_whole(report: Report, pointer: str, value: object, low: int, high: int) -> int | None:
    """Read an integer from ``low`` to ``high``; None, with a fault recorded, for anything else."""
    if isinstance(value, bool) or not isinstance(value, int):
        report.fault(pointer, "wrong-type", "must be a whole number", value, allowed=span(low, high))
        return None
    if not low <= value <= high:
        report.fault(pointer, "out-of-range", "is out of range", value, allowed=span(low, high))
        return None
    return value


def read_plain(report: Report, pointer: str, value: object, low: float, high: float) -> float | None:
    """A number without a unit from ``low`` to ``high``; None, and a problem noted, when it is not one."""
    allowed = Sentence("{low} to {high}, a plain number", low=Amount(low, digits=6), high=Amount(high, digits=6))
    if isinstance(value, bool) or not isinstance(value, int | float):
        report.fault(pointer, "wrong-type", "must be a plain number", value, allowed=allowed)
        return None
    if not low <= value <= high:
        report.fault(pointer, "out-of-range", "is out of range", value, allowed=allowed)
        return None
    return float(value)


def read_periods(report: Report, pointer: str, value: object, low: int, high: int) -> int | None:
    """A text with a whole number of excitation periods; None, and a problem noted, when it is not one."""
    allowed = Sentence('{low} to {high} whole excitation periods, as in "1000 periods"', low=low, high=high)
    try:
        number, unit = split_quantity(value) if isinstance(value, str) else (None, "")
    except QuantityError as error:
        report.fault(pointer, error.code, error.message, value, allowed=allowed)
        return None
    if number is None or unit not in PERIOD_NAMES:
        report.fault(pointer, "wrong-type", "must be a number of excitation periods", value, allowed=allowed)
    elif number.denominator != 1 or not low <= number <= high:
        report.fault(pointer, "out-of-range", "is out of range", value, allowed=allowed)
    else:
        return int(number)
    return None


def read_flag(report: Report, pointer: str, value: object) -> bool | None:
    """Read true or false; None, with a fault recorded, for anything else."""
    if isinstance(value, bool):
        return value
    report.fault(pointer, "wrong-type", "must be true or false", value, allowed="true or false")
    return None


def read_choice(
    report: Report, pointer: str, value: object, choices: Sequence[str], *, given: bool = False
) -> str | None:
    """Read one of ``choices``; None, with a fault recorded, for anything else. Unless ``given``, None means missing."""
    if isinstance(value, str) and value in choices:
        return value
    allowed = quoted(choices)
    if value is None and not given:
        report.fault(pointer, "required", "is required", allowed=allowed)
    else:
        hint = did_you_mean(value, choices) if isinstance(value, str) else Sentence("")
        report.fault(
            pointer, "invalid-choice", Sentence("is not a valid choice{hint}", hint=hint), value, allowed=allowed
        )
    return None


def read_one(report: Report, pointer: str, found: Mapping[str, Any], names: Sequence[str]) -> str | None:
    """Which one of the fields ``names`` is in ``found``; None, and a fault noted, when it is not one exactly."""
    given = [name for name in names if name in found]
    if len(given) == 1:
        return given[0]
    listed = ", ".join(names)
    message = Sentence("needs exactly one of {names}; none is given", names=listed)
    if given:
        message = plural(
            "needs exactly one of {names}; {count} is given: {given}",
            "needs exactly one of {names}; {count} are given: {given}",
            len(given), names=listed, given=", ".join(given),
        )  # fmt: skip
    report.fault(pointer, "exactly-one", message, allowed=one_of(names))
    return None


def read_object(
    report: Report, pointer: str, value: object, known: Iterable[str], *, given: bool = False
) -> Mapping[str, Any] | None:
    """Read an object; None, with a fault recorded, for anything else. Fields that are not ``known`` are faults too.

    Unless ``given``, None means missing.
    """
    known = tuple(known)
    if not isinstance(value, Mapping):
        missing = value is None and not given
        report.fault(
            pointer,
            "required" if missing else "wrong-type",
            "is required" if missing else "must be an object",
            value,
            allowed=Sentence("an object with the fields {names}", names=", ".join(known)),
        )
        return None
    report.unknown_fields(pointer, value, known)
    return value


def read_parameters(
    report: Report, pointer: str, data: Mapping[str, Any], parameters: Mapping[str, Parameter]
) -> dict[str, float]:
    """Read the numbers of an object by the path of their parameter, with defaults; invalid ones are left out.

    Parameters
    ----------
    parameters : name of the field -> its `placed` parameter
    """
    found: dict[str, float] = {}
    for name, parameter in parameters.items():
        if name in data:
            number = read_number(report, join(pointer, name), data[name], parameter)
        elif parameter.default is None:
            missing(report, join(pointer, name), parameter)
            number = None
        else:
            number = parameter.default
        if number is not None:
            found[parameter.path] = number
    return found


def missing(report: Report, pointer: str, parameter: Parameter) -> None:
    """Record that a required number is missing."""
    report.fault(
        pointer,
        "required",
        Sentence(
            "is required ({help}, for example {example})",
            help=Sentence(parameter.help),
            example=example(parameter.unit),
        ),
        allowed=range_sentence(parameter),
        unit=parameter.unit,
    )
