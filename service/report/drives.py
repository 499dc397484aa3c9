"""The part of a report about the drives of a study with tolerances: ribbon, yield, causes, worst drives."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag.sentences import Amount, Name
from sprag.service.faults import SelectionError
from sprag.service.figures.ribbons import ribbon_figure
from sprag.service.languages import decimal
from sprag.service.reading.reader import Phrase, joined, plural
from sprag.service.results.defaults import drawn_results
from sprag.service.results.tolerances.batch import Asked
from sprag.service.results.tolerances.conditions import first_condition
from sprag.service.results.tolerances.ribbons import QUANTILES, ribbon
from sprag.service.results.tolerances.yields import yields

if TYPE_CHECKING:
    from sprag.service.figures.figure import Figure
    from sprag.service.results.curves import Fetch
    from sprag.service.results.tolerances.causes import Causes
    from sprag.service.results.tolerances.yields import YieldLine
    from sprag.worker.models import ResultInfo
    from sprag.worker.study import Study

#: Drives in the list of the worst ones.
_WORST: Final = 5


@dataclass(frozen=True, slots=True)
class DrivesPart:
    """The figure of the ribbons, None where there is none, and sentences."""

    figure: Figure | None
    sentences: tuple[str, ...]


def drives_part(study: Study, infos: Sequence[ResultInfo], fetch: Fetch) -> DrivesPart | None:
    """The part about the drives; None for a study without tolerances, or one that chooses its own cases."""
    if study.spread is None or study.plan is not None:
        return None
    names = drawn_results(study, infos)
    try:
        drawn = ribbon(study, infos, names, Asked(), QUANTILES, fetch)
        wanted = first_condition(study, names[0])
        reached = yields(study, infos, [wanted], Asked(), _WORST, fetch)
    except SelectionError as error:
        return DrivesPart(None, (Phrase("There are no ribbons here: {why}.", why=str(error)),))
    sentences: list[str] = [plural("{count} drive was drawn.", "{count} drives were drawn.", study.drives)]
    for one, line in zip(drawn.lines, reached.lines, strict=True):
        at = joined(
            ", ",
            (
                Phrase("{name} = {value}", name=Name(path), value=Amount(value, drawn.places.units[path], 6))
                for path, value in line.line.by.items()
            ),
        )
        parts = [*_yield(line, reached.conditions[0].text)]
        parts += [text for name in names for text in _causes(study, one.spreads[name].causes, name)]
        sentences += [joined(": ", (at, text)) if at else text for text in parts]
    return DrivesPart(ribbon_figure(drawn), tuple(sentences))


def _yield(line: YieldLine, condition: str) -> Iterator[str]:
    share = line.whole
    if not share.drives:
        yield Phrase("No drive has been run at every place yet.")
        return
    value, low, high = (_percent(float(part)) for part in (share.value, share.low, share.high))
    shares: dict[str, str] = {"value": value, "low": low, "high": high, "condition": condition}
    count = int(share.drives)
    if line.line.x:
        yield plural(
            "{value} of {count} drive (95 % interval {low} to {high}) has {condition} at every place.",
            "{value} of {count} drives (95 % interval {low} to {high}) have {condition} at every place.",
            count,
            **shares,
        )
    else:
        yield plural(
            "{value} of {count} drive (95 % interval {low} to {high}) has {condition}.",
            "{value} of {count} drives (95 % interval {low} to {high}) have {condition}.",
            count,
            **shares,
        )
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
    return decimal(f"{100.0 * share:.1f} %")


def _causes(study: Study, causes: Causes, name: str) -> Iterator[str]:
    tolerances = () if study.spread is None else study.spread.names
    known = [(share.value, share.error, path) for path, share in zip(tolerances, causes.shares, strict=True) if share]
    parts = [
        joined(" ", (Name(path, within=True), f"{_percent(max(value, 0.0)).removesuffix(' %')} ± {_percent(error)}"))
        for value, error, path in sorted(known, reverse=True)
    ]
    if parts:
        shares = joined(", ", parts)
        yield Phrase("Shares of the variance of {name}: {shares}.", name=Name(name, within=True), shares=shares)
    if causes.note:
        yield joined("", (causes.note, "."))
