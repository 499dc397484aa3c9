"""A single machine of a spec, as an address describes it or as an example of its model."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag_study.service.http.problems import ApiError
from sprag_study.service.spec.component_axes import with_base
from sprag_study.service.spec.derive import with_values
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.fields import base_path
from sprag_study.service.spec.kinds.registry import WHICH_CASES, without_cases
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report
from sprag_study.service.spec.stored import accepted
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_ADDRESS_BYTES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag_study.worker.study import Study

#: Parameters of an address that describe a machine: base and run of its spec as JSON, and its title.
FIELDS: Final = ("base", "run", "title")
_NOT_HERE: Final = {*WHICH_CASES, "derive", "base"}


def single_machine(spec: Mapping[str, Any]) -> dict[str, Any]:
    """A spec as one machine of plain numbers; raises SpecError where there is none.

    Formulas have their values, measured clutches the coefficients of their fit, and what only an axis gives has the
    value in the middle of the axis.
    """
    spec = accepted(spec)
    whole = parse_spec(spec).study
    if whole.components:  # what is asked of prices is not asked of one machine
        spec = {**with_base(spec), "quantities": {}}
    base = Node(Report(), "/base", spec["base"])
    middle = {path: axis.values[len(axis.values) // 2] for axis in whole.axes for path in axis.paths}
    given = {
        path: value for path, value in middle.items()
        if path not in whole.beside and not base.below(path).given
    }  # fmt: skip
    kept = without_cases(spec)
    parsed = parse_spec({**kept, "base": with_values(spec["base"], given)})
    study = parsed.study
    laws = {base_path(pointer): _law(f"{base_path(pointer)}.", study) for pointer in parsed.fits}
    numbers = with_values(parsed.spec["base"], {path: study.base[path] for path in study.derive})
    return {**{key: value for key, value in kept.items() if key not in _NOT_HERE}, "base": with_values(numbers, laws)}


def _law(prefix: str, study: Study) -> dict[str, Any]:
    """The law of the clutch whose numbers have paths with this beginning."""
    count = sum(path.startswith(f"{prefix}coefficients.") for path in study.base)
    limit = study.base.get(f"{prefix}windup_limit", math.inf)
    law = {"coefficients": [study.base[f"{prefix}coefficients.{k}"] for k in range(count)]}
    return law | ({} if math.isinf(limit) else {"windup_limit": limit})


def own_spec(given: Mapping[str, str], model: str) -> dict[str, Any]:
    """The spec of a machine that an address describes; ApiError where it does not."""
    long = len(urlencode({name: given.get(name, "") for name in FIELDS}))
    if long > MAX_ADDRESS_BYTES:
        text = f"base and run must have at most {MAX_ADDRESS_BYTES} characters in an address; got {long}."
        raise ApiError("invalid-parameter", text)
    title = given.get("title", "").strip() or "Own machine"
    spec = {"sprag": 1, "model": model, "name": title, "base": _object(given, "base")}
    return spec | ({"run": _object(given, "run")} if given.get("run") else {})


def _object(given: Mapping[str, str], name: str) -> dict[str, Any]:
    try:
        found = json.loads(given.get(name, ""))
    except (ValueError, RecursionError) as error:
        raise ApiError("invalid-parameter", f"{name} must be the JSON object of a machine: {error}.") from error
    if not isinstance(found, dict):
        raise ApiError("invalid-parameter", f"{name} must be the JSON object of a machine.")
    return found


def example_spec(model: str) -> dict[str, Any]:
    """A machine of a model without examples: each number has its default, or 1 where that is in its range."""
    base: dict[str, Any] = {}
    for entry in models.parameter_catalogue(model):
        *parts, name = entry.path.split(".")
        if not {"N", "K", "NAME"} & {*parts, name}:
            place = base
            for part in parts:
                place = place.setdefault(part, {})
            usual = entry.default if entry.default is not None and math.isfinite(entry.default) else 1.0
            place[name] = usual if entry.accepts(usual) else min(max(usual, entry.low), entry.high)
    return {"sprag": 1, "model": model, "name": models.model_of(model).presentation.title or model, "base": base}
