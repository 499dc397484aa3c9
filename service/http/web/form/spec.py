"""The spec of a study as fields of a form: one description, from which the spec of the fields and the fields of a spec
are made. Only the spec's reader interprets the fields.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, Final

from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    list_of,
    list_text,
    names_of,
    plain,
    text_of,
    unclear,
)
from sprag_study.service.http.web.form.machine import form_of, model_name
from sprag_study.service.http.web.form.machine_spec import Machine
from sprag_study.service.http.web.form.tolerances import BATCH, FIELDS, Tolerances, with_batch
from sprag_study.service.http.web.form.walk import Cell, Filled, Record, Rows, chosen, described, typed
from sprag_study.service.languages import N_, _
from sprag_study.service.reading.ranges import Spacing, TypedRange, typed_range
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.spec.axes.axes import OF_BASE, SWEPT
from sprag_study.service.spec.axes.sample import SAMPLE, SCALE
from sprag_study.service.spec.component_axes import COMPONENT
from sprag_study.service.spec.components import KINDS
from sprag_study.service.spec.described import ANY_RUN, SETTLED_RUN, SHAFT_RUN
from sprag_study.service.spec.kinds.goal import GOAL
from sprag_study.service.spec.kinds.refine import REFINE
from sprag_study.service.spec.kinds.tolerances import DRAWS
from sprag_study.service.spec.report import join
from sprag_study.service.spec.run import TIMED_DEFAULTS, TIMED_FIELDS, time_text
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_AXES, MAX_QUANTITIES
from sprag_study.worker.models import SETTLED

#: What is asked of a refinement in a form that was not about one.
REFINE_DEFAULTS: Final[Values] = {
    "/refine/results": "shaft.speed.mean; efficiency",
    "/refine/error": REFINE.described["error"].default_text,
}
#: What a search asks for in a form that was not about one.
GOAL_DEFAULTS: Final[Values] = {
    **dict.fromkeys(("vary", "best"), "1"),
    **dict.fromkeys(("subject_to", "at"), "0"),
    "/goal/best/0/toward": "max",
    "/goal/population": GOAL.described["population"].default_text,
    "/goal/generations": GOAL.described["generations"].default_text,
    "/goal/least_gain": GOAL.described["least_gain"].default_text,
    "/goal/over": "worst",
    "/goal/polish": "on",
}
#: Digits of a count of values at most.
_COUNT_DIGITS: Final = 7
#: Entries of an axis that are ranges without a step, and their spacing.
_SPACINGS: Final[dict[str, Spacing]] = {"linspace": "even", "geomspace": "geometric", "adaptive": "refined"}
#: A result, and behind it the error that it may have.
_WITH_ERROR: Final = re.compile(r"\s*(?P<name>[^\s,;:]+)\s*[:\s]\s*(?P<error>[-+.0-9].*?)\s*")
#: Kinds of limits with their labels.
LIMITS: Final = (("at_most", N_("at most")), ("at_least", N_("at least")), ("is", N_("equal to")))
#: Kinds of conditions by which cases are left out, with their labels.
CONDITIONS: Final = (
    ("above", N_("above")), ("below", N_("below")), *reversed(LIMITS[:2]), ("is", N_("equal to (one of a list)"))
)  # fmt: skip
#: Field with points, as the text of a CSV file.
POINTS: Final = "/points"
#: The form's choice for a run of a given time, which a spec expresses by its duration or window.
_TIMED: Final = "time"
#: Conditions and correlations that the form shows; a spec may have more.
_MOST: Final = 20
_TWICE: Final = N_("this parameter already has a limit of this kind; choose another kind, or leave this part empty")


def is_search(values: Mapping[str, str]) -> bool:
    """Whether the form asks for the best designs, not for cases along axes."""
    return values.get("asks") == "goal"


def is_refined(values: Mapping[str, str]) -> bool:
    """Whether an axis of a form is refined between two values."""
    rows = (typed_range(values.get(f"/axes/{row}/values", "")) for row in PARTS["axes"].filled(dict(values)))
    return any(row is not None and row.spacing == "refined" for row in rows)


def _paths(form: Filled) -> dict[str, Any]:
    """The path or the tied paths of what varies; None where there is none."""
    paths = list(filter(None, (form.text("path"), *names_of(form.text("tied")))))
    return {"path": paths if len(paths) > 1 else next(iter(paths), None)}


def _path_fields(item: Mapping[str, Any]) -> Values:
    first, *others = item["path"] if isinstance(item["path"], list) else [item["path"]]
    return {"path": first, "tied": ", ".join(others)}


def with_row_texts(values: Mapping[str, str]) -> Values:
    """A form whose rows of what varies have their values as one text, also where older pages and drafts have fields for
    the ends of a range, and its step or count.
    """
    found = dict(values)
    for name in [name for name in values if re.fullmatch(r"/(?:axes|goal/vary)/\d+/way", name)]:
        row = name.removesuffix("/way")
        way, *texts, count = (found.pop(f"{row}/{part}", "").strip() for part in ("way", "from", "to", "step", "count"))
        if way != "values" and any(texts):
            first, last, step = (text or "?" for text in texts)
            counted = way in ("linspace", "geomspace") and count.isdecimal() and len(count) <= _COUNT_DIGITS
            number = int(count) if counted else None
            found[f"{row}/values"] = TypedRange(
                first, last, step if way == "range" else "", number, _SPACINGS.get(way, "even")
            ).text
    return found


def _range_of(form: Filled) -> TypedRange | None:
    """The range that the values of a row are; None for a list, and for what is not a range."""
    return typed_range(form.text("values"))


def _axis_values(form: Filled) -> dict[str, Any]:
    written = _range_of(form)
    if written is None or (written.count is None and not written.step and written.spacing == "even"):
        return {"values": form.listed("values")}  # of which the reader of the spec asks how many values it has
    numbers = form.together(written.numbers, ["values"] * len(written.numbers))
    counts = [] if written.count is None else [written.count]
    way = next(way for way, spacing in _SPACINGS.items() if spacing == written.spacing)
    if way == "adaptive":
        include = [*numbers[2:], *([OF_BASE] if written.of_base else [])]
        return {way: numbers[:2], **({"include": include} if include else {})}
    return {"range" if written.step else way: [*numbers, *counts]}


def _axis_text(item: Mapping[str, Any]) -> Values:
    if "values" in item:
        return {"values": list_text(item["values"])}
    way = next((way for way in _AXIS_VALUES.keys if way in item), "")
    first, last, *more = map(text_of, item[way])
    if len(more) != (way != "adaptive") or (way in ("linspace", "geomspace") and not more[0].isdecimal()):
        raise ValueError("the form has no field for this range")
    step, count = (more[0], None) if way == "range" else ("", int(more[0]) if more else None)
    include = item.get("include", []) if way == "adaptive" else []
    others = tuple(text_of(value) for value in include if value != OF_BASE)
    spacing = _SPACINGS.get(way, "even")
    return {"values": TypedRange(first, last, step, count, spacing, others, len(others) < len(include)).text}


def _variable_values(form: Filled) -> dict[str, Any]:
    return _ends(form, "values") or {"values": form.listed("values")}


def _variable_text(item: Mapping[str, Any]) -> Values:
    return {"values": list_text(item["values"]) if "values" in item else _ends_text(item)}


def _ends(form: Filled, name: str) -> dict[str, Any]:
    """The ends of the range that a field has; none where it has anything else, such as a range with a step."""
    written = typed_range(form.text(name))
    if written is None or written.count is not None or written.step or written.spacing != "even":
        return {}
    return dict(zip(("from", "to"), form.together([written.first, written.last], [name] * 2), strict=True))


def _ends_text(item: Mapping[str, Any]) -> str:
    return TypedRange(text_of(item["from"]), text_of(item["to"])).text


def number_or_range(name: str) -> Cell:
    """An entry that is a number, or a range from one to another, in one field."""
    return Cell(
        (name,), (name,),
        lambda form: {name: _ends(form, name) or plain(form.text(name))} if form.text(name) else {},
        lambda item: {name: _ends_text(given) if isinstance(given := item.get(name, ""), Mapping) else text_of(given)},
    )  # fmt: skip


def _refined_results(text: str) -> list[Any]:
    """Results that are refined, of which some have an error behind their name: ``efficiency; torque.max 0.2 N*m``."""
    found: list[Any] = []
    # A comma before a letter separates results, one before a digit can be decimal.
    for part in re.split(r";|,(?=\s*[^\W\d])", text):
        own = _WITH_ERROR.fullmatch(part)
        found += names_of(part) if own is None else [{"result": own["name"], "error": plain(own["error"])}]
    return found


def _refined_text(items: Sequence[Any]) -> str:
    texts = (item if isinstance(item, str) else f"{item['result']} {text_of(item['error'])}" for item in items)
    return "; ".join(texts)


def _limit(form: Filled) -> dict[str, Any]:
    kind = form.text("kind", "at_most")
    value, within = with_last_unit([form.text("value"), form.text("within") if kind == "is" else ""])
    return {kind: plain(value), **({"within": plain(within)} if within else {})}


def _limit_fields(item: Mapping[str, Any]) -> Values:
    kind = next(kind for kind, _label in LIMITS if kind in item)
    within = {"within": text_of(item["within"])} if "within" in item else {}
    return {"kind": kind, "value": text_of(item[kind]), **within}


def _start_fields(item: Mapping[str, Any]) -> Values:
    start = item.get("start", [])
    if start not in ([], [{}]):
        raise ValueError("the form has no fields for known designs other than its own")
    return {"start": "on" if start else ""}


def _until(form: Filled) -> dict[str, Any]:
    if form.text("until", SETTLED) == SETTLED:
        return {"until": SETTLED}
    texts = [form.text(name) for name in ("duration", *_WINDOW.fields)]
    if not any(texts):
        return {"duration": time_text(TIMED_DEFAULTS["duration"])}
    return {"duration": plain(texts[0])} if texts[0] else {}


def _window(form: Filled) -> dict[str, Any]:
    texts = [form.text(name) for name in _WINDOW.fields]
    return {"window": [plain(text) for text in with_last_unit(texts)]} if any(texts) else {}


def _counted(item: Mapping[str, Any]) -> Values:
    """The field of the operating point at which a goal or a limit counts."""
    if not isinstance(item.get("at", ""), str):
        raise ValueError("the form has no fields for operating points by their values")
    return {"at": item.get("at", "")}


class _Points:
    """The operating points of a search: a row has a parameter with its values at all of them."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`; the lists of the parameters, value by value."""
        columns: dict[str, list[Any]] = {}
        rows = [form.inside(f"{_AT.pointer}/{row}") for row in _AT.filled(form.values)]
        for row in rows:
            path, column = row.text("path"), row.listed("values")
            if not path or path in columns:
                form.faults[f"{row.at}/path"] = [
                    _("is a parameter of the points already") if path else _("is required")
                ]
            if fault := _wrong_column(column, next(iter(columns.values()), column)):
                form.faults[f"{row.at}/values"] = [fault]
            columns.setdefault(path, column)
        points: list[dict[str, Any]] = [
            dict(zip(columns, point, strict=True)) for point in zip(*columns.values(), strict=False)
        ]
        names = [name.strip() for name in form.values.get(_NAMES, "").split(";")]
        for index, name in enumerate(names if any(names) else ()):
            form.fields[f"{form.pointer}/at/{index}/name"] = _NAMES
            if index >= len(points):
                form.faults[_NAMES] = [_("has more names than there are operating points")]
            elif name:
                points[index] = {"name": name, **points[index]}
        pointer = f"{form.pointer}/at"
        form.fields[pointer] = _AT.pointer
        for index, row in [(index, row) for index in range(max(len(points), 1)) for row in rows]:
            form.fields.setdefault(f"{pointer}/{index}", f"{row.at}/values")
            form.fields.setdefault(join(f"{pointer}/{index}", row.text("path")), f"{row.at}/values")
        return {"at": points} if points else {}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        points = item.get("at", ())
        names = [str(point.get("name", "")) for point in points]
        form.values[_NAMES] = "; ".join(names) if any(names) else ""
        paths = [path for path in points[0] if path != "name"] if points else []
        form.values["at"] = str(len(paths))
        for row, path in enumerate(paths):
            values = "; ".join(text_of(point[path]) for point in points)
            form.inside(f"{_AT.pointer}/{row}").show({"path": path, "values": values})
        return {"at"}


def _wrong_column(column: list[Any], first: list[Any]) -> str:
    """What is wrong with the values of a parameter of points, of which the first parameter has ``first``."""
    if not column:
        return _("is required; allowed: one value for each operating point")
    if unclear(column):
        return _("could be one value or several; allowed: semicolons between values, or no blanks")
    if len(column) == len(first):
        return ""
    return _(
        "must have as many values as the first parameter, {first}; got {count}; allowed: one value for each "
        "operating point",
        first=len(first),
        count=len(column),
    )


class _Quantities:
    """The quantities of a study: a row has a name, a formula and a unit."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`; formulas by name, with their unit where it is given."""
        quantities: dict[str, Any] = {}
        pointer = f"{form.pointer}{_ASKED.pointer}"
        form.fields[pointer] = _ASKED.pointer
        for row in _ASKED.filled(form.values):
            inner = form.inside(f"{_ASKED.pointer}/{row}")
            name, formula, unit = (inner.text(part) for part in ("name", "formula", "unit"))
            if not name or name in quantities:
                form.faults[f"{inner.at}/name"] = [_("is the name of another quantity") if name else _("is required")]
                continue
            at = join(pointer, name)
            form.fields |= {at: f"{inner.at}/formula"}
            form.fields |= {f"{at}/{part}": f"{inner.at}/{part}" for part in ("formula", "unit")}
            quantities[name] = {"formula": formula, "unit": unit} if unit else formula
        return {_ASKED.key: quantities} if quantities else {}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        quantities = item.get(_ASKED.key, {})
        known = {"formula", "unit"}
        if not isinstance(quantities, Mapping) or not all(
            isinstance(each, str) or (isinstance(each, Mapping) and known.issuperset(each))
            for each in quantities.values()
        ):
            raise ValueError("the form has no fields for all of these quantities")
        form.values[_ASKED.name] = str(len(quantities))
        for row, (name, given) in enumerate(quantities.items()):
            whole = {"formula": given} if isinstance(given, str) else given
            texts = {part: str(whole.get(part, "")) for part in ("formula", "unit")}
            form.inside(f"{_ASKED.pointer}/{row}").show({"name": name, **texts})
        return {_ASKED.key}


class _Condition:
    """A condition of one or two parts, which must hold together: objects by path."""

    def _parts(self, form: Filled) -> list[Filled]:
        """The parts that are filled in."""
        parts = (form.inside(form.at + part) for part in ("", "/and"))
        return [part for part in parts if part.text("path") or part.text("value")]

    def filled(self, form: Filled) -> bool:
        """As of an `Item`."""
        return bool(self._parts(form))

    def value(self, form: Filled) -> dict[str, Any]:
        """As of an `Item`; a spec has one limit of a kind for each path."""
        condition: dict[str, dict[str, Any]] = {}
        for part in self._parts(form):
            path, kind, text = part.text("path"), part.text("kind", CONDITIONS[0][0]), part.text("value")
            items = list_of(text) if kind == "is" else []
            limits = condition.setdefault(path, {})
            if kind in limits:
                form.faults[f"{part.at}/value"] = [_(_TWICE)]
            limits[kind] = items if len(items) > 1 or unclear(items) else plain(text)
            pointer = join(form.pointer, path)
            for known, name in ((form.pointer, "path"), (pointer, "path"), (join(pointer, kind), "value")):
                form.fields.setdefault(known, f"{part.at}/{name}")
        return condition

    def fill(self, item: Mapping[str, Any], form: Filled) -> None:
        """As of an `Item`."""
        limits = [(path, kind, value) for path, parts in item.items() for kind, value in parts.items()]
        if not 1 <= len(limits) <= 2:
            raise ValueError("the form has no fields for all of these conditions")
        for part, (path, kind, value) in zip(("", "/and"), limits, strict=False):
            text = "; ".join(map(text_of, value)) if isinstance(value, list) else text_of(value)
            form.inside(form.at + part).show({"path": path, "kind": kind, "value": text})


class _Axes:
    """Axes, and behind them a sample over ranges and points of a table."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`."""
        axes = PARTS["axes"].entries(form)["axes"]
        if PARTS["ranges"].filled(form.values) or form.values.get("/sample/count", "").strip():
            axes.append(_SAMPLE.value(form.inside("/sample", f"/axes/{len(axes)}")))
        if (points := form.values.get(POINTS, "")).strip():
            form.fields[f"/axes/{len(axes)}"] = POINTS
            axes.append({"points": points.replace("\r\n", "\n")})
        return {"axes": axes}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        axes = list(item.get("axes", ()))
        if axes and "points" in axes[-1]:
            form.values[POINTS] = str(axes.pop()["points"])
        if axes and isinstance(axes[-1], Mapping) and "sample" in axes[-1]:
            _SAMPLE.fill(axes.pop(), form.inside("/sample"))
        return PARTS["axes"].show({"axes": axes}, form)


@dataclass(frozen=True, slots=True)
class _Varied:
    """A row of what varies: a parameter with values, as ``plain`` reads it, or a kind of components with their names.

    The field ``of`` has the components whose fields a spec has, so that they are those of the spec again.
    """

    plain: Record

    def filled(self, form: Filled) -> bool:
        """As of an `Item`."""
        return self.plain.filled(form)

    def value(self, form: Filled) -> dict[str, Any]:
        """As of an `Item`."""
        kind = form.text("path")
        if kind not in KINDS:
            return self.plain.value(form)
        form.fields |= {form.pointer: f"{form.at}/values", f"{form.pointer}/{COMPONENT}": f"{form.at}/path"}
        known = {own["name"]: own for own in _components_in(form.text("of"))}
        names = filter(None, (name.strip() for name in form.text("values").split(";")))
        return {COMPONENT: kind, "of": [known.get(name, name) for name in names]}

    def fill(self, item: Mapping[str, Any], form: Filled) -> None:
        """As of an `Item`."""
        if COMPONENT not in item:
            self.plain.fill(item, form)
            return
        names = [own if isinstance(own, str) else str(own["name"]) for own in item["of"]]
        if set(item) - {COMPONENT, "of"} or any(";" in name for name in names):
            raise ValueError("the form has no fields for these components")
        whole = [own for own in item["of"] if not isinstance(own, str)]
        form.show({"path": str(item[COMPONENT]), "values": "; ".join(names), "of": json.dumps(whole) if whole else ""})


def _components_in(text: str) -> list[dict[str, Any]]:
    """The components of a hidden field; none where it is not as the page made it."""
    with suppress(ValueError):
        listed = json.loads(text)
        if isinstance(listed, list):
            return [own for own in listed if isinstance(own, dict) and isinstance(own.get("name"), str)]
    return []


PATHS: Final = Cell(("path",), ("path", "tied"), _paths, _path_fields)
RANGE: Final = Cell(
    ("from", "to"), ("from", "to"), Filled.ranged,
    lambda item: {name: text_of(item[name]) for name in ("from", "to")},
)  # fmt: skip
_AXIS_VALUES: Final = Cell(("values", "range", *_SPACINGS, "include"), ("values",) * 6, _axis_values, _axis_text)
_VARIABLE_VALUES: Final = Cell(("values", "from", "to"), ("values",) * 3, _variable_values, _variable_text)
RESULT: Final = typed("result", lambda text: text or None, str, always=True)
_TOWARD: Final = Cell(
    ("max",), ("toward",), lambda form: {"max": True} if form.text("toward", "max") == "max" else {},
    lambda item: {"toward": "max" if item.get("max", False) else "min"}, counts=False,
)  # fmt: skip
_LIMIT: Final = Cell((*(kind for kind, _label in LIMITS), "within"), (*["value"] * 3, "within"), _limit, _limit_fields)
#: What of the drives a goal or a limit is about.
_OF_DRIVES: Final = (chosen("statistic"), typed("deviations"), typed("quantile"))
_COUNTED: Final = (
    Cell(("at",), ("at",), lambda form: {"at": text} if (text := form.text("at")) else {}, _counted, counts=False),
    chosen("over"),
)
_START: Final = Cell(
    ("start",), ("start",), lambda form: {"start": [{}]} if form.text("start") == "on" else {}, _start_fields,
    counts=False,
)  # fmt: skip
_BETWEEN: Final = Cell(
    ("between",), ("between/0", "between/1"),
    lambda form: {"between": [form.text(f"between/{end}") for end in range(2)]},
    lambda item: {f"between/{end}": item["between"][end] for end in range(2)},
)  # fmt: skip
_WINDOW: Final = Cell(
    ("window",), ("window/0", "window/1"), _window,
    lambda item: {f"window/{end}": text_of(time) for end, time in enumerate(item.get("window", ()))},
)  # fmt: skip
_UNTIL: Final = Cell(
    ("until", "duration"), ("until", "duration"), _until,
    lambda item: {"until": _TIMED if set(TIMED_FIELDS) & set(item) else SETTLED}
    | ({"duration": text_of(item["duration"])} if "duration" in item else {}),
)  # fmt: skip
#: Field with the names of the operating points.
_NAMES: Final = "/goal/names"
_AT: Final = Rows("at", "/goal/at", MAX_AXES, Record((typed("path"), typed("values"))))
_ASKED: Final = Rows(
    "quantities", "/quantities", MAX_QUANTITIES, Record((typed("name"), typed("formula"), typed("unit")))
)
#: Lists of rows that users add and remove, by the name of the field with their number.
PARTS: Final = {
    rows.name: rows
    for rows in (
        Rows(
            "axes", "/axes", MAX_AXES,
            _Varied(Record((PATHS, _AXIS_VALUES, chosen(SWEPT.name)), whole="/path")),
        ),
        Rows(
            "vary", "/goal/vary", GOAL.listed["vary"].high,
            _Varied(Record((PATHS, _VARIABLE_VALUES), whole="/values")),
        ),
        Rows(
            "best", "/goal/best", GOAL.listed["best"].high,
            Record((RESULT, _TOWARD, *_OF_DRIVES, *_COUNTED), whole="/result"),
            new={"toward": "max"}, always=False,
        ),
        Rows(
            "subject_to", "/goal/subject_to", GOAL.listed["subject_to"].high,
            Record((RESULT, _LIMIT, *_OF_DRIVES, *_COUNTED), whole="/result"), new={"kind": "at_most"}, always=False,
        ),
        _AT,
        _ASKED,
        Rows(
            "ranges", "/sample/ranges", MAX_AXES, Record((PATHS, RANGE, chosen(SCALE.name)), whole="/from"),
            whole="/sample/count",
        ),
        Rows("exclude", "/exclude", _MOST, _Condition(), always=False),
        Rows(
            "correlations", "/correlations", _MOST, Record((_BETWEEN, typed("coefficient")), whole="/between/0"),
            always=False,
        ),
    )
}  # fmt: skip
_SAMPLE: Final = Record((*described(SAMPLE.described.values()), PARTS["ranges"]), whole="/count")
_UNTIL_SETTLED: Final = described(entry for entry in SETTLED_RUN.values() if entry.name != "until")
_ANY_RUN: Final = described(ANY_RUN.values())
_RUN: Final = Record(
    (_UNTIL, _WINDOW, *_UNTIL_SETTLED, *_ANY_RUN), key="run", when=lambda values: form_of(values).with_run
)
#: The fields of a run that is chosen: those of the other one are out of sight and keep their texts.
_SETTLED_RUN: Final = replace(_RUN, members=(_UNTIL, *_UNTIL_SETTLED, *_ANY_RUN))
_TIMED_RUN: Final = replace(_RUN, members=(_UNTIL, _WINDOW, *_ANY_RUN))
_SHAFT_RUN: Final = Record(
    tuple(described(SHAFT_RUN.values())), key="run", when=lambda values: form_of(values).with_loads
)


class _Run:
    """The run of a study, whose fields depend on the model."""

    def entries(self, form: Filled) -> dict[str, Any]:
        """As of a `Member`; no run where a machine shaft has nothing to say of it."""
        settled = form.values.get("/run/until", SETTLED) == SETTLED
        found = (_SETTLED_RUN if settled else _TIMED_RUN).entries(form) or _SHAFT_RUN.entries(form)
        return found if found.get("run") else {}

    def show(self, item: Mapping[str, Any], form: Filled) -> set[str]:
        """As of a `Member`."""
        return (_SHAFT_RUN if _SHAFT_RUN.when(form.values) else _RUN).show(item, form)


_GOAL: Final = Record(
    (PARTS["vary"], PARTS["best"], PARTS["subject_to"], _Points(), _START, *described(GOAL.described.values())),
    whole="", key="goal", when=is_search, new=GOAL_DEFAULTS,
)  # fmt: skip
_REFINE: Final = Record(
    (typed("results", _refined_results, _refined_text), *described(REFINE.described.values())),
    whole="/results", key="refine", when=is_refined, new=REFINE_DEFAULTS,
)  # fmt: skip
_CASES: Final = Record(
    (_Axes(), PARTS["exclude"], chosen("combine", "grid", always=True), _REFINE),
    when=lambda values: not is_search(values),
)  # fmt: skip
_BATCH: Final = Record((Tolerances(), *described(DRAWS.values()), PARTS["correlations"]), when=with_batch)
_STUDY: Final = Record((typed("name", str), Machine(), _Run(), _Quantities(), _BATCH, _GOAL, _CASES))


def quantities_of(values: Values) -> list[str]:
    """The names of the quantities of a form."""
    texts = (values.get(f"{_ASKED.pointer}/{row}/name", "").strip() for row in _ASKED.filled(values))
    return list(dict.fromkeys(filter(None, texts)))


def form_with_spec(values: Mapping[str, str]) -> tuple[dict[str, Any], Filled]:
    """The spec of a filled form, and the form with what cannot be expressed as a spec and the fields of the rest."""
    form = Filled(with_row_texts(values))
    return {"sprag": 1, "model": model_name(values), **_STUDY.value(form)}, form


def spec_of(values: Mapping[str, str]) -> tuple[dict[str, Any], Faults]:
    """The spec of a filled form, and the faults, by field, of what cannot be expressed as a spec."""
    spec, form = form_with_spec(values)
    return spec, form.faults


def values_of(spec: Mapping[str, Any]) -> Values:
    """The form's values for ``spec``; raises ValueError where the form cannot show it."""
    values: Values = {"model": str(spec.get("model")), "/name": "", "asks": "goal" if "goal" in spec else "axes"}
    if values["model"] not in models.model_names():
        raise ValueError("the form does not know the model")
    values |= {BATCH: "on"} if FIELDS[0] in spec else {}
    _STUDY.fill({name: entry for name, entry in spec.items() if name not in ("sprag", "model")}, Filled(values))
    if spec.get("combine", "grid") not in ("grid", "zip") or (
        "run" in spec and not any(each.when(values) for each in (_RUN, _SHAFT_RUN))
    ):
        raise ValueError("the form has no fields for all of this spec")
    return values
