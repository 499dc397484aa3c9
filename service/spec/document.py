"""The study spec, version 1: turns JSON or TOML data into a study in SI numbers, or reports all its faults.

Its parts are the modules beside it (`text`, `units`, `run`, `warnings`, the `report` of faults) and packages: `machine`
(drive, clutch, shaft), `axes` (values, points, samples, combinations), `draws` (tolerances), `plan`, `schema`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import TYPE_CHECKING, Any, Final

from sprag.sentences import Sentence
from sprag.service.reading.limits import characters, quoted
from sprag.service.reading.texts import did_you_mean
from sprag.service.spec.axes.design import read_design
from sprag.service.spec.axes.sweep import read_sweep, with_sweep
from sprag.service.spec.derive import check_derived, layout, read_machine
from sprag.service.spec.draws.tolerances import read_tolerances, warn_of_invalid_drives, with_drives
from sprag.service.spec.fields import TOLERANCE_FIELDS
from sprag.service.spec.machine.registry import part_of
from sprag.service.spec.node import Node
from sprag.service.spec.plan.outline import Outline, chooses, first_round, read_outline
from sprag.service.spec.report import Report, SpecError
from sprag.service.spec.starts import read_starts
from sprag.service.spec.text import Format, load_spec
from sprag.worker import models
from sprag.worker.limits import MAX_NAME_LENGTH
from sprag.worker.study import Study

if TYPE_CHECKING:
    from sprag.service.spec.machine.machine import Machine
    from sprag.worker.models import ClutchFit
    from sprag.worker.study import Combine

__all__ = ["VERSION", "ParsedSpec", "SpecError", "format_of", "load_spec", "parse_spec"]

#: The supported version of the spec.
VERSION: Final = 1
#: Name of a study that gives none.
UNNAMED: Final = "untitled"

FIELDS: Final = (
    "sprag", "model", "name", "base", "derive", "run", "axes", "combine", "exclude", "refine", "goal", "calibrate",
    "starts", *TOLERANCE_FIELDS,
)  # fmt: skip


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
    """

    study: Study
    warnings: tuple[str, ...]
    fits: dict[str, ClutchFit] = field(default_factory=dict)
    spec: dict[str, Any] = field(default_factory=dict)


def format_of(name: str) -> Format:
    """The format of a spec file by its name: TOML when it ends in ``.toml``, otherwise JSON."""
    return "toml" if PurePath(name).suffix.lower() == ".toml" else "json"


def parse_spec(data: object) -> ParsedSpec:
    """The study that ``data`` (plain JSON data, as from `load_spec`) describes.

    Raises
    ------
    SpecError
        With all faults, each with its JSON Pointer, the value, and what is allowed.
    """
    report = Report(data)
    spec = Node(report, "", data)
    if not spec.has(FIELDS):
        raise report.error()
    found = spec.value
    _read_version(report, found)
    name = _read_name(report, found.get("name", UNNAMED))
    # The spec of an unknown model cannot be read further.
    model = _read_model(report, found)
    if model is None:
        raise report.error()
    part = part_of(model)
    report.machine = machine = read_machine(report, part, found)
    swept = read_sweep(spec)
    outline: Outline | None = None
    combine: Combine = "zip"
    if chooses(found):
        outline = read_outline(spec)
        axes = None if outline is None else outline.axes
    else:
        axes, combine = read_design(spec)
    if machine.derive and axes is not None and not report.found:
        check_derived(report, found["derive"], machine, layout(machine, axes, combine), ranges=outline is not None)
    spread = read_tolerances(spec, axes)
    if outline is not None and outline.with_drives is None and "tolerances" in found:
        report.fault(
            "/tolerances",
            "conflict",
            "cannot be combined with `refine` or `calibrate`",
            allowed="`goal`, or plain axes",
        )
    run = part.read_run(spec["run"], axes, combine)
    run |= read_starts(spec, axes, run)
    part.check(report, machine, axes or (), combine)
    report.raise_if_any()
    study = Study(model, name, _in_order(machine), run, structure=machine.structure, derive=machine.derive)
    given = replace(study, axes=axes or (), combine=combine)
    study = given if outline is None else first_round(spec, study, outline, spread)
    if swept is not None:
        study = with_sweep(study, *swept)
    if spread is not None and outline is None:
        study = with_drives(report, study, spread)
        warn_of_invalid_drives(report, study)
    part.warn(report, study)
    return ParsedSpec(study, tuple(report.warnings), machine.fits, dict(found))


def _read_version(report: Report, found: Mapping[str, Any]) -> None:
    version = found.get("sprag")
    if version is None or isinstance(version, bool) or version != VERSION or not isinstance(version, int):
        report.fault(
            "/sprag",
            "required" if version is None else "unsupported-version",
            "is required: the version of the spec" if version is None else "is not a supported spec version",
            version,
            allowed=str(VERSION),
        )


def _read_name(report: Report, value: object) -> str:
    if isinstance(value, str) and 0 < len(value.strip()) <= len(value) <= MAX_NAME_LENGTH and value.isprintable():
        return value.strip()
    report.fault(
        "/name",
        "invalid-text",
        "must be a printable text in one line",
        value,
        allowed=characters(1, MAX_NAME_LENGTH),
    )
    return UNNAMED


def _read_model(report: Report, found: Mapping[str, Any]) -> str | None:
    model, known = found.get("model"), models.model_names()
    if isinstance(model, str) and model in known:
        return model
    hint = did_you_mean(model, known) if isinstance(model, str) else Sentence("")
    report.fault(
        "/model",
        "required" if model is None else "unknown-name",
        "is required" if model is None else Sentence("is not a known model{hint}", hint=hint),
        model,
        allowed=quoted(known),
    )
    return None


def _in_order(machine: Machine) -> dict[str, float]:
    """The base with sorted paths, so that equal machines are stored identically."""
    return {path: machine.values[path] + 0.0 for path in sorted(machine.values)}
