"""Conversion between the fields of a machine shaft and the ``base`` of its spec."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from sprag.service.http.web.form.entries import Faults, Values, plain, text_of
from sprag.service.http.web.form.shaft import CONSTANTS, DRIVE, Entry, blocks, owners, parts_of, stages_of
from sprag.service.languages import N_, _, gettext
from sprag.service.reading.together import with_last_unit
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.spec.machine.shaft_drive import MOTOR
from sprag.service.spec.machine.shaft_parts import MECHANISM_CHOICES

_STEP: Final = (N_("from"), N_("to"), N_("value"))
_PLACES: Final = {"angle": ("angle", "rad"), "stroke": ("fraction", "1"), "time": ("time", "s")}
_TEXTS: Final = ("formula", "csv")
_FORMS: Final = ("value", "steps", "formula", "csv", "gas", "indicator")


def base_of(values: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The base of a filled form; ``faults`` gets what cannot be expressed, by field."""
    base: dict[str, Any] = {"drive": {}}
    if parts_of(values):
        base["parts"] = [{} for _ in range(parts_of(values))]
    if stages_of(values):
        base["drive"]["stages"] = [{} for _ in range(stages_of(values))]
    for owner in owners(values):
        _open(base, values, owner)
    motor = values.get(DRIVE, "found")
    if motor in MOTOR.values:
        base["drive"]["motor"] = {"kind": motor}
    flywheel = values.get("/base/drive/flywheel", "none")
    if flywheel != "none":
        base["drive"]["flywheel"] = {"kind": flywheel}
    for block in blocks(values):
        for entry in block.entries:
            text = values.get(entry.name, "")
            if not text.strip() and entry.field.choices and not entry.own:
                text = entry.field.choices[0][0]
            if text.strip() and not entry.own:
                _put(base, entry, text, faults)
    return base


def _open(base: dict[str, Any], values: Mapping[str, str], owner: str) -> None:
    """The objects of the chosen mechanism and operation, even where none of their fields is filled in."""
    place = base if owner == "/base" else base["parts"][int(owner.rpartition("/")[2])]
    kind, form = values.get(f"{owner}/mechanism", "none"), values.get(f"{owner}/operation", "none")
    if kind != "none":
        place["mechanism"] = {} if kind in _TEXTS else {kind: {}}
    if form != "none":
        place["operation"] = {form: {}} if form in {"gas", "indicator"} else {}


def _put(base: dict[str, Any], entry: Entry, text: str, faults: Faults) -> None:
    """Put the value of a field at its pointer."""
    *path, name = entry.name.removeprefix("/base/").split("/")
    place: Any = base
    for key in path:
        place = place[int(key)] if isinstance(place, list) else place.setdefault(key, {})
    if entry.name == CONSTANTS:
        place[name] = _constants(text, faults)
    elif entry.lines and name == "steps":
        place[name] = _steps(text)
    else:
        place[name] = text.strip() if entry.lines or entry.field.choices else plain(text)


def _steps(text: str) -> list[dict[str, Any]]:
    """The steps of an operation, one a line; a unit at the end of a column holds for the bare numbers above it."""
    rows = [[text.strip() for text in line.split(";")] for line in text.splitlines() if line.strip()]
    places = iter(with_last_unit([text for row in rows for text in row[:2]]))
    levels = iter(with_last_unit([text for row in rows for text in row[2:3]]))
    return [_step([*(next(places) for _ in row[:2]), *(next(levels) for _ in row[2:3]), *row[3:]]) for row in rows]


def _step(texts: list[str]) -> dict[str, Any]:
    """One step of an operation; what is missing is reported by the reader of the spec."""
    found = {name: plain(text) for name, text in zip(_STEP, texts, strict=False) if text}
    return found | ({"further": "; ".join(texts[3:])} if len(texts) > len(_STEP) else {})


def _constants(text: str, faults: Faults) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        name, equals, value = line.partition("=")
        if line.strip() and not equals:
            message = _(
                "line {number} has no equals sign; got {line}; allowed: lines such as k = 40",
                number=number,
                line=line.strip(),
            )
            faults.setdefault(CONSTANTS, []).append(message)
        elif line.strip():
            found[name.strip()] = plain(value)
    return found


def field_of_base(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the base is shown; "" for the whole form."""
    known = {entry.name for block in blocks(values) for entry in block.entries}
    place = pointer
    while place not in known and place != "/base":
        place = place.rpartition("/")[0] or "/base"
    if place in known and not (place == pointer and place in {"/base/drive/flywheel"}):
        return place
    under = sorted(name for name in known if name.startswith(f"{pointer}/") and pointer != "/base")
    if pointer in {"/base/drive/torque", "/base/drive/motor", "/base/balance"}:
        return DRIVE
    return under[0] if under else ""


def step_of(pointer: str) -> str:
    """What is at fault within a field of steps, for its message: ``step 2, from: ``; "" elsewhere."""
    found = re.fullmatch(r".*/operation/steps/(\d+)(?:/(\w+))?", pointer)
    if found is None:
        return ""
    step = _("step {number}", number=int(found[1]) + 1)
    return f"{step}, {gettext(found[2])}: " if found[2] else f"{step}: "


def values_of_base(base: Mapping[str, Any]) -> Values:
    """The form's values for a base; raises ValueError where the form cannot show it."""
    values: Values = {DRIVE: "found", "/base/drive/flywheel": "none"}
    for key, content in base.items():
        if key == "drive":
            values |= _drive_values(content)
        elif key == "parts":
            values["parts"] = str(len(content))
            for index, part in enumerate(content):
                values |= _owner_values(f"/base/parts/{index}", part)
        elif key == "constants":
            values[CONSTANTS] = "\n".join(f"{name} = {text_of(value)}" for name, value in content.items())
        elif key not in {"mechanism", "operation"}:
            values[f"/base/{key}"] = _text(content)
    if "parts" not in base:
        values |= _owner_values("/base", base)
    return values


def _text(value: Any) -> str:
    if isinstance(value, Mapping | list):
        raise ValueError("the form has no fields for all of this machine")
    return text_of(value)


def _drive_values(drive: Mapping[str, Any]) -> Values:
    values: Values = {}
    for key, content in drive.items():
        if key == "stages":
            values["stages"] = str(len(content))
            for index, own in enumerate(content):
                values |= {f"/base/drive/stages/{index}/{name}": _text(value) for name, value in own.items()}
        elif key == "flywheel":
            values["/base/drive/flywheel"] = _text(content.get("kind"))
            values |= {f"/base/drive/flywheel/{name}": _text(v) for name, v in content.items() if name != "kind"}
        elif key == "motor":
            values[DRIVE] = _text(content.get("kind"))
            rows = {"table", "csv", "interpolation"}
            values |= {
                f"/base/drive/motor/{name}": _text(v) for name, v in content.items() if name not in {"kind", *rows}
            }
            if rows & set(content):
                values |= _diagram_values("/base/drive/motor", content, ("speed", "rad/s"), ("torque", "N*m"))[1]
        elif key == "torque" and isinstance(content, Mapping):
            form, own = _diagram_values("/base/drive/torque", content, ("angle", "rad"), ("torque", "N*m"))
            values |= {DRIVE: form} | own
        else:
            values[f"/base/drive/{key}"] = _text(content)
    if "torque" in drive and DRIVE not in values:
        values[DRIVE] = "value"
    return values


def _owner_values(owner: str, found: Mapping[str, Any]) -> Values:
    values: Values = {f"{owner}/mechanism": "none", f"{owner}/operation": "none"}
    if "crank_angle" in found:
        values[f"{owner}/crank_angle"] = _text(found["crank_angle"])
    mechanism = found.get("mechanism") or {}
    kind = next((name for name in MECHANISM_CHOICES if name in mechanism), "")
    if kind:
        values[f"{owner}/mechanism"] = kind
        values |= {f"{owner}/mechanism/{kind}/{name}": _text(value) for name, value in mechanism[kind].items()}
    elif mechanism:
        form, own = _diagram_values(f"{owner}/mechanism", mechanism, ("angle", "rad"), ("inertia", "kg*m^2"))
        values |= {f"{owner}/mechanism": form} | own
    return values | _operation_values(f"{owner}/operation", found.get("operation") or {})


def _operation_values(pointer: str, operation: Mapping[str, Any]) -> Values:
    if not operation:
        return {}
    values: Values = {}
    form = next((name for name in (*_FORMS, "table") if name in operation), "")
    place = _PLACES.get(operation.get("over", "angle"), _PLACES["angle"])
    for key, content in operation.items():
        if key in {"table", "csv", "formula", "interpolation"}:
            continue
        if key == "gas":
            values |= {f"{pointer}/gas/{name}": _text(value) for name, value in content.items()}
        elif key == "indicator":
            over = _PLACES.get(content.get("over", "angle"), _PLACES["angle"])
            values |= {f"{pointer}/indicator/{name}": _text(value) for name, value in content.items()
                       if name not in {"table", "csv", "interpolation"}}  # fmt: skip
            values |= _diagram_values(f"{pointer}/indicator", content, over, ("pressure", "Pa"))[1]
        elif key == "steps":
            values[f"{pointer}/steps"] = "\n".join("; ".join(_text(step[n]) for n in _STEP) for step in content)
        else:
            values[f"{pointer}/{key}"] = _text(content)
    if form in {"table", "csv", "formula"}:
        unit = ("force", "N") if operation.get("quantity") == "force" else ("torque", "N*m")
        form, own = _diagram_values(pointer, operation, place, unit)
        values |= own
    return values | {pointer: form}


def _diagram_values(
    pointer: str, found: Mapping[str, Any], place: tuple[str, str], value: tuple[str, str]
) -> tuple[str, Values]:
    """The form and the values of a formula or a table; rows become the text of a CSV file in SI units."""
    values = {f"{pointer}/{name}": _text(found[name]) for name in (*_TEXTS, "interpolation") if name in found}
    if "table" in found:
        rows = [f"{_si(first, place[1])!r},{_si(second, value[1])!r}" for first, second in found["table"]]
        heading = ",".join(name if unit == "1" else f"{name} [{unit}]" for name, unit in (place, value))
        values[f"{pointer}/csv"] = "\n".join([heading, *rows])
    return "formula" if "formula" in found else "csv", values


def _si(value: Any, unit: str) -> float:
    try:
        return parse_quantity(value, unit)
    except QuantityError as error:
        raise ValueError(str(error)) from error
