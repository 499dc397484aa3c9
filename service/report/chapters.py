"""The appendix of a document: chapters that are added by name, each with a part of what is known of a study."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from sprag_study.sentences import Place
from sprag_study.service.exports.inputs import Input
from sprag_study.service.figures.answers import answers_figure
from sprag_study.service.figures.curves import curves_figure
from sprag_study.service.figures.drawings import drawings
from sprag_study.service.figures.svg import WIDE
from sprag_study.service.figures.svg_bars import sensitivity_svg
from sprag_study.service.languages import N_, _, gettext
from sprag_study.service.reading.catalogue import axes_json
from sprag_study.service.reading.directions import ends_in_words
from sprag_study.service.reading.part_names import lower_first, upper_first
from sprag_study.service.reading.reader import CODES, model_title, shown, term, titled
from sprag_study.service.reading.wording import number, unit_text, words
from sprag_study.service.report.blocks import Block, Section, Table, Text
from sprag_study.service.report.drawn import chosen_image, drawing_images, image, image_of, map_images
from sprag_study.service.results.defaults import caption, varying_axes
from sprag_study.service.results.fronts import goal_units
from sprag_study.service.results.key_answer_words import answer_facts, curve_name, note_of, said_title
from sprag_study.service.results.refined_maps import map_plan
from sprag_study.service.results.regimes import counted, left_out
from sprag_study.service.results.rounds import sentence
from sprag_study.service.results.shown_inputs import choice_name, in_words, run_settings
from sprag_study.service.results.varied import formula_in_words, formula_text, in_captions, tolerances_of, values_text
from sprag_study.service.views.study_questions import CHAPTERS
from sprag_study.worker import models
from sprag_study.worker.planning.calibrate.plan import CALIBRATE

if TYPE_CHECKING:
    from sprag_study.service.report.content import Report
    from sprag_study.service.results.key_answers import ReadAnswer
    from sprag_study.worker.study import Study


def facts_of(report: Report) -> tuple[tuple[str, str], ...]:
    """Names and values of a study, times on the clock of the office."""
    record, office = report.record, report.office
    ended = record.finished_at
    counts = {"cases": number(record.cases), "done": number(record.done), "ok": number(record.ok)}
    return (
        (_("study"), record.id),
        (_("model"), model_title(record.model)),
        (_("state"), f"{_(record.state.value)}: {_(record.state.sentence)}"),
        (_("cases"), _("{cases}, of which {done} are done and {ok} ended ok", **counts)),
        (_("axes"), _combined(report.study)),
        (_("submitted"), office.moment(record.created_at)),
        (_("ended"), _("not yet") if ended is None else office.moment(ended)),
        (_("version of Sprag"), version("sprag-study")),
        (_("engine"), record.engine_version),
        (_("hash of the physics"), record.physics_hash),
        (_("SHA-256 of the spec"), spec_hash(report.spec)),
    )


def spec_hash(spec: Mapping[str, Any]) -> str:
    """SHA-256 of a spec as JSON in ASCII with sorted keys and without spaces."""
    text = json.dumps(spec, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode("ascii")).hexdigest()


def _combined(study: Study) -> str:
    if study.plan is not None:
        return _("cases chosen in rounds")
    if not study.axes:
        return _("none")
    return _("every combination") if study.combine == "grid" else _("side by side")


#: How the path of a formula begins among what was given.
_DERIVED: Final = "derive."
_ORIGINS: Final = {
    "axes": N_("varies"), "given": "", "default": N_("default"), "derived": N_("derived"),
    "fitted": N_("fitted"), "tolerance": N_("varies from drive to drive"),
}  # fmt: skip


def chapters_of(report: Report) -> dict[str, str]:
    """The chapters that the study has, and their titles, in their order."""
    return {name: _(_CHAPTERS[name].title) for name in CHAPTERS if _CHAPTERS[name].has(report)}


def appendix(report: Report) -> Iterator[Section]:
    """The chapters that are asked for, without those that have nothing to say."""
    names = report.question.appendix or ()
    for name, title in chapters_of(report).items():
        if name in names or "all" in names:
            blocks = tuple(_CHAPTERS[name].write(report))
            if blocks:
                yield Section(title, blocks)


def _warnings(report: Report) -> Iterator[Block]:
    for text in report.warnings:
        yield Text(text, warning=True)


def _answers(report: Report) -> Iterator[Block]:
    rows = tuple(dict.fromkeys(_answer_rows(report)))
    if rows:
        yield Table(("", _("Value"), _("at"), _("Note")), rows, (1, 2))


def _answer_rows(report: Report) -> Iterator[tuple[str, ...]]:
    """Title, value, place and note of each answer; a row with the curve before those of each of several."""
    found, read = report.answers, report.reading
    for one in () if found is None else found.curves:
        name = curve_name(one, report.study).said(read)
        if name and len(found.curves) > 1:  # type: ignore[union-attr]
            yield (_("Curve {name}", name=name), "", "", "")
        # Answers of a model may be among the main results at the working point.
        yield from dict.fromkeys(_answer_row(report, item) for item in (*one.answers, *one.working_point))


def _answer_row(report: Report, item: ReadAnswer) -> tuple[str, str, str, str]:
    read, title, unit = report.reading, item.answer.title, "1" if report.answers is None else report.answers.unit
    title = read.say_name(title) if title == item.answer.result else said_title(title, read)
    sign = "> " if item.above and item.value is not None else ""
    value = "–" if item.value is None else sign + read.quantity(item.value, item.unit)
    place = "" if item.x is None else read.quantity(item.x, unit)
    return (title, value, place, note_of(answer_facts(item), unit).said(read))


def _axes(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = []
    for own, axis in zip(report.study.axes, axes_json(report.study), strict=True):
        least, largest = ends_in_words(axis)
        rows.append(
            (
                read.caption(" = ".join(axis["paths"])),
                values_text(report.study, own, read),
                *(number(read.value(end, axis["unit"])) for end in (least, largest)),
                unit_text(read.unit(axis["unit"])),
            )
        )
    if rows:
        yield Table((_("Parameter"), _("Values"), _("Least"), _("Largest"), _("Unit")), tuple(rows), (1, 2, 3))


def _curves(report: Report) -> Iterator[Block]:
    found = report.answers
    if found is not None and found.drawn is not None and found.query is not None:
        text = caption(report.study, found.query).said(report.reading)
        yield image(report, answers_figure(found, 2, chosen=report.curve), text)
    yield from map_images(report, report.maps)


def _clutch(report: Report) -> Iterator[Block]:
    if report.clutch is not None:
        yield replace(image(report, report.clutch, _("Law of the clutch")), wide=False)


def _sensitivity(report: Report) -> Iterator[Block]:
    for item in report.effects:
        text = _("What {result} depends on", result=report.reading.within(item.info.name))
        notes = (upper_first(report.reading.say(note)) for note in item.notes)
        yield image_of(partial(sensitivity_svg, [item], report.reading), WIDE, ". ".join((text, *notes)), text)


def _part(report: Report, *, name: str) -> Iterator[Block]:
    part = report.calibration if name == "calibration" else report.drives
    if part is not None:
        if part.figure is not None:
            yield image(report, part.figure, part.caption)
        for text in part.sentences:
            yield Text(upper_first(report.reading.say(text)))


def _endings(report: Report) -> Iterator[Block]:
    rows = [
        (shown(term(name)), number(count), gettext(models.ENDING_SENTENCES.get(name, "")))
        for name, count in report.progress.endings.items()
    ]
    if rows:
        yield Table((_("Ending"), _("Cases"), _("Meaning")), tuple(rows), (1,))
    # The flags of regimes stand with the regimes.
    flags = {name: count for name, count in report.kinds.flags.items() if name not in models.REGIME_SENTENCES}
    kinds = [
        *_kinds(report.kinds.regimes, models.REGIME_SENTENCES),
        *_kinds(flags, models.flags_of(report.study.model)),
    ]
    if kinds:
        yield Table((_("Regime or flag"), _("Cases"), _("Meaning")), tuple(kinds), (1,))


def _kinds(counts: Mapping[str, int], meanings: Mapping[str, str]) -> Iterator[tuple[str, str, str]]:
    for name, count in counts.items():
        meaning = meanings.get(name, "")
        yield titled(name), number(count), gettext(meaning) if meaning else ""


def _ranges(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = []
    for row in report.ranges:
        values = [number(read.value(value, row.info.unit), 6) for value in (row.least, row.mean, row.largest)]
        cases = ["" if case is None else number(case) for case in (row.least_case, row.largest_case)]
        unit = unit_text(read.unit(row.info.unit))
        rows.append((read.caption(row.info.name), unit, values[0], cases[0], values[1], values[2], cases[1],
                     number(row.known)))  # fmt: skip
    heads = (_("Result"), _("Unit"), _("Least"), _("in case"), _("Mean"), _("Largest"), _("in case"), _("Cases"))
    yield Table(heads, tuple(rows), (2, 3, 4, 5, 6, 7))
    if report.left_out:
        yield Text(f"{upper_first(shown(left_out(report.left_out)))}.")


def _inputs(report: Report) -> Iterator[Block]:
    read = report.reading
    rows = []
    for item in report.inputs:
        name = read.caption(item.path) if item.unit else choice_name(item)
        origin = _(_ORIGINS.get(item.origin, item.origin))
        rows.append((name, *_value(report, item), origin, item.path))
    rows += [(_("Run: {name}", name=lower_first(label)), value, "", _(_ORIGINS.get(item.origin, item.origin)),
              f"run.{item.path}") for label, value, item in run_settings(report.study, report.spec, read)]  # fmt: skip
    heads = (_("Parameter"), _("Value"), _("Unit"), _("Origin"), _("Name in specs"))
    coded = read.names == CODES  # the names of files are for who has asked for them
    yield Table(heads if coded else heads[:-1], tuple(row if coded else row[:-1] for row in rows), (1,))


def _value(report: Report, item: Input) -> tuple[str, str]:
    """The value of an input and its unit, that of one that varies in a word, a formula with names of quantities."""
    if item.origin == "derived":
        return formula_text(item, report.reading), ""  # a formula has its units
    value, unit = report.reading.number_and_unit(in_words(item), item.unit)
    return (_("varies") if item.origin == "axes" else value), unit


def _given(report: Report) -> Iterator[Block]:
    rows = [
        (_place(report, path), _text(report, path, text))
        for path, text in report.given.items()
        if not path.startswith("tolerances.")
    ]
    for paths, said in tolerances_of(report.study):
        rows.append((_("Tolerance: {name}", name=lower_first(_tied(report, paths))), report.reading.say(said)))
    if rows:
        yield Table((_("Field"), _("As given")), tuple(rows))


def _tied(report: Report, paths: tuple[str, ...]) -> str:
    return report.reading.caption(" = ".join(paths))


def _place(report: Report, path: str) -> str:
    if path.startswith(_DERIVED):
        return report.reading.caption(path.removeprefix(_DERIVED))
    pointer = f"/{path.replace('.', '/')}"
    return report.reading.place(Place(pointer, path.removeprefix("base.") if report.reading.names == CODES else ""))


def _listed(text: str) -> str:
    """A list as it is typed, its items in their order; one that was shortened stays as it is."""
    try:
        items = json.loads(text)
    except ValueError:
        return text
    rows = (item if isinstance(item, list) else [item] for item in items)
    return "; ".join(", ".join(one if isinstance(one, str) else number(one, 12) for one in row) for row in rows)


def _text(report: Report, path: str, text: str) -> str:
    """What was given: a choice in words, a formula with names of quantities."""
    if path.startswith(_DERIVED):
        return formula_in_words(text, report.reading)
    if text.startswith("["):
        text = _listed(text)
    choice = re.fullmatch("[a-z]+(_[a-z]+)*", text)
    return gettext(words(text)) if choice else in_captions(text, report.names, report.reading)


def _further(report: Report) -> Iterator[Block]:
    pictures, note = report.further
    if note:
        yield Text(note)
    for curves in pictures:
        names = ", ".join(report.reading.caption(info.name) for info in curves.selection.results)
        across = lower_first(report.reading.caption(curves.selection.x))
        found = image(report, curves_figure([("", curves)], 2), _("Further results against {x}", x=across))
        yield replace(found, alt=_("{names} against {x}", names=names, x=across))
    if pictures:
        yield Text(_("A result that has the same value everywhere on these curves is in the table of ranges only."))


def _facts(report: Report) -> Iterator[Block]:
    facts = [*facts_of(report)]
    if report.kinds.regimes:
        facts.append((_("motions"), shown(counted(report.kinds.regimes))))
    origins = "; ".join(origin.sentence for origin in report.library.store.rows.origins(report.study_id))
    facts.append((_("computed by"), origins or _("no host yet")))
    if report.progress.rounds is not None:
        said = report.reading.say(sentence(report.progress.rounds, report.record.state, goal_units(report.study)))
        facts.append((_("rounds"), said))
    yield Table(("", ""), tuple(facts))


def _varies(report: Report) -> bool:
    return bool(varying_axes(report.study))


def _drawn(report: Report) -> bool:
    """Whether the cases lie on curves or maps."""
    plain = report.study.plan is None or report.answers is not None or map_plan(report.study) is not None
    return _varies(report) and plain


class _Chapter(NamedTuple):
    """A chapter: its title, what it has, and whether a study has it."""

    title: str
    write: Callable[[Report], Iterator[Block]]
    has: Callable[[Report], object] = lambda _report: True


#: The further figures stand by themselves: they are chosen one by one.
_CHAPTERS: Final = {
    "warnings": _Chapter(N_("Warnings"), _warnings, lambda report: report.warnings),
    "answers": _Chapter(N_("Answers"), _answers, lambda report: report.answers is not None),
    "axes": _Chapter(N_("What varies"), _axes, _varies),
    "curves": _Chapter(N_("Curves"), _curves, _drawn),
    "drawings": _Chapter(N_("Drawings"), drawing_images, lambda report: len(drawings(report.study)) > 1),
    "clutch": _Chapter(N_("Clutch"), _clutch, lambda report: models.has_clutches(report.study)),
    "sensitivity": _Chapter(N_("Sensitivity"), _sensitivity, lambda report: report.compares),
    "calibration": _Chapter(
        N_("Calibration"), partial(_part, name="calibration"), lambda report: report.study.kind == CALIBRATE
    ),
    "drives": _Chapter(N_("Drives"), partial(_part, name="drives"), lambda report: report.study.batched),
    "endings": _Chapter(N_("How the cases ended"), _endings),
    "ranges": _Chapter(N_("Ranges of the results"), _ranges),
    "inputs": _Chapter(N_("Inputs"), _inputs),
    "given": _Chapter(N_("Machine and run as given"), _given),
    "versions": _Chapter(N_("Study and versions"), _facts),
    "results": _Chapter(N_("Curves of further results"), _further, _drawn),
}


def further_figures(report: Report) -> Section | None:
    """The figures that were put into the report after the first one, with the texts of the author before them."""
    blocks: list[Block] = []
    texts = report.question.text or []
    for place, chosen in enumerate(report.figures[1:], start=3):
        blocks.append(Text(texts[place] if place < len(texts) else "", look="own", place=place))
        blocks.append(chosen_image(chosen))
    return Section(_("Figures"), tuple(blocks)) if blocks else None
