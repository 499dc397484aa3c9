"""Least-squares clutch characteristic from measured torque over angle (docs/theory.md).

The polynomial is solved from the scaled matrix of powers by QR and SVD; the normal equations (7) are never formed. The
eigenvalues and condition number of their matrix, which the source's program reports, follow from singular values.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sprag_study.engine.vibration_drive.clutch_data import HIGHEST_DEGREE, Rows, check_options, measured_rows
from sprag_study.engine.vibration_drive.clutch_law import check_law, find_dip, stiffness, stored_energy, torque
from sprag_study.engine.vibration_drive.clutch_report import (
    ClutchError,
    ClutchFit,
    ClutchFitError,
    ClutchLaw,
    ClutchLawError,
    DegreeReport,
)
from sprag_study.engine.vibration_drive.singular_values import singular_values
from sprag_study.sentences import Amount, Part, Sentence, WarningText, joined

__all__ = [
    "HIGHEST_DEGREE",
    "ClutchError",
    "ClutchFit",
    "ClutchFitError",
    "ClutchLaw",
    "ClutchLawError",
    "DegreeReport",
    "check_law",
    "fit_clutch",
    "stiffness",
    "stored_energy",
    "torque",
]

_EPS = float(np.finfo(np.float64).eps)
#: Terms of a law that exceed their sum by this factor follow the scatter of the data, not the clutch.
_MAX_CANCELLATION = 30.0


def fit_clutch(
    data: ArrayLike,
    accuracy: float,
    *,
    max_degree: int = 7,
    through_origin: bool = True,
    angles_include_backlash: bool = False,
    backlash: float = 0.0,
) -> ClutchFit:
    """Fit the polynomial of lowest degree whose residuals all stay within ``accuracy``.

    Parameters
    ----------
    data : array_like, shape (m, 2)
        Rows of angle (rad, 0 .. 1000) and torque (N*m), in any order; angles may repeat.
    accuracy : float
        Largest |residual| that is accepted, N*m, > 0.
    max_degree : int
        Highest degree to try, 1 .. 11. Degrees with more unknowns than different windups are not tried.
    through_origin : bool
        True: c_1 = 0, no torque at zero windup, degrees from 1. False: the source's full polynomial, degrees from 0.
    angles_include_backlash : bool
        True: the angles count from the start of contact, and ``backlash`` (rad) is subtracted to get windups. Rows
        within the backlash are left out of the fit; they must show no torque (beyond ``accuracy``). A row at zero
        windup stays. False: the angles are windups, and ``backlash`` is not used.

    Returns
    -------
    ClutchFit

    Raises
    ------
    ClutchFitError
        For wrong input, for an accuracy that no degree reaches (with every degree's residuals), and for a law that is
        negative somewhere between zero and the largest measured windup.
    """
    check_options(accuracy, max_degree, through_origin, angles_include_backlash, backlash)
    offset = float(backlash) if angles_include_backlash else 0.0
    rows = measured_rows(data, offset, accuracy, through_origin)
    first_power = 1 if through_origin else 0
    highest = min(max_degree, rows.distinct - 1 + first_power)
    reports: list[DegreeReport] = []
    for degree in range(first_power, highest + 1):
        law, report = _fit_degree(rows, np.arange(first_power, degree + 1))
        reports.append(report)
        if report.max_residual <= accuracy and report.rank == degree + 1 - first_power:
            return _accepted(rows, law, tuple(reports), accuracy, first_power)
    reached, tried, advice = _not_reached(rows, tuple(reports), accuracy, max_degree, first_power)
    raise ClutchFitError(
        Sentence("{reached}; largest residuals: {tried}. {advice}", reached=reached, tried=tried, advice=advice),
        name="accuracy",
        value=accuracy,
        degrees=tuple(reports),
        summary=joined(". ", (reached, advice)),
    )


@dataclass(frozen=True, slots=True)
class _Solution:
    """Least-squares solution over some powers.

    ``triangle`` is the QR factor of the scaled matrix of powers, whose columns had the lengths ``norms``; ``values``
    and ``right`` are its singular values and right vectors, ``scaled`` the solution in its columns.
    """

    values: NDArray[np.float64]
    right: NDArray[np.float64]
    triangle: NDArray[np.float64]
    scaled: NDArray[np.float64]
    norms: NDArray[np.float64]
    rank: int


def _solve(rows: Rows, powers: NDArray[np.int64]) -> _Solution:
    """QR of the columns (u/u_end)^k at unit length, SVD of the triangle, singular values at rounding level cut off."""
    columns = (rows.windup[rows.fitted, None] / rows.limit) ** powers
    norms = np.asarray(np.linalg.norm(columns, axis=0), dtype=np.float64)
    q, triangle = np.linalg.qr(columns / norms)
    left, values, right = np.linalg.svd(triangle)
    rank = int(np.count_nonzero(values > max(columns.shape) * _EPS * values[0]))
    projected = left.T @ (q.T @ rows.torque[rows.fitted])
    scaled = right[:rank].T @ (projected[:rank] / values[:rank])
    return _Solution(values, right, triangle, scaled, norms, rank)


def _law(solution: _Solution, powers: NDArray[np.int64], limit: float) -> NDArray[np.float64]:
    """Coefficients c_1 .. c_(highest power + 1) in rad, zeros at powers that were left out."""
    law = np.zeros(int(powers[-1]) + 1)
    law[powers] = solution.scaled / solution.norms / limit**powers
    return law


def _fit_degree(rows: Rows, powers: NDArray[np.int64]) -> tuple[NDArray[np.float64], DegreeReport]:
    solution = _solve(rows, powers)
    law = _law(solution, powers, rows.limit)
    residuals = rows.residuals(law)
    # Singular values of the unscaled matrix of powers; their squares are the eigenvalues of (7)'s matrix.
    sigma = singular_values(solution.triangle * (solution.norms * rows.limit**powers))
    report = DegreeReport(
        degree=int(powers[-1]),
        rms=_rms(residuals),
        max_residual=float(np.abs(residuals).max()),
        rank=solution.rank,
        condition_number=float((sigma[0] / sigma[-1]) ** 2) if sigma[-1] > 0.0 else math.inf,
        eigenvalues=tuple(float(value) for value in sigma**2),
    )
    return law, report


def _without_rounding_terms(rows: Rows, law: NDArray[np.float64], powers: NDArray[np.int64]) -> NDArray[np.float64]:
    """The law refitted without the lower terms that are zero to within the rounding of their own solution.

    Otherwise exact data would leave a c_1 of 1e-16 N*m, with which the clutch could lock (state LOCKED), or a slope of
    -1e-13 N*m/rad at zero, which would make the law negative. The highest term always stays.
    """
    solution = _solve(rows, powers)
    sensitivity = np.linalg.norm(solution.right.T / solution.values, axis=1)
    size = np.linalg.norm(rows.torque[rows.fitted]) + np.linalg.norm(solution.scaled)
    kept = np.abs(solution.scaled) > 8.0 * _EPS * size * sensitivity
    kept[-1] = True
    if kept.all():
        return law
    return _law(_solve(rows, powers[kept]), powers[kept], rows.limit)


def _accepted(
    rows: Rows, law: NDArray[np.float64], reports: tuple[DegreeReport, ...], accuracy: float, first_power: int
) -> ClutchFit:
    """The fit of the last degree tried, unless its law is negative in the measured range."""
    last = reports[-1]
    simpler = _without_rounding_terms(rows, law, np.arange(first_power, last.degree + 1))
    if np.abs(rows.residuals(simpler)).max() <= accuracy:
        law = simpler
    coefficients = tuple(float(value) for value in law)
    dip = find_dip(coefficients, rows.limit)
    if dip is not None:
        raise ClutchFitError(
            Sentence(
                "the fitted law of degree {degree} is negative {place} (for instance {torque} at {windup}) and would "
                "pull the shaft back. Measure more rows there, {origin}choose another accuracy (a lower or higher "
                "degree then serves), or check the backlash and the signs of the torques",
                degree=last.degree,
                place=dip.place,
                torque=Amount(dip.value, "N*m", 6),
                windup=Amount(dip.at, "rad", 6),
                origin="" if first_power else Sentence("fit through the origin, "),
            ),
            name="data",
            value=list(coefficients),
            degrees=reports,
        )
    try:
        checked = check_law(coefficients, rows.limit)
    except ClutchLawError as error:
        message = Sentence("the fitted law cannot be used: {fault}", fault=error.placed)
        raise ClutchFitError(message, name="data", degrees=reports) from error
    residuals = rows.residuals(law)
    backlash_rows = tuple(int(row) for row in np.flatnonzero(~rows.fitted))
    return ClutchFit(
        coefficients=coefficients,
        windup_limit=rows.limit,
        degree=last.degree,
        accuracy=float(accuracy),
        degrees_tried=reports,
        residuals=tuple(float(value) for value in residuals),
        rms=_rms(residuals),
        max_residual=float(np.abs(residuals).max()),
        rank=last.rank,
        condition_number=last.condition_number,
        eigenvalues=last.eigenvalues,
        rows_in_backlash=backlash_rows,
        monotone=checked.monotone,
        negative=False,
        warnings=_data_warnings(rows, law, last, backlash_rows) + checked.warnings,
    )


def _data_warnings(
    rows: Rows, law: NDArray[np.float64], report: DegreeReport, backlash_rows: tuple[int, ...]
) -> tuple[WarningText, ...]:
    warnings = []
    if backlash_rows:
        text = Sentence(
            "{count} of {rows} rows lie within the backlash and were left out of the fit; their residuals compare them "
            "with no torque",
            count=len(backlash_rows),
            rows=rows.windup.size,
        )
        warnings.append(WarningText(text, "rows-in-backlash"))
    if report.rank == rows.distinct:
        text = Sentence(
            "degree {degree} has as many unknowns as the data has different windups, so the small residuals prove "
            "nothing; measure more rows",
            degree=report.degree,
        )
        warnings.append(WarningText(text, "too-few-rows"))
    terms = float(np.abs(law * rows.limit ** np.arange(law.size)).sum())
    cancellation = terms / float(np.abs(rows.torque[rows.fitted]).max())
    if cancellation > _MAX_CANCELLATION:
        text = Sentence(
            "the terms of the law of degree {degree} are together {factor} times as large as the largest torque and "
            "all but cancel (condition number {condition}), so they follow the scatter of the rows; check the backlash "
            "and the units, or allow a larger residual",
            degree=report.degree,
            factor=Amount(cancellation, digits=3, form=".0f"),
            condition=Amount(report.condition_number, digits=2),
        )
        warnings.append(WarningText(text, "terms-cancel"))
    return tuple(warnings)


def _not_reached(
    rows: Rows, reports: tuple[DegreeReport, ...], accuracy: float, max_degree: int, first_power: int
) -> tuple[Sentence, Sentence, Sentence]:
    """For data that no tried degree fits well enough: the missed accuracy, the residuals, and advice."""
    tried = joined(", ", (_residual(report, report.degree + 1 - first_power) for report in reports))
    best = min(reports, key=lambda report: report.max_residual)
    law, _ = _fit_degree(rows, np.arange(first_power, best.degree + 1))
    row = int(np.argmax(np.abs(rows.residuals(law))))
    reached = Sentence(
        "the accuracy of {accuracy} is not reached up to degree {degree}",
        accuracy=Amount(float(accuracy), "N*m", 6),
        degree=reports[-1].degree,
    )
    out_of_rows = reports[-1].degree == rows.distinct - 1 + first_power
    more = Sentence("")
    if first_power and rows.windup[row] == 0.0:
        more = Sentence(", or fit without through_origin, since this row shows torque at zero windup")
    elif max_degree < HIGHEST_DEGREE and not out_of_rows:
        more = Sentence(", or raise max_degree (up to {highest})", highest=HIGHEST_DEGREE)
    advice = Sentence(
        "The best, degree {degree}, is farthest off at the row with windup {windup} and torque {torque}. Check that "
        "row, or allow a larger residual{more}.",
        degree=best.degree,
        windup=Amount(float(rows.windup[row]), "rad", 6),
        torque=Amount(float(rows.torque[row]), "N*m", 6),
        more=more,
    )
    if out_of_rows:
        rest = Sentence(
            "Higher degrees have more unknowns than the data has different windups ({windups}); measure more.",
            windups=rows.distinct,
        )
        advice = joined(" ", (rest, advice))
    return reached, tried, advice


def _residual(report: DegreeReport, unknowns: int) -> Sentence:
    """The largest residual of a degree, and whether its unknowns are determined."""
    parts: dict[str, Part] = {"residual": Amount(report.max_residual, "N*m", 4), "degree": report.degree}
    if report.rank == unknowns:
        return Sentence("{residual} at degree {degree}", **parts)
    return Sentence("{residual} at degree {degree} (not determined by these angles)", **parts)


def _rms(residuals: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(residuals**2)))
