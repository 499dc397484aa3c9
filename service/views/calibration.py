"""What a calibration has found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.answers.calibration import CalibrationReport
from sprag.service.figures.calibration import calibration_figure
from sprag.service.results.calibration import Calibration, calibration_csv, calibration_json, plan_of
from sprag.service.views.study_questions import CALIBRATION, CalibrationQuestion
from sprag.service.views.study_view import StudyAnswer, StudyView

if TYPE_CHECKING:
    from sprag.service.figures.figure import Figure
    from sprag.service.reading.reader import Reading
    from sprag.service.views.library import Library
    from sprag.worker.study import Study


class CalibrationView(StudyView[CalibrationQuestion, None, Calibration]):
    """Values with intervals, correlations, residuals, the next point to measure."""

    about = CALIBRATION
    content = "The calibration, as JSON, a table of the measured values or a picture."
    shape = CalibrationReport

    def choose(self, study: Study, question: CalibrationQuestion) -> None:
        """Nothing; FaultError where the study is no calibration."""
        plan_of(study)

    def find(self, library: Library, study_id: str, chosen: None, *, drawn: bool = False) -> Calibration:
        """The calibration."""
        return library.calibrations.of(study_id)

    def json(self, answer: StudyAnswer[None, Calibration]) -> CalibrationReport:
        """The calibration as JSON data."""
        return calibration_json(answer.study_id, answer.result)

    def csv(self, answer: StudyAnswer[None, Calibration], reading: Reading) -> bytes:
        """The measured points beside the fit."""
        return calibration_csv(answer.result, reading.units)

    def figure(self, answer: StudyAnswer[None, Calibration], columns: int = 2) -> Figure:
        """The measured points on the fitted curves, and the residuals."""
        return calibration_figure(answer.result, columns)


def calibration_report(library: Library, study_id: str) -> CalibrationReport:
    """The calibration as JSON data whose sentences are phrases, for a page."""
    return calibration_json(study_id, library.calibrations.of(study_id))
