"""The parts of a machine shaft in a spec: the fields of mechanism, operation and cycle that are not numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from fractions import Fraction
from typing import Any, Final

from sprag_study.sentences import Amount, Sentence, plural
from sprag_study.service.languages import N_
from sprag_study.service.reading.catalogue import range_sentence
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.spec.described import Described, Field, Listed, Record, choice, named
from sprag_study.service.spec.machine.linkage import LINKAGE, read_linkage
from sprag_study.service.spec.machine.shaft_numbers import numbers_under
from sprag_study.service.spec.machine.shaft_tables import read_csv_rows
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.schema.quantity import QUANTITY, required_of
from sprag_study.worker.models import Parameter, machine_shaft

_PHI_C_HELP: Final = (
    "which of the angles with T = T_mean S3 and S4 count from, from 0; by default the first where T rises"
)
PHI_C: Final = Described("phi_c", "", _PHI_C_HELP, "whole", 0, 1000)
_LAWS: Final = ("cycloidal", "polynomial_345")
INTERPOLATION: Final = choice(
    "interpolation",
    "how rows of the table are joined: without overshoot, or by straight lines",
    "smooth",
    "linear",
    default="smooth",
)
_WEIGHTS: Final = "whether the ram alone has a weight, or rods, couplers and blocks too"
_MODELLED: Final = "rods and couplers as full bodies, or as two masses on their pins"
_BODIES: Final = named(
    choice("weights", _WEIGHTS, "ram", "all", default="ram"),
    choice("bodies", _MODELLED, "full", "two_mass", default="full"),
)
#: What of a mechanism is no number.
MECHANISM_CHOICES: Final[dict[str, dict[str, Described]]] = {
    **dict.fromkeys(("slider_crank", "four_bar", "drag_link", "toggle"), _BODIES),
    "scotch_yoke": {},
    "parallel_crank": {},
    "quick_return": named(choice("kind", "kind of the quick return", "crank_shaper", "whitworth"), *_BODIES.values()),
    "cam": named(*(choice(part, f"law of the {part}", *_LAWS, default=_LAWS[0]) for part in ("rise", "fall"))),
}
#: What of an indicator diagram is no number: its rows over the shaft's angle, or along the strokes of the cycle.
_AGAINST: Final = "against the shaft's angle, or the volume as fraction of the stroke, or recorded over time"
INDICATOR_OVER: Final = choice("over", _AGAINST, "angle", "stroke", "time", default="angle")
_OVER: Final = "against the shaft's angle, or the fraction of the stroke, or recorded over time"
_DURING: Final = "strokes in which a diagram over the stroke holds"
_SENSE: Final = "a force against the motion, or always against the forward stroke"
_EFFICIENCY_IS: Final = (
    "whether the efficiency is the share of the power that passes at each angle, or of the work of a cycle"
)
OPERATION_CHOICES: Final = named(
    choice("quantity", "a force on the working part, or a torque on the shaft", "force", "torque"),
    choice("over", _OVER, "angle", "stroke", "time", default="angle"),
    choice("during", _DURING, "forward", "return", "both", default="forward"),
    choice("sense", _SENSE, "resisting", "fixed", default="resisting"),
)
EFFICIENCY_IS: Final = choice(
    "efficiency_is", _EFFICIENCY_IS, "power", "work", default="power", label=N_("Efficiency means"),
    called={"power": N_("share of the power, in either direction"), "work": N_("share of the work of a cycle")},
)  # fmt: skip
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]{0,39}")
_ANY: Final = 1e30
ANGLE = Parameter("angle", "phi", "rad", -400.0, 400.0, False, None, "angle of the shaft")
_TIME = Parameter("time", "t", "s", -1e6, 1e6, False, None, "time since the shaft's angle 0")
#: Turns the times of a diagram into angles.
RECORDED_AT: Final = Parameter(
    "recorded_at", "", "rad/s", 0.0, 1e6, True, None, "mean speed of the shaft while the diagram was recorded over time"
)
_PRESSURE = Parameter("pressure", "p", "Pa", 0.0, 1e12, False, None, "absolute pressure")
_FRACTION = Parameter("fraction", "x", "1", 0.0, 1.0, False, None, "fraction of the stroke")
_PLACES: Final = {"angle": ANGLE, "stroke": _FRACTION, "time": _TIME}


_ROWS: Final = Listed(
    "rows", 2, machine_shaft.MAX_ROWS, item={"type": "array", "minItems": 2, "maxItems": 2, "items": QUANTITY}
)
STEPS: Final = Listed(
    "steps", 1, machine_shaft.MAX_STEPS, "constant pieces; zero elsewhere",
    item=Record(numbers_under("operation.steps.K."), required=required_of(numbers_under("operation.steps.K."))),
)  # fmt: skip
#: The cycle and the constants of formulas.
_REVOLUTIONS: Final = {"type": ["integer", "string"]}
CYCLE: Final = {
    **_REVOLUTIONS,
    "default": "1 revolution",
    "description": f"revolutions of a cycle, 1 to {max(machine_shaft.REVOLUTIONS)}",
}
#: The shaft of a part.
RATIO: Final = Parameter(
    "ratio", "i", "1", 0.0, float(max(machine_shaft.REVOLUTIONS)), True, 1.0,
    "speed of the part's shaft over that of the main shaft",
)  # fmt: skip
PART_CYCLE: Final = {
    **_REVOLUTIONS,
    "description": "revolutions of the part's shaft after which the part repeats itself; by default all of its "
    "revolutions in a cycle of the machine",
}
CONSTANTS: Final = {
    "type": "object",
    "maxProperties": machine_shaft.MAX_CONSTANTS,
    "additionalProperties": {"type": "number"},
    "description": "numbers that formulas use by their names",
}


def rows_of(table: str) -> dict[str, Field]:
    """The fields of a course that is given as a table."""
    return {
        "table": {**_ROWS.schema(), "description": f"rows of {table}"},
        "csv": {"type": "string", "description": f"{table} as the text of a CSV file, headings with units in brackets"},
    }


def diagram_of(table: str, formula: str) -> dict[str, Field]:
    """The fields of a course that is given as a table or as a formula."""
    return {**rows_of(table), "formula": {"type": "string", "minLength": 1, "description": formula}}


def _kind(kind: str, choices: Mapping[str, Described]) -> Record:
    numbers = numbers_under(f"mechanism.{kind}.")
    required = [*(name for name, field in choices.items() if field.default is None), *required_of(numbers)]
    return Record({**choices, **numbers}, required=required)


_KINDS: Final = {kind: _kind(kind, choices) for kind, choices in MECHANISM_CHOICES.items()}
_REDUCED: Final = diagram_of(
    "angle (rad) and reduced inertia (kg*m^2)", "reduced inertia in kg*m^2 as a formula of phi (rad)"
)
MECHANISM: Final = Record(
    {**_REDUCED, **_KINDS, "linkage": LINKAGE, "interpolation": INTERPOLATION},
    "what the shaft drives: a table, a formula, or dimensions and masses",
    either=(*_REDUCED, *_KINDS, "linkage"),
)
_GAS: Final = Record(
    numbers_under("operation.gas."), "a gas drawn in and compressed by the working part",
    required=required_of(numbers_under("operation.gas.")),
)  # fmt: skip
_INDICATOR: Final = Record(
    {
        "over": INDICATOR_OVER,
        "recorded_at": RECORDED_AT,
        **rows_of(
            "angle (rad), fraction of the stroke, to and fro in every revolution, or time (s), and pressure (Pa)"
        ),
        "interpolation": INTERPOLATION,
        **numbers_under("operation.indicator."),
    },
    "the pressure on the piston as measured",
    required=required_of(numbers_under("operation.indicator.")),
    either=("table", "csv"),
)
_RESISTANCE: Final = diagram_of(
    "angle (rad), fraction of the stroke or time (s), and force (N) or torque (N*m)",
    "force or torque as a formula of phi (rad), t (s), x (fraction of the stroke) and omega (rad/s)",
)
OPERATION: Final = Record(
    {
        "value": numbers_under("operation.")["value"],
        "steps": STEPS,
        **_RESISTANCE,
        "gas": _GAS,
        "indicator": _INDICATOR,
        **OPERATION_CHOICES,
        EFFICIENCY_IS.name: EFFICIENCY_IS,
        "interpolation": INTERPOLATION,
        **numbers_under("operation."),
        "recorded_at": RECORDED_AT,
    },
    "what resists",
    either=("value", "steps", *_RESISTANCE, "gas", "indicator"),
)
_PART: Final = Record(
    {
        **numbers_under("parts.N."),
        RATIO.path: RATIO,
        "cycle": PART_CYCLE,
        "mechanism": MECHANISM,
        "operation": OPERATION,
    },
    "a mechanism with its operation; their angle is that of the shaft, times the ratio, plus the crank angle",
)
PARTS: Final = Listed(
    "parts",
    1,
    machine_shaft.MAX_PARTS,
    "several mechanisms, each with its operation, at its crank angle and on its shaft",
    item=_PART,
)


def read_cycle(node: Node) -> int | None:
    """Read the revolutions of a cycle, by default one."""
    most, value = max(machine_shaft.REVOLUTIONS), node.otherwise(1).value
    turns: float | None = None
    if isinstance(value, str):
        allowed = plural("1 to {count} revolution", "1 to {count} revolutions", most)
        angle = node.parsed(lambda text: parse_quantity(text, "rad"), allowed=allowed)
        if angle is None:
            return None
        turns = angle / (2.0 * math.pi)
    elif isinstance(value, int | float) and not isinstance(value, bool):
        turns = float(value)
    for known in machine_shaft.REVOLUTIONS:
        if turns is not None and math.isclose(turns, known, rel_tol=1e-12):
            return known
    allowed = Sentence('"1 revolution" to "{most} revolutions", or 1 to {most}', most=str(most))
    node.refuse("wrong-type", "must be a whole number of revolutions", allowed=allowed)
    return None


def read_constants(node: Node) -> list[str] | None:
    """Read the names of the constants of formulas."""
    data = node.otherwise({}).value
    if not isinstance(data, Mapping) or len(data) > machine_shaft.MAX_CONSTANTS:
        most = str(machine_shaft.MAX_CONSTANTS)
        allowed = Sentence("an object of at most {count} names with their numbers", count=most)
        node.refuse("wrong-type", "must be an object of names with their numbers", allowed=allowed)
        return None
    for name in data:
        if not _NAME.fullmatch(name):
            node[name].refuse("invalid-text", "is not a valid name for a constant", name,
                              allowed="letters, digits and _, at most 40, no digit first")  # fmt: skip
    return sorted(data) if node.sound else None


def read_mechanism(node: Node, places: dict[str, str], prefix: str = "") -> dict[str, Any] | None:
    """Read the mechanism: its kind and its non-numeric fields."""
    places[f"{prefix}mechanism"] = node.pointer
    if node.value is None:
        return {"kind": "none"}
    kind = node.one_of(MECHANISM.either) if MECHANISM.read(node) else None
    if kind is None:
        return None
    own = node[kind]
    places[f"{prefix}mechanism"] = own.pointer
    if kind in _REDUCED:
        diagram = read_diagram(node, ANGLE, value_in("kg*m^2"))
        return diagram and {"kind": diagram["form"], "table": diagram["table"], "formula": diagram["formula"]}
    if "interpolation" in node:
        node["interpolation"].refuse("not-used", "applies to a table, and there is none")
    if kind == "linkage":
        linkage = read_linkage(own)
        return linkage and {"kind": kind, "linkage": linkage}
    record = _KINDS[kind]
    if not record.read(own):
        return None
    made: dict[str, Any] = {"kind": kind}
    for name, value in record.values(own).items():
        # Defaults are left out, so that studies from before these choices keep their hash.
        if name not in _BODIES or value != _BODIES[name].default:
            made["quick_return" if name == "kind" else name] = value
    if None in made.values():
        return None
    unused = sorted(name for name in _unused_of(made) if name in own)
    for name in unused:
        own[name].refuse("not-used", _UNUSED[name])
    return None if unused else made


_MASSES: Final = N_('is not used with `bodies` "two_mass": it follows from the centre of mass')
_UNUSED: Final = {
    "rod_inertia": _MASSES, "coupler_inertia": _MASSES,
    "inclination": N_('is not used without `weights` "all": nothing of this mechanism has a weight'),
}  # fmt: skip


def _unused_of(made: Mapping[str, Any]) -> set[str]:
    """Numbers that a mechanism with these choices does not use."""
    unused = {"rod_inertia", "coupler_inertia"} if "bodies" in made else set()
    return unused | {"inclination"} if made["kind"] == "four_bar" and "weights" not in made else unused


def read_operation(node: Node, places: dict[str, str], prefix: str = "") -> dict[str, Any] | None:
    """Read the operation: the resistance, its form and its variable."""
    places[f"{prefix}operation"] = node.pointer
    if node.value is None:
        return {"quantity": "none", "over": "angle", "steps": 0}
    if not OPERATION.read(node):
        return None
    share = _read_efficiency_is(node)
    if share is None:
        return None
    operation = _read_course(node, places, prefix)
    return operation and operation | share


def _read_efficiency_is(node: Node) -> dict[str, str] | None:
    """What the efficiency means, where that is not the usual; None with a fault recorded."""
    means = EFFICIENCY_IS.read(node)
    if means != "work":
        return None if means is None else {}
    own = node[EFFICIENCY_IS.name]
    if "formula" in node:
        own.refuse("conflict", "is not possible for a formula, whose work over the cycle is not known before",
                   allowed=N_('"power", or another diagram'))  # fmt: skip
        return None
    return {EFFICIENCY_IS.name: "work"}


def _read_course(node: Node, places: dict[str, str], prefix: str) -> dict[str, Any] | None:
    """Read the resistance of an operation: its form and its variable."""
    if "gas" in node:
        well = not _beside(node, "gas") and _GAS.read(node["gas"])
        return {"quantity": "gas", "over": "angle", "steps": 0} if well else None
    if "indicator" in node:
        return _read_indicator(node, places, prefix)
    form = node.one_of(OPERATION.either)
    if form is None:
        return None
    chosen = {name: field.read(node) for name, field in OPERATION_CHOICES.items()}
    if None in chosen.values():
        return None
    speed = _read_recorded_at(node, str(chosen["over"]), form)
    if speed is None:
        return None
    operation: dict[str, Any] = {**chosen, "steps": 0}
    places[f"{prefix}operation"] = node[form].pointer
    if form == "value":
        return operation | {"form": "constant"}
    if form == "steps":
        steps = STEPS.read_records(node["steps"])
        return operation | {"form": "steps", "steps": len(steps)} if steps else None
    value = value_in("N" if chosen["quantity"] == "force" else "N*m")
    diagram = read_diagram(node, _PLACES[str(chosen["over"])], value)
    return None if diagram is None else _over_angle(operation | diagram, speed)


#: Fields that every operation has.
_SHARE: Final = ("scale", "efficiency", EFFICIENCY_IS.name)


def _beside(node: Node, form: str) -> bool:
    """Whether there are fields beside a gas or an indicator diagram that do not belong to it; each is a fault."""
    foreign = [name for name in node.value if name not in {form, *_SHARE}]
    for name in foreign:
        node[name].refuse(
            "not-used",
            "does not belong to a gas, which acts on the working part over the whole cycle"
            if form == "gas"
            else "does not belong to an indicator diagram, which acts on the working part over the whole cycle",
            allowed=", ".join((form, *_SHARE)),
        )
    return bool(foreign)


def _read_indicator(operation: Node, places: dict[str, str], prefix: str) -> dict[str, Any] | None:
    """Read an indicator diagram: pressure over the angle or along the strokes."""
    node = operation["indicator"]
    if _beside(operation, "indicator") or not _INDICATOR.read(node):
        return None
    over = INDICATOR_OVER.read(node)
    form = None if over is None else node.one_of(_INDICATOR.either)
    speed = None if form is None else _read_recorded_at(node, over, form)
    if form is None or speed is None:
        return None
    places[f"{prefix}operation"] = node[form].pointer
    diagram = read_diagram(node, _PLACES[over], _PRESSURE)
    return None if diagram is None else _over_angle({"quantity": "pressure", "over": over, "steps": 0} | diagram, speed)


def _read_recorded_at(owner: Node, over: str, form: str) -> float | None:
    """The speed in rad/s at which a diagram over time was recorded, 1 for any other; None with a fault recorded."""
    node = owner["recorded_at"]
    if over != "time":
        if not node.given:
            return 1.0
        node.refuse("not-used", "belongs to a diagram over time, and this one is not",
                    allowed='with `over` "time" only')  # fmt: skip
    elif form not in {"table", "csv"}:
        text = Sentence(
            "is possible for what was recorded, a table or csv, and not for {form}; a formula may use the time t",
            form=form,
        )
        owner["over"].refuse("conflict", text, allowed='"angle" or "stroke"')
    elif node.given:
        return node.number(RECORDED_AT)
    else:
        node.refuse(
            "required", "is required by a diagram over time: the angle is this speed times the time",
            allowed=range_sentence(RECORDED_AT), unit=RECORDED_AT.unit,
        )  # fmt: skip
    return None


def _over_angle(operation: dict[str, Any], speed: float) -> dict[str, Any]:
    """An operation whose rows over time have become rows over the angle of a shaft that turns evenly at ``speed``."""
    if operation["over"] != "time":
        return operation
    table = operation["table"]
    rows = [[speed * time, value] for time, value in table["rows"]]
    return operation | {"over": "angle", "table": table | {"rows": rows}}


def _read_shaft(part: Node, cycle: int | None) -> dict[str, int]:
    """Read the turns of a part's shaft in a ``cycle`` of the machine and the part's cycle, where they are not usual."""
    ratio = part[RATIO.path].number_or_default(RATIO)
    own = read_cycle(part["cycle"]) if part["cycle"].value is not None else None
    if ratio is None or cycle is None or not part["cycle"].sound:
        return {}
    turns = round(ratio * cycle)
    if not 1 <= turns <= max(machine_shaft.REVOLUTIONS) or not math.isclose(turns, ratio * cycle, rel_tol=1e-9):
        _refuse_ratio(part[RATIO.path], ratio, cycle)
        return {}
    if own is not None and turns % own:
        message = Sentence(
            "does not divide the turns of the part in a cycle of the machine, which are {turns}", turns=str(turns)
        )
        divisors = (str(each) for each in machine_shaft.REVOLUTIONS if turns % each == 0)
        part["cycle"].refuse("conflict", message, allowed=", ".join(divisors))
        return {}
    # What is usual is left out, so that studies from before there were such shafts keep their hash.
    return ({} if turns == cycle else {"turns": turns}) | ({} if own in {None, turns} else {"cycle": own})


def _refuse_ratio(node: Node, ratio: float, cycle: int) -> None:
    """Record a ratio with which the machine would not repeat itself after its cycle."""
    most = max(machine_shaft.REVOLUTIONS)
    message = Sentence(
        "lets the part turn {turns} times in a cycle of the machine ({cycle}), which must be a whole number of times, "
        "or nothing repeats itself",
        turns=Amount(ratio * cycle, "1", 6), cycle=plural("{count} revolution", "{count} revolutions", cycle),
    )  # fmt: skip
    longer = math.lcm(cycle, Fraction(ratio).limit_denominator(most).denominator)
    near = str(min(max(round(ratio * cycle), 1), most))
    if longer in machine_shaft.REVOLUTIONS and longer != cycle and 1 <= ratio * longer <= most:
        allowed = Sentence(
            "{near}/{cycle}, or a machine with a cycle of {longer} revolutions",
            near=near, cycle=str(cycle), longer=str(longer),
        )  # fmt: skip
    else:
        allowed = Sentence(
            "1/{cycle} to {most}/{cycle}, such as {near}/{cycle}", near=near, cycle=str(cycle), most=most
        )
    node.refuse("conflict", message, allowed=allowed)


def read_parts(node: Node, places: dict[str, str], cycle: int | None) -> list[dict[str, Any]] | None:
    """Read the mechanisms of a machine of several with their operations; None, with the faults recorded, if any.

    ``cycle`` are the revolutions of a cycle of the machine, if they could be read.
    """
    parts = []
    for index, item in enumerate(PARTS.read(node) or ()):
        if _PART.read(item):
            prefix = f"parts.{index}."
            mechanism = read_mechanism(item["mechanism"], places, prefix)
            operation = read_operation(item["operation"], places, prefix)
            parts.append({"mechanism": mechanism, "operation": operation} | _read_shaft(item, cycle))
    return parts if node.sound else None


def value_in(unit: str) -> Parameter:
    return Parameter("value", "", unit, -_ANY, _ANY, False, None, "value")


def read_diagram(node: Node, place: Parameter, value: Parameter) -> dict[str, Any] | None:
    """Form, table and formula of a diagram that is given as a table, the text of a CSV file or a formula."""
    form = node.one_of(("table", "csv", "formula"))
    if form is None:
        return None
    own = node[form]
    if form == "formula":
        if "interpolation" in node:
            node["interpolation"].refuse("not-used", "applies to a table, and this is a formula")
        elif not isinstance(own.value, str) or not own.value.strip():
            own.refuse("wrong-type", "must be a text", allowed="a formula of phi, in rad")
        return {"form": "formula", "table": None, "formula": own.value} if own.sound else None
    rows = read_csv_rows(own, place, value) if form == "csv" else _ROWS.read_rows(own, place, value)
    interpolation = INTERPOLATION.read(node)
    if not own.sound:
        return None
    return {"form": "table", "table": {"rows": rows, "interpolation": interpolation}, "formula": None}
