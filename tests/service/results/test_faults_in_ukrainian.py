"""Faults of what is asked for, and of times of schedules, in Ukrainian: whole sentences with their values."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

import pytest

from sprag_study.service.faults import FaultError
from sprag_study.service.languages import language
from sprag_study.service.reading.faults import allowed_text, fault_text
from sprag_study.service.results.curve_cases import select
from sprag_study.service.results.curves import CurveQuery
from sprag_study.service.results.explore import ExploreQuery, plan_of
from sprag_study.service.results.selection import locate_axes, numeric_results, require_axis
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.views.basin import BasinView
from sprag_study.service.views.branch import range_of
from sprag_study.service.views.case_questions import (
    BasinQuestion,
    DutyQuestion,
    EngagementsQuestion,
    ForcesQuestion,
    StrobesQuestion,
)
from sprag_study.service.views.duty import DutyView
from sprag_study.service.views.engagements import EngagementsView
from sprag_study.service.views.forces import ForcesView
from sprag_study.service.views.portrait import StrobesView
from sprag_study.service.views.sections import section_of
from sprag_study.worker import models
from tests.service.spec_sample import SPEC, parsed

STUDY = parse_spec(SPEC).study
PRESS, NO_PRESS = (parsed({"/base/shaft/cyclic_load": share}).study for share in (0.2, 0.0))
#: A drive of a settled study that an earlier release has drawn.
DRAWN = replace(PRESS, run=parsed({"/run": {"until": "settled"}}).study.run)
INFOS = models.study_results(STUDY)
NOW = datetime(2026, 1, 1, tzinfo=UTC)


def schedule(**fields: object) -> Callable[[], object]:
    return lambda: read_fields({"spec": SPEC, "cron": "0 22 * * *", **fields}, NOW)


@pytest.mark.parametrize(
    ("asked", "english", "ukrainian", "allowed"),
    [
        (
            lambda: require_axis(STUDY, "x", "shaft.inertia"),
            "not an axis: it is 0.002 kg*m^2 in every case; did you mean 'shaft.load'?",
            "не є віссю: у кожному випадку дорівнює 0,002 кг·м²; можливо, мається на увазі 'shaft.load'?",
            "excitation.frequency, ",
        ),
        (
            lambda: locate_axes(STUDY, [("shaft.load", "7 kg")]),
            """shaft.load is in 'kg', which is not a unit of this field; expected N*m, for example "0.1 N*m\"""",
            """shaft.load має одиницю 'kg', яка не є одиницею цього поля; очікується Н·м, наприклад "0,1 Н·м\"""",
            "",
        ),
        (lambda: locate_axes(STUDY, [("shaft.load", "7")]), "the axis has no such value",
         "вісь не має такого значення", "0.02, 0.1, 0.3"),
        (lambda: numeric_results(INFOS, "y", ["efficiencz"]), "unknown result; did you mean 'efficiency'?",
         "невідомий результат; можливо, мається на увазі 'efficiency'?", ""),
        (
            lambda: select(STUDY, CurveQuery("shaft.load", ("efficiency",))),
            "the axis excitation.frequency is left open: name it in by=, or give its value as "
            "at=excitation.frequency=VALUE",
            "вісь excitation.frequency залишено відкритою: назвіть її в by= або задайте її значення як "
            "at=excitation.frequency=VALUE",
            "16.0, ",
        ),
        (lambda: range_of(STUDY, 0, "shaft.load", "1", "2"),
         "the range 1 .. 2 must contain the value of the case, 0.02",
         "діапазон 1 .. 2 мусить містити значення випадку, 0,02", "from <= 0.02 <= to"),
        (lambda: range_of(PRESS, 0, "shaft.load"), "has a load that swings with the angle of the shaft",
         "має навантаження, що коливається з кутом вала (shaft.cyclic_load)", ""),
        (lambda: section_of(PRESS, 0, None, 4), "has a load that swings with the angle of the shaft",
         "має навантаження, що коливається з кутом вала (shaft.cyclic_load)", ""),
        (lambda: range_of(NO_PRESS, 0, "shaft.cyclic_load", "0", "1"), "has a load that swings with the angle",
         "має навантаження, що коливається з кутом вала (shaft.cyclic_load)", ""),
        (lambda: plan_of(STUDY, ExploreQuery(where=("efficiency > x",))), "is not a range", "не є діапазоном",
         "NAME >= VALUE, наприклад shaft.load <= 2 N*m"),
        (schedule(cron="0 22"), "a cron expression has five fields: minute, hour,",
         "вираз cron має п’ять полів: хвилина, година,", "п"),
        (schedule(finish_by="2000 days"), "is too far away", "надто далеко", ""),
        (schedule(misfire_grace="1 ms"), "is shorter than 1 s", "коротше за 1 с", ""),
        (schedule(zone="Europe/Kyev"), "is not a time zone; did you mean 'Europe/Kyiv'?",
         "не є часовим поясом; можливо, мається на увазі 'Europe/Kyiv'?", ""),
        (schedule(trouble_flags=["unsettld"]),
         "is not a flag of the model vibration-drive; did you mean 'unsettled'?",
         "не є позначкою моделі vibration-drive; можливо, мається на увазі 'unsettled'?", ""),
        *(
            (lambda view=view, question=question: view.choose(DRAWN, 0, question),
             "has a load that swings with the angle of the shaft",
             "має навантаження, що коливається з кутом вала (shaft.cyclic_load)", "")
            for view, question in (
                (EngagementsView(), EngagementsQuestion()), (DutyView(), DutyQuestion()),
                (ForcesView(), ForcesQuestion()), (StrobesView(), StrobesQuestion()), (BasinView(), BasinQuestion()),
            )
        ),
    ],
)  # fmt: skip
def test_the_sentence_of_a_fault(asked: Callable[[], object], english: str, ukrainian: str, allowed: str) -> None:
    with pytest.raises(FaultError) as refused:
        asked()
    fault = refused.value.faults[0]
    assert fault.message.startswith(english)
    assert fault_text(fault) == fault.message
    with language("uk"):
        assert fault_text(fault).startswith(ukrainian)
        assert allowed_text(fault.allowed).startswith(allowed)
