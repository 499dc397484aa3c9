"""A batch of drives as people read it: its spread and its yield, what they are owed to, and the worst drives."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name, Whole
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.results.tolerances.batch import deviations
from sprag_study.service.results.tolerances.written import at_line, percent, yield_sentence
from sprag_study.service.results.tolerances.yields import WANTED
from sprag_study.service.views.shown import Column, Shown, ShownTable

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from sprag_study.service.results.tolerances.causes import Causes
    from sprag_study.service.results.tolerances.ribbons import Ribbon, RibbonLine, Spread
    from sprag_study.service.results.tolerances.yields import WorstDrive, Yield, YieldLine
    from sprag_study.service.views.shown import Cell
    from sprag_study.worker.models import ResultInfo
    from sprag_study.worker.spread import Tolerance
    from sprag_study.worker.study import Study

#: Drives in the short list of the worst ones.
_WORST: Final = 5


def batch_shown(found: Ribbon, reached: Yield | None) -> Shown:
    """What is read beside the figure of a batch; ``reached`` is None where its conditions cannot be asked.

    What the spread is owed to and the worst drives are open where there is one line of places.
    """
    places = found.places
    said: list[str] = []
    opened: list[ShownTable] = []
    folded: list[ShownTable] = []
    lines = [None] * len(found.lines) if reached is None else reached.lines
    for one, good in zip(found.lines, lines, strict=True):
        at = at_line(places, one.line)
        first, *others = found.results
        causes = _causes_table(places.study, one.spreads[first.name].causes, _of(at, _spread_of(first)), good)
        further = [_causes_table(places.study, one.spreads[info.name].causes, _of(at, _spread_of(info)))
                   for info in others]  # fmt: skip
        # No drive has a mean over the places where each lacks a result at one.
        ended = [info for info in found.results if one.spreads[info.name].lowest]
        numbers = [_numbers_table(found, one, good, at), *(_ends_table(info, one.spreads[info.name], at)
                                                         for info in ended)]  # fmt: skip
        worst: list[ShownTable] = []
        if reached is not None and good is not None:
            wanted = joined(", ", [condition.text for condition in reached.conditions])
            texts = [yield_sentence(good, wanted), *_unfinished(good)]
            said += [joined(": ", (at, text)) if at else text for text in texts]
            further.append(_causes_table(places.study, good.causes, _of(at, _REACHING)))
            if good.worst:
                worst.append(_worst_table(reached, good, one.spreads[first.name].causes))
                numbers.append(_draws_table(reached, good))
        opened += [*([causes] if causes else []), *worst]
        folded += [*numbers, *filter(None, further)]
    notes = (spread.causes.why for one in found.lines for spread in one.spreads.values())
    said += [joined("", [Whole(note)]) for note in dict.fromkeys(filter(None, notes))]
    return Shown(said, folded, opened) if len(found.lines) == 1 else Shown(said, [*opened, *folded])


#: What a yield is about, in the title of its causes.
_REACHING: Final = Phrase("What decides whether a drive is good")


def _spread_of(info: ResultInfo) -> Phrase:
    return Phrase("Where the spread of {name} comes from", name=Name(info.name, within=True))


def _of(at: Phrase, title: Phrase) -> Phrase:
    return joined(": ", (at, title)) if at else title


def _unfinished(one: YieldLine) -> Iterator[str]:
    """Drives that are not run yet, or have no result."""
    if pending := int(one.pending.max()):
        yield plural("Up to {count} drive is not run yet.", "Up to {count} drives are not run yet.", pending)
    if failed := int(one.failed.max()):
        yield plural(
            "Up to {count} drive has no result at a place, and counts as not good.",
            "Up to {count} drives have no result at a place, and count as not good.",
            failed,
        )


def _causes_table(study: Study, causes: Causes, title: Phrase, good: YieldLine | None = None) -> ShownTable | None:
    """The shares that tolerances have of a variance, the largest first; None where none is known.

    With a yield that is neither all nor none, also that of the drives that are nearest to nominal in each tolerance,
    and how near they have to be for the wanted one.
    """
    tolerances = study.tolerances
    columns = [Column(Phrase("Tolerance")), Column(Phrase("Share"), "%", 3), Column(Phrase("±"), "%", 2)]
    further: list[list[Cell]] = [[] for _ in tolerances]
    if good is not None and 0.0 < float(good.whole.value) < 1.0:
        columns.append(Column(Phrase("Yield of the half nearest to nominal"), "%", 3))
        further = [[100.0 * value] for value in good.nearest.value.tolist()]
        if good.whole.value < WANTED:
            columns.append(Column(Phrase("{share} % are good within", share=Amount(100.0 * WANTED, "1", bare=True))))
            for cells, own, size in zip(further, tolerances, good.within.tolist(), strict=True):
                cells.append(
                    Phrase("not by it alone") if math.isnan(size) else joined("", ("±", _size(study, own, size)))
                )
    every = zip(tolerances, causes.shares, further, strict=True)
    known = [(share, own.name, cells) for own, share, cells in every if share is not None]
    rows: list[list[Cell]] = [
        [joined("", [Name(name)]), 100.0 * max(share.value, 0.0), 100.0 * share.error, *cells]
        for share, name, cells in sorted(known, key=lambda item: item[0].value, reverse=True)
    ]
    if rows and causes.rest is not None:
        rows.append([Phrase("Several together"), 100.0 * causes.rest, *[None, None, ""][: len(columns) - 2]])
    return ShownTable(title, columns, rows) if rows else None


def _numbers_table(found: Ribbon, one: RibbonLine, good: YieldLine | None, at: Phrase) -> ShownTable:
    """The numbers of the figure: at each place the quantiles of each result, the nominal drive, and the yield."""
    places = found.places
    columns: list[Column] = []
    cells: list[list[Cell]] = []
    if places.x is not None:
        columns.append(Column(places.x, places.units[places.x]))
        cells.append(list(one.line.x))
    for info in found.results:
        spread = one.spreads[info.name]
        titles = [*(percent(probability) for probability in found.probabilities), Phrase("nominal")]
        for title, values in zip(titles, [*spread.quantiles.values, spread.nominal], strict=True):
            heading = joined(", ", (Name(info.name), title))
            columns.append(Column(heading, info.unit, 4))
            cells.append([None if math.isnan(value) else value for value in values.tolist()])
    if good is not None:
        columns.append(Column(Phrase("Yield"), "%", 3))
        cells.append([None if math.isnan(value) else 100.0 * value for value in good.each.value.tolist()])
    return ShownTable(_of(at, Phrase("Quantiles over the drives")), columns, list(zip(*cells, strict=True)))


def _ends_table(info: ResultInfo, spread: Spread, at: Phrase) -> ShownTable:
    """The drives at the ends of a result, its mean over the places."""
    ends = [*spread.lowest, *reversed(spread.highest)]
    title = Phrase("Drives with the smallest and with the largest {name}", name=Name(info.name, within=True))
    columns = (Column(Phrase("Drive")), Column(info.name, info.unit, 4))
    return ShownTable(_of(at, title), columns, [[end.drive, end.value] for end in ends], [end.case for end in ends])


def _worst_columns(found: Yield, x: str | None) -> list[Column]:
    infos = {condition.info.name: condition.info for condition in found.conditions}
    place = [] if x is None else [Column(x, found.places.units[x])]
    return [Column(Phrase("Drive")), *place, *(Column(info.name, info.unit, 4) for info in infos.values())]


def _worst_cells(one: YieldLine, drive: WorstDrive, x: str | None) -> list[Cell]:
    values = (None if math.isnan(value) else value for value in drive.values.values())
    return [drive.drive, *([] if x is None else [one.line.x[drive.place]]), *values]


def _worst_table(found: Yield, one: YieldLine, causes: Causes) -> ShownTable:
    """The worst drives of a line, each at the place where it is worst, with a tolerance that is far from nominal.

    That is the one to which its part of the spread is owed; without a result, or where ``causes`` are not known, the
    one in which the fewest drives are farther from nominal.
    """
    study, x = found.places.study, found.places.x
    tolerances = study.tolerances
    apart = deviations(study)
    size = np.abs(apart)
    shares = np.array([0.0 if share is None else max(share.value, 0.0) for share in causes.shares])
    owed = shares * size**2 / np.maximum((apart**2).mean(axis=0), np.finfo(np.float64).tiny)
    rows: list[list[Cell]] = []
    for drive in one.worst[:_WORST]:
        own = drive.drive - 1
        known = None not in causes.shares and not math.isinf(drive.margin)
        at = int((owed[own] if known else (size < size[own]).sum(axis=0)).argmax())
        rows.append([*_worst_cells(one, drive, x), _change(study, tolerances[at], float(apart[own, at]))])
    columns = [*_worst_columns(found, x), Column(Phrase("Far from nominal"))]
    cases = [drive.case for drive in one.worst[:_WORST]]
    title = _of(at_line(found.places, one.line), Phrase("Drives with the least margin"))
    return ShownTable(title, columns, rows, cases)


def _change(study: Study, tolerance: Tolerance, apart: float) -> Phrase:
    """How far a drive is from nominal in a tolerance."""
    size = _size(study, tolerance, abs(apart))
    if apart < 0.0:
        return Phrase("{name}: {amount} less", name=Name(tolerance.name), amount=size)
    return Phrase("{name}: {amount} more", name=Name(tolerance.name), amount=size)


def _size(study: Study, tolerance: Tolerance, size: float) -> Amount:
    """The size of a deviation from nominal: a share of the value, or SI."""
    return (
        Amount(100.0 * size, "%", 3)
        if tolerance.change == "scale"
        else Amount(size, unit_of(study, tolerance.paths[0]), 3)
    )


def _drawn(own: Tolerance, draws: Mapping[str, float]) -> float:
    """A draw of a drive: the deviation from nominal in per cent, or the value."""
    return 100.0 * (draws[own.name] - 1.0) if own.change == "scale" else draws[own.name]


def _draws_table(found: Yield, one: YieldLine) -> ShownTable:
    """The worst drives of a line with their margins and draws."""
    study, x = found.places.study, found.places.x
    spread = study.tolerances
    columns = [
        *_worst_columns(found, x), Column(Phrase("Margin"), "%", 3),
        *(Column(own.name, "%" if own.change == "scale" else unit_of(study, own.paths[0]), 3) for own in spread),
    ]  # fmt: skip
    rows: list[list[Cell]] = [
        [
            *_worst_cells(one, drive, x), None if math.isinf(drive.margin) else 100.0 * drive.margin,
            *(_drawn(own, drive.draws) for own in spread),
        ]
        for drive in one.worst
    ]  # fmt: skip
    title = Phrase("Worst drives, each where it is worst; of tolerances the deviation from nominal")
    return ShownTable(_of(at_line(found.places, one.line), title), columns, rows, [drive.case for drive in one.worst])
