"""``sprag fit``: the clutch polynomial of measured data, with its report (docs/theory.md)."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer

from sprag_study.service.cli.common import names_service, wants_json
from sprag_study.service.cli.console import (
    WrongInputError,
    cell_text,
    say,
    show_table,
    table_words,
    warning_lines,
    write_json,
    write_text,
    wrong_option,
)
from sprag_study.service.cli.files import MAX_DATA_BYTES, decode, read_bytes
from sprag_study.service.cli.remote import connection
from sprag_study.service.faults import Fault, warned
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.numbers import parse_number
from sprag_study.service.reading.texts import shorten

if TYPE_CHECKING:
    from sprag_study.service.answers.studies import ClutchFitReport, FitDegree
    from sprag_study.service.spec.measured import MeasuredData
    from sprag_study.worker.models import DegreeReport

_DEGREE_COLUMNS = (
    (N_("degree"), True),
    (N_("RMS [N*m]"), True),
    (N_("largest residual [N*m]"), True),
    (N_("rank"), True),
    (N_("condition number"), True),
)
_ROW_COLUMNS = (
    (N_("line"), True),
    (N_("angle [rad]"), True),
    (N_("torque [N*m]"), True),
    (N_("residual [N*m]"), True),
)


def fit(
    data: Annotated[
        str, typer.Argument(metavar="DATA.csv", help="Measured rows of angle and torque; - reads standard input.")
    ],
    accuracy: Annotated[
        str, typer.Option(metavar="TORQUE", help='Largest residual allowed, in N*m or with a unit ("50 N*mm").')
    ],
    max_degree: Annotated[int, typer.Option(metavar="N", help="Highest degree of the polynomial to try.")] = 7,
    full: Annotated[bool, typer.Option("--full", help="Full polynomial: torque at zero windup allowed.")] = False,
    angles_include_backlash: Annotated[
        bool,
        typer.Option("--angles-include-backlash", help="The measured angles include the backlash."),
    ] = False,
    backlash: Annotated[
        str, typer.Option(metavar="ANGLE", help='Backlash in the angles, in rad or with a unit ("0.3 deg").')
    ] = "0",
) -> None:
    """Fit the clutch polynomial of lowest degree that reaches the accuracy, and report on it.

    Reads a text file of two columns, angle and torque, with or without a header that names the units. With --server
    that service fits it.
    """
    lost_motion = _quantity("--backlash", backlash, "rad")
    if lost_motion and not angles_include_backlash:
        message = N_("is taken off the angles only with --angles-include-backlash")
        raise wrong_option("--backlash", "not-used", message, backlash)
    measured = _measured(data)
    fitted = _asked if names_service() else _fitted
    made, warnings = fitted(
        measured,
        accuracy=_quantity("--accuracy", accuracy, "N*m"),
        backlash=lost_motion,
        max_degree=max_degree,
        through_origin=not full,
        angles_include_backlash=angles_include_backlash,
    )
    warnings = (*measured.warnings, *warnings)
    if wants_json():
        write_json({**made, **warned(warnings)})
    else:
        _report(measured, made)
        say(*warning_lines(warnings))


def _quantity(option: str, text: str, unit: str) -> float:
    """The SI number of an option: a plain number in ``unit`` or a text with its own unit."""
    from sprag_study.service.reading.units import QuantityError, parse_quantity

    number = parse_number(text)
    try:
        return parse_quantity(text if number is None else number, unit)
    except QuantityError as error:
        raise wrong_option(option, error.code, error.message, text, unit=unit) from error


def _measured(path: str) -> MeasuredData:
    from sprag_study.service.spec.measured import MeasuredDataError, parse_measured

    try:
        return parse_measured(decode(path, read_bytes(path, MAX_DATA_BYTES)))
    except MeasuredDataError as error:
        raise WrongInputError("invalid-data", _("{file}: no measured clutch data", file=path), error.faults) from error


def _asked(measured: MeasuredData, **options: Any) -> tuple[ClutchFitReport, Sequence[str]]:
    """The fit by the service that is named, and its warnings."""
    with connection() as client:
        made = client.fit_clutch(measured.rows.tolist(), **options)
    return made, made["warnings"]


def _fitted(measured: MeasuredData, *, accuracy: float, **options: Any) -> tuple[ClutchFitReport, Sequence[str]]:
    """The fit by this program, and its warnings."""
    from sprag_study.service.results.fits import fit_json
    from sprag_study.worker.models import ClutchFitError, fit_clutch

    try:
        made = fit_clutch(measured.rows, accuracy, **options)
        return fit_json(made), made.warnings
    except ClutchFitError as error:
        if error.degrees:
            raise WrongInputError("invalid-data", error.summary, _tried(error.degrees, accuracy)) from error
        where = _place(error.name, measured)
        problem = Fault(where, "no-clutch-law", error.message, shorten(error.value), allowed=error.allowed)
        raise WrongInputError("invalid-data", _("no law can be fitted"), [problem]) from error


def _place(name: str, measured: MeasuredData) -> str:
    """The user's name of the field: a line of the file, or an option."""
    row = re.match(r"data\.(\d+)", name)
    if row is not None:
        return _("line {number}", number=measured.lines[int(row[1])])
    return name if name in ("", "data") else "--" + name.replace("_", "-")


def _tried(degrees: Iterable[DegreeReport], accuracy: float) -> list[Fault]:
    """Best residual of each degree that was tried, as faults."""
    return [
        Fault(
            _("degree {degree}", degree=report.degree),
            "out-of-range",
            N_("largest residual in N*m"),
            float(f"{report.max_residual:.6g}"),
            allowed=f"<= {accuracy:g}",
        )
        for report in degrees
    ]


def law_text(coefficients: Sequence[float]) -> str:
    """The law as a formula: ``T(u) = 200 u + 20000 u^3`` (N*m, u in rad)."""
    powers = ["", " u", *(f" u^{power}" for power in range(2, len(coefficients)))]
    terms = [(c, power) for c, power in zip(coefficients, powers, strict=False) if c != 0]
    if not terms:
        return "T(u) = 0"
    text = f"{terms[0][0]:.6g}{terms[0][1]}"
    for coefficient, power in terms[1:]:
        text += f" {'-' if coefficient < 0 else '+'} {abs(coefficient):.6g}{power}"
    return f"T(u) = {text}"


def _report(measured: MeasuredData, made: ClutchFitReport) -> None:
    with table_words():
        fields = ("degree", "rms", "max_residual", "rank")
        degrees = [(*(dict(tried)[field] for field in fields), _condition(tried)) for tried in made["degrees_tried"]]
        show_table(_("Degrees tried"), [(_(head), numeric) for head, numeric in _DEGREE_COLUMNS], degrees)
        rows = zip(measured.lines, measured.rows.tolist(), made["residuals"], strict=True)
        columns = [(_(head), numeric) for head, numeric in _ROW_COLUMNS]
        cells = [(line, angle, torque, residual) for line, (angle, torque), residual in rows]
        show_table(_("Residuals"), columns, cells)
    law = law_text(made["coefficients"])
    spec = f'"clutch": {{"coefficients": {made["coefficients"]!r}, "windup_limit": {made["windup_limit"]!r}}}'
    numbers = {
        "degree": made["degree"],
        "rms": cell_text(made["rms"]),
        "residual": cell_text(made["max_residual"]),
        "kind": _("monotone") if made["monotone"] else _("not monotone"),
    }
    eigenvalues = "; ".join(map(cell_text, made["eigenvalues"]))
    lines = (
        law + "   " + _("(N*m, windup u in rad, measured to u = {end} rad)", end=cell_text(made["windup_limit"])),
        _("degree {degree}, RMS {rms} N*m, largest residual {residual} N*m, {kind}", **numbers),
        _(
            "normal matrix: condition number {condition}, eigenvalues {eigenvalues}",
            condition=cell_text(_condition(made)),
            eigenvalues=eigenvalues,
        ),
        _("for a spec: {text}", text=spec),
    )
    write_text("".join(f"{line}\n" for line in lines))


def _condition(made: ClutchFitReport | FitDegree) -> float:
    """The condition number, which is null in JSON where it is infinite."""
    number = made["condition_number"]
    return math.inf if number is None else number
