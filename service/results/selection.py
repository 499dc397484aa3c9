"""Selection of axes by any of their paths, and of their values with or without a unit."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from sprag_study.sentences import Amount, Name, Sentence, joined
from sprag_study.service.faults import Fault, ParameterFault, SelectionError, parameter_error, refused, shown
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import result_of, unit_of, unknown_result
from sprag_study.service.reading.deviations import deviations
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.reader import Phrase, term
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.reading.together import AMBIGUOUS_UNIT, question, with_unit_of_end
from sprag_study.service.reading.units import QuantityError, typed_value
from sprag_study.service.reading.wording import typed_text
from sprag_study.worker import models
from sprag_study.worker.directions import DIRECTIONS, SWEEP, direction
from sprag_study.worker.spread import DRIVE
from sprag_study.worker.study import SAME_VALUE

if TYPE_CHECKING:
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.spread import Tolerance
    from sprag_study.worker.study import Study

#: Fixed axes: position of the axis -> (the path that named it, position of the value on it).
Fixed = dict[int, tuple[str, int]]

_LISTED = 24
#: Of an axis without a value.
LEFT_OPEN = N_("the axis {path} is left open: give its value as at={path}=VALUE")


def numeric_results(infos: Sequence[ResultInfo], parameter: str, names: Sequence[str]) -> tuple[ResultInfo, ...]:
    """The results of those names, each once; SelectionError (about ``parameter``) for others and for categories."""
    faults: list[Fault] = []
    found: dict[str, ResultInfo] = {}
    for name in dict.fromkeys(names):
        info = result_of(infos, name)
        if info is None:
            message, known = unknown_result(infos, name), listed(info.name for info in infos)
            faults.append(ParameterFault(parameter, "unknown-name", message, shown(name), known))
        elif info.kind == "category":
            faults.append(ParameterFault(parameter, "not-numeric", "is a category, not a number", name, "a number"))
        else:
            found[name] = info
    if faults:
        raise SelectionError(faults)
    return tuple(found.values())


def listed(values: Iterable[object]) -> Sentence:
    """Values for a message; the middle of a long list is left out."""
    texts = [f"{value!r}" if isinstance(value, float) else str(value) for value in values]
    if len(texts) <= _LISTED:
        return joined(", ", texts)
    more = Sentence("… {count} more", count=str(len(texts) - _LISTED))
    return joined(", ", (*texts[: _LISTED - 4], more, *texts[-4:]))


def require_axis(study: Study, parameter: str, path: str) -> int:
    """Position of the axis with ``path`` among its paths; SelectionError (about ``parameter``) otherwise."""
    position = study.axis_of(path)
    if position is not None:
        return position
    known: str = listed(study.axis_paths) if study.axis_paths else N_("no axis at all")
    if path in study.derive:
        raise refused(parameter, "not-an-axis", "not an axis: it is derived from other parameters", path, allowed=known)
    if study.spread is not None and path in study.spread.paths:
        raise refused(parameter, "not-an-axis", "not an axis: it differs from drive to drive", path, allowed=known)
    hint = did_you_mean(path, study.axis_paths)
    message = Sentence("not an axis of this study{hint}", hint=hint)
    if path in study.base:
        value = Amount(study.base[path], unit_of(study, path), 10)
        message = Sentence("not an axis: it is {value} in every case{hint}", value=value, hint=hint)
    raise refused(parameter, "not-an-axis", message, path, allowed=known)


def own_paths(study: Study) -> list[str]:
    """A path for each number that cases have for themselves: one of each axis, drawn and derived ones."""
    drawn = () if study.spread is None else study.spread.paths
    return list(dict.fromkeys([*(axis.paths[0] for axis in study.axes), *drawn, *study.derive]))


def with_nominal(study: Study, fixed: Fixed, roles: Iterable[int]) -> Fixed:
    """The fixed axes with that of the drives at the nominal one, where the drives have no other role; of a sweep with
    that of the directions at its first, up where there are both.
    """
    if study.sweep is not None and (last := len(study.axes) - 1) not in {*fixed, *roles}:
        return {**fixed, last: (SWEEP, 0)}
    position = study.axis_of(DRIVE)
    if position is None or position in {*fixed, *roles}:
        return fixed
    return {**fixed, position: (DRIVE, int(np.argmin(study.axes[position].array)))}


def numeric_names(infos: Iterable[ResultInfo]) -> list[str]:
    """The results that are numbers."""
    return [info.name for info in infos if info.kind != "category"]


def axis_name(study: Study, path: str) -> str:
    """``path`` with the paths tied to it: ``excitation.amplitude_x = excitation.amplitude_y``."""
    position = study.axis_of(path)
    tied = () if position is None else study.axes[position].paths
    return " = ".join(dict.fromkeys((path, *tied)))


def held_text(study: Study, path: str, value: float, *, every: bool = False) -> Phrase:
    """A parameter held at ``value`` (SI) for display: ``excitation.frequency = 25 Hz``.

    That of ``every`` drive of a batch has its tolerance.
    """
    if path == SWEEP:
        return Phrase("{name} {direction}", name=Name(SWEEP, within=True), direction=term(direction(value)))
    amount = Amount(value, unit_of(study, path), 6)
    said = with_tolerance(study, path, amount) if every else amount
    return Phrase("{name} = {value}", name=Name(axis_name(study, path)), value=said)


def tolerance_of(study: Study, path: str) -> Tolerance | None:
    """The tolerance of a parameter; None where it has none."""
    return next((one for one in study.tolerances if path in one.paths), None)


def with_tolerance(study: Study, path: str, value: str | Amount) -> str | Amount:
    """A value with the tolerance of its parameter as it was written: ``0.2 mm ± 60 %``; the value without one."""
    one = tolerance_of(study, path)
    if one is None or "plus_minus" not in one.about:
        return value
    return joined(" ", (value, deviation_text(one.about)))


def deviation_text(about: Mapping[str, Any]) -> str | Phrase:
    """The deviations of a tolerance as they were written: ``± 60 %``, or ``+0.05/-0 mm``."""
    text = str(about["plus_minus"])
    typed = typed_text(text)
    return typed if deviations(text) else Phrase("± {tolerance}", tolerance=typed)


def held_texts(study: Study, at: Mapping[str, float]) -> tuple[Phrase, ...]:
    """The fixed axes, then the constant parameters of the operating point; those of every drive with tolerances."""
    point, varying = models.presentation_of(study).operating_point, study.axis_paths
    always = [path for path in point if path in study.base and path not in varying]
    values = study.base
    if study.spread is not None and DRIVE in at:
        drive = np.array([at[DRIVE]])
        drawn = {
            path: float(study.spread.values(path, values[path], drive)[0])
            for path in always
            if path in study.spread.paths
        }
        values = {**values, **drawn}
    fixed = [*at.items(), *((path, values[path]) for path in always)]
    return tuple(held_text(study, path, value, every=DRIVE not in at) for path, value in fixed)


def locate_axes(study: Study, at: Sequence[tuple[str, str]], parameter: str = "at") -> Fixed:
    """The axes and the positions on them given by pairs of path and value (as text), the content of ``parameter``.

    A path that is not an axis is accepted where its only value is the given one. Raises SelectionError otherwise.
    """
    fixed: Fixed = {}
    for path, text in at:
        position = study.axis_of(path)
        if position is None and (path in study.derive or path not in study.base):
            require_axis(study, parameter, path)
        unit = unit_of(study, path)
        value = value_of(path, text, unit, parameter)
        if position is None:
            if not math.isclose(study.base[path], value, rel_tol=SAME_VALUE):
                require_axis(study, parameter, path)
            continue
        index = study.axes[position].index_of(value)
        if index is None:
            values = np.unique(study.axes[position].array).tolist()
            known = listed(map(direction, values) if path == SWEEP else values)
            raise refused(
                parameter, "unknown-value", "the axis has no such value", f"{path}={text}", allowed=known, unit=unit
            )
        if fixed.setdefault(position, (path, index))[1] != index:
            raise refused(parameter, "repeated", "the axis is given two values", f"{path}={text}")
    return fixed


def locate_values(study: Study, of: Sequence[tuple[str, str]], parameter: str = "of") -> dict[int, list[int]]:
    """Positions of several values on axes, by axis, in the order of the values; pairs are those of `locate_axes`."""
    refuse_mixed_texts(parameter, of, {path: unit_of(study, path) for path, _ in of if study.axis_of(path) is not None})
    found: dict[int, dict[int, float]] = {}
    for pair in of:
        for axis, (_, index) in locate_axes(study, [pair], parameter).items():
            found.setdefault(axis, {})[index] = study.axes[axis].value(index)
    return {axis: sorted(places, key=places.__getitem__) for axis, places in found.items()}


def refuse_mixed_texts(parameter: str, pairs: Sequence[tuple[str, str]], units: Mapping[str, str]) -> None:
    """Raise SelectionError where a value of a name has no unit beside others of the name in units of another scale.

    ``pairs`` are names with texts, ``units`` the SI units of names; others are left out.
    """
    for name, unit in units.items():
        texts = [text for own, text in pairs if own == name]
        asked = question(texts, unit)
        if asked is not None:
            value = f"{name}={texts[asked.place]}"
            raise refused(parameter, AMBIGUOUS_UNIT, asked.message, value, allowed=asked.allowed, unit=unit)


def ends_of_range(
    names: tuple[str, str], low: str | None, high: str | None, unit: str
) -> tuple[str | None, str | None]:
    """The texts of two ends, a bare first one with the unit of the last; FaultError about one that remains unclear."""
    low, high = (None if text is None else in_language(text) for text in (low, high))
    ends = with_unit_of_end(low, high)
    asked = question([text or "" for text in ends], unit)
    if asked is not None:
        place = asked.place
        raise parameter_error(names[place], AMBIGUOUS_UNIT, asked.message, ends[place], asked.allowed)
    return ends


def value_of(path: str, text: str, unit: str, parameter: str = "at") -> float:
    """The value (SI) of a path in a text with or without a unit; SelectionError about ``parameter`` otherwise."""
    if path == SWEEP and text in DIRECTIONS:
        return float(DIRECTIONS.index(text))
    text = in_language(text)
    try:
        return typed_value(text, unit)
    except QuantityError as error:
        if path == SWEEP:
            allowed = ", ".join(DIRECTIONS)
            raise refused(
                parameter, "unknown-value", "is not a direction", f"{path}={text}", allowed=allowed
            ) from error
        message = of_name(path, error.message)
        given = f"{path}={text}" if parameter == "at" else text
        raise refused(parameter, error.code, message, given, unit=unit) from error


def of_name(name: str, message: str) -> Sentence:
    """A message about the value of a name."""
    return Sentence("{name} {message}", name=Name(name), message=message)
