"""What a search is asked for, in words: its goals, and the limits of its designs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Name
from sprag_study.service.reading.reader import Phrase, term
from sprag_study.service.results.fronts import goal_of
from sprag_study.worker import models

if TYPE_CHECKING:
    from sprag_study.worker.planning.goals.plan import Goal, Limit
    from sprag_study.worker.study import Study


def goals_of(study: Study) -> list[Phrase]:
    """The goals of a search: ``Largest mean shaft speed``."""
    return [_goal(own) for own in goal_of(study).best]


def limits_of(study: Study) -> list[Phrase]:
    """The limits of its designs: ``Largest clutch torque at most 3 N·m``."""
    return [_limit(study, own) for own in goal_of(study).subject_to]


def _goal(goal: Goal) -> Phrase:
    name = Name(goal.name, within=True)
    return Phrase("Largest {name}", name=name) if goal.max else Phrase("Smallest {name}", name=name)


def _limit(study: Study, limit: Limit) -> Phrase:
    info = next((own for own in models.study_results(study) if own.name == limit.result), None)
    unit = models.SHARE if info is None else info.unit
    cell = limit.value if info is None else info.cell(limit.value)
    value = term(cell) if isinstance(cell, str) else Amount(limit.value, unit)
    texts = {
        "at_least": Phrase("{name} at least {value}", name=Name(limit.name), value=value),
        "at_most": Phrase("{name} at most {value}", name=Name(limit.name), value=value),
        "is": Phrase("{name} = {value}", name=Name(limit.name), value=value),
    }
    return texts[limit.kind]
