"""What a calibration shows, in sentences: scatter, what cannot be separated, ends of ranges, the next point."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag.service.reading.catalogue import unit_of
from sprag.service.reading.phrases import Amount, Name, Part, Phrase, joined, plural

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


def _scatter(found: Calibration, known: Answer) -> Iterator[Phrase]:
    plan = found.plan
    _, columns = plan.places
    for column, one in enumerate(plan.measured):
        if not one.sigma:
            sigma = float(known.sigma[columns == column][0])
            yield Phrase(
                "The standard deviation of {name} follows from the residuals: {sigma}.",
                name=Name(one.result, within=True),
                sigma=Amount(sigma, found.infos[one.result].unit, 4, form=".4g"),
            )
    if not plan.known_sigma or known.freedom < 1:
        return
    values: dict[str, Part] = {"value": Amount(known.chi_square, "1", 3, form=".3g"), "freedom": known.freedom}
    if plan.loss != "linear":
        yield Phrase("Chi-square is {value} for {freedom} degrees of freedom, outliers included.", **values)
        return
    above = _chi_square_above(known.chi_square, known.freedom)
    if above < _CHANCE:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points are farther off than sigma explains; "
            "the intervals are too narrow.",
            **values,
        )
    elif above > 1.0 - _CHANCE:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points scatter less than sigma; the intervals "
            "are too wide.",
            **values,
        )
    else:
        yield Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points scatter as sigma says.", **values
        )


def _chi_square_above(value: float, freedom: int) -> float:
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * freedom, 0.5 * value))


def _direction(found: Calibration, one: Direction) -> Phrase:
    paths = [found.names[place] for place in one.parameters]
    names = [Name(path, within=True) for path in paths]
    if len(names) == 1:
        return Phrase("These points do not determine {name}.", name=names[0])
    changes = [
        Phrase("{name} by {change}", name=name, change=Amount(change, unit_of(found.study, path), 3, form="+.3g"))
        for path, name, change in zip(paths, names, one.changes, strict=True)
    ]
    parts = {"names": _listed(names), "changes": _listed(changes)}
    if one.undetermined:
        return Phrase("These points cannot separate {names}: changing {changes} changes hardly any of them.", **parts)
    return Phrase("These points hardly separate {names}: changing {changes} is within their scatter.", **parts)


def _bounds(found: Calibration, known: Answer) -> Iterator[Phrase]:
    if known.at_bounds is None:
        return
    for one, path, (low, high) in zip(found.plan.unknown, found.names, known.at_bounds.tolist(), strict=True):
        unit, name = unit_of(found.study, path), Name(path, within=True)
        ends = [Amount(end, unit, 4, form=".4g") for end, reached in ((one.low, low), (one.high, high)) if reached]
        if len(ends) == 1:
            yield Phrase(
                "The interval of {name} reaches the end of its range ({end}); a wider one may change it.",
                name=name,
                end=ends[0],
            )
        elif ends:
            yield Phrase(
                "The interval of {name} reaches both ends of its range ({low}, {high}); a wider one may change it.",
                name=name,
                low=ends[0],
                high=ends[1],
            )


def _points(found: Calibration, known: Answer) -> Iterator[Phrase]:
    failed = int(np.count_nonzero(known.failed))
    if failed:
        yield Phrase(
            "{count} of {total} measured values have no result at the fitted values and are left out.",
            count=failed,
            total=found.plan.count,
        )
    residuals = np.where(known.failed, 0.0, known.residuals)
    far = [index for index in np.argsort(-np.abs(residuals)).tolist() if abs(residuals[index]) > _FAR]
    for index in far[:_MOST_POINTS]:
        yield Phrase(
            "Measured value {number} is {count} standard deviations off the fit.",
            number=index + 1,
            count=Amount(round(abs(residuals[index]), 1), "1", form=".1f"),
        )
    if len(far) > _MOST_POINTS:
        yield plural(
            "{count} further value is more than {limit} standard deviations off.",
            "{count} further values are more than {limit} standard deviations off.",
            len(far) - _MOST_POINTS,
            limit=Amount(_FAR, "1", form="g"),
        )


def _refits(found: Calibration, known: Answer) -> Iterator[Phrase]:
    if not found.summary["complete"]:
        yield Phrase("The calibration has not run to its end.")
    ended = known.refits - found.converged
    if known.refits and ended > _ENDED * known.refits:
        yield Phrase(
            "{count} of {total} refits ended before they converged, as the results are not smooth: the intervals are "
            "rough.",
            count=ended,
            total=known.refits,
        )


def _next(found: Calibration, known: Answer) -> Iterator[Phrase]:
    one = known.next
    if one is None:
        return
    best = int(np.argmax(one.narrower))
    at = [
        Phrase(
            "{name} = {value}",
            name=Name(path, within=True),
            value=Amount(value, unit_of(found.study, path), 4, form=".4g"),
        )
        for path, value in zip(found.plan.paths_at, one.condition, strict=True)
    ]
    yield Phrase(
        "A further measurement says most at {condition}: the interval of {name} would become {share} % narrower.",
        condition=joined(", ", at),
        name=Name(found.names[best], within=True),
        share=Amount(100.0 * float(one.narrower[best]), "1", 2, form=".2g"),
    )


def _listed(parts: Sequence[Part]) -> Phrase:
    return Phrase("{first} and {last}", first=joined(", ", parts[:-1]), last=parts[-1])
