"""The form on which measured points are pasted: they calibrate the machine of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag_study.service.faults import Fault
from sprag_study.service.http.context import Context
from sprag_study.service.http.web.form.walk import Filled
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_NAME_LENGTH
from sprag_study.worker.planning.calibrate.plan import LOSSES

#: Rows for unknown parameters, and for sensors.
ROWS: Final = 6
SENSORS: Final = 3
_SUFFIX: Final = ", calibrated"


def calibration_spec(spec: Mapping[str, Any], values: Mapping[str, str]) -> dict[str, Any]:
    """The spec of a calibration of the machine of ``spec``, with the fields of the page."""
    kept = without_cases(spec)
    unknown = [
        {"path": path, **Filled({f"/{name}": values.get(f"{name}{row}", "") for name in ("from", "to")}).ranged()}
        for row in range(ROWS)
        if (path := values.get(f"path{row}", "").strip())
    ]
    sensors = [
        {"result": result, **_factors(values, row)}
        for row in range(SENSORS)
        if (result := values.get(f"sensor{row}", "").strip())
    ]
    name = str(spec.get("name", ""))[: MAX_NAME_LENGTH - len(_SUFFIX)] + _SUFFIX
    measured = {"csv": values.get("measured", "")}
    calibrate = {"unknown": unknown, "measured": measured, "loss": values.get("loss", LOSSES[0])}
    return {**kept, "name": name, "calibrate": calibrate | ({"sensors": sensors} if sensors else {})}


def _factors(values: Mapping[str, str], row: int) -> dict[str, Any]:
    """Gain and offset of a row of sensors: a range, or one value where the second field is empty."""
    factors: dict[str, Any] = {}
    for factor in ("gain", "offset"):
        texts = {name: values.get(f"{factor}_{name}{row}", "").strip() for name in ("from", "to")}
        if any(texts.values()):
            ends = Filled({f"/{name}": text for name, text in texts.items()}).ranged()
            factors[factor] = ends if texts["to"] else ends["from"]
    return factors


def fields(context: Context, study_id: str, values: Mapping[str, str], faults: Sequence[Fault]) -> dict[str, Any]:
    """What the form for measured points of a study shows: what was typed, with what is wrong, and what can be named."""
    study = context.store.studies.study(study_id)
    paths = [path for path in study.base if path not in study.derive]
    infos = [info for info in models.study_results(study) if info.kind != "category"]
    first = models.presentation_of(study).along[:1]
    reading = Reading(study.model)
    example = [f"{path} [{unit_of(study, path)}]" for path in first] + [f"{infos[0].name} [{infos[0].unit}]", "sigma"]
    return {
        "values": values,
        "faults": faults,
        "rows": range(ROWS),
        "sensors": range(SENSORS),
        "paths": [(path, reading.caption(path), unit_of(study, path), study.base[path]) for path in paths],
        "results": [(info.name, info.unit) for info in infos],
        "losses": LOSSES,
        "example": ",".join(example),
    }
