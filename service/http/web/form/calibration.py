"""The form on which measured points are pasted: they calibrate the machine of a study."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag_study.sentences import Amount, Name
from sprag_study.service.http.web.form.check import Checked
from sprag_study.service.http.web.form.entries import Faults, Values, plain, text_of
from sprag_study.service.http.web.form.fields import Choice, Groups, described, grouped_results
from sprag_study.service.http.web.form.machine import grouped
from sprag_study.service.http.web.form.spec import PATHS, RANGE, RESULT
from sprag_study.service.http.web.form.walk import Cell, Filled, Record, Rows
from sprag_study.service.http.web.form.walk import described as members
from sprag_study.service.languages import _, gettext
from sprag_study.service.reading.catalogue import unit_of
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.ranges import TypedRange, typed_range
from sprag_study.service.reading.reader import Phrase, Reading
from sprag_study.service.reading.wording import number, unit_text
from sprag_study.service.results.calibration_words import advised
from sprag_study.service.spec.kinds.calibrate import CALIBRATE
from sprag_study.service.spec.kinds.registry import without_cases
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_NAME_LENGTH
from sprag_study.worker.models.vocabulary import bare_caption

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.faults import Fault
    from sprag_study.service.results.calibration import Calibration
    from sprag_study.worker.study import Study

#: Field of the measured points.
POINTS: Final = "/calibrate/measured/csv"
#: Fields out of sight unless something is filled in, by their descriptions.
RARE: Final = {f"/calibrate/{name}": entry for name, entry in CALIBRATE.described.items()}
_SUFFIX: Final = ", calibrated"
#: Rows with which an empty form begins.
_AT_FIRST: Final = {"unknown": 2, "sensors": 1}
#: Standard deviations on both sides of an offset between which it is fitted.
_DEVIATIONS: Final = 5.0


def _factor(name: str) -> Cell:
    """Gain or offset of a sensor: a value, or a range in which it is fitted."""

    def read(form: Filled) -> dict[str, Any]:
        written = typed_range(form.text(name))
        if written is None or written.count is not None or written.step or written.spacing != "even":
            return {name: plain(form.text(name))} if form.text(name) else {}
        ends = form.together([written.first, written.last], [name] * 2)
        return {name: dict(zip(("from", "to"), ends, strict=True))}

    def write(item: Mapping[str, Any]) -> Values:
        given = item.get(name, "")
        if isinstance(given, Mapping):
            return {name: TypedRange(text_of(given["from"]), text_of(given["to"])).text}
        return {name: text_of(given)}

    return Cell((name,), (name,), read, write)


_CSV: Final = Cell(
    ("csv",), ("csv",), lambda form: {"csv": form.values.get(POINTS, "")}, lambda item: {"csv": str(item["csv"])}
)  # fmt: skip
#: Lists of rows that users add and remove, by the name of the field with their number.
PARTS: Final = {
    rows.name: rows
    for rows in (
        Rows(
            "unknown", "/calibrate/unknown", CALIBRATE.listed["unknown"].high,
            Record((PATHS, RANGE), whole="/path"), always=False, whole="/calibrate/unknown/0/path",
        ),
        Rows(
            "sensors", "/calibrate/sensors", CALIBRATE.listed["sensors"].high,
            Record((RESULT, _factor("gain"), _factor("offset")), whole="/result"), always=False,
        ),
    )
}  # fmt: skip
_CALIBRATE: Final = Record(
    (*PARTS.values(), Record((_CSV,), key="measured"), *members(CALIBRATE.described.values())), whole="",
    key="calibrate",
)  # fmt: skip


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
    offset = advised(found)
    if offset is None:
        return None
    result = found.plan.results[offset.column]
    unit = found.infos[result].unit
    values, far = values_of(spec, {}), max(abs(offset.value), _DEVIATIONS * offset.deviation)
    low, high = (
        f"{reading.value(end, unit):.3g} {reading.unit(unit)}".removesuffix(" 1")
        for end in (offset.value - far, offset.value + far)
    )
    known = {values[f"/calibrate/sensors/{row}/result"]: row for row in PARTS["sensors"].filled(values)}
    row = known.get(result, len(known))
    at = f"/calibrate/sensors/{row}"
    query = {
        "ask": "measurement", "again": "on", "sensors": max(len(known), row + 1),
        f"{at}/result": result, f"{at}/offset": TypedRange(low, high).text,
    }  # fmt: skip
    label = Phrase(
        "Calibrate again with an offset of {name} near {offset}",
        name=Name(result, within=True),
        offset=Amount(offset.value, unit, 3, form=".3g"),
    )
    return f"/studies/{study_id}/matters?{urlencode(query)}", reading.say(label)


def faults_of(form: Filled, faults: Sequence[Fault]) -> Faults:
    """Faults of the spec of a form by their fields."""
    found: Faults = {}
    for fault in faults:
        texts = found.setdefault(form.field_of(fault.where or ""), [])
        texts += [text] if (text := message(fault)) not in texts else []
    return found


def shown(study: Study, values: Values, faults: Faults | None) -> dict[str, Any]:
    """What the template of the form is filled with, beside the macros of ``_fields.html``; ``faults`` are None where
    it was not checked.
    """
    reading = Reading(study.model)
    infos = [info for info in models.study_results(study) if info.kind != "category"]
    units = {path: unit_of(study, path) for path in study.base if path not in study.derive}
    names = {info.name: info.unit for info in infos}
    example = [name for name in (*models.presentation_of(study).along[:1], infos[0].name) if name in units | names]
    empty = frozenset(name for name, text in values.items() if not text.strip())
    return {
        "values": values,
        "faults": faults or {},
        "checked": Checked({}, faults=faults or {}, empty=empty),
        "begun": faults is not None,
        "model": study.model,
        "parts": PARTS,
        "rows": {name: range(rows.count(values)) for name, rows in PARTS.items()},
        "unknown": _parameters(study, units),
        "measured": grouped_results(reading, infos),
        "rare": [described(entry, "/calibrate") for entry in RARE.values()],
        "headings": [(_("Parameters"), list(units.items())), (_("Results"), list(names.items()))],
        "example": ",".join([*(f"{name} [{(units | names)[name]}]" for name in example), "sigma"]),
        "opened": {
            "sensors": _is_filled(values, faults, "/calibrate/sensors"),
            "rare": any(
                values.get(name, "") not in ("", entry.default) or name in (faults or {})
                for name, entry in RARE.items()
            ),
        },
    }  # fmt: skip


def _is_filled(values: Values, faults: Faults | None, pointer: str) -> bool:
    """Whether one of the fields that begin with ``pointer`` has a text or a fault."""
    filled = (name for name, text in values.items() if text.strip())
    return any(name.startswith(pointer) for name in (*filled, *(faults or ())))


def _parameters(study: Study, units: Mapping[str, str]) -> Groups:
    """The parameters that can be unknown, by group, with their values, and those of all parts of a kind alike."""
    groups = grouped(study.model, units)
    values = {path: f"{number(study.base[path])} {unit_text(unit)}".removesuffix(" 1") for path, unit in units.items()}
    alike: dict[str, list[str]] = {}
    for path in units:
        alike.setdefault(re.sub(r"\.\d+\.", ".*.", path), []).append(path)
    tied = [Choice(pattern, bare_caption(study.model, paths[0], gettext), units[paths[0]])
            for pattern, paths in alike.items() if len(paths) > 1]  # fmt: skip
    return [
        *([(_("all of them alike"), tied)] if tied else []),
        *((title, [Choice(one.path, f"{one.label}, {values[one.path]}", "1") for one in own]) for title, own in groups),
    ]
