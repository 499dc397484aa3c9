"""Results and errors of the checks and the fit of a clutch law."""

import reprlib
from dataclasses import dataclass

from sprag_study.sentences import Sentence, WarningText, joined


class ClutchError(ValueError):
    """Refused clutch input.

    Attributes
    ----------
    message : str
        The sentence, without name, value and range.
    name : str
        Dotted path of the field inside the clutch's own fields: ``accuracy``, ``coefficients.2``, ``data.4.0`` (row 4,
        angle), ``data.4.1`` (row 4, torque). Rows and coefficients are counted from 0, as in paths of a spec.
    value : object
        What was given.
    allowed : str or None
        The allowed range with its unit, where the field has one.
    """

    def __init__(self, message: str, *, name: str = "", value: object = None, allowed: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.name = name
        self.value = value
        self.allowed = allowed

    @property
    def placed(self) -> str:
        """The sentence with name, value and range."""
        head = joined(": ", (self.name, self.message)) if self.name else self.message
        if self.allowed is None:
            return head
        value = reprlib.repr(self.value)
        return Sentence("{fault} (got {value}; allowed: {allowed})", fault=head, value=value, allowed=self.allowed)

    def __str__(self) -> str:
        return str(self.placed)


class ClutchLawError(ClutchError):
    """Coefficients that are not a clutch law: invalid numbers, zero everywhere, or negative within the range."""


@dataclass(frozen=True, slots=True)
class ClutchLaw:
    """A law that was checked.

    ``coefficients`` are c_1 first, N*m/rad^(k-1); ``windup_limit`` in rad, infinite where the law has no end.
    ``monotone`` states that the torque never falls within the range; ``warnings`` are sentences about what is allowed
    but notable.
    """

    coefficients: tuple[float, ...]
    windup_limit: float
    monotone: bool
    warnings: tuple[WarningText, ...]


@dataclass(frozen=True, slots=True)
class DegreeReport:
    """How well the polynomial of one degree fits.

    ``rms`` and ``max_residual`` (N*m) are taken over all rows of the data. ``rank`` is the numerical rank of the
    scaled matrix of powers; below the number of unknowns the data do not determine this degree. ``eigenvalues``
    (largest first) and ``condition_number`` (infinite for a singular matrix) belong to the unscaled normal matrix
    A_ik = sum_j u_j^(i+k-2) of (7), over the fitted rows, angles in rad, with i, k = 1..degree+1, or 2..degree+1 where
    c_1 = 0 is imposed.
    """

    degree: int
    rms: float
    max_residual: float
    rank: int
    condition_number: float
    eigenvalues: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ClutchFit:
    """The law fitted to measured data, with its report.

    Attributes
    ----------
    coefficients : tuple of degree + 1 floats
        c_1 first, N*m/rad^(k-1); c_1 = 0 where the law was fitted through the origin.
    windup_limit : float
        Largest measured windup, rad.
    degree : int
        Lowest degree that reaches ``accuracy`` (N*m), the largest allowed |residual|.
    degrees_tried : tuple of DegreeReport
        From the lowest degree to the accepted one.
    residuals : tuple of floats, one per row of the data, in its order
        Measured minus fitted torque, N*m; a row within the backlash is compared with no torque.
    rows_in_backlash : tuple of int
        Rows (from 0) left out of the fit because their angle lies within the backlash.
    rms, max_residual, rank, condition_number, eigenvalues
        As in the last DegreeReport; the first two of the law as returned.
    monotone, negative : bool
        Whether the torque never falls, and whether it is negative, within 0 .. ``windup_limit``. A negative law is
        refused, so ``negative`` is always False here.
    warnings : tuple of WarningText
        Sentences for the user.
    """

    coefficients: tuple[float, ...]
    windup_limit: float
    degree: int
    accuracy: float
    degrees_tried: tuple[DegreeReport, ...]
    residuals: tuple[float, ...]
    rms: float
    max_residual: float
    rank: int
    condition_number: float
    eigenvalues: tuple[float, ...]
    rows_in_backlash: tuple[int, ...]
    monotone: bool
    negative: bool
    warnings: tuple[WarningText, ...]


class ClutchFitError(ClutchError):
    """No law could be fitted: wrong input, accuracy not reached, or a law that is negative in its range.

    ``degrees`` holds the report of every degree that was tried, with its residuals; it is empty for wrong input.
    ``summary`` is the message without the list of residuals, for callers that show the degrees separately.
    """

    def __init__(
        self,
        message: str,
        *,
        name: str = "",
        value: object = None,
        allowed: str | None = None,
        degrees: tuple[DegreeReport, ...] = (),
        summary: str | None = None,
    ) -> None:
        super().__init__(message, name=name, value=value, allowed=allowed)
        self.degrees = degrees
        self.summary = message if summary is None else summary
