"""Goals: what a design should reach, and what may vary for it (`goal` of a spec)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Place, Sentence, joined, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import at_most_cases, span
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.axes.axes import PATHS, check_paths, expand, read_components
from sprag_study.service.spec.axes.values import plan_values
from sprag_study.service.spec.component_axes import COMPONENT, COMPONENT_AXIS
from sprag_study.service.spec.described import Described, Field, Listed, Record, Variants, choice
from sprag_study.service.spec.kinds.draft import Kind
from sprag_study.service.spec.kinds.fields import (
    RESULT,
    read_ends,
    read_numeric_result,
    read_path_of,
    read_result,
    read_value,
)
from sprag_study.service.spec.kinds.places import AT, NAME, POINT_NAME, Places
from sprag_study.service.spec.kinds.robust import (
    DEVIATIONS,
    FRESH,
    QUANTILE,
    STATISTIC,
    check_drives,
    read_about_drives,
    read_fresh,
)
from sprag_study.service.spec.lists import refuse_mixed
from sprag_study.service.spec.schema.quantity import QUANTITY
from sprag_study.service.spec.shares import in_percent
from sprag_study.worker.limits import MAX_PLANNED_CASES
from sprag_study.worker.planning.goals.plan import Variable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sprag_study.service.spec.kinds.draft import Draft, Finish
    from sprag_study.service.spec.node import Node
    from sprag_study.worker.models import ResultInfo

_KINDS: Final = ("is", "at_least", "at_most")
_MAX: Final = Described("max", "", "whether the largest value is the best", "flag", default=False)
_WITHIN: Final = Described(
    "within", "", "how far from that", "text", default="1 %", limits="a quantity, or a share of the value"
)
_OVER_HELP: Final = "what counts of several operating points: the worst one, the mean, or the best one"
_OVER: Final = choice(
    "over", f"{_OVER_HELP}; by default as the field `over` of the whole goal says", "worst", "mean", "best"
)
_OVER_LIMIT: Final = choice(
    "over", "whether the mean or the best one of the operating points must keep the limit; by default each must",
    "mean", "best",
)  # fmt: skip
_VARIABLE: Final = Record(
    {
        "path": PATHS,
        "from": QUANTITY,
        "to": QUANTITY,
        "values": Listed("values", 1, 10_000, "the values to choose from", item=QUANTITY, text=True),
    },
    required=("path",),
)
_LIMIT: Final = Record(
    {
        "result": RESULT,
        "is": {**QUANTITY, "description": "value that the result must have"},
        "at_least": QUANTITY,
        "at_most": QUANTITY,
        "within": _WITHIN,
        "at": AT,
    },
    required=("result",),
)
_YIELD: Final = Listed(
    "conditions", 1, 32, "the share of the drawn drives that meet all these conditions at every operating point",
    item=_LIMIT,
)  # fmt: skip
#: What of the drives a goal or a limit is about.
_OF_DRIVES: Final[dict[str, Field]] = {"quantile": QUANTILE, STATISTIC.name: STATISTIC, DEVIATIONS.name: DEVIATIONS}
_GOAL: Final = Variants((
    Record({"result": RESULT, "max": _MAX, **_OF_DRIVES, "at": AT, "over": _OVER}, required=("result",)),
    # Generators of clients write invalid code for a constant that is true.
    Record({"yield": _YIELD, "max": {"type": "boolean", "description": "true: a yield is to be as large as possible"}},
           required=("yield",)),
))  # fmt: skip
_SHARE: Final = {"type": ["number", "string"], "description": 'a share, as in "90 %"'}
_CONSTRAINT: Final = Variants((
    Record({**_LIMIT.fields, **_OF_DRIVES, "over": _OVER_LIMIT}, required=("result",)),
    Record({"yield": _YIELD, "at_least": _SHARE}, required=("yield", "at_least")),
))  # fmt: skip
GOAL: Final = Record(
    {
        "vary": Listed("variables", 1, 64, "what may vary: over a range, among listed values, or among components",
                       item=Variants((_VARIABLE, COMPONENT_AXIS))),
        "best": Listed("goals", 0, 8, "results that are to be as small, or with max as large, as possible", item=_GOAL),
        "subject_to": Listed("constraints", 0, 32, "what a feasible design must fulfil", item=_CONSTRAINT),
        "at": Listed(
            "operating points", 0, 64,
            "parameters of each operating point, and its `name` if it has one; by default one, that of the base",
            item={
                "type": "object", "minProperties": 1, "properties": {NAME: {"type": "string", "pattern": POINT_NAME}},
                "additionalProperties": QUANTITY,
            },
        ),
        "start": Listed(
            "known designs", 0, 1000,
            "known designs, which the first generation has: the values of what varies, by default those of `base`: {} "
            "is the design of `base`",
            item={"type": "object", "additionalProperties": QUANTITY},
        ),
        "over": choice(
            "over", _OVER_HELP, "worst", "mean", "best", default="worst",
        ),
        "population": Described(
            "population", "Designs of a generation", "designs of one generation", "whole", 4, 1000, 100
        ),
        "generations": Described(
            "generations", "Generations", "generations, each chosen from the ones before", "whole", 1, 10_000, 60
        ),
        "seed": Described("seed", "Seed", "seed of the random numbers", "whole", 0, 2**32 - 1, 1),
        "least_gain": Described(
            "least_gain", "Least gain",
            "a search for one goal ends where starting anew has bettered the goal by at most this share; 0: after all "
            "generations", "text", default="0.1 %", limits="0 % to 100 %",
        ),
        "polish": Described(
            "polish", "",
            "whether equalities are met exactly at the end, and one goal is brought to its optimum by derivatives",
            "flag", default=True,
        ),
        FRESH.name: FRESH,
    },
    "what a design should reach, and what may vary for it",
    required=("vary",),
)  # fmt: skip

Variables = list[dict[str, Any]]


def _read(draft: Draft) -> Finish | None:
    node = draft.spec["goal"]
    if not GOAL.read(node, null=False):
        return None
    variables = read_variables(node)
    points = read_points(node, variables)
    if variables is None or points is None:
        return None
    ends = [(tuple(v["paths"]), v.get("values") or (v["low"], v["high"])) for v in variables]
    draft.vary([*ends, *(((path,), [point[path] for point in points]) for path in (points[0] if points else ()))])

    columns = len(variables) + len(points[0] if points else ()) + 1
    draft.fresh = read_fresh(node, len(GOAL.items(node, "best")), len(points), columns)

    def make_plan() -> None:
        spread = draft.spread
        drives, fresh = (0, 0) if spread is None else (spread.drives, spread.fresh)
        draft.plan = read_goal(node, variables, points, drives, fresh)

    return make_plan


#: Searches for the best designs.
SEARCH: Final = Kind({"goal": GOAL}, _read)


def read_variables(goal: Node) -> Variables | None:
    """What may vary: its paths with a range or a list of values (SI); None, and the faults recorded, if invalid."""
    vary = goal["vary"]
    read = [_variable(item) for item in GOAL.items(goal, "vary")]
    check_paths(goal.report, [tuple(variable["paths"]) if variable else () for variable in read], vary.pointer)
    return [variable for variable in read if variable] if vary.sound else None


def _variable(item: Node) -> dict[str, Any] | None:
    if COMPONENT in item:
        paths, plan = read_components(item)
        return None if paths is None or plan is None else {"paths": list(paths), "values": plan.expand().tolist()}
    if not _VARIABLE.read(item):
        return None
    paths = read_path_of(item["path"])
    way = item.one_of(("from", "values"))
    if paths is None or way is None:
        return None
    if way == "from":
        ends = read_ends(item, paths, (item["from"], item["to"]))
        return None if ends is None else {"paths": list(paths), "low": ends[0], "high": ends[1]}
    parameters = [item.machine.parameters[path] for path in paths]
    plan = plan_values(item["values"], parameters[0])
    values = None if plan is None else expand(plan, parameters, "grid")
    return None if values is None else {"paths": list(paths), "values": values.tolist()}


def read_points(goal: Node, variables: Variables | None) -> list[dict[str, float]] | None:
    """The operating points: path -> value (SI), the same paths for each; None, and the faults recorded, if invalid."""
    at, machine = goal["at"], goal.machine
    items = GOAL.items(goal, "at")
    _refuse_mixed_points(items)
    varied = {path for variable in variables or () for path in variable["paths"]}
    points: list[dict[str, float]] = []
    for item in items:
        if not isinstance(item.value, Mapping) or not item.value:
            item.refuse("wrong-type", "must be an object", allowed='as in {"shaft.load": "0.2 N*m"}')
            continue
        if set(item.value) == {NAME}:
            item.refuse("required", "has a name and no parameters", allowed='as in {"name": "idle", "shaft.load": 0}')
        point: dict[str, float] = {}
        for path in item.value:
            place = item[path]
            if path == NAME:
                continue
            if path in machine.derive:
                place.refuse("conflict", "is derived from other parameters", path, allowed="a path of `base`")
            elif (kind := machine.component_of(path)) is not None:
                message = Sentence("follows from the component `{kind}`, which varies", kind=kind)
                place.refuse("conflict", message, path, allowed=N_("a path that no component gives"))
            elif path not in machine.parameters:
                message = Sentence("names no parameter{hint}", hint=did_you_mean(path, machine.parameters))
                place.refuse("invalid-path", message, path, allowed="a path of `base`")
            elif path in varied:
                place.refuse("repeated", "varies already", path, allowed="each path once")
            else:
                number = place.number(machine.parameters[path])
                point |= {} if number is None else {path: number}
        points.append(point)
    for index, (item, point) in enumerate(zip(items, points, strict=True)) if at.sound else ():
        if set(point) != set(points[0]):
            item.refuse("conflict", "has other parameters than the first point", sorted(point),
                        allowed=", ".join(sorted(points[0])))  # fmt: skip
        elif point in points[:index]:
            repeats = Sentence("repeats point {number}", number=str(points.index(point)))
            item.refuse("repeated", repeats, allowed="each point once")
    return points if at.sound else None


def _read_over(item: Node, described: Described) -> dict[str, str] | None:
    """How a goal or a limit counts at several points; empty by default, None, and a fault recorded, if wrong."""
    if not item[described.name].given:
        return {}
    over = described.read(item)
    return None if over is None else {described.name: over}


def _refuse_mixed_points(items: Sequence[Node]) -> None:
    """Record bare numbers that a parameter has at some points beside quantities of another scale at others."""
    for path, entry in items[0].machine.parameters.items() if items else ():
        refuse_mixed([item[path] for item in items if path in item], entry.unit)


def read_goal(
    goal: Node, variables: Variables, points: list[dict[str, float]], drives: int = 0, fresh: int = 0
) -> dict[str, Any] | None:
    """The plan of a study with a goal as plain JSON data; None, and the faults recorded, where it is invalid.

    Parameters
    ----------
    goal : the field `goal` of the spec, when the results of the study are known
    variables, points : as `read_variables` and `read_points` give them
    drives, fresh : numbers of drawn drives, and of fresh ones for the best designs; 0 without tolerances
    """
    places = Places(goal["at"], GOAL.items(goal, "at"), points)
    best = _read_best(GOAL.items(goal, "best"), places)
    read = [_read_constraint(item, places, robust=True) for item in GOAL.items(goal, "subject_to")]
    constraints = [constraint for constraint in read if constraint]
    apart = {"least_gain", FRESH.name}
    search = {name: field.read(goal) for name, field in GOAL.described.items() if name not in apart}
    least_gain = goal["least_gain"].otherwise(GOAL.described["least_gain"].default).share(0.0, 1.0)
    if goal.sound and not best and not constraints:
        goal.refuse("empty", "asks for nothing", None, allowed="`best` or `subject_to`, or both")
    if goal.sound:
        check_drives(goal.report, best, constraints, drives, fresh=FRESH.name in goal)
    if not goal.sound:
        return None
    most = search["population"] * search["generations"] * max(len(points), 1) * (1 + drives)
    if most > MAX_PLANNED_CASES:
        message = Sentence("the generations have {cases} cases together", cases=most)
        if drives:
            each = Sentence("with {drives} drawn drives of each design and the nominal one", drives=drives)
            message = joined(", ", (message, each))
        goal["generations"].refuse("too-many", message, search["generations"], allowed=at_most_cases(MAX_PLANNED_CASES))
        return None
    start = read_start(goal, variables, search["population"])
    if start is None:
        return None
    plan = {"kind": "goal", "vary": variables, "best": best, "subject_to": constraints, "at": points, **search}
    plan |= ({"drives": drives} if drives else {}) | ({"start": start} if start else {})
    plan |= {"fresh": fresh} if fresh else {}
    plan |= {"names": places.names} if any(places.names) else {}
    return plan | (_of_one_goal(search["polish"], least_gain or 0.0) if len(best) == 1 else {})


def _of_one_goal(polish: bool, least_gain: float) -> dict[str, Any]:
    """What the search for one goal does beyond that of earlier releases, whose plans go on as they began."""
    return {
        "growing": True,
        **({"finish": True} if polish else {}),
        **({"least_gain": least_gain} if least_gain else {}),
    }


def read_start(goal: Node, variables: Variables, population: int) -> list[list[float]] | None:
    """The known designs: the value (SI) of each variable; None, and the faults recorded, if invalid."""
    node, items = goal["start"], GOAL.items(goal, "start")
    _refuse_mixed_points(items)
    if len(items) > population:
        message = plural("has {count} design", "has {count} designs", len(items))
        allowed = Sentence("at most those of one generation, {population}", population=population)
        node.refuse("too-many", message, None, allowed=allowed)
    known = [Variable.from_json(variable) for variable in variables]
    read = [_read_design(item, known) for item in (items if node.sound else ())]
    return [design for design in read if design is not None] if node.sound else None


def _read_design(item: Node, variables: Sequence[Variable]) -> list[float] | None:
    """One known design; None, and the faults recorded, where it is invalid."""
    if not isinstance(item.value, Mapping):
        item.refuse("wrong-type", "must be an object", allowed='as in {"pendulums.0.arm": "30 mm"}, or {}')
        return None
    paths = [path for variable in variables for path in variable.paths]
    for path in item.value:
        if path not in paths:
            item[path].refuse("invalid-path", "does not vary", path, allowed=", ".join(paths))
    values = [_read_known(item, variable) for variable in variables]
    known = [value for value in values if value is not None]
    return known if len(known) == len(variables) and item.sound else None


def _read_known(item: Node, variable: Variable) -> float | None:
    """The value of a variable, by default that of the base; None, and a fault recorded, where it is invalid."""
    parameters, base, name = item.machine.parameters, item.machine.values, " = ".join(variable.paths)
    place = next((item[path] for path in variable.paths if path in item), item)
    given = {item[path].number(parameters[path]) for path in variable.paths if path in item}
    numbers = given or {base[path] for path in variable.paths if path in base}
    if len(numbers) != 1:
        several = Sentence("{path} has several values", path=name)
        missing = Sentence("{path} has no nominal value in `base`", path=name)
        place.refuse("conflict" if numbers else "required", several if numbers else missing, None)
        return None
    value = numbers.pop()
    if value is not None and not variable.has(value):
        unit = parameters[variable.paths[0]].unit
        told = Sentence("{path} = {value} is outside of what varies", path=name, value=Amount(value, unit, 6))
        ends = span(*(Amount(end, unit, 6) for end in (variable.low, variable.high)))
        place.refuse("out-of-range", told, None, allowed=N_("one of its `values`") if variable.values else ends)
        return None
    return value


def _read_best(items: Sequence[Node], places: Places) -> list[dict[str, Any]]:
    best: list[dict[str, Any]] = []
    for item in items:
        if not _GOAL.read(item):
            continue
        if "yield" in item:
            best += _read_yield_goal(item, places)
            continue
        info = read_numeric_result(item["result"])
        largest, drives = _MAX.read(item), read_about_drives(item)
        at, over = places.read(item), _read_over(item, _OVER)
        if info is None or largest is None or drives is None or at is None or over is None:
            continue
        about = {"result": info.name, **drives, **at, **over}
        if any({key: value for key, value in goal.items() if key != "max"} == about for goal in best):
            item["result"].refuse("repeated", "is a goal already", info.name, allowed="each result once")
        else:
            best.append({**about, "max": largest})
    return best


def _read_yield_goal(item: Node, places: Places) -> list[dict[str, Any]]:
    """The goal of a large yield; nothing, and faults recorded, where it is invalid."""
    item.refuse_each(("result", *_OF_DRIVES, "at", "over"), "cannot be combined with `yield`")
    if item["max"].otherwise(True).value is not True:
        item["max"].refuse("conflict", "a yield is to be large", allowed="true")
        return []
    conditions = _read_conditions(item["yield"], places)
    return [{"yield": conditions, "max": True}] if conditions else []


def _read_conditions(node: Node, places: Places) -> list[dict[str, Any]]:
    """The conditions of a yield; nothing, and faults recorded, where one is invalid."""
    read = [_read_constraint(item, places) for item in _YIELD.read(node) or ()]
    return [condition for condition in read if condition] if node.sound else []


def _read_constraint(item: Node, places: Places, *, robust: bool = False) -> dict[str, Any] | None:
    """One constraint; None, and the faults recorded, where it is invalid. ``robust``: of a quantile or a yield, too."""
    if not (_CONSTRAINT if robust else _LIMIT).read(item):
        return None
    if robust and "yield" in item:
        item.refuse_each(
            ("result", *_OF_DRIVES, "is", "at_most", "within", "at", "over"), "cannot be combined with `yield`"
        )
        conditions, least = _read_conditions(item["yield"], places), item["at_least"].share(0.0, 1.0)
        return None if least is None or not conditions else {"yield": conditions, "at_least": least}
    info, kind, drives = read_result(item["result"]), item.one_of(_KINDS), read_about_drives(item)
    at, over = places.read(item), _read_over(item, _OVER_LIMIT) if robust else {}
    if info is None or kind is None or drives is None or at is None or over is None:
        return None
    limit = item[kind]
    if over and kind == "is":
        item["over"].refuse("conflict", "cannot be combined with `is`", allowed="at_least or at_most")
        return None
    if "quantile" in drives and kind == "is":
        item["quantile"].refuse("conflict", "cannot be combined with `is`", allowed="at_least or at_most")
        return None
    if STATISTIC.name in drives and kind == "is" and info.kind != "real":
        item[STATISTIC.name].refuse(
            "conflict", "cannot be combined with `is`", allowed="a result that is a real number"
        )
        return None
    if info.kind == "category" and kind != "is":
        limit.refuse("not-numeric", "compares a category", allowed="`is` for a category")
        return None
    together = [item[name] for name in (kind, "within") if name in item]
    if info.kind == "real" and refuse_mixed(together, info.unit):
        return None
    value = read_value(limit, info)
    if value is not None and kind == "is" and info.kind == "count" and not value.is_integer():
        limit.refuse("not-a-number", "must be a whole number", allowed="a whole number, or at_least and at_most")
        return None
    within = _read_within(item["within"], info, kind, value)
    if value is None or within is None:
        return None
    return {"result": info.name, **drives, **at, **over, kind: value, **({"within": within} if within else {})}


def _read_within(node: Node, info: ResultInfo, kind: str, value: float | None) -> float | None:
    """Half the width (SI) of an equality, a quantity or relative to its value; 0 for other kinds and other results."""
    if kind != "is" or info.kind != "real":
        if node.given:
            node.refuse("not-used", "is not used here", allowed="only with `is` and a real number")
        return 0.0
    if value is None:
        return None
    given = node.otherwise(_WITHIN.default)
    share = in_percent(given.value)
    if share is not None and value == 0.0:
        node.refuse(
            "out-of-range" if node.given else "required",
            "must be a quantity: a share of 0 is no width" if node.given else "is required: a share of 0 is no width",
            allowed="a quantity greater than 0", unit=info.unit,
        )  # fmt: skip
        return None
    width = abs(value) * share if share is not None else read_value(given, info)
    if width is not None and width <= 0.0:
        given.refuse("out-of-range", "is not a valid width",
                     allowed='greater than 0, as in "2 %" of the value, or a quantity', unit=info.unit)  # fmt: skip
        return None
    if width is not None and width >= abs(value) > 0.0:
        text = Sentence("is at least as wide as the value, so that 0 fulfils the limit, too")
        node.report.warn("wide-limit", Place(node.pointer, info.name), text)
    return width
