"""What a calibration says of itself in sentences: whether the model fits, what the points determine, how sure it is."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Final, NamedTuple

import numpy as np

from sprag_study.sentences import Amount, Name, Part
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.worker.planning.calibrate.answer import Answer, Direction
from sprag_study.worker.planning.calibrate.lack_of_fit import CHANCE, Offset

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from sprag_study.service.reading.reader import Reading
    from sprag_study.service.results.calibration import Calibration


#: Sentences about the fit and the measurement that belong to the answer at most, the first of: whether it fits, priors
#: that are contradicted, an offset, values far off.
_DOUBTS: Final = 3
#: Probability below which a chi-square is not explained by chance.
_CHANCE: Final = 0.01
#: Part of the squares of the residuals that an offset has to take where the rest is no chance.
_MOST_OF: Final = 0.9
#: Standard deviations on both sides of an offset between which it is fitted.
_OFFSET_DEVIATIONS: Final = 5.0
#: Standard deviations from which on a point is named.
_FAR: Final = 4.0
#: Share of the standard deviation of its prior from which on a parameter is hardly known better.
_NARROWER: Final = 0.8
#: Standard deviations beyond which measured values contradict a prior.
_CONTRADICTS: Final = 3.0
#: Share of refits that may end before they converge without a word.
_ENDED: Final = 0.25
_MOST_POINTS: Final = 5


def sentences(found: Calibration) -> list[str]:
    """What should be known before the values are used."""
    known = found.answer
    if known is None:
        return []
    return [
        *_doubts(found, known),
        *_deviations(found, known),
        *_of_priors(found, known),
        *(_undetermined(found, one) for one in known.directions),
        *_bounds(found, known),
        *_refits(found, known),
        *_next_point(found, known),
    ]


def doubts(found: Calibration) -> list[str]:
    """The first of these sentences, about the fit and the measurement, which belong to the answer."""
    return [] if found.answer is None else list(_doubts(found, found.answer))[:_DOUBTS]


def _doubts(found: Calibration, known: Answer) -> Iterator[str]:
    """Whether the model fits, and what in the measurement may be wrong."""
    yield from _fits(found, known)
    yield from _chi_square(found, known)
    yield from _against_priors(found, known)
    yield from _shifted(found)
    yield from _points(found, known)


def _fits(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """Whether the residuals are chance, where no sigma says how large they may be."""
    if found.plan.known_sigma:
        return
    test = found.test
    if test is None:
        yield Phrase("These points are too few to test whether the model fits: repeat some of them, or give sigma.")
        return
    values: dict[str, Part] = {
        "name": Name(found.plan.results[test.column], within=True),
        "p": Amount(test.p, "1", 2, form=".2g"),
    }
    if test.test == "runs":
        values |= {"runs": round(test.statistic), "total": round(sum(test.freedom))}
        if test.p < CHANCE:
            yield _with_narrow(known, Phrase(
                "The {total} residuals of {name} keep their sign too long for chance ({runs} runs, p = {p}): the model "
                "lacks something, or a value of the base is wrong; free a further parameter, or correct the base.",
                **values,
            ))  # fmt: skip
        else:
            yield Phrase(
                "The {total} residuals of {name} change their sign as by chance ({runs} runs, p = {p}): no lack of fit "
                "shows.",
                **values,
            )
        return
    values["ratio"] = Amount(test.statistic, "1", 3, form=".3g")
    if test.p < CHANCE:
        yield _with_narrow(known, Phrase(
            "The fit misses {name} by more than repeated points scatter (F = {ratio}, p = {p}): the model lacks "
            "something, or a value of the base is wrong; free a further parameter, or correct the base.",
            **values,
        ))  # fmt: skip
    else:
        yield Phrase(
            "The fit misses {name} by no more than repeated points scatter (F = {ratio}, p = {p}): no lack of fit "
            "shows.",
            **values,
        )


def _against_priors(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """Parameters whose priors the measured values contradict.

    The difference of value and mean has the variance of the prior less that of the value, if both are right.
    """
    if known.deviations is None:
        return
    for place, one in enumerate(found.plan.unknown):
        value, deviation = float(known.values[place]), float(known.deviations[place])
        if one.prior is not None and deviation < _NARROWER * one.prior[1]:
            mean, sigma = one.prior
            apart = abs(value - mean) / math.sqrt(sigma**2 - deviation**2)
            if apart > _CONTRADICTS:
                yield Phrase(
                    "Measured values and prior contradict each other in {name}: the value is {count} standard "
                    "deviations from {mean}, beyond chance; check both before you use it.",
                    name=found.called(place),
                    count=Amount(apart, "1", 2, form=".2g"),
                    mean=Amount(mean, found.unit(place), 4, form=".4g"),
                )


def _of_priors(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """Parameters of which hardly more is known than before."""
    if known.deviations is None:
        return
    for place, one in enumerate(found.plan.unknown):
        if one.prior is not None and known.deviations[place] >= _NARROWER * one.prior[1]:
            yield Phrase(
                "These points say hardly anything about {name}: its interval is that of the prior.",
                name=found.called(place),
            )


def advised(found: Calibration) -> Offset | None:
    """The offset that would explain the residuals; None for none."""
    offset = min(found.answer.offsets if found.answer else (), key=lambda one: one.p, default=None)
    explains = offset is not None and (offset.rest >= _CHANCE or offset.share >= _MOST_OF)
    return offset if explains and offset is not None and offset.p < _CHANCE else None


class Advice(NamedTuple):
    """A further calibration with sensors as `sensors` of a spec has them, and what leads there."""

    label: Phrase
    sensors: list[dict[str, Any]]


def further(found: Calibration, sensors: Sequence[Mapping[str, Any]], reading: Reading) -> Advice | None:
    """The calibration that fits the offset which the answer advises, too, beside the ``sensors`` that it has.

    None where none is advised. The ends of its range are in the units of the reader.
    """
    offset = advised(found)
    if offset is None:
        return None
    result = found.plan.results[offset.column]
    unit = found.infos[result].unit
    far = max(abs(offset.value), _OFFSET_DEVIATIONS * offset.deviation)
    shown = "" if reading.unit(unit) == "1" else f" {reading.unit(unit)}"
    ends = {
        name: f"{reading.value(end, unit):.3g}{shown}"
        for name, end in (("from", offset.value - far), ("to", offset.value + far))
    }
    known = next((dict(one) for one in sensors if one["result"] == result), {"result": result})
    label = Phrase(
        "Calibrate again with an offset of {name} near {offset}",
        name=Name(result, within=True),
        offset=Amount(offset.value, unit, 3, form=".3g"),
    )
    return Advice(label, [*(dict(one) for one in sensors if one["result"] != result), {**known, "offset": ends}])


def _shifted(found: Calibration) -> Iterator[Phrase]:
    """The offset that would explain the residuals."""
    offset = advised(found)
    if offset is not None:
        result = found.plan.results[offset.column]
        unit = found.infos[result].unit
        yield Phrase(
            "An offset of {name} by {offset} (standard deviation {deviation}) would explain {share} % of the squares "
            "of the residuals (p = {p}): check the zero of its sensor, or calibrate it too by `sensors`.",
            name=Name(result, within=True),
            offset=Amount(offset.value, unit, 3, form="+.3g"),
            deviation=Amount(offset.deviation, unit, 2, form=".2g"),
            share=round(100.0 * offset.share),
            p=Amount(offset.p, "1", 2, form=".2g"),
        )


def _deviations(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """The standard deviations that follow from the residuals."""
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


def _chi_square(found: Calibration, known: Answer) -> Iterator[Phrase]:
    """Whether the residuals are as large as given standard deviations say."""
    plan = found.plan
    if not plan.known_sigma or known.freedom < 1:
        return
    values: dict[str, Part] = {"value": Amount(known.chi_square, "1", 3, form=".3g"), "freedom": known.freedom}
    if plan.loss != "linear":
        yield Phrase("Chi-square is {value} for {freedom} degrees of freedom, outliers included.", **values)
        return
    above = _chi_square_above(known.chi_square, known.freedom)
    if above < _CHANCE:
        yield _with_narrow(known, Phrase(
            "Chi-square is {value} for {freedom} degrees of freedom: the points are farther off than sigma explains.",
            **values,
        ))  # fmt: skip
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


def _with_narrow(known: Answer, text: Phrase) -> Phrase:
    """A sentence, and what follows from it for the intervals that are not their whole ranges."""
    bounds = known.at_bounds
    whole = [] if bounds is None else [bool(low and high) for low, high in bounds]
    if whole and all(whole):
        return text
    narrow = (
        Phrase("The intervals that end within their ranges are too narrow.")
        if any(whole)
        else Phrase("The intervals are too narrow.")
    )
    return joined(" ", [text, narrow])


def _chi_square_above(value: float, freedom: int) -> float:
    from scipy.special import gammaincc

    return float(gammaincc(0.5 * freedom, 0.5 * value))


def _undetermined(found: Calibration, one: Direction) -> Phrase:
    names = [found.called(place) for place in one.parameters]
    if len(names) == 1:
        return Phrase("These points do not determine {name}.", name=names[0])
    changes = [
        Phrase("{name} by {change}", name=name, change=Amount(change, found.unit(place), 3, form="+.3g"))
        for place, name, change in zip(one.parameters, names, one.changes, strict=True)
    ]
    parts = {"names": _listed(names), "changes": _listed(changes)}
    if one.undetermined:
        return Phrase("These points cannot separate {names}: changing {changes} changes hardly any of them.", **parts)
    return Phrase("These points hardly separate {names}: changing {changes} is within their scatter.", **parts)


def _bounds(found: Calibration, known: Answer) -> Iterator[Phrase]:
    if known.at_bounds is None:
        return
    for place, (one, (low, high)) in enumerate(zip(found.plan.fitted, known.at_bounds.tolist(), strict=True)):
        unit, name = found.unit(place), found.called(place)
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
    lone = found.far
    if lone is not None and lone.p < CHANCE:
        yield Phrase(
            "Measured value {number} ({point}) is far off the others ({count} standard deviations, Cook's distance "
            "{cook}, p = {p}): check it, or let outliers count less by `loss`, such as soft_l1.",
            number=lone.place + 1,
            point=_named(found, lone.place),
            count=Amount(abs(lone.deleted), "1", 3, form=".3g"),
            cook=Amount(lone.cook, "1", 2, form=".2g"),
            p=Amount(lone.p, "1", 2, form=".2g"),
        )
    residuals = np.where(known.failed, 0.0, known.residuals)
    if lone is not None and lone.p < CHANCE:
        residuals[lone.place] = 0.0
    far = [index for index in np.argsort(-np.abs(residuals)).tolist() if abs(residuals[index]) > _FAR]
    for index in far[:_MOST_POINTS]:
        values: dict[str, Part] = {
            "number": index + 1,
            "point": _named(found, index),
            "count": Amount(round(abs(residuals[index]), 1), "1", form=".1f"),
        }
        if found.plan.loss == "linear":
            yield Phrase(
                "Measured value {number} ({point}) is {count} standard deviations off the fit: check it, or let "
                "outliers count less by `loss`, such as soft_l1.",
                **values,
            )
        else:
            yield Phrase("Measured value {number} ({point}) is {count} standard deviations off the fit.", **values)
    if len(far) > _MOST_POINTS:
        yield plural(
            "{count} further value is more than {limit} standard deviations off.",
            "{count} further values are more than {limit} standard deviations off.",
            len(far) - _MOST_POINTS,
            limit=Amount(_FAR, "1", form="g"),
        )


def _named(found: Calibration, index: int) -> Phrase:
    """A measured value by its condition and what was read there."""
    conditions, columns = found.plan.places
    result = found.plan.results[columns[index]]
    read = {result: (float(found.plan.values[index]), found.infos[result].unit)}
    at = found.at(found.plan.at[conditions[index]])
    every = {path: (value, unit_of(found.study, path)) for path, value in at.items()} | read
    return joined(
        ", ",
        [
            Phrase("{name} = {value}", name=Name(name, within=True), value=Amount(value, unit, 4, form=".4g"))
            for name, (value, unit) in every.items()
        ],
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


def _next_point(found: Calibration, known: Answer) -> Iterator[Phrase]:
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
        name=found.called(best),
        share=Amount(100.0 * float(one.narrower[best]), "1", 2, form=".2g"),
    )


def _listed(parts: Sequence[Part]) -> Phrase:
    return Phrase("{first} and {last}", first=joined(", ", parts[:-1]), last=parts[-1])
