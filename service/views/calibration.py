"""What a calibration has found."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.answers.calibration import CalibrationReport
from sprag.service.figures.calibration import calibration_figure
from sprag.service.results.calibration import Calibration, calibration_csv, calibration_json, plan_of
from sprag.service.views.study_questions import CALIBRATION, CalibrationQuestion
from sprag.service.views.study_view import Found, StudyView

if TYPE_CHECKING:
    from sprag.service.figures.figure import Figure
    from sprag.service.reading.reader import Reading
    from sprag.service.views.library import Library
    from sprag.worker.study import Study


class CalibrationView(StudyView[CalibrationQuestion, None, Calibration]):
    """Values with intervals, correlations, residuals, the next point to measure."""

    about = CALIBRATION
    content = "The calibration, as JSON, a table of the measured values or a picture."
    answer = CalibrationReport

    def choose(self, study: Study, question: CalibrationQuestion) -> None:
        """Nothing; FaultError where the study is no calibration."""
        plan_of(study)

    def find(self, library: Library, study_id: str, chosen: None, *, drawn: bool = False) -> Calibration:
        """The calibration."""
        return library.calibrations.of(study_id)

    def json(self, found: Found[None, Calibration]) -> CalibrationReport:
        """The calibration as JSON data."""
        return calibration_json(found.study_id, found.made)

    def csv(self, found: Found[None, Calibration], reading: Reading) -> bytes:
        """The measured points beside the fit."""
        return calibration_csv(found.made)

    def figure(self, found: Found[None, Calibration], columns: int = 2) -> Figure:
        """The measured points on the fitted curves, and the residuals."""
        return calibration_figure(found.made, columns)


def calibration_report(library: Library, study_id: str) -> CalibrationReport:
    """The calibration as JSON data whose sentences are phrases, for a page."""
    return calibration_json(study_id, library.calibrations.of(study_id))
