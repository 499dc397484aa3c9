"""What is said of the drives of a study with tolerances: how many reach conditions, and what spreads are owed to."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Name
from sprag_study.service.languages import decimal
from sprag_study.service.reading.reader import Phrase, joined, plural

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.results.refined import Line
    from sprag_study.service.results.tolerances.batch import Places
    from sprag_study.service.results.tolerances.causes import Causes
    from sprag_study.service.results.tolerances.yields import YieldLine
    from sprag_study.worker.study import Study


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
