"""What a calibration has found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Name
from sprag_study.service.answers.calibration import CalibrationReport
from sprag_study.service.figures.calibration import calibration_figure
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.calibration import Calibration, plan_of
from sprag_study.service.results.calibration_answers import calibration_csv, calibration_json
from sprag_study.service.results.calibration_words import doubts, sentences
from sprag_study.service.views.relatives import asked_by
from sprag_study.service.views.shown import Column, Shown, ShownTable
from sprag_study.service.views.study_questions import CALIBRATION, CalibrationQuestion
from sprag_study.service.views.study_view import StudyAnswer, StudyView

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag_study.service.answers.calibration import Prior
    from sprag_study.service.figures.figure import Figure
    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.views.library import Library
    from sprag_study.service.views.shown import Cell
    from sprag_study.worker.study import Study


CalibrationAnswer = StudyAnswer[None, Calibration]


class CalibrationView(StudyView[CalibrationQuestion, None, Calibration]):
    """Values with intervals, correlations, residuals, the next point to measure."""

    about = CALIBRATION
    content = "The calibration, as JSON, a table of the measured values or a picture."
    shape = CalibrationReport

    def choose(self, study: Study, question: CalibrationQuestion) -> None:
        """Nothing; FaultError where the study is no calibration."""
        plan_of(study)

    def find(self, library: Library, study_id: str, chosen: None) -> Calibration:
        """The calibration."""
        return library.calibrations.of(study_id)

    def json(self, answer: CalibrationAnswer) -> CalibrationReport:
        """The calibration as JSON data."""
        return calibration_json(answer.study_id, answer.result)

    def csv(self, answer: CalibrationAnswer, reading: Reading) -> bytes:
        """The measured points beside the fit."""
        return calibration_csv(answer.result, reading.units)

    def figure(self, answer: CalibrationAnswer, columns: int = 2) -> Figure:
        """The measured points on the fitted curves, and the residuals."""
        return calibration_figure(answer.result, columns)

    def has(self, study: Study) -> bool:
        """Whether it is a calibration."""
        return asked_by(study) == "measured"

    def shown(self, answer: CalibrationAnswer) -> Shown:
        """What else should be known before the values are used; values, correlations, measured points."""
        found = answer.result
        report = calibration_json(answer.study_id, found)
        tables = [_values(found, report), *_correlations(found, report), *_points(found, report)]
        return Shown(sentences(found)[len(doubts(found)) :], tables)


def _ends(interval: Sequence[float] | None, unit: str) -> Cell:
    """An interval of a table; None for none."""
    return None if interval is None else joined(" … ", [Amount(end, unit, 5, bare=True) for end in interval])


def _prior(prior: Prior | None, unit: str) -> Cell:
    """A prior of a table; None for none."""
    if prior is None:
        return None
    values = {name: Amount(value, unit, 5) for name, value in (("mean", prior["mean"]), ("sigma", prior["sigma"]))}
    return Phrase("{mean}, standard deviation {sigma}", **values)


def _values(found: Calibration, report: CalibrationReport) -> ShownTable:
    rows: list[list[Cell]] = []
    priors = any(one["prior"] for one in report["parameters"])
    for place, one in enumerate(report["parameters"]):
        own = (
            joined(" = ", map(Name, one["paths"])) if one["paths"] else joined("", [found.called(place, within=False)])
        )
        cells = (one["value"], one["interval"], one["deviation"], [one["low"], one["high"]])
        unit = one["unit"]
        rows.append(
            [
                own,
                *(
                    _ends(cell, unit)
                    if isinstance(cell, list)
                    else cell
                    if cell is None
                    else joined("", [Amount(cell, unit)])
                    for cell in cells
                ),
            ]
        )
        if priors:
            rows[-1].append(_prior(one["prior"], unit))
    titles = [N_("Parameter"), N_("Value"), N_("95 % interval"), N_("Standard deviation"), N_("Range")]
    titles += [N_("Known before")] if priors else []
    return ShownTable(Phrase("Values"), [Column(Phrase(title)) for title in titles], rows)


def _correlations(found: Calibration, report: CalibrationReport) -> Iterator[ShownTable]:
    names = [one["name"] for one in report["parameters"]]
    if report["correlations"] and len(names) > 1:
        called = [joined("", [found.called(place, within=False)]) for place in range(len(names))]
        rows = [[name, *row] for name, row in zip(called, report["correlations"], strict=True)]
        heads = [name if not found.sensor(place) else called[place] for place, name in enumerate(names)]
        yield ShownTable(Phrase("Correlations"), [Column(Phrase("Parameter")), *map(Column, heads)], rows)


def _points(found: Calibration, report: CalibrationReport) -> Iterator[ShownTable]:
    """The measured values of each result beside the fit."""
    units = {path: unit_of(found.study, path) for path in found.plan.paths_at}
    for name, info in found.infos.items():
        own = [point for point in report["points"] if point["result"] == name]
        rows: list[list[Cell]] = [
            [
                *point["at"].values(),
                point["measured"],
                point["sigma"],
                point["fitted"],
                _ends(point["interval"], info.unit),
                point["residual"],
            ]
            for point in own
        ]
        columns = [
            *(Column(path, unit) for path, unit in units.items()), Column(Phrase("Measured"), info.unit),
            Column(Phrase("Sigma"), info.unit), Column(Phrase("Fitted"), info.unit),
            Column(Phrase("95 % interval"), info.unit), Column(Phrase("Residual")),
        ]  # fmt: skip
        yield ShownTable(Phrase("Measured values, {name}", name=Name(name, within=True)), columns, rows)
