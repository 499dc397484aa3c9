"""A machine shaft with sliders: its spec with changed numbers, its results and its figure."""

from __future__ import annotations

from copy import deepcopy
from typing import TYPE_CHECKING, Any, Final

from sprag.service.http.web.figures.plotly import plotly_figure
from sprag.service.json_text import numbers
from sprag.service.results.figures.motion import motion_figure
from sprag.service.spec.fields import WHICH_CASES
from sprag.worker import models

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.study import Study

#: Angles at which a machine is drawn.
SAMPLES: Final = 1441


def machine_case(study: Study) -> dict[str, Any]:
    """Ending, results and figure of a machine's first case. For the computing process."""
    rows = models.run_chunk(study, 0, 1)
    infos = models.study_results(study)
    values = {info.name: numbers(rows.values[0, index : index + 1])[0] for index, info in enumerate(infos)}
    found: dict[str, Any] = {"ending": rows.endings[0], "results": values, "figure": None}
    if rows.endings[0] == models.OK:
        whole = models.run_trajectory(study, 0, 0.0, models.extent(study, 0).end, SAMPLES)
        found["figure"] = plotly_figure(motion_figure(whole, models.presentation_of(study)))
    return found


def overridden(spec: Mapping[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """``spec`` with other numbers at some flat paths of its base, and without axes."""
    base = deepcopy(spec["base"])
    for path, value in values.items():
        *parents, name = path.split(".")
        place = base
        for key in parents:
            place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
        place[int(name) if isinstance(place, list) else name] = value
    return {**{key: value for key, value in spec.items() if key not in WHICH_CASES}, "base": base}
