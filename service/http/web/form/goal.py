"""The search of a form, `goal` of the spec: variables, goals, limits, operating points."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from sprag.service.http.web.form.entries import (
    Faults,
    Values,
    list_of,
    list_text,
    path_values,
    paths_of,
    plain,
    range_of,
    text_of,
    unclear,
)
from sprag.service.http.web.form.parts import PARTS, filled
from sprag.service.languages import N_, _
from sprag.service.reading.together import with_last_unit
from sprag.service.spec.kinds.goal import GOAL

#: What a search asks for in a form that was not about one.
GOAL_DEFAULTS: Final[Values] = {
    "vary": "1",
    "best": "1",
    "subject_to": "0",
    "at": "0",
    "/goal/vary/0/way": "from",
    "/goal/best/0/toward": "max",
    "/goal/population": GOAL.described["population"].default_text,
    "/goal/generations": GOAL.described["generations"].default_text,
    "/goal/over": "worst",
    "/goal/polish": "on",
}
#: Kinds of limits with their labels.
LIMITS: Final = (("at_most", N_("at most")), ("at_least", N_("at least")), ("is", N_("equal to")))
_NUMBERS: Final = ("population", "generations", "seed")
_VARIABLE: Final = {"from": ("from", "to"), "values": ("values",)}


def goal_of(values: Mapping[str, str], faults: Faults) -> dict[str, Any]:
    """The search that a form asks for; ``faults``, by field, get what cannot be expressed in a spec."""
    found: dict[str, Any] = {"vary": [_variable(values, index) for index in filled(values, "vary")]}
    best = [_best(values, index) for index in filled(values, "best")]
    limits = [_limit(values, index) for index in filled(values, "subject_to")]
    points = _points(values, faults)
    found |= {name: part for name, part in (("best", best), ("subject_to", limits), ("at", points)) if part}
    if values.get("/goal/over", "worst") != "worst":
        found["over"] = values["/goal/over"]
    found |= {name: plain(text) for name in _NUMBERS if (text := values.get(f"/goal/{name}", "").strip())}
    return found | ({} if values.get("/goal/polish") == "on" else {"polish": False})


def _variable(values: Mapping[str, str], index: int) -> dict[str, Any]:
    pointer = f"/goal/vary/{index}"
    way = values.get(f"{pointer}/way", "from")
    if way == "values":
        return {"path": paths_of(values, pointer), "values": list_of(values.get(f"{pointer}/values", ""))}
    return {"path": paths_of(values, pointer)} | range_of(values, f"{pointer}/")


def _best(values: Mapping[str, str], index: int) -> dict[str, Any]:
    pointer = f"/goal/best/{index}"
    largest = values.get(f"{pointer}/toward", "max") == "max"
    return {"result": values[f"{pointer}/result"]} | ({"max": True} if largest else {})


def _limit(values: Mapping[str, str], index: int) -> dict[str, Any]:
    pointer = f"/goal/subject_to/{index}"
    kind = values.get(f"{pointer}/kind", "at_most")
    value, within = values.get(f"{pointer}/value", ""), values.get(f"{pointer}/within", "") if kind == "is" else ""
    value, within = (text.strip() for text in with_last_unit([value, within]))
    return {
        "result": values.get(f"{pointer}/result", "") or None,
        kind: plain(value),
        **({"within": plain(within)} if within else {}),
    }


def _points(values: Mapping[str, str], faults: Faults) -> list[dict[str, Any]]:
    """The operating points: the lists of the parameters, value by value."""
    columns: dict[str, list[Any]] = {}
    for index in filled(values, "at"):
        pointer = f"/goal/at/{index}"
        path, column = values.get(f"{pointer}/path", ""), list_of(values.get(f"{pointer}/values", ""))
        if not path or path in columns:
            faults[f"{pointer}/path"] = [_("is a parameter of the points already") if path else _("is required")]
        first = next(iter(columns.values()), column)
        if not column:
            faults[f"{pointer}/values"] = [_("is required; allowed: one value for each operating point")]
        elif unclear(column):
            faults[f"{pointer}/values"] = [
                _("could be one value or several; allowed: semicolons between values, or no blanks")
            ]
        elif len(column) != len(first):
            message = _(
                "must have as many values as the first parameter, {first}; got {count}; allowed: one value for each "
                "operating point",
                first=len(first),
                count=len(column),
            )
            faults[f"{pointer}/values"] = [message]
        columns.setdefault(path, column)
    return [dict(zip(columns, point, strict=True)) for point in zip(*columns.values(), strict=False)]


def field_of_goal(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the spec, in or below `/goal`, is shown."""
    match = re.fullmatch(r"/goal/([a-z_]+)/(\d+)(?:/(.*))?", pointer)
    if match is None:
        return pointer if pointer.rpartition("/")[2] in {*PARTS, *GOAL.described} else "/goal"
    part, place, rest = match[1], int(match[2]), (match[3] or "").partition("/")[0]
    rows = filled(values, part)
    if part == "at":
        # A row of the form is a parameter, with its values at all points.
        column = next((row for row in rows if values.get(f"/goal/at/{row}/path") == rest), rows[0] if rows else 0)
        return f"/goal/at/{column}/values"
    row = f"/goal/{part}/{rows[place] if place < len(rows) else place}"
    if part == "vary":
        names = _VARIABLE.get(values.get(f"{row}/way", "from"), ())
        return f"{row}/{rest if rest in names else 'path' if rest == 'path' else names[0]}"
    if rest in {kind for kind, _ in LIMITS}:
        return f"{row}/value"
    return f"{row}/{rest if rest == 'within' else 'result'}"


def goal_values(found: Mapping[str, Any]) -> Values:
    """The form's values for `goal` of a spec; raises ValueError where the form cannot show it."""
    if not set(found) <= {"vary", "best", "subject_to", "at", "over", "polish", *_NUMBERS}:
        raise ValueError("the form has no fields for all of this search")
    values: Values = {"/goal/over": str(found.get("over", "worst"))}
    values |= {"/goal/polish": "on"} if found.get("polish", True) else {}
    values |= {f"/goal/{name}": text_of(found[name]) for name in _NUMBERS if name in found}
    for index, item in enumerate(found.get("vary", ())):
        values |= _variable_values(f"/goal/vary/{index}", item)
    for index, item in enumerate(found.get("best", ())):
        _only(item, "result", "max")
        toward = "max" if item.get("max", False) else "min"
        values |= {f"/goal/best/{index}/result": item["result"], f"/goal/best/{index}/toward": toward}
    for index, item in enumerate(found.get("subject_to", ())):
        kind = next(kind for kind, _ in LIMITS if kind in item)
        _only(item, "result", kind, "within")
        row: Values = {"result": item["result"], "kind": kind, "value": text_of(item[kind])}
        row |= {"within": text_of(item["within"])} if "within" in item else {}
        values |= {f"/goal/subject_to/{index}/{name}": text for name, text in row.items()}
    points = found.get("at", ())
    for index, path in enumerate(points[0] if points else ()):
        row = {"path": path, "values": "; ".join(text_of(point[path]) for point in points)}
        values |= {f"/goal/at/{index}/{name}": text for name, text in row.items()}
    counts = {"at": len(points[0]) if points else 0}
    counts |= {part: len(found.get(part, ())) for part in ("vary", "best", "subject_to")}
    return values | {part: str(count) for part, count in counts.items()}


def _variable_values(pointer: str, item: Mapping[str, Any]) -> Values:
    way = "values" if "values" in item else "from"
    _only(item, "path", *_VARIABLE[way])
    values = path_values(pointer, item["path"]) | {f"{pointer}/way": way}
    if way == "values":
        return values | {f"{pointer}/values": list_text(item["values"])}
    return values | {f"{pointer}/{name}": text_of(item[name]) for name in ("from", "to")}


def _only(item: Mapping[str, Any], *names: str) -> None:
    if not set(item) <= set(names):
        raise ValueError("the form has no fields for all of this search")
