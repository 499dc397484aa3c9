"""Conversion between the form's fields and the study spec. Only the spec's reader interprets the fields."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from sprag.service.faults import Fault
from sprag.service.http.web.form.cases import (
    blocks_of,
    case_values,
    exclusions_of,
    field_of_block,
    field_of_exclusion,
    repeated_limits,
)
from sprag.service.http.web.form.correlations import correlation_values, correlations_of, field_of_correlation
from sprag.service.http.web.form.entries import (
    Faults,
    Values,
    count_in,
    entries_of,
    items_of,
    list_of,
    list_text,
    names_of,
    path_values,
    paths_of,
    plain,
    range_of,
    text_of,
)
from sprag.service.http.web.form.fields import FORM_MODEL, pendulum, sections
from sprag.service.http.web.form.goal import GOAL_DEFAULTS, field_of_goal, goal_of, goal_values
from sprag.service.http.web.form.parts import count_of
from sprag.service.http.web.form.shaft import is_shaft
from sprag.service.http.web.form.shaft_spec import base_of, field_of_base, values_of_base
from sprag.service.http.web.form.tolerances import FIELDS as TOLERANT
from sprag.service.http.web.form.tolerances import field_of_tolerance, tolerance_values, tolerances_of
from sprag.service.languages import _, gettext
from sprag.service.reading.faults import allowed_text, fault_text
from sprag.service.reading.phrases import lower_first
from sprag.service.reading.printed import could_be_several
from sprag.service.reading.together import with_last_unit
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.reading.wording import unit_text
from sprag.service.spec.axes.sweep import SWEPT
from sprag.service.spec.derive import formulas_of, with_values
from sprag.service.spec.measured import MeasuredDataError, parse_measured
from sprag.service.spec.plan import refine
from sprag.service.spec.run import TIMED_DEFAULTS, TIMED_FIELDS, time_text
from sprag.worker.models import MACHINE_SHAFT, MAX_PENDULUMS, SETTLED

#: Fields of an axis for each way of giving its values.
WAYS: Final = {
    "values": ("values",),
    "linspace": ("from", "to", "count"),
    "geomspace": ("from", "to", "count"),
    "range": ("from", "to", "step"),
    "adaptive": ("from", "to"),
}
#: What is asked of a refinement in a form that was not about one.
REFINE_DEFAULTS: Final[Values] = {
    "/refine/results": "shaft.speed.mean; efficiency",
    "/refine/error": refine.ERROR.default_text,
}
#: The form's choice for a run of a given time, which a spec expresses by its duration or window.
TIMED: Final = "time"
_FIELDS: Final = frozenset(
    {
        "sprag",
        "model",
        "name",
        "base",
        "run",
        "axes",
        "combine",
        "derive",
        "refine",
        "goal",
        "correlations",
        "exclude",
        *TOLERANT,
    }
)
#: Fields of the spec of a machine shaft that the form has.
_SHAFT_FIELDS: Final = _FIELDS - {"run"}
#: Beginning of a field with the formula of a derived parameter.
FORMULA: Final = "="


def pendulums_of(values: Mapping[str, str]) -> int:
    """How many pendulums the form has."""
    return count_in(values, "pendulums", 1, 1, MAX_PENDULUMS)


def is_search(values: Mapping[str, str]) -> bool:
    """Whether the form asks for the best designs, not for cases along axes."""
    return values.get("asks") == "goal"


def clutch_pointers(values: Mapping[str, str]) -> list[str]:
    """JSON Pointers of the form's clutches: one for all pendulums, or one in each; a machine shaft has none."""
    if is_shaft(values):
        return []
    if values.get("clutches") == "own":
        return [f"/base/pendulums/{index}/clutch" for index in range(pendulums_of(values))]
    return ["/base/clutch"]


def spec_of(values: Mapping[str, str]) -> tuple[dict[str, Any], Faults]:
    """The spec of a filled form, and the faults, by field, of what cannot be expressed as a spec."""
    faults: Faults = {}
    shaft = is_shaft(values)
    base = base_of(values, faults) if shaft else _drive_base(values, faults)
    model = MACHINE_SHAFT if shaft else FORM_MODEL
    spec: dict[str, Any] = {"sprag": 1, "model": model, **_given(values, "/name", "name"), "base": base}
    if "name" in spec:
        spec["name"] = values["/name"].strip()
    derive = _formulas(base)
    if derive:
        spec["derive"] = derive
    if not shaft:
        spec["run"] = _run(values)
    spec |= tolerances_of(values) | correlations_of(values)
    if is_search(values):
        return spec | {"goal": goal_of(values, faults)}, faults
    axes = [_axis(values, index) for index in range(count_of(values, "axes"))]
    spec["axes"] = [axis for axis in axes if axis is not None] + list(blocks_of(values).values())
    if conditions := exclusions_of(values):
        spec["exclude"] = conditions
        faults |= repeated_limits(values)
    spec["combine"] = values.get("/combine", "grid")
    if any("adaptive" in axis for axis in spec["axes"]):
        spec["refine"] = _refine(values)
    return spec, faults


def _drive_base(values: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The base of a vibration drive."""
    base: dict[str, Any] = {}
    for section in sections():
        found = _object(values, section.pointer, [field.name for field in section.fields])
        base |= found if section.pointer == "/base" else {section.pointer.removeprefix("/base/"): found}
    base["pendulums"] = [
        _object(values, f"/base/pendulums/{index}", [field.name for field in pendulum(index).fields])
        for index in range(pendulums_of(values))
    ]
    for pointer in clutch_pointers(values):
        clutch = _clutch(values, pointer, faults)
        if pointer == "/base/clutch":
            base["clutch"] = clutch
        else:
            base["pendulums"][int(pointer.split("/")[3])]["clutch"] = clutch
    return base


def _refine(values: Mapping[str, str]) -> dict[str, Any]:
    """What a form with an adaptive axis asks for."""
    found = _object(values, "/refine", [f"/refine/{name}" for name in refine.FIELDS if name != "results"])
    names = names_of(values.get("/refine/results", ""))
    return {**({"results": names} if names else {}), **found}


def _formulas(base: dict[str, Any]) -> dict[str, str]:
    """Take the formulas out of ``base``: they are texts that begin with an equals sign."""
    found: dict[str, str] = {}

    def take(place: Any, prefix: str) -> None:
        for key, value in list(place.items() if isinstance(place, dict) else enumerate(place)):
            if isinstance(value, dict | list):
                take(value, f"{prefix}{key}.")
            elif isinstance(value, str) and value.startswith(FORMULA):
                found[f"{prefix}{key}"] = value.removeprefix(FORMULA).strip()
                if isinstance(place, dict):
                    del place[key]
                else:
                    place[key] = None

    take(base, "")
    return found


def _given(values: Mapping[str, str], name: str, key: str) -> dict[str, Any]:
    text = values.get(name, "").strip()
    return {key: plain(text)} if text else {}


def _object(values: Mapping[str, str], pointer: str, names: list[str]) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in names:
        found |= _given(values, name, name.removeprefix(f"{pointer}/"))
    return found


def _clutch(values: Mapping[str, str], pointer: str, faults: Faults) -> dict[str, Any]:
    if values.get(f"{pointer}/kind", "law") != "data":
        coefficients = values.get(f"{pointer}/coefficients", "")
        # Blanks also separate numbers, where there is no unit among them.
        if could_be_several(coefficients):
            faults[f"{pointer}/coefficients"] = [
                _("could be one coefficient or several; allowed: semicolons between coefficients, or no blanks")
            ]
        elif re.fullmatch(r"(?:[-+0-9.eE\s]|,[0-9])+", coefficients):
            coefficients = "; ".join(coefficients.split())
        return {
            # Each coefficient has a unit of its own: that of the last one holds for no other.
            **({"coefficients": entries_of(items_of(coefficients))} if coefficients.strip() else {}),
            **_given(values, f"{pointer}/windup_limit", "windup_limit"),
        }
    found: dict[str, Any] = {"data": None}
    text = values.get(f"{pointer}/data", "")
    if text.strip():
        try:
            measured = parse_measured(text, parse_quantity)
            found["data"] = measured.rows.tolist()
        except MeasuredDataError as error:
            faults[f"{pointer}/data"] = [_fault_text(fault) for fault in error.faults]
    found |= _given(values, f"{pointer}/accuracy", "accuracy") | _given(values, f"{pointer}/max_degree", "max_degree")
    # An unticked box is not sent, so both values are written explicitly.
    found["through_origin"] = values.get(f"{pointer}/through_origin") == "on"
    found["angles_include_backlash"] = values.get(f"{pointer}/angles_include_backlash") == "on"
    return found


def _fault_text(fault: Fault) -> str:
    """A fault of measured data as a sentence: the line, the fault, the value, what is allowed."""
    line = re.fullmatch(r"line (\d+)", fault.where or "")
    place = _("line {line}", line=line[1]) if line else _("the table")
    parts = [f"{place}: {lower_first(fault_text(fault))}"]
    if fault.value is not None:
        parts.append(gettext("got {value}", value=fault.value))
    if fault.allowed:
        parts.append(gettext("allowed: {allowed}", allowed=unit_text(allowed_text(fault.allowed))))
    return "; ".join(parts)


def _run(values: Mapping[str, str]) -> dict[str, Any]:
    run = _object(
        values, "/run", ["/run/at_most", "/run/max_period", "/run/settled", "/run/duration", "/run/tolerance"]
    )
    window = [plain(text) for text in with_last_unit([values.get(f"/run/window/{index}", "") for index in (0, 1)])]
    if any(window):
        run["window"] = window
    if values.get("/run/until", SETTLED) == SETTLED:
        run = {"until": SETTLED, **run}
    elif not any(window):
        run.setdefault("duration", time_text(TIMED_DEFAULTS["duration"]))
    if values.get("/run/reset", "contact") != "contact":
        run["reset"] = values["/run/reset"]
    return run


def _axis(values: Mapping[str, str], index: int) -> dict[str, Any] | None:
    """One axis; None for one in which nothing is filled in."""
    pointer = f"/axes/{index}"
    path = paths_of(values, pointer)
    way = values.get(f"{pointer}/way", "values")
    names = WAYS.get(way, ("values",))
    texts = [values.get(f"{pointer}/{name}", "").strip() for name in names]
    if not path and not any(texts):
        return None
    axis: dict[str, Any] = {"path": path}
    axis[way] = list_of(texts[0]) if way == "values" else list(range_of(values, f"{pointer}/", names).values())
    swept = values.get(f"{pointer}/{SWEPT.name}", "")
    return axis | ({SWEPT.name: swept} if swept else {})


def field_of(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the spec is shown; "" for the whole form."""
    if pointer.startswith("/derive/"):
        pointer = "/base/" + pointer.removeprefix("/derive/").replace(".", "/")
    if pointer == "/refine" or pointer.startswith("/refine/results"):
        return "/refine/results"
    if pointer.startswith("/goal"):
        return field_of_goal(pointer, values)
    if pointer.startswith("/tolerances"):
        return field_of_tolerance(pointer, values)
    if pointer.startswith("/correlations"):
        return field_of_correlation(pointer, values)
    if is_shaft(values) and pointer.startswith("/base"):
        return field_of_base(pointer, values)
    if pointer.startswith("/exclude"):
        return field_of_exclusion(pointer, values)
    match = re.fullmatch(r"/axes/(\d+)(?:/(.*))?", pointer)
    if match:
        # Axes that are not filled in are not in the spec.
        filled = [index for index in range(count_of(values, "axes")) if _axis(values, index) is not None]
        if int(match[1]) >= len(filled) and blocks_of(values):
            return field_of_block(int(match[1]) - len(filled), match[2] or "", values)
        index = filled[int(match[1])] if int(match[1]) < len(filled) else int(match[1])
        rest = match[2] or "path"
        if rest == SWEPT.name:
            return f"/axes/{index}/{rest}"
        way, _, item = rest.partition("/")
        names = WAYS.get(way)
        if names is None:
            return f"/axes/{index}/path"
        inside = item if item.isdigit() and int(item) < len(names) else "0"
        return f"/axes/{index}/{names[0] if way == 'values' else names[int(inside)]}"
    for pattern in (r"(.*/clutch/(?:data|coefficients))(?:/.*)?", r"(/base/[a-z]+/[a-z_]+)/[a-z_]+"):
        found = re.fullmatch(pattern, pointer)
        if found and "pendulums" not in found[1].split("/")[-1]:
            return found[1]
    if re.fullmatch(r"(.*/clutch)", pointer):
        return f"{pointer}/coefficients" if values.get(f"{pointer}/kind", "law") == "law" else f"{pointer}/data"
    return "/run/window/0" if pointer == "/run/window" else pointer


def values_of(spec: Mapping[str, Any]) -> Values:
    """The form's values for ``spec``; raises ValueError where the form cannot show it."""
    shaft = spec.get("model") == MACHINE_SHAFT
    if not shaft and spec.get("model") != FORM_MODEL:
        raise ValueError("the form describes another model")
    if not set(spec) <= (_SHAFT_FIELDS if shaft else _FIELDS) or spec.get("combine", "grid") not in ("grid", "zip"):
        raise ValueError("the form has no fields for all of this spec")
    axes = [axis for axis in spec.get("axes", ()) if isinstance(axis, Mapping) and not {"sample", "points"} & set(axis)]
    blocks = list(spec.get("axes", ()))[len(axes) :]
    if not all(map(_plain_axis, axes)) or not all({"sample", "points"} & set(block) for block in blocks):
        raise ValueError("the form has no fields for all of these axes")
    values: Values = {"/name": str(spec.get("name", "")), "/combine": str(spec.get("combine", "grid"))}
    formulas = {path: f"{FORMULA} {text}" for path, text in formulas_of(spec).items()}
    base: Mapping[str, Any] = with_values(spec["base"], formulas)
    values |= {"model": MACHINE_SHAFT} | values_of_base(base) if shaft else _drive_values(spec, base)
    values |= {"asks": "goal" if "goal" in spec else "axes"} | REFINE_DEFAULTS
    values |= goal_values(spec["goal"]) if "goal" in spec else GOAL_DEFAULTS
    for key, content in spec.get("refine", {}).items():
        values[f"/refine/{key}"] = "; ".join(content) if key == "results" else text_of(content)
    values |= tolerance_values(spec, values) | correlation_values(spec)
    values |= case_values(blocks, spec.get("exclude", ()))
    values["axes"] = str(len(axes))
    for index, axis in enumerate(axes):
        values |= _axis_values(f"/axes/{index}", axis)
    return values


def _drive_values(spec: Mapping[str, Any], base: Mapping[str, Any]) -> Values:
    """The form's values for base and run of a vibration drive."""
    values: Values = {}
    for key, content in base.items():
        if key == "clutch":
            values |= _clutch_values("/base/clutch", content)
        elif key == "pendulums":
            values["pendulums"] = str(len(content))
            for index, item in enumerate(content):
                if "clutch" in item:
                    values["clutches"] = "own"
                    values |= _clutch_values(f"/base/pendulums/{index}/clutch", item["clutch"])
                values |= {f"/base/pendulums/{index}/{k}": text_of(v) for k, v in item.items() if k != "clutch"}
        elif isinstance(content, Mapping):
            values |= {f"/base/{key}/{name}": text_of(value) for name, value in content.items()}
        else:
            values[f"/base/{key}"] = text_of(content)
    run = spec.get("run", {})
    values["/run/until"] = TIMED if any(name in run for name in TIMED_FIELDS) else SETTLED
    for key, content in run.items():
        if key == "window":
            values |= {f"/run/window/{index}": text_of(item) for index, item in enumerate(content)}
        else:
            values[f"/run/{key}"] = text_of(content)
    return values


def with_clutch_defaults(values: Values) -> Values:
    """The values, with the boxes of the clutches ticked according to the spec's defaults."""
    return values | {f"{pointer}/through_origin": "on" for pointer in clutch_pointers(values)}


def _plain_axis(axis: Mapping[str, Any]) -> bool:
    """Whether an axis gives its values in one of the form's ways."""
    return any(set(axis) - {SWEPT.name} == {"path", way} for way in WAYS)


def _clutch_values(pointer: str, clutch: Mapping[str, Any]) -> Values:
    if "data" not in clutch:
        found = {f"{pointer}/kind": "law", f"{pointer}/coefficients": "; ".join(map(text_of, clutch["coefficients"]))}
        # Ticked in case measured data replace the coefficients; this is the spec's default.
        found[f"{pointer}/through_origin"] = "on"
        return found | {f"{pointer}/windup_limit": text_of(clutch[key]) for key in ("windup_limit",) if key in clutch}
    rows = [f"{_si(angle, 'rad')!r}\t{_si(torque, 'N*m')!r}" for angle, torque in clutch["data"]]
    found = {f"{pointer}/kind": "data", f"{pointer}/data": "\n".join(["angle_rad\ttorque_Nm", *rows])}
    found |= {f"{pointer}/{key}": text_of(clutch[key]) for key in ("accuracy", "max_degree") if key in clutch}
    flags = {"through_origin": clutch.get("through_origin", True)}
    flags["angles_include_backlash"] = clutch.get("angles_include_backlash", False)
    return found | {f"{pointer}/{name}": "on" for name, ticked in flags.items() if ticked}


def _si(value: Any, unit: str) -> float:
    try:
        return parse_quantity(value, unit)
    except QuantityError as error:
        raise ValueError(str(error)) from error


def _axis_values(pointer: str, axis: Mapping[str, Any]) -> Values:
    way = next(name for name in WAYS if name in axis)
    found = {**path_values(pointer, axis["path"]), f"{pointer}/way": way}
    found |= {f"{pointer}/{SWEPT.name}": str(axis[SWEPT.name])} if SWEPT.name in axis else {}
    if way == "values":
        return found | {f"{pointer}/values": list_text(axis[way])}
    return found | {f"{pointer}/{name}": text_of(item) for name, item in zip(WAYS[way], axis[way], strict=True)}
