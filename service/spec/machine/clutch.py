"""The clutch of a spec: coefficients, or measured data that are fitted here; and the check of all laws of a study."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from sprag_study.sentences import Sentence
from sprag_study.service import languages
from sprag_study.service.languages import gettext
from sprag_study.service.reading.texts import quantity_text
from sprag_study.service.spec.described import FIT, Listed, Record, Variants
from sprag_study.service.spec.lists import read_list
from sprag_study.service.spec.machine.part import NO_LIMIT
from sprag_study.service.spec.report import Report, join
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_CLUTCH_LAWS, MAX_CLUTCH_ROWS
from sprag_study.worker.models import CLUTCH_COEFFICIENT, CLUTCH_WINDUP_LIMIT, MAX_COEFFICIENTS, Parameter
from sprag_study.worker.models.parameters import placed

if TYPE_CHECKING:
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import ClutchFit
    from sprag_study.worker.study import Axis, Combine

_ANGLE = Parameter("angle", "xi", "rad", 0.0, 1e3, False, None, "measured angle")
_TORQUE = Parameter("torque", "M", "N*m", -1e9, 1e9, False, None, "measured torque")
_ACCURACY = Parameter("accuracy", "", "N*m", 0.0, 1e9, True, None, "largest residual of the fit that is accepted")
_COEFFICIENTS = Listed(
    "clutch coefficients", 1, MAX_COEFFICIENTS,
    "c_1 .. c_p of the torque over the windup, c_1 first: N*m, N*m/rad, N*m/rad^2, ..",
    ", c_1 first (N*m, N*m/rad, N*m/rad^2, ..); or `data` with `accuracy`",
    item=QUANTITY,
)  # fmt: skip
_ROWS = Listed(
    "measured rows", 2, MAX_CLUTCH_ROWS, "measured rows [angle, torque]: rad and N*m, or texts with their units",
    item={"type": "array", "minItems": 2, "maxItems": 2, "items": QUANTITY, "description": "angle and torque"},
)  # fmt: skip
_LAW = Record({"coefficients": _COEFFICIENTS, "windup_limit": CLUTCH_WINDUP_LIMIT}, required=("coefficients",))
MEASURED = Record({"data": _ROWS, "accuracy": _ACCURACY, **FIT}, required=("data", "accuracy"))
CLUTCH = Variants((_LAW, MEASURED), "torque of the freewheel clutch over its windup", only=True)


@cache
def _no_limit() -> frozenset[str]:
    """How pages print that the law has no limit, in each language."""
    texts = set()
    for code in languages.available():
        with languages.language(code):
            texts.add(gettext(NO_LIMIT))
    return frozenset({NO_LIMIT, *texts})


@dataclass(frozen=True)
class Clutch:
    """A clutch as the spec gives it.

    Attributes
    ----------
    pointer : str
        JSON Pointer of its object.
    prefix : str
        Beginning of its flat paths: "clutch." or "pendulums.N.clutch.".
    coefficients : tuple of float
        c_1 first, N*m/rad^(k-1).
    windup_limit : float
        End of the law's range, rad; infinite when none is given.
    fit : ClutchFit or None
        The fit, where the coefficients come from measured data.
    """

    pointer: str
    prefix: str
    coefficients: tuple[float, ...]
    windup_limit: float
    fit: ClutchFit | None = None

    @property
    def values(self) -> dict[str, float]:
        """Flat path -> SI number; without the windup limit when there is none."""
        limit = {} if math.isinf(self.windup_limit) else {f"{self.prefix}windup_limit": self.windup_limit}
        return {f"{self.prefix}coefficients.{k}": value for k, value in enumerate(self.coefficients)} | limit

    @property
    def parameters(self) -> dict[str, Parameter]:
        """The parameters that an axis can vary, by flat path; none when the law comes from data."""
        if self.fit is not None:
            return {}
        paths = [(f"{self.prefix}coefficients.{k}", CLUTCH_COEFFICIENT) for k in range(len(self.coefficients))]
        return {
            path: placed(entry, path) for path, entry in [*paths, (f"{self.prefix}windup_limit", CLUTCH_WINDUP_LIMIT)]
        }


def read_clutch(node: Node, prefix: str, backlashes: Sequence[float]) -> Clutch | None:
    """Read a clutch; None, with the faults recorded, when it is invalid.

    Parameters
    ----------
    backlashes : backlash (rad) of each pendulum that has this clutch; needed when the angles include it
    """
    if not CLUTCH.read(node):
        return None
    by_law, by_data = ([name for name in way.fields if name in node] for way in (_LAW, MEASURED))
    if by_law and by_data:
        given = {"law": ", ".join(by_law), "data": ", ".join(by_data)}
        either = {"first": ", ".join(_LAW.fields), "second": ", ".join(MEASURED.fields)}
        node.refuse(
            "conflict", Sentence("is given both as a law ({law}) and as measured data ({data})", **given), None,
            allowed=Sentence("either {first} or {second}", **either),
        )  # fmt: skip
        return None
    return read_measured(node, prefix, backlashes) if by_data else _given(node, prefix)


def _given(node: Node, prefix: str) -> Clutch | None:
    limit: float | None = math.inf
    if "windup_limit" in node and node["windup_limit"].value not in _no_limit():
        limit = node["windup_limit"].number(CLUTCH_WINDUP_LIMIT)
    items = _COEFFICIENTS.read(node["coefficients"])
    if items is None:
        return None
    own = [placed(CLUTCH_COEFFICIENT, f"{prefix}coefficients.{k}") for k in range(len(items))]
    read = read_list(items, [entry.unit for entry in own])
    if read is None:
        return None
    numbers = [item.number(entry) for item, entry in zip(read, own, strict=True)]
    if limit is None or None in numbers:
        return None
    return Clutch(node.pointer, prefix, tuple(number for number in numbers if number is not None), limit)


def read_measured(node: Node, prefix: str, backlashes: Sequence[float]) -> Clutch | None:
    """Read a clutch that is given by measured data; None, with the faults recorded, when it is invalid."""
    data = node["data"]
    rows, accuracy = _ROWS.read_rows(data, _ANGLE, _TORQUE), node["accuracy"].number_or_default(_ACCURACY)
    options = {name: field.read(node) for name, field in FIT.items()}
    if options["angles_include_backlash"]:
        if len(set(backlashes)) > 1:
            node["angles_include_backlash"].refuse(
                "conflict",
                "the backlash can be subtracted only if all pendulums of a common clutch have the same one; give the "
                "clutch in each pendulum instead",
                [quantity_text(backlash, "rad") for backlash in backlashes],
            )
        elif backlashes:
            options["backlash"] = backlashes[0]
        else:
            return None  # the backlash could not be read, which is recorded already
    if accuracy is None or not data.sound:
        return None
    try:
        fit = models.fit_clutch(rows, accuracy, **options)
    except models.ClutchFitError as error:
        where = node.below(error.name or "data")
        where.refuse("no-clutch-law", error.message, _shown(error.value), allowed=error.allowed)
        return None
    for warning in fit.warnings:
        node.report.adopt_warning(node.pointer, warning)
    return Clutch(node.pointer, prefix, fit.coefficients, fit.windup_limit, fit)


def _shown(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def check_laws(
    report: Report, clutches: Iterable[Clutch], axes: Sequence[Axis], combine: Combine, place: str = ""
) -> None:
    """Record every clutch whose law is negative in its range, or zero everywhere, in some case of the study.

    ``place`` is the JSON Pointer of what varies the laws, by default that of the first axis that does.

    The torque rises with each coefficient, and a wider range only adds windups. So the worst law of a grid is the one
    with the smallest coefficients and the widest range, and only that one is checked.
    """
    for clutch in clutches:
        if clutch.fit is not None:
            continue
        varied = {
            path: (position, axis)
            for position, axis in enumerate(axes)
            for path in axis.paths
            if path.startswith(clutch.prefix)
        }
        if not varied:
            _check_law(report, clutch, clutch.values, "")
            continue
        pointer = place or f"/axes/{min(position for position, _ in varied.values())}"
        worst = {
            path: float(axis.array.max() if path.endswith("windup_limit") else axis.array.min())
            for path, (_, axis) in varied.items()
        }
        if combine == "grid":
            _check_law(report, clutch, clutch.values | worst, pointer)
        elif not _passes(clutch, clutch.values | worst):
            _check_zipped(report, clutch, {path: axis.values for path, (_, axis) in varied.items()}, pointer)


def _check_zipped(report: Report, clutch: Clutch, varied: Mapping[str, tuple[float, ...]], pointer: str) -> None:
    laws = dict.fromkeys(zip(*varied.values(), strict=True))
    if len(laws) > MAX_CLUTCH_LAWS:
        report.fault(
            pointer,
            "too-many",
            Sentence(
                "zips {laws} different clutch laws, too many to check one by one for negative torque",
                laws=len(laws),
            ),
            allowed=Sentence(
                "at most {laws} different laws, or coefficients that never make it negative",
                laws=MAX_CLUTCH_LAWS,
            ),
        )
        return
    for law in laws:
        if not _check_law(report, clutch, clutch.values | dict(zip(varied, law, strict=True)), pointer):
            return


def _law(clutch: Clutch, values: Mapping[str, float]) -> tuple[list[float], float]:
    coefficients = [values[f"{clutch.prefix}coefficients.{k}"] for k in range(len(clutch.coefficients))]
    return coefficients, values.get(f"{clutch.prefix}windup_limit", math.inf)


def _passes(clutch: Clutch, values: Mapping[str, float]) -> bool:
    try:
        models.check_law(*_law(clutch, values))
    except models.ClutchLawError:
        return False
    return True


def _check_law(report: Report, clutch: Clutch, values: Mapping[str, float], pointer: str) -> bool:
    coefficients, limit = _law(clutch, values)
    try:
        law = models.check_law(coefficients, limit)
    except models.ClutchLawError as error:
        where = pointer or join(clutch.pointer, *(error.name or "coefficients").split("."))
        report.fault(where, "no-clutch-law", error.message, coefficients, allowed=error.allowed)
        return False
    for warning in law.warnings:
        report.adopt_warning(pointer or clutch.pointer, warning)
    return True
