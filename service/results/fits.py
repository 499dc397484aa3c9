"""A clutch fit requested as JSON data, and its report, shared by the HTTP interface and the commands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from sprag_study.service.answers import filled
from sprag_study.service.answers.studies import ClutchFitReport, FitDegree
from sprag_study.service.faults import warned
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.machine.clutch import MEASURED, read_measured
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.worker import models
from sprag_study.worker.models.parameters import placed

if TYPE_CHECKING:
    from sprag_study.worker.models import ClutchFit

#: A request for a fit.
REQUEST: Final = Record(
    {
        **MEASURED.fields,
        "backlash": {**QUANTITY, "description": "backlash to be taken off the angles (rad)", "default": 0},
    },
    "Measured data of a clutch and how well it is to be fitted; numbers in SI or texts with a unit.",
    required=MEASURED.required,
)


def fit_json(fit: ClutchFit) -> ClutchFitReport:
    """The whole report of ``fit``, SI units; an infinite condition number is null."""
    degrees = [filled(FitDegree, report) for report in fit.degrees_tried]
    return filled(ClutchFitReport, fit, degrees_tried=degrees, **warned(fit.warnings))


def read_fit(data: object) -> ClutchFit:
    """Compute the fit that JSON data with rows, accuracy and options request; raises SpecError."""
    report = Report(data)
    request = Node(report, "", data)
    REQUEST.read(request)
    backlash = request["backlash"].otherwise(0.0).number(_backlash())
    if backlash and request["angles_include_backlash"].value is not True:
        request["backlash"].refuse(
            "not-used", "is subtracted from the angles only where they include it", backlash,
            allowed="with `angles_include_backlash` true; else 0 or left out", unit="rad",
        )  # fmt: skip
    clutch = None if report.faults else read_measured(request, "clutch.", [backlash or 0.0])
    report.raise_if_any()
    assert clutch is not None
    assert clutch.fit is not None
    return clutch.fit


def _backlash() -> models.Parameter:
    entry = next(e for e in models.parameter_catalogue(models.model_names()[0]) if e.path.endswith(".backlash"))
    return placed(entry, "backlash")
