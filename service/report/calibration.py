"""The part of a report about a calibration: values, points on the fitted curve, what should be known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Name
from sprag_study.service.figures.calibration import calibration_figure
from sprag_study.service.languages import _
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.report.drives import DrivesPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.results.calibration import Calibration


def calibration_part(found: Calibration) -> DrivesPart:
    """The part about the calibration."""
    if found.answer is None:
        return DrivesPart(None, "", (Phrase("The first fit has not ended yet."),))
    caption = _("Measured points on the fitted curve, and residuals")
    return DrivesPart(calibration_figure(found), caption, (*_values(found), *found.sentences))


def _values(found: Calibration) -> Iterator[str]:
    known = found.answer
    assert known is not None
    for index, name in enumerate(found.names):
        unit = unit_of(found.study, name)
        value = Phrase("{name} = {value}", name=Name(name), value=Amount(known.values[index], unit, 6))
        if known.intervals is None:
            yield joined("", (value, "."))
            continue
        low, high = (Amount(end, unit, 6, bare=True) for end in known.intervals[index])
        yield Phrase("{value} (95 % interval {low} to {high}).", value=value, low=low, high=high)
