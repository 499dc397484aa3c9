"""What a spec names of a service, replaced when a study is submitted: the end of a case of another study, from which it
starts, by initial values, and components by their fields.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from sprag_study.sentences import Sentence
from sprag_study.service.reading.limits import span
from sprag_study.service.spec.component_axes import with_fields
from sprag_study.service.spec.fields import base_pointer
from sprag_study.service.spec.machine.drive import START, START_AT
from sprag_study.service.spec.machine.shaft_check import NotCompiledError, compiles_here
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_CASES, MAX_STARTS
from sprag_study.worker.models.starts import count_of, motion_of

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.study import Study

_POINTER = f"/base/{START}"


def with_start(store: Store, data: Any) -> Any:
    """The spec ``data`` with the initial values that go on from the case that its `base.start` names; else unchanged.

    Raises SpecError, and NotCompiledError where the kernel for that case has to be compiled first, elsewhere.
    """
    base = data.get("base") if isinstance(data, Mapping) else None
    if not isinstance(base, Mapping) or START not in base:
        return data
    report = Report(data)
    source = _source(Node(report, _POINTER, base[START]), store, data)
    report.raise_if_any()
    assert source is not None
    study, case = source
    shape = models.shape_of(study)
    if not (compiles_here() or models.is_compiled(shape)):
        raise NotCompiledError(shape)
    values = models.run_end_state(study, case)
    if values is None:
        report.fault(_POINTER, "conflict", "the case does not end ok", base[START], allowed="a case that ends ok")
        raise report.error()
    new = {name: part for name, part in base.items() if name != START}
    for path, value in values.items():
        _put(report, new, path, value)
    _check_pendulums(report, new, values)
    report.raise_if_any()
    return {**data, "base": new}


def completed(store: Store, data: Any) -> Any:
    """The spec ``data`` with what it names of a service: components, and the case that it goes on from.

    Raises as `with_start`.
    """
    return with_start(store, with_components(store, data))


def with_components(store: Store, data: Any) -> Any:
    """The spec ``data`` with the fields of the components that it names; raises SpecError."""
    return with_fields(data, lambda: [record.component for record in store.components.all()])


def _source(node: Node, store: Store, spec: Mapping[str, Any]) -> tuple[Study, int] | None:
    """A study and the case in it that is gone on from; None, with faults recorded, where there is none."""
    if not START_AT.read(node, null=False):
        return None
    case, start = node["case"].whole(0, MAX_CASES - 1), node["start"].otherwise(0).whole(0, MAX_STARTS - 1)
    named = node["study"]
    try:
        if not isinstance(named.value, str):
            raise StudyNotFoundError(str(named.value))
        study = store.studies.study(named.value)
    except StudyNotFoundError:
        named.refuse("unknown-name", "is not a study of this service", allowed="its id")
        return None
    if study.model != spec.get("model"):
        named.refuse("conflict", Sentence("is of the model {model}", model=study.model), allowed="one model")
    if case is not None and case >= study.cases:
        node["case"].refuse("out-of-range", "is out of range", allowed=span(0, study.cases - 1))
    count = count_of(study.run)
    if start is not None and start >= count:
        node["start"].refuse("out-of-range", "is out of range", start, allowed=span(0, count - 1))
    if not node.sound or case is None or start is None:
        return None
    return motion_of(study, case, start)


def _check_pendulums(report: Report, base: Mapping[str, Any], values: Mapping[str, float]) -> None:
    """Record a fault where the base has more pendulums than the case that is gone on from."""
    count = len({path.split(".")[1] for path in values if path.startswith("pendulums.")})
    own = base.get("pendulums")
    if isinstance(own, list) and 0 < count < len(own):
        message = Sentence("the base has {own} pendulums, the case has {count}", own=str(len(own)), count=str(count))
        report.fault("/base/pendulums", "conflict", message, allowed="as many as the case")


def _put(report: Report, base: dict[str, Any], path: str, value: float) -> None:
    """Write an initial value into a base; faults are recorded where it has no such place, or another value there."""
    *parts, name = path.split(".")
    place: Any = base
    for part in parts:
        key: Any = int(part) if isinstance(place, list) else part
        inside = key < len(place) if isinstance(place, list) else key in place
        if not inside or not isinstance(place[key], Mapping | list):
            message = Sentence("has a value of {path}, which the base has no place for", path=path)
            report.fault(_POINTER, "conflict", message, base)
            return
        place[key] = list(place[key]) if isinstance(place[key], list) else dict(place[key])
        place = place[key]
    if name in place:
        report.fault(
            base_pointer(path), "conflict", Sentence("is given by `{field}`", field=f"base.{START}"),
            place[name],
            allowed=Sentence("either it or `{field}`", field=f"base.{START}"),
        )  # fmt: skip
    place[name] = value
