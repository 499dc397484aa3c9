"""What a calibration shows, in sentences: scatter, what cannot be separated, ends of ranges, the next point."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.results.wording import percent
from sprag.service.spec.catalogue import unit_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from sprag.service.results.calibration import Calibration
    from sprag.worker.planning.calibrate.answer import Answer, Direction

#: Probability below which a chi-square is not explained by chance.
_CHANCE: Final = 0.01
#: Standard deviations from which on a point is named.
_FAR: Final = 4.0
#: Share of refits that may end before they converge without a word.
_ENDED: Final = 0.25
_MOST_POINTS: Final = 5


def sentences(found: Calibration) -> list[str]:
    """What should be known before the values are used."""
    known = found.answer
    if known is None:
        return []
    return [
        *_scatter(found, known),
        *(_direction(found, one) for one in known.directions),
        *_bounds(found, known),
        *_points(found, known),
        *_refits(found, known),
        *_next(found, known),
    ]


def _scatter(found: Calibration, known: Answer) -> Iterator[str]:
    plan = found.plan
    _, columns = plan.places
    for column, one in enumerate(plan.measured):
        if not one.sigma:
            sigma = float(known.sigma[columns == column][0])
            unit = found.infos[one.result].unit
            yield f"The standard deviation of {one.result} follows from the residuals: {_quantity(sigma, unit)}."
    if not plan.known_sigma or known.freedom < 1:
        return
    told = f"Chi-square is {known.chi_square:.3g} for {known.freedom} degrees of freedom"
    if plan.loss != "linear":
        yield f"{told}, outliers included."
        return
    above = _chi_square_above(known.chi_square, known.freedom)
    if above < _CHANCE:
        yield f"{told}: the points are farther off than sigma explains; the intervals are too narrow."
    elif above > 1.0 - _CHANCE:
        yield f"{told}: the points scatter less than sigma; the intervals are too wide."
    else:
        yield f"{told}: the points scatter as sigma says."


def _chi_square_above(value: float, freedom: int) -> float:
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * freedom, 0.5 * value))


def _direction(found: Calibration, one: Direction) -> str:
    names = [found.names[place] for place in one.parameters]
    changes = " and ".join(
        f"{name} by {_quantity(change, unit_of(found.study, name), signed=True)}"
        for name, change in zip(names, one.changes, strict=True)
    )
    if len(names) == 1:
        return f"These points do not determine {names[0]}."
    if one.undetermined:
        return f"These points cannot separate {_listed(names)}: changing {changes} changes hardly any of them."
    return f"These points hardly separate {_listed(names)}: changing {changes} is within their scatter."


def _bounds(found: Calibration, known: Answer) -> Iterator[str]:
    if known.at_bounds is None:
        return
    for one, name, (low, high) in zip(found.plan.unknown, found.names, known.at_bounds.tolist(), strict=True):
        unit = unit_of(found.study, name)
        ends = [_quantity(end, unit) for end, reached in ((one.low, low), (one.high, high)) if reached]
        if ends:
            which = "the end" if len(ends) == 1 else "both ends"
            yield f"The interval of {name} reaches {which} of its range ({', '.join(ends)}); a wider one may change it."


def _points(found: Calibration, known: Answer) -> Iterator[str]:
    failed = int(np.count_nonzero(known.failed))
    if failed:
        yield f"{failed} of {found.plan.count} measured values have no result at the fitted values and are left out."
    residuals = np.where(known.failed, 0.0, known.residuals)
    far = [index for index in np.argsort(-np.abs(residuals)).tolist() if abs(residuals[index]) > _FAR]
    for index in far[:_MOST_POINTS]:
        yield f"Measured value {index + 1} is {abs(residuals[index]):.1f} standard deviations off the fit."
    if len(far) > _MOST_POINTS:
        yield f"{len(far) - _MOST_POINTS} further values are more than {_FAR:g} standard deviations off."


def _refits(found: Calibration, known: Answer) -> Iterator[str]:
    if not found.summary["complete"]:
        yield "The calibration has not run to its end."
    ended = known.refits - found.converged
    if known.refits and ended > _ENDED * known.refits:
        yield (
            f"{ended} of {known.refits} refits ended before they converged, as the results are not smooth: the "
            "intervals are rough."
        )


def _next(found: Calibration, known: Answer) -> Iterator[str]:
    one = known.next
    if one is None:
        return
    best = int(np.argmax(one.narrower))
    at = ", ".join(
        f"{path} = {_quantity(value, unit_of(found.study, path))}"
        for path, value in zip(found.plan.paths_at, one.condition, strict=True)
    )
    yield (
        f"A further measurement says most at {at}: the interval of {found.names[best]} would become "
        f"{percent(one.narrower[best])} narrower."
    )


def _listed(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


def _quantity(value: float, unit: str, *, signed: bool = False) -> str:
    text = f"{value:+.3g}" if signed else f"{value:.4g}"
    return text if unit == "1" else f"{text} {unit}"
