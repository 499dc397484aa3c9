"""A clutch fit requested as JSON data, and its report, shared by the HTTP interface and the commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag.service.answers import filled
from sprag.service.answers.studies import ClutchFitReport, FitDegree
from sprag.service.faults import warned
from sprag.service.spec.described import FIT
from sprag.service.spec.fields import read_number, read_object
from sprag.service.spec.machine.clutch import read_clutch
from sprag.service.spec.report import Report
from sprag.worker import models
from sprag.worker.models.parameters import placed

if TYPE_CHECKING:
    from sprag.worker.models import ClutchFit

#: Fields of a request for a fit.
REQUEST_FIELDS: Final = ("data", "accuracy", *FIT, "backlash")


def fit_json(fit: ClutchFit) -> ClutchFitReport:
    """The whole report of ``fit``, SI units; an infinite condition number is null."""
    degrees = [filled(FitDegree, report) for report in fit.degrees_tried]
    return filled(ClutchFitReport, fit, degrees_tried=degrees, **warned(fit.warnings))


def read_fit(data: object) -> ClutchFit:
    """Compute the fit that JSON data with rows, accuracy and options request; raises SpecError."""
    report = Report(data)
    found = dict(read_object(report, "", data, REQUEST_FIELDS) or {})
    backlash = read_number(report, "/backlash", found.pop("backlash", 0.0), _backlash())
    if backlash and found.get("angles_include_backlash") is not True:
        report.fault(
            "/backlash", "not-used", "is subtracted from the angles only where they include it", backlash,
            allowed="with `angles_include_backlash` true; else 0 or left out", unit="rad",
        )  # fmt: skip
    clutch = None
    if not report.faults:
        # Without rows this would be read as a law without coefficients.
        clutch = read_clutch(report, "", {"data": None, **found}, "clutch.", [backlash or 0.0])
    report.raise_if_any()
    assert clutch is not None
    assert clutch.fit is not None
    return clutch.fit


def _backlash() -> models.Parameter:
    entry = next(e for e in models.parameter_catalogue(models.model_names()[0]) if e.path.endswith(".backlash"))
    return placed(entry, "backlash")
