"""How far the numbers of a document can be trusted: what is certified, what is between points, what was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount
from sprag_study.service.languages import _
from sprag_study.service.reading.part_names import upper_first
from sprag_study.service.reading.reader import Phrase, joined, plural
from sprag_study.service.report.blocks import Text
from sprag_study.service.results import refined
from sprag_study.service.results.refined import curve_plan
from sprag_study.service.results.regimes import left_out
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.report.content import Report

#: Regimes of motions that repeat, and whose disturbances die away.
_CERTIFIED: Final = ("periodic", "coasting", "held")
#: A fall between two points is told from this share of the range of a curve on.
_STEEP: Final = 0.25
#: Warnings on a sheet; the others are counted.
_WARNINGS: Final = 2


def trust(report: Report) -> Iterator[Text]:
    """A paragraph for each."""
    yield Text(joined(" ", _computed(report)), lead=_certified_lead(report))
    between = [*_between(report)]
    if between:
        yield Text(joined(" ", between), lead=_("Between the points"))
    yield _measured(report)
    for text in report.warnings[:_WARNINGS]:
        yield Text(upper_first(text), warning=True)
    more = len(report.warnings) - _WARNINGS
    if more > 0:
        yield Text(plural("{count} more warning is in the appendix on warnings.",
                          "{count} more warnings are in the appendix on warnings.", more))  # fmt: skip


def _certified_lead(report: Report) -> str:
    return _("Certified.") if report.kinds.regimes else _("Computed.")


def _computed(report: Report) -> Iterator[str]:
    regimes, cases = report.kinds.regimes, report.record.done
    if regimes:
        certified = sum(regimes.get(name, 0) for name in _CERTIFIED)
        yield plural(
            "{certified} of {count} case is the motion to which the machine settles: it repeats, and small "
            "disturbances of it die away.",
            "{certified} of {count} cases are the motion to which the machine settles: it repeats, and small "
            "disturbances of it die away.",
            cases, certified=certified,
        )  # fmt: skip
        if irregular := regimes.get("irregular", 0):
            yield plural(
                "{count} case does not repeat; its numbers are means.",
                "{count} cases do not repeat; their numbers are means.", irregular,
            )  # fmt: skip
    else:
        ended = plural("{ok} of {count} case ended properly.", "{ok} of {count} cases ended properly.", cases,
                       ok=report.record.ok)  # fmt: skip
        yield ended
        if models.has_clutches(report.study):
            yield Phrase("Each was run for a given time; whether its motion had settled by then is not certified.")
    if report.left_out:
        yield f"{upper_first(report.reading.say(left_out(report.left_out)))}."


def _between(report: Report) -> Iterator[str]:
    found, place = report.answers, report.curve
    if found is None or found.drawn is None or place is None or found.query is None:
        return
    plan = curve_plan(report.study)
    if plan is not None:
        curves = [curve.refined for curve in found.drawn.curves if curve.refined is not None]
        yield Phrase("the curves are straight lines between points that were chosen for their accuracy.")
        said = refined.sentence(plan, curves, found.query.y[:1])
        if said:
            yield said
        return
    if report.study.plan is not None:
        return
    yield Phrase("the curves are straight lines.")
    curve = found.drawn.curves[place]
    x, values = np.asarray(curve.line.x), curve.known(found.query.y[0])
    steps = np.abs(np.diff(values))
    span = np.nanmax(values) - np.nanmin(values) if np.isfinite(values).any() else 0.0
    if steps.size and span > 0.0 and np.isfinite(steps).any() and np.nanmax(steps) > _STEEP * span:
        at = int(np.nanargmax(steps))
        low, high = sorted((float(x[at]), float(x[at + 1])))
        ends = {"low": Amount(low, found.unit, bare=True), "high": Amount(high, found.unit)}
        yield Phrase("They are steepest between {low} and {high}: read no values between points there.", **ends)


def _measured(report: Report) -> Text:
    found = report.calibrated
    if found is None or found.answer is None:
        return Text(
            _("with a measurement. Wear, heat and play in the bearings are not in the model."), lead=_("Not compared")
        )
    notes = [upper_first(report.reading.say(text)) for text in found.sentences[:3]]
    return Text(" ".join([_("The values are those at which the model is nearest to the measured points."), *notes]),
                lead=_("Compared with the measurement."))  # fmt: skip
