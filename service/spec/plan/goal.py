"""Goals: what a design should reach, and what may vary for it (`goal` of a spec)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Place, Sentence, joined
from sprag.service.reading.limits import at_most_cases
from sprag.service.reading.texts import did_you_mean
from sprag.service.spec.axes.axes import check_paths, expand
from sprag.service.spec.axes.values import plan_values
from sprag.service.spec.described import Described, Listed, choice, named
from sprag.service.spec.fields import read_number, read_object, read_one
from sprag.service.spec.lists import refuse_mixed
from sprag.service.spec.plan.fields import read_ends, read_path_of, read_result, read_value
from sprag.service.spec.plan.robust import ROBUST, YIELD, check_drives, read_quantile, refuse_beside_yield
from sprag.service.spec.report import Report, join
from sprag.service.spec.shares import in_percent, read_share
from sprag.worker.limits import MAX_PLANNED_CASES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import ResultInfo

VARY: Final = Listed("variables", 1, 64, "what may vary: over a range, or among listed values")
BEST: Final = Listed("goals", 0, 8, "results that are to be as small, or with max as large, as possible")
SUBJECT_TO: Final = Listed("constraints", 0, 32, "what a feasible design must fulfil")
AT: Final = Listed("operating points", 0, 64, "parameters of each operating point; by default one, that of the base")
MAX: Final = Described("max", "", "whether the largest value is the best", "flag", default=False)
OVER: Final = choice(
    "over", "what counts of several operating points: the worst one, or the mean", "worst", "mean", default="worst"
)
SEARCH: Final = named(
    OVER,
    Described("population", "Designs of a generation", "designs of one generation", "whole", 4, 1000, 100),
    Described("generations", "Generations", "generations, each chosen from the ones before", "whole", 1, 10_000, 60),
    Described("seed", "Seed", "seed of the random numbers", "whole", 0, 2**32 - 1, 1),
    Described("polish", "", "whether equalities are met exactly at the end", "flag", default=True),
)
FIELDS: Final = ("vary", "best", "subject_to", "at", *SEARCH)
_KINDS: Final = ("is", "at_least", "at_most")
WITHIN: Final = Described(
    "within", "", "how far from that", "text", default="1 %", limits="a quantity, or a share of the value"
)

Variables = list[dict[str, Any]]


def read_variables(report: Report, data: object, machine: Machine) -> Variables | None:
    """What may vary: its paths with a range or a list of values (SI); None, and the faults recorded, if invalid."""
    items = VARY.read(report, "/goal/vary", data)
    if items is None:
        return None
    before = report.found
    read = [_variable(report, join("/goal/vary", index), item, machine) for index, item in enumerate(items)]
    check_paths(report, [tuple(found["paths"]) if found else () for found in read], "/goal/vary")
    return None if report.found > before else [found for found in read if found]


def _variable(report: Report, pointer: str, item: object, machine: Machine) -> dict[str, Any] | None:
    found = read_object(report, pointer, item, ("path", "from", "to", "values"))
    if found is None:
        return None
    paths = read_path_of(report, pointer, found.get("path"), machine)
    way = read_one(report, pointer, {name: 0 for name in found if name in {"values", "from"}}, ("from", "values"))
    if paths is None or way is None:
        return None
    if way == "from":
        ends = [(join(pointer, name), found.get(name)) for name in ("from", "to")]
        read = read_ends(report, pointer, paths, ends, machine)
        return None if read is None else {"paths": list(paths), "low": read[0], "high": read[1]}
    parameters = [machine.parameters[path] for path in paths]
    plan = plan_values(report, join(pointer, "values"), found["values"], parameters[0])
    values = None if plan is None else expand(report, plan, parameters, "grid")
    return None if values is None else {"paths": list(paths), "values": values.tolist()}


def read_points(
    report: Report, data: object, machine: Machine, variables: Variables | None
) -> list[dict[str, float]] | None:
    """The operating points: path -> value (SI), the same paths for each; None, and the faults recorded, if invalid."""
    items = AT.read(report, "/goal/at", data)
    if items is None:
        return None
    before = report.found
    _refuse_mixed_points(report, items, machine)
    varied = {path for found in variables or () for path in found["paths"]}
    points: list[dict[str, float]] = []
    for index, item in enumerate(items):
        where = join("/goal/at", index)
        if not isinstance(item, Mapping) or not item:
            report.fault(where, "wrong-type", "must be an object", item, allowed='as in {"shaft.load": "0.2 N*m"}')
            continue
        point: dict[str, float] = {}
        for path, value in item.items():
            place = join(where, path)
            if path in machine.derive:
                report.fault(place, "conflict", "is derived from other parameters", path, allowed="a path of `base`")
            elif path not in machine.parameters:
                message = Sentence("names no parameter{hint}", hint=did_you_mean(path, machine.parameters))
                report.fault(place, "invalid-path", message, path, allowed="a path of `base`")
            elif path in varied:
                report.fault(place, "repeated", "varies already", path, allowed="each path once")
            else:
                number = read_number(report, place, value, machine.parameters[path])
                point |= {} if number is None else {path: number}
        points.append(point)
    if report.found > before:
        return None
    for index, point in enumerate(points[1:], 1):
        if set(point) != set(points[0]):
            report.fault(
                join("/goal/at", index), "conflict", "has other parameters than the first point", sorted(point),
                allowed=", ".join(sorted(points[0])),
            )  # fmt: skip
        elif point in points[:index]:
            report.fault(
                join("/goal/at", index), "repeated",
                Sentence("repeats point {number}", number=str(points.index(point))), items[index],
                allowed="each point once",
            )  # fmt: skip
    return None if report.found > before else points


def _refuse_mixed_points(report: Report, items: Sequence[Any], machine: Machine) -> None:
    """Record bare numbers that a parameter has at some points beside quantities of another scale at others."""
    columns: dict[str, list[tuple[str, object]]] = {}
    for index, item in enumerate(items):
        for path, value in item.items() if isinstance(item, Mapping) else ():
            columns.setdefault(path, []).append((join("/goal/at", index, path), value))
    for path, column in columns.items():
        if path in machine.parameters:
            refuse_mixed(report, column, machine.parameters[path].unit)


def read_goal(
    report: Report,
    infos: Sequence[ResultInfo],
    data: Mapping[str, Any],
    variables: Variables,
    points: list[dict[str, float]],
    drives: int = 0,
) -> dict[str, Any] | None:
    """The plan of a study with a goal as plain JSON data; None, and the faults recorded, where it is invalid.

    Parameters
    ----------
    infos : the results of the study
    data : the field `goal` of the spec
    variables, points : as `read_variables` and `read_points` give them
    drives : number of drawn drives; 0 without tolerances
    """
    before = report.found
    best = _read_best(report, data.get("best", []), infos)
    constraints = _read_constraints(report, data.get("subject_to", []), infos)
    search = {name: field.read(report, "/goal", data) for name, field in SEARCH.items()}
    if not report.found > before and not best and not constraints:
        report.fault("/goal", "empty", "asks for nothing", allowed="`best` or `subject_to`, or both")
    if report.found == before:
        check_drives(report, best, constraints, drives)
    if report.found > before:
        return None
    most = search["population"] * search["generations"] * max(len(points), 1) * (1 + drives)
    if most > MAX_PLANNED_CASES:
        message = Sentence("the generations have {cases} cases together", cases=most)
        if drives:
            each = Sentence("with {drives} drawn drives of each design and the nominal one", drives=drives)
            message = joined(", ", (message, each))
        report.fault(
            "/goal/generations", "too-many", message, search["generations"], allowed=at_most_cases(MAX_PLANNED_CASES)
        )
        return None
    plan = {"kind": "goal", "vary": variables, "best": best, "subject_to": constraints, "at": points, **search}
    return plan | ({"drives": drives} if drives else {})


def _read_best(report: Report, data: object, infos: Sequence[ResultInfo]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = []
    for index, item in enumerate(BEST.read(report, "/goal/best", data) or ()):
        where = join("/goal/best", index)
        fields = read_object(report, where, item, ("result", "max", *ROBUST))
        if fields is None:
            continue
        if "yield" in fields:
            found += _read_yield_goal(report, where, fields, infos)
            continue
        info = read_result(report, join(where, "result"), fields.get("result"), infos)
        largest = MAX.read(report, where, fields)
        quantile = read_quantile(report, where, fields)
        if info is None or largest is None or quantile is None:
            continue
        if info.kind == "category":
            report.fault(
                join(where, "result"), "not-numeric", "is a category, not a number", info.name,
                allowed="a result with a number",
            )  # fmt: skip
        elif any((goal.get("result"), goal.get("quantile")) == (info.name, quantile.get("quantile")) for goal in found):
            report.fault(join(where, "result"), "repeated", "is a goal already", info.name, allowed="each result once")
        else:
            found.append({"result": info.name, **quantile, "max": largest})
    return found


def _read_yield_goal(
    report: Report, where: str, fields: Mapping[str, Any], infos: Sequence[ResultInfo]
) -> list[dict[str, Any]]:
    """The goal of a large yield; nothing, and faults recorded, where it is invalid."""
    refuse_beside_yield(report, where, fields, ("result", "quantile"))
    if fields.get("max", True) is not True:
        report.fault(join(where, "max"), "conflict", "a yield is to be large", fields["max"], allowed="true")
        return []
    conditions = _read_conditions(report, where, fields, infos)
    return [{"yield": conditions, "max": True}] if conditions else []


def _read_conditions(
    report: Report, where: str, fields: Mapping[str, Any], infos: Sequence[ResultInfo]
) -> list[dict[str, Any]]:
    """The conditions of a yield; nothing, and faults recorded, where one is invalid."""
    pointer, before = join(where, "yield"), report.found
    items = YIELD.read(report, pointer, fields["yield"]) or ()
    read = [_read_constraint(report, join(pointer, index), item, infos) for index, item in enumerate(items)]
    return [] if report.found > before else [condition for condition in read if condition]


def _read_constraints(report: Report, data: object, infos: Sequence[ResultInfo]) -> list[dict[str, Any]]:
    items = SUBJECT_TO.read(report, "/goal/subject_to", data) or ()
    read = [
        _read_constraint(report, join("/goal/subject_to", index), item, infos, robust=True)
        for index, item in enumerate(items)
    ]
    return [constraint for constraint in read if constraint]


def _read_constraint(
    report: Report, where: str, item: object, infos: Sequence[ResultInfo], *, robust: bool = False
) -> dict[str, Any] | None:
    """One constraint; None, and the faults recorded, where it is invalid. ``robust``: of a quantile or a yield, too."""
    fields = read_object(report, where, item, ("result", *_KINDS, "within", *(ROBUST if robust else ())))
    if fields is None:
        return None
    if robust and "yield" in fields:
        refuse_beside_yield(report, where, fields, ("result", "quantile", "is", "at_most", "within"))
        conditions = _read_conditions(report, where, fields, infos)
        least = read_share(report, join(where, "at_least"), fields.get("at_least"), 0.0, 1.0)
        return None if least is None or not conditions else {"yield": conditions, "at_least": least}
    info = read_result(report, join(where, "result"), fields.get("result"), infos)
    kind = read_one(report, where, {name: 0 for name in fields if name in _KINDS}, _KINDS)
    quantile = read_quantile(report, where, fields)
    if info is None or kind is None or quantile is None:
        return None
    if quantile and kind == "is":
        report.fault(join(where, "quantile"), "conflict", "cannot be combined with `is`", fields["quantile"],
                     allowed="at_least or at_most")  # fmt: skip
        return None
    if info.kind == "category" and kind != "is":
        report.fault(
            join(where, kind), "not-numeric", "compares a category", fields[kind], allowed="`is` for a category"
        )
        return None
    together = [(join(where, name), fields[name]) for name in (kind, "within") if name in fields]
    if info.kind == "real" and refuse_mixed(report, together, info.unit):
        return None
    value = read_value(report, join(where, kind), fields[kind], info)
    if value is not None and kind == "is" and info.kind == "count" and not value.is_integer():
        report.fault(
            join(where, kind), "not-a-number", "must be a whole number", fields[kind],
            allowed="a whole number, or at_least and at_most",
        )  # fmt: skip
        return None
    within = _read_within(report, where, fields, info, kind, value)
    if value is None or within is None:
        return None
    return {"result": info.name, **quantile, kind: value, **({"within": within} if within else {})}


def _read_within(
    report: Report, where: str, fields: Mapping[str, Any], info: ResultInfo, kind: str, value: float | None
) -> float | None:
    """Half the width (SI) of an equality, a quantity or relative to its value; 0 for other kinds and other results."""
    if kind != "is" or info.kind != "real":
        if "within" in fields:
            report.fault(
                join(where, "within"), "not-used", "is not used here", fields["within"],
                allowed="only with `is` and a real number",
            )  # fmt: skip
        return 0.0
    if value is None:
        return None
    given = fields.get("within", WITHIN.default)
    share = in_percent(given)
    if share is not None and value == 0.0:
        missing = "within" not in fields
        report.fault(
            join(where, "within"), "required" if missing else "out-of-range",
            "is required: a share of 0 is no width" if missing else "must be a quantity: a share of 0 is no width",
            fields.get("within"),
            allowed="a quantity greater than 0", unit=info.unit,
        )  # fmt: skip
        return None
    if share is not None:
        width: float | None = abs(value) * share
    else:
        width = read_value(report, join(where, "within"), given, info)
    if width is not None and width <= 0.0:
        report.fault(
            join(where, "within"), "out-of-range", "is not a valid width", given,
            allowed='greater than 0, as in "2 %" of the value, or a quantity', unit=info.unit,
        )  # fmt: skip
        return None
    if width is not None and width >= abs(value) > 0.0:
        text = Sentence("is at least as wide as the value, so that 0 fulfils the limit, too")
        report.warn("wide-limit", Place(join(where, "within"), info.name), text)
    return width
