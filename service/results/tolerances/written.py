"""Ribbons and yields as answers and as CSV, and in sentences."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from sprag_study.sentences import Amount, Name
from sprag_study.service import exports
from sprag_study.service.answers import filled
from sprag_study.service.answers.results import ResultMeaning
from sprag_study.service.answers.tolerances import ExtremeDrive
from sprag_study.service.json_text import numbers
from sprag_study.service.languages import decimal
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.answers.tolerances import (
        CausesInfo,
        ConditionInfo,
        PlacesAxis,
        PlacesLine,
        ResultRibbon,
        RibbonReport,
        ToleranceInfo,
        WorstDrive,
        YieldReport,
        YieldShare,
    )
    from sprag_study.service.reading.quantities import Units
    from sprag_study.service.results.refined import Line
    from sprag_study.service.results.tolerances.batch import Places
    from sprag_study.service.results.tolerances.causes import Causes
    from sprag_study.service.results.tolerances.conditions import Condition
    from sprag_study.service.results.tolerances.quantiles import Proportion
    from sprag_study.service.results.tolerances.ribbons import Ribbon, RibbonLine
    from sprag_study.service.results.tolerances.ribbons import Spread as ResultSpread
    from sprag_study.service.results.tolerances.yields import WorstDrive as Worst
    from sprag_study.service.results.tolerances.yields import Yield, YieldLine
    from sprag_study.worker.study import Study


def tolerances_json(study: Study) -> list[ToleranceInfo]:
    """The tolerances of a study."""
    return [{"name": one.name, "change": one.change, "unit": unit_of(study, one.paths[0])} for one in study.tolerances]


def _axis(places: Places) -> PlacesAxis | None:
    return None if places.x is None else {"path": places.x, "unit": places.units[places.x]}


def _line(one: RibbonLine | YieldLine) -> PlacesLine:
    """Which places, and the drives without results there."""
    line = one.line
    return {
        "by": line.by,
        "at": line.at,
        "x": list(line.x),
        "cases": line.cases.tolist(),
        "failed": one.failed.tolist(),
        "pending": one.pending.tolist(),
    }


def ribbon_json(study_id: str, found: Ribbon) -> RibbonReport:
    """The answer with the ribbons of a study."""
    places = found.places
    return {
        "study": study_id,
        "drives": places.study.drives,
        "tolerances": tolerances_json(places.study),
        "x": _axis(places),
        "units": places.units,
        "quantiles": list(found.probabilities),
        "results": {info.name: filled(ResultMeaning, info) for info in found.results},
        "lines": [
            {
                **_line(one),
                "results": {name: _result(places.study, spread) for name, spread in one.spreads.items()},
            }
            for one in found.lines
        ],
    }


def _result(study: Study, spread: ResultSpread) -> ResultRibbon:
    parts = spread.quantiles
    return {
        "nominal": numbers(spread.nominal),
        "drives": parts.drives.tolist(),
        "values": [numbers(row) for row in parts.values],
        "low": [numbers(row) for row in parts.low],
        "high": [numbers(row) for row in parts.high],
        "causes": causes_json(study, spread.causes),
        "lowest": [filled(ExtremeDrive, one) for one in spread.lowest],
        "highest": [filled(ExtremeDrive, one) for one in spread.highest],
    }


def causes_json(study: Study, causes: Causes) -> CausesInfo:
    """The causes of a spread."""
    return {
        "shares": [
            {
                "tolerance": one.name,
                "share": None if share is None else share.value,
                "error": None if share is None else share.error,
            }
            for one, share in zip(study.tolerances, causes.shares, strict=True)
        ],
        "rest": causes.rest,
        "note": causes.note,
    }


def percent(probability: float) -> str:
    """A probability for people: ``5 %``."""
    return f"{100.0 * probability:.6g} %"


def ribbon_csv(found: Ribbon, shown: Units) -> bytes:
    """A row for each place: parameters, the nominal case and its results, quantiles with their intervals, counts."""
    units = dict(found.places.units)
    parts = []
    for one in found.lines:
        part = _place_columns(found.places, one)
        for info in found.results:
            name, spread = info.name, one.spreads[info.name]
            own = {f"{name} nominal": spread.nominal}
            part |= {f"{name} nominal": [], f"{name} drives": spread.quantiles.drives.tolist()}
            for index, probability in enumerate(found.probabilities):
                for end in ("values", "low", "high"):
                    heading = f"{name} {percent(probability)} {end}".removesuffix(" values")
                    own[heading] = getattr(spread.quantiles, end)[index]
            part |= {heading: numbers(values) for heading, values in own.items()}
            units |= dict.fromkeys(own, info.unit)
        parts.append(part)
    return exports.read_table(exports.stacked(parts), units, shown)


def _place_columns(places: Places, one: RibbonLine | YieldLine) -> dict[str, list[Any]]:
    count = one.line.cases.size
    return {
        **{path: [value] * count for path, value in {**one.line.by, **one.line.at}.items()},
        **({} if places.x is None else {places.x: list(one.line.x)}),
        "case": one.line.cases.tolist(),
        "failed": one.failed.tolist(),
        "pending": one.pending.tolist(),
    }


def yield_json(study_id: str, found: Yield) -> YieldReport:
    """The answer with the yields of a study."""
    places = found.places
    return {
        "study": study_id,
        "drives": places.study.drives,
        "tolerances": tolerances_json(places.study),
        "conditions": [condition_json(condition) for condition in found.conditions],
        "x": _axis(places),
        "units": places.units,
        "lines": [
            {
                **_line(one),
                "each": [_share(one.each, place) for place in range(one.line.cases.size)],
                "all": _share(one.whole, ()),
                "nominal": one.nominal.tolist(),
                "causes": causes_json(places.study, one.causes),
                "worst": [_worst(one, worst) for worst in one.worst],
            }
            for one in found.lines
        ],
    }


def condition_json(condition: Condition) -> ConditionInfo:
    """One condition."""
    info, limit = condition.info, condition.limit
    shown = str(info.cell(limit)) if info.kind == "category" else limit
    return {
        "text": condition.text,
        "result": info.name,
        "unit": info.unit,
        "kind": condition.kind,
        "limit": shown,
        "of_nominal": condition.of_nominal,
    }


def _share(found: Proportion, place: int | tuple[()]) -> YieldShare:
    return {
        "reached": int(found.reached[place]),
        "drives": int(found.drives[place]),
        "value": _finite(float(found.value[place])),
        "low": _finite(float(found.low[place])),
        "high": _finite(float(found.high[place])),
    }


def _worst(one: YieldLine, worst: Worst) -> WorstDrive:
    made: WorstDrive = {
        "drive": worst.drive,
        "case": worst.case,
        "margin": _finite(worst.margin),
        "results": {name: _finite(value) for name, value in worst.values.items()},
        "draws": worst.draws,
    }
    return {**made, "x": one.line.x[worst.place]} if one.line.x else made


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def yield_csv(found: Yield, shown: Units) -> bytes:
    """A row for each place with its yield; of each line a last row, without a case, for all its places together."""
    return exports.read_table(exports.stacked(_yield_columns(found)), found.places.units, shown)


def _yield_columns(found: Yield) -> Iterator[dict[str, list[Any]]]:
    """The columns of each line."""
    for one in found.lines:
        part, fixed = _place_columns(found.places, one), {**one.line.by, **one.line.at}
        part = {name: [*column, fixed.get(name)] for name, column in part.items()}
        for name in ("reached", "drives", "value", "low", "high"):
            values, whole = getattr(one.each, name), getattr(one.whole, name).item()
            part["yield" if name == "value" else name] = [*numbers(values), whole]
        yield {**part, "nominal": [*one.nominal.tolist(), bool(one.nominal.all())]}


def at_line(places: Places, line: Line) -> Phrase:
    """What tells a line from others: the values of its parameters; "" for the only one."""
    values = (
        Phrase("{name} = {value}", name=Name(path), value=Amount(value, places.units[path], 6))
        for path, value in line.by.items()
    )
    return joined(", ", values)


def yield_sentence(line: YieldLine, condition: str) -> Phrase:
    """The share of the drives that reach a condition."""
    share = line.whole
    if not share.drives:
        return Phrase("No drive has been run at every place yet.")
    value, low, high = (_percent(float(part)) for part in (share.value, share.low, share.high))
    shares: dict[str, str] = {"value": value, "low": low, "high": high, "condition": condition}
    count = int(share.drives)
    if line.line.x:
        return plural(
            "{value} of {count} drive (95 % interval {low} to {high}) has {condition} at every place.",
            "{value} of {count} drives (95 % interval {low} to {high}) have {condition} at every place.",
            count,
            **shares,
        )
    return plural(
        "{value} of {count} drive (95 % interval {low} to {high}) has {condition}.",
        "{value} of {count} drives (95 % interval {low} to {high}) have {condition}.",
        count,
        **shares,
    )


def worst_sentences(line: YieldLine) -> Iterator[str]:
    """The drives with the least margins; none where none was run."""
    worst = [
        Phrase(
            "{drive} (case {case}, {margin})",
            drive=one.drive,
            case=one.case,
            margin=Phrase("no result") if math.isinf(one.margin) else _percent(one.margin),
        )
        for one in line.worst
    ]
    if worst:
        yield Phrase("Drives with the least margin: {drives}.", drives=joined(", ", worst))


def _percent(share: float) -> str:
    return decimal(f"{100.0 * share:.1f} %").replace("-", "\N{MINUS SIGN}")


def causes_sentences(study: Study, causes: Causes, name: str) -> Iterator[str]:
    """The shares that tolerances have of the variance of a result, and what to know about them."""
    pairs = zip(study.tolerances, causes.shares, strict=True)
    known = [(share.value, share.error, one.name) for one, share in pairs if share]
    parts = [
        Phrase(
            "{name} ({share} ± {error})",
            name=Name(path, within=True),
            share=_percent(max(value, 0.0)).removesuffix(" %"),
            error=_percent(error),
        )
        for value, error, path in sorted(known, reverse=True)
    ]
    if parts:
        shares = joined("; ", parts)
        yield Phrase("Shares of the variance of {name}: {shares}.", name=Name(name, within=True), shares=shares)
    if causes.note:
        yield joined("", (causes.note, "."))
