"""The part of a report about a calibration: values, points on the fitted curve, what should be known."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.results.calibration import calibration_of
from sprag.service.results.figures.calibration import calibration_figure
from sprag.service.results.report.drives import DrivesPart
from sprag.service.spec.catalogue import unit_of
from sprag.worker.planning.calibrate.plan import CALIBRATE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag.service.results.calibration import Calibration
    from sprag.service.results.curves import Fetch
    from sprag.service.storage.records import RoundRecord
    from sprag.worker.study import Study


def calibration_part(study: Study, rounds: list[RoundRecord], fetch: Fetch) -> DrivesPart | None:
    """The part about the calibration; None for a study without one."""
    if study.plan is None or study.plan.get("kind") != CALIBRATE:
        return None
    found = calibration_of(study, rounds, fetch)
    if found.answer is None:
        return DrivesPart(None, ("The first fit has not ended yet.",))
    return DrivesPart(calibration_figure(found), (*_values(found), *found.sentences))


def _values(found: Calibration) -> Iterator[str]:
    known = found.answer
    assert known is not None
    for index, name in enumerate(found.names):
        unit = unit_of(found.study, name)
        text = f"{name} = {known.values[index]:.6g}" + ("" if unit == "1" else f" {unit}")
        if known.intervals is not None:
            low, high = known.intervals[index]
            text += f" (95 % interval {low:.6g} to {high:.6g})"
        yield f"{text}."
