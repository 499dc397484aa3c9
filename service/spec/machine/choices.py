"""Non-numeric fields of a machine for a table of inputs: a text for each choice, defaults included."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.languages import N_
from sprag_study.service.spec.described import FIT, Described, Listed, below
from sprag_study.service.spec.machine.part import NO_LIMIT, Choice
from sprag_study.service.spec.machine.shaft import SHAFT
from sprag_study.worker.models import Parameter

if TYPE_CHECKING:
    from sprag_study.worker.study import Study

#: What parts of a machine shaft are, whose descriptions say what they have.
PARTS: Final = {
    "cycle": N_("revolutions of a cycle"),
    "mechanism": N_("the mechanism"),
    "working": N_("joint of the working part"),
    "operation": N_("how the resistance is given"),
}


def drive_choices(study: Study, spec: Mapping[str, Any]) -> Iterator[Choice]:
    """How the clutch laws of a vibration drive are fitted, and which of them have no limit."""
    base = spec.get("base") or {}
    places = [("clutch", base)] if "clutch" in base else []
    places += [(f"pendulums.{index}.clutch", item) for index, item in enumerate(base.get("pendulums") or ())]
    for place, owner in places:
        clutch = owner.get("clutch") or {}
        if "data" in clutch:
            for name, field in FIT.items():
                yield Choice(f"{place}.{name}", str(clutch.get(name, field.default)).lower(), field.help)
        elif clutch and f"{place}.windup_limit" not in (*study.base, *study.axis_paths):
            yield Choice(f"{place}.windup_limit", NO_LIMIT, N_("largest windup; none: the law holds for any"))


def shaft_choices(study: Study, _: Mapping[str, Any]) -> Iterator[Choice]:
    """The structure of a machine shaft."""
    for path, text in _chosen(study.structure or {}):
        entry = below(SHAFT, path)
        meaning = entry.help if isinstance(entry, Described | Listed | Parameter) else PARTS[path.rpartition(".")[2]]
        yield Choice(path, text, meaning)


def _chosen(structure: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    drive, cycle, phi_c = (structure[name] for name in ("drive", "cycle", "phi_c"))
    yield "cycle", f"{cycle} revolution{'s' if cycle > 1 else ''}"
    yield "mean_speed_is", structure["mean_speed_is"]
    yield "balance", structure["balance"]
    if "balance_side" in structure:
        yield "balance_side", structure["balance_side"]
    yield "phi_c", N_("the first at which T rises") if phi_c is None else str(phi_c)
    if drive["motor"]:
        yield "drive.motor.kind", drive["motor"]
    if drive.get("flywheel"):
        yield "drive.flywheel.kind", drive["flywheel"]
    if "flywheel_shaft" in drive:
        yield "drive.flywheel.shaft", str(drive["flywheel_shaft"])
    if drive.get("stages"):
        yield "drive.stages", ", ".join(drive["stages"])
    if drive["table"]:
        yield "drive.torque.interpolation", drive["table"]["interpolation"]
    several = structure.get("parts", ())
    for prefix, part in [(f"parts.{k}.", part) for k, part in enumerate(several)] or [("", structure)]:
        for path, text in (
            *_shaft_choices(part, cycle),
            *_mechanism_choices(part["mechanism"]),
            *_operation_choices(part["operation"]),
        ):
            yield f"{prefix}{path}", text


def _shaft_choices(part: Mapping[str, Any], cycle: int) -> Iterator[tuple[str, str]]:
    """The shaft of a part; none of the machine itself, whose cycle is its own."""
    if "turns" in part:
        yield "ratio", f"{part['turns']}/{cycle}" if part["turns"] % cycle else str(part["turns"] // cycle)
    if "mean_speed_is" not in part and "cycle" in part:
        yield "cycle", f"{part['cycle']} revolution{'s' if part['cycle'] > 1 else ''}"


def _mechanism_choices(mechanism: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    yield "mechanism", mechanism["kind"]
    if "quick_return" in mechanism:
        yield "mechanism.quick_return.kind", mechanism["quick_return"]
    for name in ("rise", "fall", "weights", "bodies"):
        if name in mechanism:
            yield f"mechanism.{mechanism['kind']}.{name}", mechanism[name]
    if mechanism.get("linkage"):
        linkage = mechanism["linkage"]
        yield "mechanism.linkage.elements", "; ".join(map(_element_text, linkage["elements"]))
        yield "mechanism.linkage.working", linkage["working"] or "none"
        yield "mechanism.linkage.forward", "negative" if linkage["reversed"] else "positive"
    if mechanism.get("table"):
        yield "mechanism.interpolation", mechanism["table"]["interpolation"]


def _element_text(element: Mapping[str, Any]) -> str:
    """``RRR C (A, B, left)``: what an element is attached to, and its branch."""
    attached = ", ".join(filter(None, [*element["joints"], *element["guides"], element["branch"]]))
    return f"{element['kind']} {element['name']}{f' ({attached})' if attached else ''}"


def _operation_choices(operation: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    form = operation.get("form", operation["quantity"])  # a gas has no form; without an operation there is neither
    if "efficiency_is" in operation:
        yield "operation.efficiency_is", operation["efficiency_is"]
    if operation["quantity"] == "pressure":
        yield "operation", "indicator"
        yield "operation.over", operation["over"]
        yield "operation.interpolation", operation["table"]["interpolation"]
        return
    yield "operation", "value" if form == "constant" else form
    if "form" not in operation:
        return
    used = ["quantity", "over", *(["during"] if operation["over"] == "stroke" else [])]
    for name in [*used, *(["sense"] if operation["quantity"] == "force" else [])]:
        yield f"operation.{name}", operation[name]
    if operation.get("table"):
        yield "operation.interpolation", operation["table"]["interpolation"]
