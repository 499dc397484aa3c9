"""Texts of the form for a new study that its tables have: labels, help and choices of fields."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from sprag_study.service.reading.wording import words
from sprag_study.service.spec.described import ANY_RUN, DURATION, FIT, SETTLED_RUN, SHAFT_RUN
from sprag_study.service.spec.draws.described import DISTRIBUTION
from sprag_study.service.spec.kinds.calibrate import CALIBRATE
from sprag_study.service.spec.kinds.goal import GOAL
from sprag_study.service.spec.kinds.refine import REFINE
from sprag_study.service.spec.kinds.tolerances import DRAWS
from sprag_study.service.spec.machine.shaft import MEAN_SPEED_IS
from sprag_study.service.spec.machine.shaft_drive import BALANCE, BALANCE_SIDE, FLYWHEEL, FLYWHEEL_SHAFT, MOTOR, STAGE
from sprag_study.service.spec.machine.shaft_parts import (
    EFFICIENCY_IS,
    INDICATOR_OVER,
    INTERPOLATION,
    MECHANISM_CHOICES,
    OPERATION,
    OPERATION_CHOICES,
    PHI_C,
)
from sprag_study.worker import models
from sprag_study.worker.models.form import Block, Form, FormChoice, FormField
from sprag_study.worker.models.laboratory import Laboratory


def form_values() -> Iterator[str]:
    """Labels and help of the fields of the form for a new study."""
    yield from (words(name) for name in OPERATION.either)
    machine = (*MECHANISM_CHOICES.values(), OPERATION_CHOICES)
    drive = (
        EFFICIENCY_IS,
        MEAN_SPEED_IS,
        BALANCE,
        BALANCE_SIDE,
        FLYWHEEL,
        FLYWHEEL_SHAFT,
        MOTOR,
        STAGE,
        INDICATOR_OVER,
        INTERPOLATION,
        PHI_C,
    )
    plan = (
        *CALIBRATE.described.values(),
        *GOAL.described.values(),
        REFINE.listed["results"],
        *REFINE.described.values(),
    )
    entries = (
        *SETTLED_RUN.values(),
        DURATION,
        *ANY_RUN.values(),
        *SHAFT_RUN.values(),
        *FIT.values(),
        *DRAWS.values(),
        *plan,
        *drive,
    )
    for entry in (*entries, *(entry for choices in machine for entry in choices.values())):
        name = words(getattr(entry, "name", ""))
        texts = [word if word != value else words(word) for value, word in getattr(entry, "choices", ())]
        yield from filter(None, (getattr(entry, "label", ""), name, entry.help, *texts))
    yield from (words(name).lower() for name in DISTRIBUTION.values)
    yield from (words(kind) for kind in MECHANISM_CHOICES)
    for name in models.model_names():
        yield from filter(None, _own(models.model_of(name).presentation.form))
        yield from filter(None, _of_laboratory(models.model_of(name).presentation.laboratory))
        for parameter in models.parameter_catalogue(name):
            yield from (words(name) for name in parameter.path.split(".") if name not in ("K", "N"))


def _own(form: Form) -> Iterator[str]:
    """What the form of a model itself says."""
    yield from (form.called, form.drawer, form.normal, form.advice, *form.labels.values())
    yield from (title for _, title in form.groups)
    for kind in form.components:
        yield from (
            kind.title,
            kind.twice,
            kind.foreign,
            kind.change,
            kind.keep,
            *map(words, (kind.choice, *kind.ways)),
        )
    for rows in form.lists:
        yield from (rows.title, rows.add, rows.drop, rows.every, rows.one)
        yield from _texts(rows.fields)
    for part in form.parts:
        for block in (part,) if isinstance(part, Block) else part.blocks:
            yield block.title
            yield from _texts(block.items)


def _texts(items: Iterable[FormField | FormChoice]) -> Iterator[str]:
    for item in items:
        yield from (item.label, item.help)
        if isinstance(item, FormField):
            yield item.default if item.kind != "tick" else ""
            continue
        for option in item.options:
            yield option.label or words(option.value)
            yield from _texts(option.items)


def _of_laboratory(own: Laboratory) -> Iterator[str]:
    """What the laboratory of a model itself says."""
    yield from (own.note, *own.main.values())
