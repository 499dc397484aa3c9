"""The study spec, version 1: turns JSON or TOML data into a study in SI numbers, or reports all its faults.

Its parts are the modules beside it (`text`, `units`, `run`, `warnings`, the `report` of faults) and packages: `machine`
(drive, clutch, shaft), `axes` (values, points, samples, combinations), `draws` (distributions and correlations),
`kinds` (of studies), `schema`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.reading.limits import characters, quoted
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.spec.component_axes import read_with_components
from sprag_study.service.spec.derive import DERIVE, check_derived, layout
from sprag_study.service.spec.described import Record
from sprag_study.service.spec.kinds.draft import Draft
from sprag_study.service.spec.kinds.registry import CASES, WITH_CASES
from sprag_study.service.spec.kinds.tolerances import warn_of_invalid_drives
from sprag_study.service.spec.machine.registry import part_of
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.quantities import QUANTITIES, read_quantities
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.service.spec.text import Format, load_spec
from sprag_study.worker import models
from sprag_study.worker.limits import MAX_NAME_LENGTH
from sprag_study.worker.study import Study

if TYPE_CHECKING:
    from sprag_study.worker.models import ClutchFit

__all__ = ["VERSION", "ParsedSpec", "SpecError", "format_of", "load_spec", "parse_spec"]

#: The supported version of the spec.
VERSION: Final = 1
#: Name of a study that gives none.
UNNAMED: Final = "untitled"

#: The whole spec; its base and run depend on the model.
SPEC: Final = Record(
    {
        "sprag": {"const": VERSION, "description": "version of the spec"},
        "model": {"type": "string", "description": "what is simulated"},
        "name": {
            "type": "string",
            "minLength": 1,
            "maxLength": MAX_NAME_LENGTH,
            "default": UNNAMED,
            "description": "name of the study",
        },
        "base": {"type": "object", "description": "the machine that every case begins from"},
        "derive": DERIVE,
        "run": {"type": "object"},
        "quantities": QUANTITIES,
        **CASES.fields,
        **{name: field for kind in WITH_CASES for name, field in kind.fields.items()},
    },
    "a study: a machine, a run, and what varies",
    required=("sprag", "model", "base"),
)


@dataclass(frozen=True)
class ParsedSpec:
    """A spec that can be run.

    Attributes
    ----------
    study : Study
        The study in SI numbers, with fitted clutch data and expanded axes.
    warnings : tuple of str
        One sentence, with its numbers, for each thing that is allowed but probably unintended.
    fits : dict
        JSON Pointer of a clutch given as measured data -> its fit.
    spec : dict
        The user's spec, unchanged.
    same_as : str
        Id of a stored study that has all of these cases, which then is not stored again; "" for none.
    follows : bool
        Whether its name follows from that of another study, and gets a number where a study has it already.
    """

    study: Study
    warnings: tuple[str, ...]
    fits: dict[str, ClutchFit] = field(default_factory=dict)
    spec: dict[str, Any] = field(default_factory=dict)
    same_as: str = ""
    follows: bool = False


def format_of(name: str) -> Format:
    """The format of a spec file by its name: TOML when it ends in ``.toml``, otherwise JSON."""
    return "toml" if PurePath(name).suffix.lower() == ".toml" else "json"


def parse_spec(data: object, told: Sequence[str] = ()) -> ParsedSpec:
    """The study that ``data`` (plain JSON data, as from `load_spec`) describes.

    Goals may name what is ``told``, too: numbers without a unit that are no results of the model.

    Raises
    ------
    SpecError
        With all faults, each with its JSON Pointer, the value, and what is allowed.
    """
    report = Report(data, told)
    spec = Node(report, "", data)
    if not SPEC.read(spec):
        raise report.error()
    _read_version(spec["sprag"])
    name, model = _read_name(spec["name"]), _read_model(spec["model"])
    # The spec of an unknown model cannot be read further.
    if model is None:
        raise report.error()
    part = part_of(model)
    report.machine = machine = read_with_components(spec, part)
    draft = Draft(spec, model, name)
    steps = [CASES.read(draft)]
    axes, combine = draft.axes, draft.combine
    if machine.derive and axes is not None and not report.found:
        check_derived(report, spec.value["derive"], machine, layout(machine, axes, combine), ranges=bool(draft.kind))
    draft.run = part.read_run(spec["run"], axes, combine)
    steps += [kind.read(draft) for kind in WITH_CASES]
    part.check(draft)
    report.raise_if_any()
    draft.quantities = read_quantities(draft)
    report.raise_if_any()
    for finish in filter(None, steps):
        finish()
    study = draft.study()
    warn_of_invalid_drives(report, study)
    part.warn(report, study)
    return ParsedSpec(study, tuple(report.warnings), machine.fits, dict(spec.value))


def _read_version(node: Node) -> None:
    version = node.value
    if version is None:
        node.refuse("required", "is required: the version of the spec", allowed=str(VERSION))
    elif isinstance(version, bool) or version != VERSION or not isinstance(version, int):
        node.refuse("unsupported-version", "is not a supported spec version", allowed=str(VERSION))


def _read_name(node: Node) -> str:
    value = node.otherwise(UNNAMED).value
    if isinstance(value, str) and 0 < len(value.strip()) <= len(value) <= MAX_NAME_LENGTH and value.isprintable():
        return value.strip()
    node.refuse("invalid-text", "must be a printable text in one line", allowed=characters(1, MAX_NAME_LENGTH))
    return UNNAMED


def _read_model(node: Node) -> str | None:
    model, known = node.value, models.model_names()
    if isinstance(model, str) and model in known:
        return model
    if model is None:
        node.refuse("required", "is required", allowed=quoted(known))
    else:
        hint = did_you_mean(model, known) if isinstance(model, str) else Sentence("")
        node.refuse("unknown-name", Sentence("is not a known model{hint}", hint=hint), allowed=quoted(known))
    return None
