"""A machine of one's own as parameters of the laboratory's address: from a form or a case, and read again."""

from __future__ import annotations

import json
import math
import re
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag.sentences import Sentence
from sprag.service.faults import Fault
from sprag.service.http.problems import ApiError
from sprag.service.http.views import preset_of
from sprag.service.languages import N_
from sprag.service.reading.faults import message
from sprag.service.spec.derive import with_values
from sprag.service.spec.design import design_spec
from sprag.service.spec.document import parse_spec
from sprag.service.spec.kinds.registry import WHICH_CASES, without_cases
from sprag.service.spec.report import SpecError
from sprag.service.spec.stored import accepted
from sprag.worker import models
from sprag.worker.limits import MAX_ADDRESS_BYTES

if TYPE_CHECKING:
    from collections.abc import Mapping

    from sprag.worker.study import Study

#: Name of a machine that the address itself describes.
OWN: Final = "own"
#: Parameters of an own machine besides its name: base and run of its spec as JSON, title, and the case it comes from.
FIELDS: Final = ("base", "run", "title", "case")
_CASE: Final = re.compile(r"([A-Za-z0-9_-]{1,64})/([0-9]{1,12})(?:/([0-9]{1,9}))?")
_NOT_HERE: Final = {*WHICH_CASES, "derive", "base"}


def single_machine(spec: Mapping[str, Any]) -> dict[str, Any]:
    """A spec as one machine of plain numbers; raises SpecError where there is none.

    Formulas have their values, measured clutches the coefficients of their fit, and what only an axis gives has the
    value in the middle of the axis.
    """
    spec = accepted(spec)
    axes = parse_spec(spec).study.axes
    middle = {path: axis.values[len(axis.values) // 2] for axis in axes for path in axis.paths}
    given = {
        path: value for path, value in middle.items()
        if path not in models.NO_PARAMETERS and not _gives(spec["base"], path)
    }  # fmt: skip
    kept = without_cases(spec)
    parsed = parse_spec({**kept, "base": with_values(spec["base"], given)})
    study = parsed.study
    base = with_values(parsed.spec["base"], {path: study.base[path] for path in study.derive})
    for pointer in parsed.fits:
        _put_law(base, pointer.removeprefix("/base/").split("/"), study)
    return {**{key: value for key, value in kept.items() if key not in _NOT_HERE}, "base": base}


def _put_law(base: dict[str, Any], keys: list[str], study: Study) -> None:
    """Replace measured data of the clutch at ``keys`` by the coefficients of their fit."""
    *above, last = keys
    place: Any = base
    for key in above:
        place = place[int(key)] if isinstance(place, list) else place[key]
    prefix = ".".join(keys) + "."
    count = sum(path.startswith(f"{prefix}coefficients.") for path in study.base)
    limit = study.base.get(f"{prefix}windup_limit", float("inf"))
    law = {"coefficients": [study.base[f"{prefix}coefficients.{k}"] for k in range(count)]}
    place[last] = law | ({"windup_limit": limit} if limit != float("inf") else {})


def _gives(base: Any, path: str) -> bool:
    """Whether the base of a spec has a number at a flat path."""
    for key in path.split("."):
        if isinstance(base, dict) and key not in base:
            return False
        base = base[int(key)] if isinstance(base, list) else base[key]
    return True


def laboratories() -> dict[str, str]:
    """The address of the laboratory of each model."""
    names = {model: models.model_of(model).presentation.laboratory.address for model in models.model_names()}
    return {
        model: "/laboratory" + ("" if name == "" else f"/{model if name is None else name}")
        for model, name in names.items()
    }


def laboratory_address(spec: Mapping[str, Any], **further: str) -> str:
    """The laboratory's address of the machine of a valid spec; raises SpecError where it is not one machine."""
    made = single_machine(spec)
    run = made.get("run")
    texts = {"base": _json(made["base"]), "run": _json(run) if run else "", "title": made.get("name", "")}
    given = {"machine": OWN, **{name: text for name, text in texts.items() if text}, **further}
    address = f"{laboratories()[made['model']]}?{urlencode(given)}"
    if not fits(address):
        message = N_("is too long for the address of the laboratory: give its tables fewer rows")
        allowed = Sentence("an address of at most {count} characters", count=MAX_ADDRESS_BYTES)
        raise SpecError([Fault("/base", "out-of-range", message, f"{len(address):,} characters", allowed)])
    return address


def fits(address: str) -> bool:
    """Whether a server reads so long an address."""
    return len(address) <= MAX_ADDRESS_BYTES


def case_address(spec: Mapping[str, Any], study: Study, case: int, mark: str, state: Mapping[str, float]) -> str:
    """The laboratory's address of a case of a study, which begins in ``state`` (SI, by path).

    ``mark`` is the case as `case_page` reads it.
    """
    further = {path: repr(value) for path, value in state.items()}
    return laboratory_address(design_spec(spec, study, case), case=mark, **further)


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


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


def machine_of(given: Mapping[str, str], name: str) -> tuple[tuple[str, str], ...]:
    """The machine of an address as parameters, without the numbers that were changed."""
    kept = [(field, given[field]) for field in FIELDS if given.get(field)] if name == OWN else []
    return (("machine", name), *kept)


@lru_cache(maxsize=32)
def read_machine(
    machine: tuple[tuple[str, str], ...], model: str, known: tuple[str, ...]
) -> tuple[dict[str, Any], Study]:
    """The machine that these parameters of a URL describe, as a spec of one case; ApiError where there is none.

    ``known`` are the names of the built-in machines of the model.
    """
    name = machine[0][1]
    if not known and not name:
        spec = example_spec(model)
        return spec, parse_spec(spec).study
    if name not in {OWN, *known}:
        raise ApiError(
            "not-found", Sentence("Unknown machine; known machines: {machines}.", machines=", ".join(known) or "none")
        )
    try:
        spec = single_machine(own_spec(dict(machine), model) if name == OWN else preset_of(name)["spec"])
        return spec, parse_spec(spec).study
    except SpecError as error:
        texts = (f"{item.where or 'the spec'}: {message(item)}" for item in error.faults)
        raise ApiError("invalid-spec", "; ".join(texts)) from error


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


def case_page(mark: str) -> str:
    """The page of the case that ``mark`` names, as ``st_1/5`` or, with its start, ``st_1/5/2``; "" where it is none."""
    found = _CASE.fullmatch(mark)
    if found is None:
        return ""
    return f"/studies/{found[1]}/cases/{found[2]}" + (f"?start={found[3]}" if found[3] else "")
