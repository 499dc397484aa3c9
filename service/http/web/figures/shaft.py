"""A machine shaft with sliders: its spec with changed numbers, its results and its figure."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final

from sprag.service.figures.motion import motion_figure
from sprag.service.figures.read import read_figure
from sprag.service.http.web.figures.drawn import drawn
from sprag.service.json_text import numbers
from sprag.service.spec.kinds.registry import without_cases
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from sprag.service.reading.reader import Reading
    from sprag.worker.models import Trajectory
    from sprag.worker.study import Study

#: Angles at which a machine is drawn.
SAMPLES: Final = 1441


def machine_case(
    study: Study, reading: Reading, held: Sequence[tuple[str, Study]] = (), columns: int = 2
) -> dict[str, Any]:
    """Ending, results and figure of a machine's first case, beside others with their names. For the computing process.

    ``held`` of the answer are ending and results of the others; the figure, in the units of ``reading``, has
    ``columns`` panels in a row.
    """
    found = _results(study)
    beside = [_results(other) for _, other in held]
    figure = None
    if found["ending"] == models.OK:
        motions = [
            (name, _whole(other)) for (name, other), own in zip(held, beside, strict=True) if own["ending"] == models.OK
        ]
        described = motion_figure(_whole(study), models.presentation_of(study), motions, columns)
        figure = drawn(read_figure(described, reading))
    return {**found, "figure": figure, "held": beside}


def irregularities(study: Study, others: Sequence[Study]) -> list[tuple[str, float | None]]:
    """Ending and irregularity of a machine's first case, and of others. For the computing process."""
    cases = [_results(each) for each in (study, *others)]
    return [(case["ending"], case["results"]["irregularity"]) for case in cases]


def _results(study: Study) -> dict[str, Any]:
    rows = models.run_chunk(study, 0, 1)
    infos = models.study_results(study)
    values = {info.name: numbers(rows.values[0, index : index + 1])[0] for index, info in enumerate(infos)}
    return {"ending": rows.endings[0], "results": values}


def _whole(study: Study) -> Trajectory:
    return models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, SAMPLES)


def overridden(spec: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """``spec`` with other numbers at some flat paths of its base, and without axes."""
    base = deepcopy(spec["base"])
    for path, value in values.items():
        *parents, name = path.split(".")
        place = base
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        place[int(name) if isinstance(place, list) else name] = value
    return {**without_cases(spec), "base": base}
