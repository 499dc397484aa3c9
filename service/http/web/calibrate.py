"""The form on which measured points are pasted: they calibrate the machine of a study."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag_study.service.faults import Fault
from sprag_study.service.http.context import Context
from sprag_study.service.http.web.form.walk import Filled
from sprag_study.service.languages import N_, gettext
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_NAME_LENGTH
from sprag_study.worker.planning.calibrate.plan import LOSSES

#: Rows for unknown parameters, and for sensors.
ROWS: Final = 6
SENSORS: Final = 3
#: Fields of a row for an unknown parameter, and for a sensor.
_ENDS: Final = ("from", "to")
_UNKNOWN: Final = ("path", *_ENDS)
_SENSOR: Final = ("sensor", *(f"{factor}_{end}" for factor in ("gain", "offset") for end in _ENDS))
_SUFFIX: Final = ", calibrated"


def calibration_spec(spec: Mapping[str, Any], values: Mapping[str, str]) -> dict[str, Any]:
    """The spec of a calibration of the machine of ``spec``, with the fields of the page."""
    kept = without_cases(spec)
    unknown = [
        {
            "path": values.get(f"path{row}", "").strip(),
            **_ends({name: values.get(f"{name}{row}", "") for name in _ENDS}),
        }
        for row in _rows(values, _UNKNOWN)
    ]
    sensors = [
        ({"result": result} if (result := values.get(f"sensor{row}", "").strip()) else {}) | _factors(values, row)
        for row in _rows(values, _SENSOR)
    ]
    name = str(spec.get("name", ""))[: MAX_NAME_LENGTH - len(_SUFFIX)] + _SUFFIX
    measured = {"csv": values.get("measured", "")}
    calibrate = {"unknown": unknown, "measured": measured, "loss": values.get("loss", LOSSES[0])}
    return {**kept, "name": name, "calibrate": calibrate | ({"sensors": sensors} if sensors else {})}


def _factors(values: Mapping[str, str], row: int) -> dict[str, Any]:
    """Gain and offset of a row of sensors: a range, or one value where the second field is empty."""
    factors: dict[str, Any] = {}
    for factor in ("gain", "offset"):
        texts = {name: values.get(f"{factor}_{name}{row}", "").strip() for name in _ENDS}
        if any(texts.values()):
            ends = _ends(texts)
            factors[factor] = ends if texts["to"] else ends["from"]
    return factors


def _ends(texts: Mapping[str, str]) -> dict[str, Any]:
    """The ends of a range that are filled in."""
    ends = Filled({f"/{name}": text for name, text in texts.items()}).ranged()
    return {name: end for name, end in ends.items() if texts[name].strip()}


def _rows(values: Mapping[str, str], fields: Sequence[str]) -> list[int]:
    """The rows of which one of these fields is filled in."""
    return [row for row in range(ROWS) if any(values.get(f"{name}{row}", "").strip() for name in fields)]


def _called(values: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    """Places in the spec, their fields, and what a reader calls these."""
    called = {"/calibrate/measured/csv": ("measured", gettext("Measured points"))}
    for index, row in enumerate(_rows(values, _UNKNOWN)):
        place = f"/calibrate/unknown/{index}"
        called |= {place: (f"path{row}", gettext("Parameter {number}", number=row + 1)),
                   f"{place}/path": (f"path{row}", gettext("Parameter {number}", number=row + 1)),
                   f"{place}/from": (f"from{row}", gettext("Parameter {number}, from", number=row + 1)),
                   f"{place}/to": (f"to{row}", gettext("Parameter {number}, to", number=row + 1))}  # fmt: skip
    for index, row in enumerate(_rows(values, _SENSOR)):
        place = f"/calibrate/sensors/{index}"
        called |= {place: (f"sensor{row}", gettext("Sensor {number}", number=row + 1)),
                   f"{place}/result": (f"sensor{row}", gettext("Sensor {number}, result", number=row + 1))}  # fmt: skip
        for factor, label in (("gain", N_("Sensor {number}, gain")), ("offset", N_("Sensor {number}, offset"))):
            own = gettext(label, number=row + 1)
            called |= {f"{place}/{factor}": (f"{factor}_from{row}", own)}
            called |= {f"{place}/{factor}/{end}": (f"{factor}_{end}{row}", own) for end in _ENDS}
    return called


def fields(context: Context, study_id: str, values: Mapping[str, str], faults: Sequence[Fault]) -> dict[str, Any]:
    """What the form for measured points of a study shows: what was typed, with what is wrong, and what can be named."""
    study, called = context.store.studies.study(study_id), _called(values)
    paths = [path for path in study.base if path not in study.derive]
    infos = [info for info in models.study_results(study) if info.kind != "category"]
    first = models.presentation_of(study).along[:1]
    reading = Reading(study.model)
    example = [f"{path} [{unit_of(study, path)}]" for path in first] + [f"{infos[0].name} [{infos[0].unit}]", "sigma"]
    return {
        "values": values,
        "faults": faults,
        "called": {place: label for place, (_field, label) in called.items()},
        "wrong": {called[fault.where][0] for fault in faults if fault.where in called},
        "rows": range(ROWS),
        "sensors": range(SENSORS),
        "with_sensors": bool(_rows(values, _SENSOR)),
        "paths": [(path, reading.caption(path), unit_of(study, path), study.base[path]) for path in paths],
        "results": [(info.name, info.unit) for info in infos],
        "losses": LOSSES,
        "example": ",".join(example),
    }
