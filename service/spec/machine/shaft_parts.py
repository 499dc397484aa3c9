"""The parts of a machine shaft in a spec: the fields of mechanism, operation and cycle that are not numbers."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

from sprag.sentences import Sentence, plural
from sprag.service.languages import N_
from sprag.service.reading.catalogue import range_sentence
from sprag.service.reading.units import QuantityError, parse_quantity
from sprag.service.spec.described import Described, Listed, choice, named
from sprag.service.spec.fields import read_number, read_object, read_one, values_of
from sprag.service.spec.machine.shaft_tables import read_csv_rows
from sprag.service.spec.node import Node
from sprag.service.spec.report import Report, join
from sprag.worker import models
from sprag.worker.models import Parameter, machine_shaft

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
MECHANISMS: Final = ("table", "csv", "formula", *MECHANISM_CHOICES)
#: Ways to give an operation.
FORMS: Final = ("value", "steps", "table", "csv", "formula", "gas", "indicator")
#: What of an indicator diagram is no number: its rows over the shaft's angle, or along the strokes of the cycle.
_AGAINST: Final = "against the shaft's angle, or the volume as fraction of the stroke, or recorded over time"
INDICATOR_OVER: Final = choice("over", _AGAINST, "angle", "stroke", "time", default="angle")
_OVER: Final = "against the shaft's angle, or the fraction of the stroke, or recorded over time"
_DURING: Final = "strokes in which a diagram over the stroke holds"
_SENSE: Final = "a force against the motion, or always against the forward stroke"
OPERATION_CHOICES: Final = named(
    choice("quantity", "a force on the working part, or a torque on the shaft", "force", "torque"),
    choice("over", _OVER, "angle", "stroke", "time", default="angle"),
    choice("during", _DURING, "forward", "return", "both", default="forward"),
    choice("sense", _SENSE, "resisting", "fixed", default="resisting"),
)
PARTS: Final = Listed(
    "parts",
    1,
    machine_shaft.MAX_PARTS,
    "several mechanisms on the shaft, each with its operation and at its crank angle",
)
PART_FIELDS: Final = ("crank_angle", "mechanism", "operation")
STEPS: Final = Listed("steps", 1, machine_shaft.MAX_STEPS, "constant pieces; zero elsewhere")
ROWS: Final = Listed("rows", 2, machine_shaft.MAX_ROWS)
_NAME = re.compile(r"[A-Za-z_][A-Za-z_0-9]{0,39}")
_ANY: Final = 1e30
ANGLE = Parameter("angle", "phi", "rad", -100.0, 100.0, False, None, "angle of the shaft")
_TIME = Parameter("time", "t", "s", -1e6, 1e6, False, None, "time since the shaft's angle 0")
#: Turns the times of a diagram into angles.
RECORDED_AT: Final = Parameter(
    "recorded_at", "", "rad/s", 0.0, 1e6, True, None, "mean speed of the shaft while the diagram was recorded over time"
)
_PRESSURE = Parameter("pressure", "p", "Pa", 0.0, 1e12, False, None, "absolute pressure")
_FRACTION = Parameter("fraction", "x", "1", 0.0, 1.0, False, None, "fraction of the stroke")
_PLACES: Final = {"angle": ANGLE, "stroke": _FRACTION, "time": _TIME}


def numbers_under(prefix: str) -> dict[str, Parameter]:
    """The numbers directly under ``prefix`` (with its last dot) in the catalogue, by their names."""
    entries = {entry.path: entry for entry in models.parameter_catalogue(models.MACHINE_SHAFT)}
    below = {path.removeprefix(prefix): entry for path, entry in entries.items() if path.startswith(prefix)}
    return {name: entry for name, entry in below.items() if "." not in name}


def _revolutions(most: int) -> Sentence:
    return plural("1 to {count} revolution", "1 to {count} revolutions", most)


def read_cycle(report: Report, value: object) -> int | None:
    """Read the revolutions of a cycle."""
    most = max(machine_shaft.REVOLUTIONS)
    turns: float | None = None
    if isinstance(value, str):
        try:
            turns = parse_quantity(value, "rad") / (2.0 * math.pi)
        except QuantityError as error:
            report.fault("/base/cycle", error.code, error.message, value, allowed=_revolutions(most))
            return None
    elif isinstance(value, int | float) and not isinstance(value, bool):
        turns = float(value)
    for known in machine_shaft.REVOLUTIONS:
        if turns is not None and math.isclose(turns, known, rel_tol=1e-12):
            return known
    report.fault(
        "/base/cycle", "wrong-type", "must be a whole number of revolutions", value,
        allowed=Sentence('"1 revolution" to "{most} revolutions", or 1 to {most}', most=str(most)),
    )  # fmt: skip
    return None


def read_constants(report: Report, data: object) -> list[str] | None:
    """Read the names of the constants of formulas."""
    if not isinstance(data, Mapping) or len(data) > machine_shaft.MAX_CONSTANTS:
        most = str(machine_shaft.MAX_CONSTANTS)
        allowed = Sentence("an object of at most {count} names with their numbers", count=most)
        report.fault(
            "/base/constants", "wrong-type", "must be an object of names with their numbers", data, allowed=allowed
        )
        return None
    wrong = [name for name in data if not _NAME.fullmatch(name)]
    for name in wrong:
        report.fault(join("/base/constants", name), "invalid-text", "is not a valid name for a constant", name,
                       allowed="letters, digits and _, at most 40, no digit first")  # fmt: skip
    return None if wrong else sorted(data)


def numbers_of(structure: Mapping[str, Any], prefix: str) -> list[str]:
    return [path.removeprefix(prefix) for path in machine_shaft.parameters_of(structure) if path.startswith(prefix)]


def refuse_foreign(report: Report, pointer: str, found: Mapping[str, Any], own: Sequence[str], what: Sentence) -> None:
    for name in found:
        if name not in own:
            report.fault(
                join(pointer, name), "unknown-field",
                Sentence("is not a field of {what}", what=what), found[name], allowed=", ".join(own),
            )  # fmt: skip


def _place(prefix: str, name: str) -> str:
    """JSON Pointer of a field of the base, or of one of its parts (``prefix`` "parts.0.")."""
    return "/base/" + prefix.replace(".", "/") + name


def read_mechanism(report: Report, data: object, places: dict[str, str], prefix: str = "") -> dict[str, Any] | None:
    """Read the mechanism: its kind and its non-numeric fields."""
    where = places[f"{prefix}mechanism"] = _place(prefix, "mechanism")
    if data is None:
        return {"kind": "none"}
    found = read_object(report, where, data, (*MECHANISMS, "interpolation"))
    if found is None:
        return None
    kind = read_one(report, where, found, MECHANISMS)
    if kind is None:
        return None
    places[f"{prefix}mechanism"] = pointer = join(where, kind)
    if kind in {"table", "csv", "formula"}:
        diagram = read_diagram(report, where, found, ANGLE, value_in("kg*m^2"))
        return (
            None
            if diagram is None
            else {"kind": diagram["form"], "table": diagram["table"], "formula": diagram["formula"]}
        )
    if "interpolation" in found:
        report.fault(
            join(where, "interpolation"), "not-used", "applies to a table, and there is none", found["interpolation"]
        )
    choices = MECHANISM_CHOICES[kind]
    own = read_object(report, pointer, found[kind], (*choices, *numbers_under(f"mechanism.{kind}.")))
    if own is None:
        return None
    made: dict[str, Any] = {"kind": kind}
    for name, field in choices.items():
        value = field.read(Node(report, pointer, own))
        # Defaults are left out, so that studies from before these choices keep their hash.
        if name not in _BODIES or value != field.default:
            made["quick_return" if name == "kind" else name] = value
    if None in made.values():
        return None
    unused = _unused_of(made) & set(own)
    for name in sorted(unused):
        report.fault(join(pointer, name), "not-used", _UNUSED[name], own[name])
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


def read_operation(report: Report, data: object, places: dict[str, str], prefix: str = "") -> dict[str, Any] | None:
    """Read the operation: the resistance, its form and its variable."""
    where = places[f"{prefix}operation"] = _place(prefix, "operation")
    if data is None:
        return {"quantity": "none", "over": "angle", "steps": 0}
    own = ("interpolation", "scale", "efficiency", "recorded_at")
    found = read_object(report, where, data, (*FORMS, *OPERATION_CHOICES, *own))
    if found is None:
        return None
    if "gas" in found:
        return _read_gas(report, where, found)
    if "indicator" in found:
        return _read_indicator(report, where, found, places, prefix)
    form = read_one(report, where, found, FORMS)
    if form is None:
        return None
    chosen = {name: field.read(Node(report, where, found)) for name, field in OPERATION_CHOICES.items()}
    if None in chosen.values():
        return None
    speed = read_recorded_at(report, where, found, str(chosen["over"]), form)
    if speed is None:
        return None
    operation: dict[str, Any] = {**chosen, "steps": 0}
    places[f"{prefix}operation"] = join(where, form)
    if form == "value":
        return operation | {"form": "constant"}
    if form == "steps":
        count = _read_steps(report, join(where, "steps"), found["steps"])
        return None if count is None else operation | {"form": "steps", "steps": count}
    value = value_in("N" if chosen["quantity"] == "force" else "N*m")
    diagram = read_diagram(report, where, found, _PLACES[str(chosen["over"])], value)
    return None if diagram is None else _over_angle(operation | diagram, speed)


def _beside(report: Report, where: str, found: Mapping[str, Any], form: str) -> bool:
    """Whether there are fields beside a gas or an indicator diagram that do not belong to it; each is a fault."""
    foreign = [name for name in found if name not in {form, "scale", "efficiency"}]
    for name in foreign:
        report.fault(
            join(where, name), "not-used",
            "does not belong to a gas, which acts on the working part over the whole cycle"
            if form == "gas"
            else "does not belong to an indicator diagram, which acts on the working part over the whole cycle",
            found[name], allowed=f"{form}, scale, efficiency",
        )  # fmt: skip
    return bool(foreign)


def _read_indicator(
    report: Report, where: str, found: Mapping[str, Any], places: dict[str, str], prefix: str
) -> dict[str, Any] | None:
    """Read an indicator diagram: pressure over the angle or along the strokes."""
    pointer = join(where, "indicator")
    names = ("over", "recorded_at", "table", "csv", "interpolation", *numbers_under("operation.indicator."))
    own = (
        None if _beside(report, where, found, "indicator") else read_object(report, pointer, found["indicator"], names)
    )
    over = None if own is None else INDICATOR_OVER.read(Node(report, pointer, own))
    if own is None or over is None:
        return None
    form = read_one(report, pointer, own, ("table", "csv"))
    speed = None if form is None else read_recorded_at(report, pointer, own, str(over), form)
    if form is None or speed is None:
        return None
    places[f"{prefix}operation"] = join(pointer, form)
    diagram = read_diagram(report, pointer, own, _PLACES[str(over)], _PRESSURE)
    return None if diagram is None else _over_angle({"quantity": "pressure", "over": over, "steps": 0} | diagram, speed)


def read_recorded_at(report: Report, where: str, found: Mapping[str, Any], over: str, form: str) -> float | None:
    """The speed in rad/s at which a diagram over time was recorded, 1 for any other; None with a fault recorded."""
    pointer = join(where, "recorded_at")
    if over != "time":
        if "recorded_at" in found:
            report.fault(
                pointer, "not-used", "belongs to a diagram over time, and this one is not", found["recorded_at"],
                allowed='with `over` "time" only',
            )  # fmt: skip
            return None
        return 1.0
    if form not in {"table", "csv"}:
        text = Sentence(
            "is possible for what was recorded, a table or csv, and not for {form}; a formula may use the time t",
            form=form,
        )
        report.fault(join(where, "over"), "conflict", text, over, allowed='"angle" or "stroke"')
        return None
    if "recorded_at" not in found:
        report.fault(
            pointer, "required", "is required by a diagram over time: the angle is this speed times the time",
            allowed=range_sentence(RECORDED_AT), unit=RECORDED_AT.unit,
        )  # fmt: skip
        return None
    return read_number(report, pointer, found["recorded_at"], RECORDED_AT)


def _over_angle(operation: dict[str, Any], speed: float) -> dict[str, Any]:
    """An operation whose rows over time have become rows over the angle of a shaft that turns evenly at ``speed``."""
    if operation["over"] != "time":
        return operation
    table = operation["table"]
    rows = [[speed * time, value] for time, value in table["rows"]]
    return operation | {"over": "angle", "table": table | {"rows": rows}}


def _read_gas(report: Report, where: str, found: Mapping[str, Any]) -> dict[str, Any] | None:
    if (
        _beside(report, where, found, "gas")
        or read_object(report, join(where, "gas"), found["gas"], numbers_under("operation.gas.")) is None
    ):
        return None
    return {"quantity": "gas", "over": "angle", "steps": 0}


def _read_steps(report: Report, where: str, data: object) -> int | None:
    fields = numbers_under("operation.steps.K.")
    steps = values_of(STEPS.read(Node(report, where, data))) or ()
    read = [read_object(report, join(where, k), item, fields) for k, item in enumerate(steps)]
    return None if not read or None in read else len(read)


def read_parts(report: Report, data: object, places: dict[str, str]) -> list[dict[str, Any]] | None:
    """Read the mechanisms of a machine of several with their operations; None, with the faults recorded, if any."""
    before, parts = report.found, []
    for index, item in enumerate(values_of(PARTS.read(Node(report, "/base/parts", data))) or ()):
        found = read_object(report, join("/base/parts", index), item, PART_FIELDS)
        if found is not None:
            prefix = f"parts.{index}."
            mechanism = read_mechanism(report, found.get("mechanism"), places, prefix)
            operation = read_operation(report, found.get("operation"), places, prefix)
            parts.append({"mechanism": mechanism, "operation": operation})
    return None if report.found > before else parts


def value_in(unit: str) -> Parameter:
    return Parameter("value", "", unit, -_ANY, _ANY, False, None, "value")


def read_diagram(
    report: Report, pointer: str, found: Mapping[str, Any], place: Parameter, value: Parameter
) -> dict[str, Any] | None:
    """Form, table and formula of a diagram that is given as a table, the text of a CSV file or a formula."""
    form = read_one(report, pointer, found, ("table", "csv", "formula"))
    if form not in {"table", "csv"}:
        return None if form is None else _formula(report, pointer, found)
    before = report.found
    if form == "csv":
        rows = read_csv_rows(Node(report, join(pointer, "csv"), found["csv"]), place, value)
    else:
        rows = ROWS.read_rows(Node(report, join(pointer, "table"), found["table"]), place, value)
    interpolation = INTERPOLATION.read(Node(report, pointer, found))
    if report.found > before:
        return None
    return {"form": "table", "table": {"rows": rows, "interpolation": interpolation}, "formula": None}


def _formula(report: Report, pointer: str, found: Mapping[str, Any]) -> dict[str, Any] | None:
    formula = found["formula"]
    if "interpolation" in found:
        report.fault(join(pointer, "interpolation"), "not-used", "applies to a table, and this is a formula",
                       found["interpolation"])  # fmt: skip
        return None
    if not isinstance(formula, str) or not formula.strip():
        report.fault(
            join(pointer, "formula"), "wrong-type", "must be a text", formula, allowed="a formula of phi, in rad"
        )
        return None
    return {"form": "formula", "table": None, "formula": formula}
