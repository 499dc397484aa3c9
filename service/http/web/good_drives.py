"""What a good drive reaches, as rows of fields: a result, a relation, and a value or per cent of the nominal drive."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import zip_longest
from typing import TYPE_CHECKING, Final

from sprag_study.service.languages import N_
from sprag_study.service.reading.units import has_unit
from sprag_study.service.results.tolerances.conditions import split_condition
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Sequence

    from starlette.datastructures import QueryParams

    from sprag_study.service.reading.reader import Reading
    from sprag_study.worker.study import Study

#: The fields of a row: result, relation, value, and what the value is.
_FIELDS: Final = ("of", "is", "value", "part")
#: The relations, and what people read of them.
RELATIONS: Final = ((">=", N_("at least")), ("<=", N_("at most")), ("=", N_("equal to")))
#: What a value is.
PARTS: Final = (("nominal", N_("% of the nominal drive")), ("", N_("a number or with its unit")))


@dataclass(frozen=True, slots=True)
class ConditionRow:
    """The fields of a condition; ``part`` is one of `PARTS`."""

    of: str = ""
    relation: str = ">="
    value: str = ""
    part: str = "nominal"


def conditionable(study: Study) -> list[str]:
    """The results that conditions can be about; half widths of intervals are no results of drives."""
    names = [info.name for info in models.study_results(study)]
    return [name for name in names if name not in set(map(models.half_width, names))]


def condition_rows(texts: Sequence[str], study: Study) -> tuple[list[ConditionRow], list[str]]:
    """The rows of conditions with an empty one behind them, and the texts that are no conditions."""
    units = {info.name: info.unit for info in models.study_results(study)}
    rows, others = [], []
    for text in filter(str.strip, "\n".join(texts).splitlines()):
        parts = split_condition(text)
        if parts is None or parts[0] not in units:
            others.append(text)
            continue
        name, sign, value, of_nominal = parts
        if not of_nominal and value[-1].isdigit() and not has_unit(value) and units[name] != "1":
            value = f"{value} {units[name]}"
        rows.append(ConditionRow(name, sign, value, "nominal" if of_nominal else ""))
    return [*rows, ConditionRow()], others


def has_rows(given: QueryParams) -> bool:
    """Whether an address comes from a form with rows of conditions."""
    return any(text.strip() for text in given.getlist("of"))


def condition_texts(given: QueryParams, study: Study, reading: Reading) -> list[str]:
    """The conditions of the rows of a form. Bare numbers are in the shown units."""
    infos = models.results_by_name(study)
    found = []
    for name, relation, typed, part in zip_longest(*map(given.getlist, _FIELDS), fillvalue=""):
        if not name.strip() or not typed.strip():
            continue
        info = infos.get(name)
        if info is None or info.kind == "category":
            limit = typed.strip()
        else:
            share = f"{typed.strip().removesuffix('%').rstrip()} % of nominal"
            limit = share if part else reading.typed(typed.strip(), info.unit)
        found.append(f"{name} {relation} {limit}")
    return found


def without_rows(given: QueryParams, texts: Sequence[str]) -> list[tuple[str, str]]:
    """The address with these conditions in the place of the rows of its form."""
    return [*(pair for pair in given.multi_items() if pair[0] not in _FIELDS), *(("condition", text) for text in texts)]
