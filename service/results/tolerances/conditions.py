"""Conditions on results that a drive reaches or not: ``shaft.speed.mean >= 90 % of nominal``."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from sprag_study.sentences import Amount, Name, Sentence, joined, plural
from sprag_study.service.faults import refused
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import result_of
from sprag_study.service.reading.limits import at_most
from sprag_study.service.reading.numbers import in_language
from sprag_study.service.reading.reader import Phrase, term
from sprag_study.service.reading.units import QuantityError, plain_signs, split_quantity, to_float, typed_value
from sprag_study.service.results.selection import listed, numeric_results, of_name, refuse_mixed_texts
from sprag_study.worker import models
from sprag_study.worker.models.usable import against

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.study import Study

#: What a condition may look like.
EXAMPLES: Final = N_("for instance shaft.speed.mean >= 7 rad/s, torque.max <= 110 % of nominal or regime = periodic")
#: Most conditions of a yield.
MOST: Final = 16

_FORM: Final = re.compile(r"\s*([A-Za-z][\w.]*)\s*(>=|<=|=|≥|≤)\s*(.+?)\s*")
_SIGNS: Final = {">=": "at_least", "≥": "at_least", "<=": "at_most", "≤": "at_most", "=": "is"}
_SHOWN: Final = {"at_least": "≥", "at_most": "≤", "is": "="}
_PART: Final = re.compile(r"(.+?)\s*%\s*(?:of\s+(?:the\s+)?)?nominal")

Kind = Literal["at_least", "at_most", "is"]


def first_condition(study: Study, result: str) -> str:
    """The condition on a result with which a page begins: a tenth worse than the nominal drive at most."""
    small = models.presentation_of(study).is_best_small(result)
    return f"{result} <= 110 % of nominal" if small else f"{result} >= 90 % of nominal"


@dataclass(frozen=True, slots=True)
class Condition:
    """A condition on one result.

    Attributes
    ----------
    info : the result
    limit : SI, the code of a category, or a part of the nominal drive's value
    of_nominal : whether ``limit`` is such a part
    text : the condition for people
    """

    info: ResultInfo
    kind: Kind
    limit: float
    of_nominal: bool
    text: Phrase

    def margins(self, values: Floats, nominal: Floats, widths: Floats | None = None) -> Floats:
        """How far results are within the limit, relative to it: negative outside, -inf without a result.

        ``values`` has the shape (places, drives), ``nominal`` (places,). Equalities have 0 and -1. ``widths`` are half
        widths of means of irregular motion, which count against the limit; NaN for none.
        """
        limit = np.broadcast_to(self.limit * nominal if self.of_nominal else np.float64(self.limit), nominal.shape)
        bound = limit[:, None]
        values = against(self.kind, bound, values, widths)
        if self.kind == "is":
            found = np.where(values == bound, 0.0, -1.0)
        else:
            scale = np.where(bound == 0.0, 1.0, np.abs(bound))
            found = (values - bound if self.kind == "at_least" else bound - values) / scale
        return np.where(np.isfinite(values) & np.isfinite(bound), found, -np.inf)


def split_condition(text: str) -> tuple[str, str, str, bool] | None:
    """Result, sign and value of a condition as they are typed, and whether the value is per cent of the nominal one."""
    parts = _FORM.fullmatch(plain_signs(text))
    if parts is None:
        return None
    name, sign, value = parts.groups()
    share = _PART.fullmatch(value)
    sign = {"≥": ">=", "≤": "<="}.get(sign, sign)
    return (name, sign, value, False) if share is None else (name, sign, share[1], True)


def read_conditions(infos: Sequence[ResultInfo], texts: Sequence[str]) -> tuple[Condition, ...]:
    """The conditions of these texts; raises SelectionError about the parameter ``condition``."""
    texts = tuple(dict.fromkeys(texts))
    if not texts:
        raise refused("condition", "required", "is required", allowed=EXAMPLES)
    if len(texts) > MOST:
        message = plural("{count} condition is given", "{count} conditions are given", len(texts))
        raise refused("condition", "too-many", message, allowed=at_most(MOST))
    pairs = [(parts[1], parts[3]) for text in texts if (parts := _FORM.fullmatch(plain_signs(text)))]
    units = {
        info.name: info.unit for info in infos if info.kind == "real" and any(name == info.name for name, _ in pairs)
    }
    refuse_mixed_texts("condition", pairs, units)
    return tuple(_read(infos, text) for text in texts)


def _read(infos: Sequence[ResultInfo], text: str) -> Condition:
    parts = _FORM.fullmatch(plain_signs(text))
    if parts is None:
        raise refused(
            "condition",
            "invalid-text",
            "is not a condition",
            text,
            allowed=joined(", ", ("RESULT >= VALUE", Sentence(EXAMPLES))),
        )
    name, sign, value = parts.groups()
    kind: Kind = _SIGNS[sign]  # type: ignore[assignment]
    info = result_of(infos, name)
    if info is not None and info.kind == "category":
        return _category(info, kind, value, text)
    (info,) = numeric_results(infos, "condition", (name,))
    if kind == "is" and info.kind != "count":
        message = Sentence("{name} is a real number, which equals no value exactly", name=name)
        raise refused("condition", "invalid-choice", message, text, allowed=">= and <=")
    value = in_language(value)
    given = _PART.fullmatch(value)
    try:
        if given is not None:
            part = to_float(split_quantity(given[1])[0]) / 100.0
            share = Amount(100.0 * part, "1", bare=True)
            shown = Phrase("{name} {sign} {share} % of nominal", name=_name(info), sign=_SHOWN[kind], share=share)
            return Condition(info, kind, part, True, shown)
        limit = typed_value(value, info.unit)
    except QuantityError as error:
        raise refused("condition", error.code, of_name(name, error.message), text, unit=info.unit) from error
    amount = Amount(limit, info.unit, 6)
    shown = Phrase("{name} {sign} {limit}", name=_name(info), sign=_SHOWN[kind], limit=amount)
    return Condition(info, kind, limit, False, shown)


def _category(info: ResultInfo, kind: Kind, value: str, text: str) -> Condition:
    if kind != "is" or value not in info.categories:
        allowed = Sentence("{name} = one of {names}", name=info.name, names=listed(info.categories))
        raise refused("condition", "invalid-choice", "is not a category of this result", text, allowed=allowed)
    shown = Phrase("{name} = {value}", name=_name(info), value=term(value))
    return Condition(info, kind, float(info.categories.index(value)), False, shown)


def _name(info: ResultInfo) -> Name:
    return Name(info.name, within=True)
