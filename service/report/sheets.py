"""The two sheets of a document: the answer with the machine and its curves; conditions, answers and how far to trust.

What a kind of study has found stands where the answers along an axis stand for a grid: the best designs of a search,
the values of a calibration, the results of a single case.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount, Name
from sprag_study.service.figures.answers import answers_figure
from sprag_study.service.figures.front import NUMBER, front_figure, quantities
from sprag_study.service.figures.orders import motion_name, motion_text
from sprag_study.service.languages import _
from sprag_study.service.reading.part_names import upper_first
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.report.blocks import Block, Section, Table, Text
from sprag_study.service.report.conditions import conditions
from sprag_study.service.report.content import varies
from sprag_study.service.report.drawn import chosen_image, drawing_images, image, map_images
from sprag_study.service.results import refined
from sprag_study.service.results.calibration_words import doubts
from sprag_study.service.results.defaults import caption
from sprag_study.service.results.key_answers import answers_of_model
from sprag_study.service.results.refined import curve_plan
from sprag_study.service.results.regimes import left_out
from sprag_study.service.results.selection import held_text
from sprag_study.worker import models
from sprag_study.worker.spread import DRIVE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.report.blocks import Words
    from sprag_study.service.report.content import Report
    from sprag_study.service.results.curves import Curve

#: Regimes of motions that repeat, and whose disturbances die away.
_CERTIFIED: Final = ("periodic", "coasting", "held")
#: A fall between two points is told from this share of the range of a curve on.
_STEEP: Final = 0.25
#: Warnings on a sheet; the others are counted.
_WARNINGS: Final = 2


def trust(report: Report) -> Iterator[Text]:
    """A paragraph for each."""
    yield Text(joined(" ", _computed(report)), lead=_certified_lead(report))
    between = [*_between(report)]
    if between:
        yield Text(joined(" ", between), lead=_("Between the points"))
    yield _measured(report)
    for text in report.warnings[:_WARNINGS]:
        yield Text(upper_first(text), warning=True)
    more = len(report.warnings) - _WARNINGS
    if more > 0:
        yield Text(plural("{count} more warning is in the appendix on warnings.",
                          "{count} more warnings are in the appendix on warnings.", more))  # fmt: skip


def _certified_lead(report: Report) -> str:
    return _("Certified.") if report.kinds.regimes else _("Computed.")


def _computed(report: Report) -> Iterator[str]:
    regimes, cases = report.kinds.regimes, report.record.done
    if regimes:
        certified = sum(regimes.get(name, 0) for name in _CERTIFIED)
        yield plural(
            "{certified} of {count} case is the motion to which the machine settles: it repeats, and small "
            "disturbances of it die away.",
            "{certified} of {count} cases are the motion to which the machine settles: it repeats, and small "
            "disturbances of it die away.",
            cases, certified=certified,
        )  # fmt: skip
        if irregular := regimes.get("irregular", 0):
            yield plural(
                "{count} case does not repeat; its numbers are means.",
                "{count} cases do not repeat; their numbers are means.", irregular,
            )  # fmt: skip
    else:
        ended = plural("{ok} of {count} case ended properly.", "{ok} of {count} cases ended properly.", cases,
                       ok=report.record.ok)  # fmt: skip
        yield ended
        if models.has_clutches(report.study):
            yield Phrase("Each was run for a given time; whether its motion had settled by then is not certified.")
    if report.left_out:
        yield f"{upper_first(report.reading.say(left_out(report.left_out)))}."


def _between(report: Report) -> Iterator[str]:
    found, place = report.answers, report.curve
    if found is None or found.drawn is None or place is None or found.query is None:
        return
    plan = curve_plan(report.study)
    if plan is not None:
        curves = [curve.refined for curve in found.drawn.curves if curve.refined is not None]
        yield Phrase("the curves are straight lines between points that were chosen for their accuracy.")
        said = refined.sentence(plan, curves, found.drawn.selection.results[:1])
        if said:
            yield said
        return
    if report.study.plan is not None:
        return
    yield Phrase("the curves are straight lines.")
    curve = found.drawn.curves[place]
    x, values = np.asarray(curve.line.x), curve.known(found.query.y[0])
    steps = np.abs(np.diff(values))
    span = np.nanmax(values) - np.nanmin(values) if np.isfinite(values).any() else 0.0
    if steps.size and span > 0.0 and np.isfinite(steps).any() and np.nanmax(steps) > _STEEP * span:
        at = int(np.nanargmax(steps))
        low, high = sorted((float(x[at]), float(x[at + 1])))
        ends = {"low": Amount(low, found.unit, bare=True), "high": Amount(high, found.unit)}
        yield Phrase("They are steepest between {low} and {high}: read no values between points there.", **ends)


def _measured(report: Report) -> Text:
    found = report.calibrated
    if found is None or found.answer is None:
        return Text(
            _("with a measurement. Wear, heat and play in the bearings are not in the model."), lead=_("Not compared")
        )
    notes = [upper_first(report.reading.say(text)) for text in doubts(found)]
    return Text(" ".join([_("The values are those at which the model is nearest to the measured points."), *notes]),
                lead=_("Compared with the measurement."))  # fmt: skip


#: Rows of the table of answers, curves above each other, drawings, columns of results, sentences about tolerances.
_ROWS: Final = 10
_PANELS: Final = 2
_DRAWINGS: Final = 2
_RESULTS: Final = 5
_SENTENCES: Final = 4
#: Dimensions of the best design, which follow the key numbers.
_DIMENSIONS: Final = 6
#: Designs, and their columns.
_DESIGNS: Final = 6
_COLUMNS: Final = 9
#: Digits of results, and of what was typed.
DIGITS: Final = 4


def sheets(report: Report) -> Iterator[Section]:
    """The sections of both sheets."""
    texts = [*(report.question.text or []), "", "", ""]
    own = [Text(text, look="own", place=place) for place, text in enumerate(texts[:3])]
    yield Section("", tuple(_answer(report)), 1)
    yield Section("", (*islice(drawing_images(report), _DRAWINGS), own[0]), 1)
    yield Section("", (*_curves(report), own[1]), 1)
    yield from conditions(report)
    yield from (_designs if report.designs else _values if report.calibrated else _along)(report)
    yield from _tolerances(report)
    yield Section("", (own[2],), 2)
    yield Section(_("How far to trust this"), tuple(trust(report)), 2)
    lines = (_("Author, date"), _("Checked, date"))
    yield Section("", (Table(("", ""), (lines,), look="signatures"),), 2)


def _answer(report: Report) -> Iterator[Block]:
    """The answer of the study, and its key numbers with the places where they hold."""
    read, found = report.reading, report.headline
    if found.sentence:
        yield Text(found.said(read), look="answer")
    rows = tuple(
        (one.title(read), f"{one.number(read)} {one.unit_text(read)}".strip(), read.say(one.where or one.note))
        for one in (*found.numbers, *found.dimensions[:_DIMENSIONS])
    )
    if rows:
        yield Table(("", "", ""), rows, look="numbers")
    answers = report.answers
    if answers is not None and answers.drawn is not None and len(answers.curves) > 1:
        yield Text(upper_first(read.say(joined("; ", _meant(report)))))


def _meant(report: Report) -> tuple[str, ...]:
    """Which curve is meant: the values of what varies beside its axis, of a batch its nominal drive."""
    if report.answers is None or report.curve is None:
        return ()
    line = report.answers.curves[report.curve].line
    fixed = {**line.by, **line.at}
    nominal = (Phrase("nominal drive"),) if DRIVE in fixed else ()
    return (*nominal, *(held_text(report.study, path, value) for path, value in fixed.items() if path != DRIVE))


def _curves(report: Report) -> Iterator[Block]:
    """The figure of the first sheet: one that was put into the report, otherwise that of the kind of study."""
    if report.figures:
        yield chosen_image(report.figures[0])
    elif report.designs is not None:
        text = _("Every design of the search; grey ones are outside the limits")
        yield image(report, front_figure(report.designs), text)
    elif (part := report.calibration or report.drives) is not None and part.figure is not None:
        yield image(report, replace(part.figure, panels=part.figure.panels[:_PANELS]), part.caption)
    elif report.maps:
        yield from map_images(report, report.maps[:1])
    else:
        yield from _main(report)


def _main(report: Report, begin: int = 0, end: int = _PANELS) -> Iterator[Block]:
    """The curves of some of the results that are asked for, otherwise of those that the answers are about."""
    found = report.answers
    if found is None or found.drawn is None or found.query is None:
        return
    figure = answers_figure(found, 1, chosen=report.curve)
    infos = found.drawn.selection.results
    panels = {info.name: panel for info, panel in zip(infos, figure.panels, strict=False) if varies(found.drawn, info)}
    shown = [name for name in _results(report) if name in panels][begin:end]
    if shown:
        nominal = held_text(report.study, DRIVE, 0.0)  # a batch is drawn as such; these are the curves of its base
        held = tuple(text for text in figure.held if text != nominal)
        figure = replace(figure, panels=tuple(panels[name] for name in shown), held=held)
        yield image(report, figure, caption(report.study, replace(found.query, y=tuple(shown))).said(report.reading))


def _results(report: Report) -> list[str]:
    """The results that are asked for, otherwise those of the answers, then the main ones."""
    found = report.answers
    if report.question.y:
        return list(report.question.y)
    main = () if found is None or found.query is None else found.query.y
    return list(dict.fromkeys((*(one.result for one in answers_of_model(report.study)), *main)))


def _along(report: Report) -> Iterator[Section]:
    """The results along the axis of the curves, for the curve that is meant; of a single case its results."""
    found, place = report.answers, report.curve
    if found is None or place is None:
        return
    if found.drawn is None or found.query is None:
        here = found.curves[place].working_point
        own = tuple((Name(item.info.name), Amount(item.value, item.unit, DIGITS)) for item in here)
        yield Section(_("Results"), (Table(("", ""), own, (1,)),), 2)
        return
    read, curve = report.reading, found.drawn.curves[place]
    infos = models.results_by_name(report.study)
    names = [name for name in _results(report) if name in curve.y][:_RESULTS]
    units = {name: infos[name].unit for name in names}
    moves = curve.regimes is not None
    heads: list[Words] = [read.title(found.query.x, found.unit), *(read.title(name, units[name]) for name in names)]
    heads += [_("Motion repeats after")] if moves else []
    shown = _places(curve, found.point)
    rows: list[tuple[Words, ...]] = []
    for index in shown:
        cells: list[Words] = [Amount(curve.line.x[index], found.unit, DIGITS, bare=True)]
        for name in names:
            value = float(curve.known(name)[index])
            cells.append(Amount(value if np.isfinite(value) else None, units[name], DIGITS, bare=True))
        if moves:
            cells.append(_motion(curve, index))
        rows.append(tuple(cells))
    count = curve.run().size
    some = [plural("{shown} of {count} point", "{shown} of {count} points", count, shown=len(shown))]
    about = joined("; ", (*_meant(report), *(some if len(shown) < count else ())))
    title = _("Answers along the axis: {axis}", axis=read.within(found.query.x))
    meant = next((row for row, index in enumerate(shown) if curve.line.x[index] == found.point), None)
    table = Table(tuple(heads), tuple(rows), tuple(range(1 + len(names))), chosen=meant)
    yield Section(title, (*([Text(upper_first(read.say(about)))] if about else []), table), 2)
    yield Section("", tuple(_main(report, _PANELS, _PANELS + 1)), 2)


def _motion(curve: Curve, index: int) -> str:
    name = motion_name((curve.regimes or [])[index], (curve.orders or [])[index])
    return "–" if name is None else motion_text(name)


def _places(curve: Curve, point: float | None) -> list[int]:
    """The points of a curve that have a row: all of few, otherwise the ends, the working point and some between."""
    run: list[int] = curve.run().tolist()
    if len(run) <= _ROWS:
        return run
    chosen = {run[place] for place in np.linspace(0, len(run) - 1, _ROWS).round().astype(int).tolist()}
    exact = [place for place in run if curve.line.x[place] == point]
    if exact and exact[0] not in chosen:
        inner = sorted(chosen)[1:-1]
        chosen.discard(min(inner, key=lambda place: abs(place - exact[0])))
        chosen.add(exact[0])
    return sorted(chosen)


def _designs(report: Report) -> Iterator[Section]:
    """The best designs of a search."""
    found = report.designs
    if found is None:
        return
    known = {name: column for name, column in quantities(found).items() if name != NUMBER}
    names = list(known)[:_COLUMNS]
    heads = ("", *(report.reading.title(name, known[name][0]) for name in names))
    rows: tuple[tuple[Words, ...], ...] = tuple(
        (str(row), *(Amount(float(known[name][1][place]), known[name][0], DIGITS, bare=True) for name in names))
        for row, place in enumerate(report.best[:_DESIGNS], start=1)
    )
    if rows:
        table = Table(heads, rows, tuple(range(len(heads))), chosen=0)
        yield Section(_("Best designs"), (table,), 2)


def _values(report: Report) -> Iterator[Section]:
    """The values of a calibration with their intervals."""
    found = report.calibrated
    known = None if found is None else found.answer
    rows: list[tuple[Words, ...]] = []
    for index in range(0 if known is None else len(found.names)):  # type: ignore[union-attr]
        unit = found.unit(index)  # type: ignore[union-attr]
        low, high = (None, None) if known.intervals is None else known.intervals[index].tolist()  # type: ignore[union-attr]
        ends = (Amount(end, unit, DIGITS) for end in (low, high))
        rows.append((found.called(index, within=False), Amount(float(known.values[index]), unit, DIGITS), *ends))  # type: ignore[union-attr]
    if rows:
        heads = ("", _("Value"), _("95 % interval from"), _("to"))
        yield Section(_("Fitted values"), (Table(heads, tuple(rows), (1, 2, 3)),), 2)


def _tolerances(report: Report) -> Iterator[Section]:
    """What tolerances do, in a few sentences."""
    part = report.drives
    if part is None:
        return
    said = [upper_first(report.reading.say(text)) for text in part.sentences[:_SENTENCES]]
    more = len(part.sentences) - len(said)
    if more:
        said.append(plural("{count} more sentence is in the appendix on the drives.",
                           "{count} more sentences are in the appendix on the drives.", more))  # fmt: skip
    yield Section(_("What tolerances do"), tuple(map(Text, said)), 2)
