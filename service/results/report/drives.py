"""The part of a report about the drives of a study with tolerances: ribbon, yield, causes, worst drives."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from sprag.service.results.defaults import drawn_results
from sprag.service.results.figures.ribbons import ribbon_figure
from sprag.service.results.selection import SelectionError
from sprag.service.results.tolerances.batch import Asked
from sprag.service.results.tolerances.ribbons import QUANTILES, ribbon
from sprag.service.results.tolerances.yields import yields
from sprag.service.results.wording import counted

if TYPE_CHECKING:
    from sprag.service.results.curves import Fetch
    from sprag.service.results.figures.figure import Figure
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
        wanted = f"{names[0]} >= 90 % of nominal"
        reached = yields(study, infos, [wanted], Asked(), _WORST, fetch)
    except SelectionError as error:
        return DrivesPart(None, (f"There are no ribbons here: {error}.",))
    sentences = [f"{counted(study.drives, 'drive')} {'was' if study.drives == 1 else 'were'} drawn."]
    for one, line in zip(drawn.lines, reached.lines, strict=True):
        at = ", ".join(f"{path} = {value:.6g}" for path, value in line.line.by.items())
        told = [*_yield(line, reached.conditions[0].text)]
        told += [text for name in names for text in _causes(study, one.spreads[name].causes, name)]
        sentences += [f"{at}: {text}" if at else text for text in told]
    return DrivesPart(ribbon_figure(drawn), tuple(sentences))


def _yield(line: YieldLine, condition: str) -> Iterator[str]:
    share = line.whole
    if not share.drives:
        yield "No drive has been run at every place yet."
        return
    value, low, high = (f"{100.0 * float(part):.1f} %" for part in (share.value, share.low, share.high))
    where = " at every place" if line.line.x else ""
    yield f"{value} of {counted(int(share.drives), 'drive')} (95 % interval {low} to {high}) have {condition}{where}."
    worst = [
        f"{one.drive} (case {one.case}, {'no result' if math.isinf(one.margin) else f'{100.0 * one.margin:.1f} %'})"
        for one in line.worst
    ]
    if worst:
        yield f"Drives with the least margin: {', '.join(worst)}."


def _causes(study: Study, causes: Causes, name: str) -> Iterator[str]:
    tolerances = () if study.spread is None else study.spread.names
    known = [(share.value, share.error, path) for path, share in zip(tolerances, causes.shares, strict=True) if share]
    told = [f"{path} {100.0 * max(value, 0.0):.1f} +- {100.0 * error:.1f} %" for value, error, path in
            sorted(known, reverse=True)]  # fmt: skip
    if told:
        yield f"Shares of the variance of {name}: {', '.join(told)}."
    if causes.note:
        yield f"{causes.note[:1].upper()}{causes.note[1:]}."
