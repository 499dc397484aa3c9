"""Components as one variable (`component` of an axis or of what a goal varies): their machines are read one by one.

Each component is put into the base of the spec, and the machine is read with it, so that a component obeys all rules of
a machine. What the machines differ in follows from the place on the axis.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.components import (
    KINDS,
    NUMBERS,
    Component,
    kind_of,
    model_of_kind,
    number_of,
    require_component,
    si_fields,
)
from sprag_study.service.spec.derive import read_machine
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.kinds.draft import Draft
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.worker.limits import MAX_AXIS_VALUES, MAX_NAME_LENGTH, MAX_NOTES_LENGTH
from sprag_study.worker.models.components import Components

if TYPE_CHECKING:
    from sprag_study.service.faults import Fault
    from sprag_study.service.spec.machine.machine import Machine
    from sprag_study.service.spec.machine.part import SpecPart
    from sprag_study.worker.study import Axis, Study

#: The field that tells such an axis from others.
COMPONENT: Final = "component"
#: Components of one axis, at most.
MOST: Final = 200
#: Names that a message lists, at most.
_LISTED: Final = 20
_GIVEN: Final = {
    "type": "object",
    "properties": {"name": {"type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH}},
    "required": ["name"],
    "additionalProperties": {"type": ["string", "number"], "maxLength": MAX_NOTES_LENGTH},
    "description": "a component with its name and its fields: quantities with their units, as in the table of parts",
}
COMPONENT_AXIS: Final = Record(
    {
        COMPONENT: {"enum": list(KINDS), "description": "kind of the components among which the study chooses"},
        "of": {
            "type": "array",
            "minItems": 1,
            "maxItems": MOST,
            "items": {
                "anyOf": [
                    {
                        "type": "string", "minLength": 1, "maxLength": MAX_NAME_LENGTH,
                        "description": "the name of a component of the service, which puts its fields here",
                    },
                    _GIVEN,
                ],
            },
            "examples": [["FW 20", {"name": "FW 25", "coefficients": "0; 300", "price": "58 EUR"}]],
        },
        "values": {
            "type": "array",
            "minItems": 1,
            "maxItems": MAX_AXIS_VALUES,
            "items": {"type": "string"},
            "description": "names of these components in the order of the cases, each as often as it is wanted where "
            "axes are zipped; by default each once",
        },
    },
    "components of one kind, which are one variable: each place on it has all parameters of one of them",
    required=(COMPONENT, "of"),
)  # fmt: skip


def component_items(spec: Node) -> list[Node]:
    """The axes and the variables of a goal that are components."""
    axes = spec["axes"].parts()
    listed = [*axes, *(item for group in axes for item in group["axes"].parts()), *spec["goal"]["vary"].parts()]
    return [item for item in listed if COMPONENT in item]


def read_with_components(spec: Node, part: SpecPart) -> Machine:
    """The machine of a spec, with the components among which the study chooses; faults are recorded.

    Raises SpecError where components are invalid.
    """
    items, before = component_items(spec), spec.report.found
    lists = [_read_item(item, str(spec["model"].value)) for item in items]
    kinds = [one[0].kind for one in lists if one]
    for kind in {kind for kind in kinds if kinds.count(kind) > 1}:
        again = [item for item, one in zip(items, lists, strict=True) if one and one[0].kind == kind][1]
        again[COMPONENT].refuse("repeated", "varies already", kind, allowed=N_("each kind once"))
    if spec.report.found > before:
        raise spec.report.error()
    if not items:
        return read_machine(spec, part)
    firsts = [_richest(one) for one in lists]
    whole = _with(spec.value, firsts, lists)
    listed = len(spec.report.faults)
    machine = read_machine(Node(spec.report, "", whole), part)
    if spec.report.found > before:
        places = {
            pointer: (item["of"][one.index(first)], first)
            for item, one, first in zip(items, lists, firsts, strict=True)
            for pointer in _pointers(whole["base"], first)
        }
        spec.report.faults[listed:] = [_at_component(fault, places) for fault in spec.report.faults[listed:]]
        raise spec.report.error()
    for item, one in zip(items, lists, strict=True):
        others = [first for first in firsts if first.kind != one[0].kind]
        read = [
            _machine_of(item["of"][place], component, part, _with(spec.value, [*others, component], lists))
            for place, component in enumerate(one)
        ]
        found = _components(item["of"], one, read, machine)
        if found is not None:
            machine.components += (found,)
            for path in (found.path, *found.numbers):
                parameter = found.parameter(path)
                assert parameter is not None
                machine.parameters[path] = parameter
    spec.report.raise_if_any()  # without its components the rest would have faults that are none
    return machine


def with_base(spec: Mapping[str, Any]) -> dict[str, Any]:
    """A valid spec, its base completed by one component of each kind among which it chooses."""
    node = Node(Report(spec), "", spec)
    lists = [one for item in component_items(node) if (one := _read_item(item, str(spec["model"])))]
    return _with(spec, [_richest(one) for one in lists], lists) if lists else dict(spec)


def axis_item(spec: Mapping[str, Any], study: Study, axis: Axis, values: Sequence[float]) -> dict[str, Any]:
    """An item of `axes` with these values (SI) of an axis of a study; ``spec`` is the study's own."""
    path = axis.paths[0]
    one = next((one for one in study.components if one.path == path), None)
    if one is None:
        return {"path": list(axis.paths), "values": list(values)}
    given = next(item.value for item in component_items(Node(Report(spec), "", spec)) if item[COMPONENT].value == path)
    names = [one.names[int(value)] for value in values]
    chosen = [own for name, own in zip(one.names, given["of"], strict=True) if name in names]
    return {COMPONENT: path, "of": chosen, "values": names}


def component_axes(spec: Mapping[str, Any], study: Study, cases: Sequence[int]) -> list[dict[str, Any]]:
    """Items of `axes` with the components of these cases of a study, zipped; none where it chooses among none."""
    columns = study.columns(cases)
    axes = (study.axis_with(one.path) for one in study.components)
    return [axis_item(spec, study, axis, columns[axis.paths[0]].tolist()) for axis in axes]


def keeps_components(study: Study) -> bool:
    """Whether the parameters of a case are those of its components, which a tolerance may change."""
    drawn = () if study.spread is None else study.spread.paths
    return set(study.component_paths).isdisjoint(drawn)


def _richest(components: Sequence[Component]) -> Component:
    """The component whose machine has the most parameters."""
    return max(components, key=lambda one: sum(len(v) if isinstance(v, list) else 1 for v in si_fields(one).values()))


def _read_item(item: Node, model: str) -> list[Component]:
    """The components of an axis; none, and faults recorded, where it is invalid."""
    if not COMPONENT_AXIS.read(item):
        return []
    kind = item[COMPONENT].choice([name for name in KINDS if model_of_kind(name) == model])
    of = item["of"]
    if not isinstance(of.value, list) or not 1 <= len(of.value) <= MOST:
        allowed = Sentence("a list of 1 to {high} names or components", high=MOST)
        of.mistake("must be a list of components", allowed=allowed)
        return []
    read = [_read_component(one, kind) for one in of.parts()] if kind is not None else []
    found = [one for one in read if one is not None]
    names = [one.name for one in found]
    for place, name in enumerate(names):
        if names.index(name) < place and len(found) == len(read):
            of[place].refuse("repeated", "is named twice", name, allowed="each once")
    return found if item.sound else []


def _read_component(node: Node, kind: str) -> Component | None:
    if isinstance(node.value, str):
        node.refuse("unknown-name", "is the name of a component of a service, and this spec is read without one",
                    allowed=N_('the component itself, as in {"name": "F-120", "spring_rate": "9.5 N/mm"}'))  # fmt: skip
        return None
    if not isinstance(node.value, Mapping):
        node.mistake("must be a component", allowed=N_("a name, or an object with a name and the fields"))
        return None
    fields = {key: str(text) for key, text in node.value.items() if key != "name" and not isinstance(text, bool)}
    try:
        return require_component({"kind": kind, "name": node.value.get("name"), "fields": fields})
    except SpecError as error:
        for fault in error.faults:
            where = (fault.where or "").removeprefix("/fields").strip("/")
            place = node[where] if where else node
            place.refuse(fault.code, fault.message, fault.value, allowed=fault.allowed, unit=fault.unit)
        return None


def _with(spec: Mapping[str, Any], components: Sequence[Component], lists: Sequence[Sequence[Component]]) -> Any:
    """The spec with these components in its base, without what other components of their lists would put there."""
    base = copy.deepcopy(spec.get("base"))
    if not isinstance(base, dict):
        return spec
    for component in components:
        kind = kind_of(component.kind)
        given = {name for one in lists if one[0].kind == component.kind for own in one for name in own.fields}
        gone = [*kind.replaces, *(kind.fields[name] for name in sorted(given & kind.fields.keys()))]
        gone += [place for place, text in kind.sets.items() if not text]
        for place in gone:
            for at in _places(base, place):
                _drop(base, at)
        for place, value in zip(_given_places(component), si_fields(component).values(), strict=True):
            for at in _places(base, place):
                _put(base, at, value)
    return {**spec, "base": base}


def _given_places(component: Component) -> list[str]:
    """Where a form would have what a component gives."""
    kind = kind_of(component.kind)
    return [kind.chosen if name == kind.choice else kind.fields[name] for name in si_fields(component)]


def _at_component(fault: Fault, places: Mapping[str, tuple[Node, Component]]) -> Fault:
    """A fault of the base at the component that gives it; ``places`` are pointers that components give."""
    for pointer, (node, component) in places.items():
        if _lies_in(fault, pointer):
            message = Sentence("{name}: {message}", name=component.name, message=fault.message)
            return replace(fault, where=node.pointer, message=message)
    return fault


def _pointers(base: Mapping[str, Any], component: Component) -> list[str]:
    """Pointers to what a component gives in a base."""
    return [f"/base/{'/'.join(map(str, at))}" for place in _given_places(component) for at in _places(base, place)]


def _lies_in(fault: Fault, pointer: str) -> bool:
    return f"{fault.where}/".startswith(f"{pointer}/")


def _places(base: Mapping[str, Any], place: str) -> list[list[str | int]]:
    """Where a base has what a field of a form gives: in each row of a list, a common part in each row that has one."""
    rows, inside, rest = place.partition("/N/")
    given = base.get(rows if inside else "pendulums")
    listed = given if isinstance(given, list) else []
    if inside:
        return [[rows, k, *rest.split("/")] for k in range(len(listed))]
    first, *others = place.split("/")
    own = [k for k, row in enumerate(listed) if isinstance(row, Mapping) and first in row]
    return [["pendulums", k, first, *others] for k in own] if own else [[first, *others]]


def _drop(base: Any, at: Sequence[str | int]) -> None:
    for key in at[:-1]:
        inside = isinstance(base, list) or (isinstance(base, dict) and key in base)
        base = base[key] if inside else None
    if isinstance(base, dict):
        base.pop(at[-1], None)


def _put(base: Any, at: Sequence[str | int], value: object) -> None:
    for key in at[:-1]:
        if isinstance(base, dict) and not isinstance(base.get(key), dict | list):
            base[key] = {}
        base = base[key]
    if isinstance(base, dict):
        base[at[-1]] = value


def _machine_of(node: Node, component: Component, part: SpecPart, spec: Any) -> Machine | None:
    """The machine with a component; None, and faults recorded at the component, where it is invalid."""
    report = Report(spec)
    report.machine = machine = read_machine(Node(report, "", spec), part)
    faults = list(report.faults)
    if not faults:
        part.check(Draft(Node(report, "", spec), str(spec["model"]), "", axes=(), combine="grid"))
        # What is wrong elsewhere without the axes need not be wrong with them.
        given = _pointers(spec["base"], component)
        faults = [fault for fault in report.faults if any(_lies_in(fault, pointer) for pointer in given)]
    for fault in faults:
        message = Sentence("{name}: {message}", name=component.name, message=fault.message)
        node.refuse(fault.code, message, fault.value, allowed=fault.allowed, unit=fault.unit)
    return None if faults else machine


def _components(
    node: Node, components: Sequence[Component], read: Sequence[Machine | None], machine: Machine
) -> Components | None:
    """The components of one kind as a study stores them; None, and faults recorded, where they do not go together."""
    machines = [one for one in read if one is not None]
    if len(machines) < len(components):
        return None
    kind = components[0].kind
    for place, (one, own) in enumerate(zip(components, machines, strict=True)):
        if own.structure != machine.structure:
            node[place].refuse("conflict", "makes a machine of another kind than the others", one.name,
                               allowed=N_("components of one characteristic"))  # fmt: skip
        lacking = sorted(path for path in machine.values.keys() - own.values.keys() if ".coefficients." not in path)
        lacking += sorted(own.values.keys() - machine.values.keys())
        for path in lacking[:1]:
            node[place].refuse("required", Sentence("has no {path}, or is the only one that has it", path=path),
                               one.name, allowed=N_("fields that all of the components have"))  # fmt: skip
    if not node.sound:
        return None
    values = {path: tuple(own.values.get(path, 0.0) + 0.0 for own in machines) for path in machine.values}
    differing = {path: own for path, own in values.items() if len(set(own)) > 1 and path not in machine.derive}
    numbers, units = _numbers_of(node, components)
    return Components(kind, tuple(one.name for one in components), differing, numbers, units) if node.sound else None


def _numbers_of(node: Node, components: Sequence[Component]) -> tuple[dict[str, tuple[float, ...]], dict[str, str]]:
    """The numbers that all components of a list have beside their parameters (SI), and their units, by path."""
    numbers, units = {}, {}
    for name in NUMBERS:
        read = [number_of(one, name) for one in components]
        known = [one for one in read if one is not None]
        if not known or len(known) < len(read):
            continue
        path = f"{components[0].kind}.{name}"
        numbers[path], units[path] = tuple(value for value, _ in known), known[0][1]
        for place, (_, unit) in enumerate(known):
            if unit != units[path]:
                message = Sentence("has a {name} in {unit}, the first component in {first}", name=name,
                                   unit=unit, first=units[path])  # fmt: skip
                node[place].refuse("wrong-unit", message, components[place].name, allowed=N_("one currency"))
    return numbers, units


def _named(spec: Any, report: Report) -> list[Node]:
    items = component_items(Node(report, "", spec))
    return [one for item in items for one in item["of"].parts() if isinstance(one.value, str)]


def names_components(spec: Any) -> bool:
    """Whether a spec has the names of components without their fields."""
    return bool(_named(spec, Report(spec)))


def with_fields(spec: Any, known: Callable[[], Iterable[Component]]) -> Any:
    """A spec whose components, where it names them only, have their fields; itself where it names none.

    Raises SpecError for names that none of the ``known`` components has.
    """
    report = Report(spec)
    named = _named(spec, report)
    if not named:
        return spec
    components = {(one.kind, one.name): one for one in known()}
    completed = copy.deepcopy(spec)
    for node in named:
        *above, _of, place = node.pointer.split("/")[1:]
        item = Node(report, "", completed).below(".".join(above)).value
        kind, name = item[COMPONENT], str(node.value).strip()
        names = [own for known_kind, own in components if known_kind == kind]
        if (kind, name) in components:
            item["of"][int(place)] = {"name": name, **components[kind, name].fields}
        elif kind in KINDS:
            message = Sentence("is the name of no {kind} of this service{hint}", kind=str(kind),
                               hint=did_you_mean(name, names))  # fmt: skip
            node.refuse("unknown-name", message, allowed=", ".join(names[:_LISTED]) or N_("a part that is stored"))
    report.raise_if_any()
    return completed
