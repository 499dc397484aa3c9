"""Conversion between the form's fields and the study spec. Only the spec's reader interprets the fields."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, Final

from sprag_study.service.http.web.form.cases import (
    blocks_of,
    case_values,
    exclusions_of,
    field_of_block,
    field_of_exclusion,
    repeated_limits,
)
from sprag_study.service.http.web.form.entries import (
    Faults,
    Values,
    names_of,
    plain,
    text_of,
)
from sprag_study.service.http.web.form.goal import GOAL_DEFAULTS, field_of_goal, goal_of, goal_values
from sprag_study.service.http.web.form.machine import form_of, model_name
from sprag_study.service.http.web.form.machine_spec import base_of, field_of_base, values_of_base
from sprag_study.service.http.web.form.rows import field_of_row, filled, items_of_part, values_of_part
from sprag_study.service.http.web.form.tolerances import FIELDS as TOLERANT
from sprag_study.service.http.web.form.tolerances import field_of_tolerance, tolerance_values, tolerances_of, with_batch
from sprag_study.service.reading.together import with_last_unit
from sprag_study.service.spec.derive import formulas_of, with_values
from sprag_study.service.spec.kinds import refine
from sprag_study.service.spec.run import TIMED_DEFAULTS, TIMED_FIELDS, time_text
from sprag_study.worker import models
from sprag_study.worker.models import SETTLED

#: What is asked of a refinement in a form that was not about one.
REFINE_DEFAULTS: Final[Values] = {
    "/refine/results": "shaft.speed.mean; efficiency",
    "/refine/error": refine.REFINE.described["error"].default_text,
}
#: The form's choice for a run of a given time, which a spec expresses by its duration or window.
TIMED: Final = "time"
_FIELDS: Final = frozenset(
    {
        "sprag",
        "model",
        "name",
        "base",
        "axes",
        "combine",
        "derive",
        "refine",
        "goal",
        "correlations",
        "exclude",
        *TOLERANT,
    }
)
#: Beginning of a field with the formula of a derived parameter.
FORMULA: Final = "="


def is_search(values: Mapping[str, str]) -> bool:
    """Whether the form asks for the best designs, not for cases along axes."""
    return values.get("asks") == "goal"


def spec_of(values: Mapping[str, str]) -> tuple[dict[str, Any], Faults]:
    """The spec of a filled form, and the faults, by field, of what cannot be expressed as a spec."""
    faults: Faults = {}
    base, name = base_of(values, faults), values.get("/name", "").strip()
    spec: dict[str, Any] = {"sprag": 1, "model": model_name(values), **({"name": name} if name else {}), "base": base}
    derive = _formulas(base)
    if derive:
        spec["derive"] = derive
    if form_of(values).with_run:
        spec["run"] = _run(values)
    spec |= tolerances_of(values)
    if with_batch(values) and (correlations := items_of_part(values, "correlations")):
        spec["correlations"] = correlations
    if is_search(values):
        return spec | {"goal": goal_of(values, faults)}, faults
    spec["axes"] = [*items_of_part(values, "axes"), *blocks_of(values).values()]
    if conditions := exclusions_of(values):
        spec["exclude"] = conditions
        faults |= repeated_limits(values)
    spec["combine"] = values.get("/combine", "grid")
    if any("adaptive" in axis for axis in spec["axes"]):
        spec["refine"] = _refine(values)
    return spec, faults


def _refine(values: Mapping[str, str]) -> dict[str, Any]:
    """What a form with an adaptive axis asks for."""
    found = _given(values, "/refine", refine.REFINE.described)
    names = names_of(values.get("/refine/results", ""))
    return {**({"results": names} if names else {}), **found}


def _formulas(base: dict[str, Any]) -> dict[str, str]:
    """Take the formulas out of ``base``: they are texts that begin with an equals sign."""
    found: dict[str, str] = {}

    def take(place: Any, prefix: str) -> None:
        for key, value in list(place.items() if isinstance(place, dict) else enumerate(place)):
            if isinstance(value, dict | list):
                take(value, f"{prefix}{key}.")
            elif isinstance(value, str) and value.startswith(FORMULA):
                found[f"{prefix}{key}"] = value.removeprefix(FORMULA).strip()
                if isinstance(place, dict):
                    del place[key]
                else:
                    place[key] = None

    take(base, "")
    return found


def _given(values: Mapping[str, str], pointer: str, names: Iterable[str]) -> dict[str, Any]:
    """The fields of an object that are filled in."""
    return {name: plain(text) for name in names if (text := values.get(f"{pointer}/{name}", "").strip())}


def _run(values: Mapping[str, str]) -> dict[str, Any]:
    run = _given(values, "/run", ("at_most", "max_period", "settled", "duration", "tolerance"))
    window = [plain(text) for text in with_last_unit([values.get(f"/run/window/{index}", "") for index in (0, 1)])]
    if any(window):
        run["window"] = window
    if values.get("/run/until", SETTLED) == SETTLED:
        run = {"until": SETTLED, **run}
    elif not any(window):
        run.setdefault("duration", time_text(TIMED_DEFAULTS["duration"]))
    if values.get("/run/reset", "contact") != "contact":
        run["reset"] = values["/run/reset"]
    return run


def field_of(pointer: str, values: Mapping[str, str]) -> str:
    """The field beside which a fault at ``pointer`` of the spec is shown; "" for the whole form."""
    if pointer.startswith("/derive/"):
        pointer = "/base/" + pointer.removeprefix("/derive/").replace(".", "/")
    if pointer == "/refine" or pointer.startswith("/refine/results"):
        return "/refine/results"
    if pointer.startswith("/goal"):
        return field_of_goal(pointer, values)
    if pointer.startswith("/tolerances"):
        return field_of_tolerance(pointer, values)
    if pointer.startswith("/base"):
        return field_of_base(pointer, values)
    if pointer.startswith("/exclude"):
        return field_of_exclusion(pointer, values)
    match = re.fullmatch(r"/(axes|correlations)/(\d+)(?:/(.*))?", pointer)
    if match:
        name, place, rest = match[1], int(match[2]), match[3] or ""
        behind = place - len(filled(values, name))
        if name == "axes" and behind >= 0 and blocks_of(values):
            return field_of_block(behind, rest, values)
        return field_of_row(name, place, rest, values)
    return "/run/window/0" if pointer == "/run/window" else pointer


def values_of(spec: Mapping[str, Any]) -> Values:
    """The form's values for ``spec``; raises ValueError where the form cannot show it."""
    values: Values = {"model": str(spec.get("model")), "/name": str(spec.get("name", ""))}
    if values["model"] not in models.model_names():
        raise ValueError("the form does not know the model")
    known = _FIELDS | {"run"} if form_of(values).with_run else _FIELDS
    if not set(spec) <= known or spec.get("combine", "grid") not in ("grid", "zip"):
        raise ValueError("the form has no fields for all of this spec")
    axes = [axis for axis in spec.get("axes", ()) if isinstance(axis, Mapping) and not {"sample", "points"} & set(axis)]
    blocks = list(spec.get("axes", ()))[len(axes) :]
    if not all({"sample", "points"} & set(block) for block in blocks):
        raise ValueError("the form has no fields for all of these axes")
    values["/combine"] = str(spec.get("combine", "grid"))
    formulas = {path: f"{FORMULA} {text}" for path, text in formulas_of(spec).items()}
    values_of_base(with_values(spec["base"], formulas), values)
    if "run" in known:
        values |= _run_values(spec.get("run", {}))
    values |= {"asks": "goal" if "goal" in spec else "axes"} | REFINE_DEFAULTS
    values |= goal_values(spec["goal"]) if "goal" in spec else GOAL_DEFAULTS
    for key, content in spec.get("refine", {}).items():
        values[f"/refine/{key}"] = "; ".join(content) if key == "results" else text_of(content)
    values |= tolerance_values(spec, values) | values_of_part("correlations", spec.get("correlations", ()))
    return values | case_values(blocks, spec.get("exclude", ())) | values_of_part("axes", axes)


def _run_values(run: Mapping[str, Any]) -> Values:
    """The form's values for a run."""
    values: Values = {}
    values["/run/until"] = TIMED if any(name in run for name in TIMED_FIELDS) else SETTLED
    for key, content in run.items():
        if key == "window":
            values |= {f"/run/window/{index}": text_of(item) for index, item in enumerate(content)}
        else:
            values[f"/run/{key}"] = text_of(content)
    return values
