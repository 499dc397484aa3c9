"""Texts that are values of the program and are translated where they are shown: vocabulary of models, codes, states."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from sprag_study.engine.continuation.problem import End
from sprag_study.engine.continuation.problem import Kind as Special
from sprag_study.engine.machine_shaft.transient_run import OUTCOMES
from sprag_study.service.actor import Role
from sprag_study.service.fault_meanings import KIND_MEANINGS, MEANINGS, WARNING_MEANINGS
from sprag_study.service.http.problems import PROBLEM_TYPES
from sprag_study.service.http.views import preset_of
from sprag_study.service.presets import preset_names
from sprag_study.service.reading.quantities import KINDS
from sprag_study.service.reading.reader import part_label
from sprag_study.service.schedules.outcomes import Result
from sprag_study.service.spec.machine.shaft_parts import MECHANISM_CHOICES
from sprag_study.service.spec.saved_views import PAGES
from sprag_study.service.storage.people.scopes import TokenScope
from sprag_study.worker import models
from sprag_study.worker.directions import DIRECTIONS
from sprag_study.worker.models.forces import force_infos
from sprag_study.worker.models.machine_shaft import REMARKS
from sprag_study.worker.models.model import Model
from sprag_study.worker.models.ramps import start_up_infos
from sprag_study.worker.models.registry import all_models
from sprag_study.worker.models.transients import RESULTS as TRANSIENT_RESULTS
from sprag_study.worker.models.vocabulary import caption, caption_texts
from sprag_study.worker.states import StudyState

#: Variables of motions by which a model finds the parts whose lines it draws.
_SWINGING = ("pendulums.0.angle", "pendulums.1.angle", "shaft.angle")


#: Fields of the details of the audit log.
LOGGED: Final = (
    "after", "before", "cases", "catch_up", "cron", "deadline", "enabled", "endings", "expires", "fields", "fresh",
    "in_report", "kind", "most_bytes", "most_cases", "most_checks", "name", "note", "notes", "now", "overlap",
    "owner", "page", "priority", "problem", "reason", "report_email", "report_webhook", "report_when", "role", "rows",
    "schedules", "spec", "studies", "study", "tags", "to", "window", "zone",
)  # fmt: skip


def units() -> set[str]:
    """The names in units that are shown: ``kg`` and ``m`` of ``kg*m^2``."""
    every = [unit for kind in KINDS for unit in (kind.unit, *kind.others)]
    shown = {name for unit in every for name in re.findall(r"[A-Za-z]+\d?", re.sub(r"\^-?\d+", "", unit))}
    return shown | {"GB", "MB", "d", "h", "standard deviations"}


def vocabulary() -> Iterator[str]:
    """Every such text; some more than once."""
    for model in all_models():
        yield from filter(None, _of_model(model))
    for codes in (models.ENDING_SENTENCES, models.REGIME_SENTENCES, StudyState, DIRECTIONS):
        yield from map(_term, codes)
    yield from map(_term, (*Special, *OUTCOMES))
    yield from (end.sentence for end in End)
    yield from (*models.ENDING_SENTENCES.values(), *models.REGIME_SENTENCES.values())
    yield from (meaning for _name, _unit, meaning in TRANSIENT_RESULTS)
    yield from (info.description for info in (*force_infos(1), *start_up_infos(1)))
    yield from (state.sentence for state in StudyState)
    yield from (kind.title for kind in KINDS)
    for meanings in (MEANINGS, KIND_MEANINGS, WARNING_MEANINGS):
        yield from meanings.values()
    yield from (result.value for result in Result)
    yield "periods"
    yield from map(_term, (*LOGGED, *PAGES, *Role, *TokenScope))
    yield from (preset_of(name)["title"] for name in preset_names())
    quick = (name for name, *_ in MECHANISM_CHOICES["quick_return"]["kind"].choices)
    yield from map(_term, (*MECHANISM_CHOICES, *quick))
    for problem in PROBLEM_TYPES.values():
        yield from (problem.title, problem.help)


def _of_model(model: Model) -> Iterator[str]:
    shown = model.presentation
    yield from caption_texts(model.name)
    for entry in model.parameters():
        yield from {entry.help, entry.help.removesuffix(REMARKS.get(entry.path, ""))}
    yield from (info.description for variant in model.variants() for info in model.results(variant))
    yield from (shown.title, shown.heading, shown.portrait, shown.motion, shown.motion_note)
    yield from (answer.title for answer in shown.answers)
    yield from shown.clauses.texts
    yield from (label for _, _, label in shown.balance)
    yield from map(_term, (*shown.states, *model.flags))
    yield from model.flags.values()
    for panel in shown.panels(_SWINGING, ("rad",) * len(_SWINGING)):
        yield caption(model.name, panel.title)
        yield from (part_label(label).parts.get("part", label) for _, label in panel.lines)


def _term(code: str) -> str:
    return code.replace(".", " ").replace("_", " ")
