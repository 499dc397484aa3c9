"""The form on which measured points are pasted: they calibrate the machine of a study."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag_study.service.http.web.form.check import Checked
from sprag_study.service.http.web.form.entries import Faults, Values, plain, text_of
from sprag_study.service.http.web.form.fields import Choice, Groups, described, grouped_results
from sprag_study.service.http.web.form.machine import grouped
from sprag_study.service.http.web.form.spec import PATHS, RANGE, RESULT, number_or_range
from sprag_study.service.http.web.form.walk import Cell, Filled, Record, Rows
from sprag_study.service.http.web.form.walk import described as members
from sprag_study.service.languages import _, gettext
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.deviations import with_tolerance
from sprag_study.service.reading.reader import Reading
from sprag_study.service.reading.wording import number
from sprag_study.service.results.calibration_words import further
from sprag_study.service.spec.kinds.calibrate import CALIBRATE
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_NAME_LENGTH
from sprag_study.worker.models.vocabulary import bare_caption

if TYPE_CHECKING:
    from sprag_study.service.results.calibration import Calibration
    from sprag_study.worker.study import Study

#: Field of the measured points.
POINTS: Final = "/calibrate/measured/csv"
#: Entries whose fields are out of sight unless something is filled in.
_RARE: Final = CALIBRATE.described
_SUFFIX: Final = ", calibrated"
#: Rows with which an empty form begins.
_AT_FIRST: Final = {"unknown": 2, "sensors": 1}
_CSV: Final = Cell(
    ("csv",), ("csv",), lambda form: {"csv": form.values.get(POINTS, "")}, lambda item: {"csv": str(item["csv"])}
)  # fmt: skip
_PRIOR: Final = Cell(
    ("prior",), ("prior",),
    lambda form: {"prior": _prior(text)} if (text := form.text("prior")) else {},
    lambda item: {"prior": "{} ± {}".format(*map(text_of, (given["mean"], given["sigma"])))}
    if (given := item.get("prior")) else {},
)  # fmt: skip
#: Lists of rows that users add and remove, by the name of the field with their number.
PARTS: Final = {
    rows.name: rows
    for rows in (
        Rows(
            "unknown", "/calibrate/unknown", CALIBRATE.listed["unknown"].high,
            Record((PATHS, RANGE, _PRIOR), whole="/path"), always=False, whole="/calibrate/unknown/0/path",
        ),
        Rows(
            "sensors", "/calibrate/sensors", CALIBRATE.listed["sensors"].high,
            Record((RESULT, number_or_range("gain"), number_or_range("offset")), whole="/result"), always=False,
        ),
    )
}  # fmt: skip
_CALIBRATE: Final = Record(
    (*PARTS.values(), Record((_CSV,), key="measured"), *members(_RARE.values())), whole="",
    key="calibrate",
)  # fmt: skip


def _prior(text: str) -> dict[str, Any]:
    """Mean and standard deviation of ``9.5 N/mm ± 5 %``; where there is one number only, the mean."""
    both = with_tolerance(text) or (text,)
    return dict(zip(("mean", "sigma"), map(plain, both), strict=False))


def form_with_spec(spec: Mapping[str, Any], values: Values) -> tuple[dict[str, Any], Filled]:
    """The spec of a calibration of the machine of ``spec``, and the form with the fields of its places."""
    form = Filled(values)
    name = str(spec.get("name", "")).removesuffix(_SUFFIX)[: MAX_NAME_LENGTH - len(_SUFFIX)] + _SUFFIX
    return {**without_cases(spec), "name": name, **_CALIBRATE.entries(form)}, form


def values_of(spec: Mapping[str, Any], changes: Mapping[str, str]) -> Values:
    """The form of a calibration of the machine of ``spec``, filled in with its own where it is one, and ``changes``."""
    values: Values = {}
    if "calibrate" in spec:
        _CALIBRATE.show(spec, Filled(values))
    counts = {name: str(max(int(values.get(name, 0)), least)) for name, least in _AT_FIRST.items()}
    own = {name: text for name, text in changes.items() if name in PARTS or name.startswith("/calibrate/")}
    return values | counts | own


def again(spec: Mapping[str, Any], study_id: str, found: Calibration, reading: Reading) -> tuple[str, str] | None:
    """Address of the form with the offset that a calibration advises, and what leads there; None for none."""
    advice = further(found, spec["calibrate"].get("sensors", ()), reading)
    if advice is None:
        return None
    values = values_of({**spec, "calibrate": {**spec["calibrate"], "sensors": advice.sensors}}, {})
    fields = {name: text for name, text in values.items() if "sensors" in name}
    return f"/studies/{study_id}/matters?{urlencode({'ask': 'measurement', 'again': 'on', **fields})}", reading.say(
        advice.label
    )


def shown(study: Study, values: Values, faults: Faults | None) -> dict[str, Any]:
    """What the template of the form is filled with, beside the macros of ``_fields.html``; ``faults`` are None where
    it was not checked.
    """
    infos = [info for info in models.study_results(study) if info.kind != "category"]
    units = {path: unit_of(study, path) for path in study.base if path not in study.derive}
    first = [f"{path} [{units[path]}]" for path in models.presentation_of(study).along[:1] if path in units]
    empty = frozenset(name for name, text in values.items() if not text.strip())
    return {
        "values": values,
        "faults": faults or {},
        "checked": Checked({}, faults=faults or {}, empty=empty),
        "begun": faults is not None,
        "model": study.model,
        "parts": PARTS,
        "rows": {name: range(rows.count(values)) for name, rows in PARTS.items()},
        "names": [
            (_("Parameters"), _parameters(study, units)),
            (_("Results"), grouped_results(Reading(study.model), infos)),
        ],
        "rare": [described(entry, "/calibrate") for entry in _RARE.values()],
        "example": ",".join([*first, f"{infos[0].name} [{infos[0].unit}]", "sigma"]),
        "opened": any(values.get(f"/calibrate/{name}", "") not in ("", entry.default) for name, entry in _RARE.items()),
    }


def _parameters(study: Study, units: Mapping[str, str]) -> Groups:
    """The parameters that can be unknown, by group, with their values, and those of all parts of a kind alike."""
    alike: dict[str, list[str]] = {}
    for path in units:
        alike.setdefault(re.sub(r"\.\d+\.", ".*.", path), []).append(path)
    tied = [Choice(pattern, bare_caption(study.model, paths[0], gettext), units[paths[0]])
            for pattern, paths in alike.items() if len(paths) > 1]  # fmt: skip
    groups = [
        (title, [replace(one, label=f"{one.label} = {number(study.base[one.path])}") for one in own])
        for title, own in grouped(study.model, units)
    ]
    return [(_("all of them alike"), tied), *groups] if tied else groups
