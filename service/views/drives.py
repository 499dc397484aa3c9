"""What the drives of a study with tolerances do: ribbons of quantiles, and the share that reaches conditions."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Final

from sprag.sentences import Name, Whole
from sprag.service.answers import tolerances as m
from sprag.service.faults import parameter_error
from sprag.service.figures.pictures import Picture, draw_map
from sprag.service.figures.read import read_map
from sprag.service.figures.ribbons import ribbon_figure, ribbon_map, yield_figure, yield_map
from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.reader import Phrase, joined, plural
from sprag.service.results.defaults import drawn_results, main_query, varying_axes
from sprag.service.results.selection import axis_name, numeric_names, numeric_results
from sprag.service.results.tolerances.batch import Asked, places_of
from sprag.service.results.tolerances.conditions import first_condition, read_conditions
from sprag.service.results.tolerances.ribbons import QUANTILES, Ribbon, ribbon
from sprag.service.results.tolerances.told import at_line, yield_sentences
from sprag.service.results.tolerances.written import ribbon_csv, ribbon_json, yield_csv, yield_json
from sprag.service.results.tolerances.yields import Yield, yields
from sprag.service.views import study_view
from sprag.service.views.branch import named
from sprag.service.views.curves import pairs
from sprag.service.views.setting import Offered
from sprag.service.views.shown import Column, Shown, ShownTable
from sprag.service.views.study_questions import RIBBON, YIELD, RibbonQuestion, YieldQuestion
from sprag.service.views.study_view import StudyAnswer, StudyView
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from sprag.sentences import Part
    from sprag.service.figures.figure import Figure
    from sprag.service.reading.reader import Reading
    from sprag.service.results.tolerances.causes import Causes
    from sprag.service.results.tolerances.yields import YieldLine
    from sprag.service.views.library import Library
    from sprag.service.views.shown import Cell
    from sprag.worker.spread import Tolerance
    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class RibbonQuery:
    """Which ribbons: results (by default those drawn first), places, probabilities of quantiles, picture as a map."""

    y: tuple[str, ...] = ()
    asked: Asked = field(default_factory=Asked)
    quantiles: tuple[float, ...] = QUANTILES
    mapped: bool = False


@dataclass(frozen=True, slots=True)
class YieldQuery:
    """Which yield: conditions, places, number of worst drives, picture as a map."""

    conditions: tuple[str, ...]
    asked: Asked = field(default_factory=Asked)
    worst: int = 10
    mapped: bool = False


def _asked(question: RibbonQuestion | YieldQuestion) -> Asked:
    return Asked(question.x, tuple(dict.fromkeys(question.by or ())), pairs(question.at))


class _OfDrives:
    """Which studies have it, and the places to choose from."""

    def has(self, study: Study) -> bool:
        """Whether drives were drawn."""
        return study.spread is not None and study.plan is None

    def offered(self, study: Study) -> dict[str, Offered]:
        """The axes, the results, and what a good drive reaches first."""
        infos = models.study_results(study)
        axes = {"": [(axis.paths[0], axis_name(study, axis.paths[0])) for axis in varying_axes(study)]}
        main, y = main_query(study, infos), drawn_results(study, infos)
        return {
            "x": Offered((main.x,) if main else (), groups=axes, left_out=main is None),
            "by": Offered(groups=axes, left_out=len(axes[""]) < 2),
            "y": Offered(y, groups=named(numeric_names(infos))),
            "quantile": Offered(tuple(f"{100.0 * p:g} %" for p in QUANTILES)),
            "condition": Offered((first_condition(study, y[0]),)),
        }


class RibbonView(_OfDrives, StudyView[RibbonQuestion, RibbonQuery, Ribbon]):
    """Quantiles of results over the drives along an axis."""

    about = RIBBON
    content = "Quantiles over the drives, as JSON, a table or a picture."
    shape = m.RibbonReport

    def choose(self, study: Study, question: RibbonQuestion) -> RibbonQuery:
        """The query; a fault for several quantiles of a map."""
        given = question.quantiles
        if question.mapped and given is not None and len(given) > 1:
            raise parameter_error("quantile", "too-many", "a map shows one quantile", given, "one")
        quantiles = tuple(given) if given else (0.5,) if question.mapped else QUANTILES
        return RibbonQuery(tuple(dict.fromkeys(question.y or ())), _asked(question), quantiles, question.mapped)

    def check(self, study: Study, chosen: RibbonQuery) -> None:
        """The results and the axes."""
        infos = models.study_results(study)
        numeric_results(infos, "y", chosen.y)
        places_of(study, infos, chosen.asked)

    def small(self, study: Study, chosen: RibbonQuery) -> bool:
        """By the cases of the study."""
        return study.cases <= study_view.FEW // 10

    def find(self, library: Library, study_id: str, chosen: RibbonQuery, *, drawn: bool = False) -> Ribbon:
        """The ribbons; SelectionError as of `ribbon`."""
        study = library.store.studies.study(study_id)
        infos = models.study_results(study)
        fetch = partial(library.store.rows.for_cases, study_id)
        return ribbon(study, infos, chosen.y or drawn_results(study, infos), chosen.asked, chosen.quantiles, fetch)

    def json(self, answer: StudyAnswer[RibbonQuery, Ribbon]) -> m.RibbonReport:
        """The ribbons as JSON data."""
        return ribbon_json(answer.study_id, answer.result)

    def shown(self, answer: StudyAnswer[RibbonQuery, Ribbon]) -> Shown:
        """What the spread of each result is owed to, and the drives at its ends."""
        found = answer.result
        tables: list[ShownTable] = []
        for one in found.lines:
            at = at_line(found.places, one.line)
            for info in found.results:
                title, spread = Name(info.name, within=bool(at)), one.spreads[info.name]
                tables += causes_tables(found.places.study, spread.causes, joined(": ", [at, title] if at else [title]))
                ends = [*spread.lowest, *reversed(spread.highest)]
                heads = (Column(Phrase("Drive")), Column(info.name, info.unit, 4))
                rows = [[end.drive, end.value] for end in ends]
                name = Phrase("Drives with the smallest and with the largest {name}", name=Name(info.name, within=True))
                tables += [ShownTable(name, heads, rows, [end.case for end in ends])] if ends else []
        notes = dict.fromkeys(
            spread.causes.note for one in found.lines for spread in one.spreads.values() if spread.causes.note
        )
        return Shown([joined("", [Whole(note)]) for note in notes], tables)

    def csv(self, answer: StudyAnswer[RibbonQuery, Ribbon], reading: Reading) -> bytes:
        """A row for each place and quantile."""
        return ribbon_csv(answer.result, reading.units)

    def figure(self, answer: StudyAnswer[RibbonQuery, Ribbon], columns: int = 2) -> Figure:
        """The quantiles over the places."""
        return ribbon_figure(answer.result)

    def picture(self, answer: StudyAnswer[RibbonQuery, Ribbon], reading: Reading, title: str, form: Picture) -> bytes:
        """The ribbons, or a map of the first quantile."""
        if not answer.chosen.mapped:
            return super().picture(answer, reading, title, form)
        return draw_map(read_map(ribbon_map(answer.result, answer.chosen.quantiles[0]), reading), title, form)


class YieldView(_OfDrives, StudyView[YieldQuestion, YieldQuery, Yield]):
    """The share of drives that reach conditions."""

    about = YIELD
    content = "Yields, as JSON, a table or a picture."
    shape = m.YieldReport

    def choose(self, study: Study, question: YieldQuestion) -> YieldQuery:
        """The query."""
        return YieldQuery(tuple(question.conditions), _asked(question), question.worst, question.mapped)

    def check(self, study: Study, chosen: YieldQuery) -> None:
        """The conditions and the axes."""
        infos = models.study_results(study)
        read_conditions(infos, chosen.conditions)
        places_of(study, infos, chosen.asked)

    def small(self, study: Study, chosen: YieldQuery) -> bool:
        """By the cases of the study."""
        return study.cases <= study_view.FEW // 10

    def find(self, library: Library, study_id: str, chosen: YieldQuery, *, drawn: bool = False) -> Yield:
        """The yields; SelectionError as of `yields`."""
        study = library.store.studies.study(study_id)
        fetch = partial(library.store.rows.for_cases, study_id)
        return yields(study, models.study_results(study), chosen.conditions, chosen.asked, chosen.worst, fetch)

    def json(self, answer: StudyAnswer[YieldQuery, Yield]) -> m.YieldReport:
        """The yields as JSON data."""
        return yield_json(answer.study_id, answer.result)

    def shown(self, answer: StudyAnswer[YieldQuery, Yield]) -> Shown:
        """The share of the drives that reach the conditions, what it is owed to, and the worst drives."""
        found = answer.result
        wanted = joined(", ", [one.text for one in found.conditions])
        said: list[str] = []
        tables: list[ShownTable] = []
        for one in found.lines:
            at = at_line(found.places, one.line)
            texts = [*yield_sentences(one, wanted), *_unfinished(one)]
            said += [joined(": ", (at, text)) if at else text for text in texts]
            tables += causes_tables(found.places.study, one.causes, joined(": ", (at, _REACHING)) if at else _REACHING)
            tables += [worst_table(found, one)] if one.worst else []
        return Shown(said, tables)

    def csv(self, answer: StudyAnswer[YieldQuery, Yield], reading: Reading) -> bytes:
        """A row for each place."""
        return yield_csv(answer.result, reading.units)

    def figure(self, answer: StudyAnswer[YieldQuery, Yield], columns: int = 2) -> Figure:
        """The yield over the places."""
        return yield_figure(answer.result)

    def picture(self, answer: StudyAnswer[YieldQuery, Yield], reading: Reading, title: str, form: Picture) -> bytes:
        """The yields over the places, or as a map."""
        if not answer.chosen.mapped:
            return super().picture(answer, reading, title, form)
        return draw_map(read_map(yield_map(answer.result), reading), title, form)


#: What a yield is about, in the title of its causes.
_REACHING: Final = Phrase("Reaching the conditions")


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


def causes_tables(study: Study, causes: Causes, title: Part) -> list[ShownTable]:
    """The shares that tolerances have of a variance, the largest first; no table where none is known."""
    names = () if study.spread is None else study.spread.names
    known = [(share, name) for name, share in zip(names, causes.shares, strict=True) if share is not None]
    rows: list[list[Cell]] = [
        [joined("", [Name(name)]), 100.0 * max(share.value, 0.0), 100.0 * share.error]
        for share, name in sorted(known, key=lambda one: one[0].value, reverse=True)
    ]
    if rows and causes.rest is not None:
        rows.append([Phrase("several together"), 100.0 * causes.rest, None])
    columns = (Column(Phrase("Tolerance")), Column(Phrase("Share"), "%", 3), Column(Phrase("±"), "%", 2))
    heading = Phrase("{of}: shares of the variance by tolerance", of=title)
    return [ShownTable(heading, columns, rows)] if rows else []


def _drawn(own: Tolerance, draws: Mapping[str, float]) -> float:
    """A draw of a drive: the deviation from nominal in per cent, or the value."""
    return 100.0 * (draws[own.name] - 1.0) if own.change == "scale" else draws[own.name]


def worst_table(found: Yield, one: YieldLine) -> ShownTable:
    """The worst drives of a line, each at the place where it is worst."""
    study, x = found.places.study, found.places.x
    spread = () if study.spread is None else study.spread.tolerances
    infos = {condition.info.name: condition.info for condition in found.conditions}
    columns = [
        Column(Phrase("Drive")), *([] if x is None else [Column(x, found.places.units[x])]),
        Column(Phrase("Margin"), "%", 3), *(Column(info.name, info.unit) for info in infos.values()),
        *(Column(own.name, "%" if own.change == "scale" else unit_of(study, own.paths[0]), 4) for own in spread),
    ]  # fmt: skip
    rows: list[list[Cell]] = [
        [
            drive.drive, *([] if x is None else [one.line.x[drive.place]]),
            Phrase("no result") if math.isinf(drive.margin) else 100.0 * drive.margin,
            *(drive.values[name] for name in infos),
            *(_drawn(own, drive.draws) for own in spread),
        ]
        for drive in one.worst
    ]  # fmt: skip
    title = Phrase("Worst drives, each where it is worst; of tolerances the deviation from nominal")
    return ShownTable(title, columns, rows, [drive.case for drive in one.worst])
