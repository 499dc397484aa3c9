"""Sentences with values: plain English for programs, whole in every language, and the same after they were stored."""

from __future__ import annotations

import json
import pickle
import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import get_args

import numpy as np
import pytest

from sprag_study.sentences import (
    Amount,
    Clause,
    Name,
    Place,
    Sentence,
    Typed,
    WarningText,
    Whole,
    joined,
    plural,
    sentence_of,
)
from sprag_study.service.cli.console import warning_lines
from sprag_study.service.faults import FaultError, WarningCode
from sprag_study.service.http.problems import as_api_error
from sprag_study.service.languages import language
from sprag_study.service.languages.recorded import MANY_STUDIES, NOT_IN_TIME
from sprag_study.service.reading.part_names import part_name
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Phrase, Reading, shown, shown_stored
from sprag_study.service.reading.units import parse_quantity
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.service.storage.stored_sentences import read_warnings, write_warnings
from sprag_study.worker.ports import StoreError
from sprag_study.worker.states import StudyEvent, StudyState, TransitionError
from tests.service import warning_samples

DRIVE = Reading("vibration-drive", Units({"N*m": "N*mm", "m": "mm", "rad": "deg"}))
SHAFT = Reading("machine-shaft", Units({"Pa": "bar", "m": "mm"}))
#: Names that are the same in every language, and what a user typed.
KEPT = re.compile(r"SPRAG_CHUNK_TIMEOUT|CSV|T_mean|Sprag|«[^»]*»")
PLACED = Sentence(
    "{value} is more than {limit}; {question}",
    value=Amount(1.6, "m", 6),
    limit=Amount(0.1, "m", 4),
    question=Sentence("was it in mm?"),
)
SENTENCES = [
    PLACED,
    Sentence("no values"),
    plural("{count} row of {all}", "{count} rows of {all}", 20_000, all=1),
    joined(": ", (Place("/axes/0", "shaft.load"), Name("shaft.load", within=True), "x", PLACED)),
    joined("", (Whole(PLACED), " ", Clause(Sentence(NOT_IN_TIME)), " ", Whole("x"), " ", Typed("20.000 N*mm"))),
    Sentence("{a} {b}", a=Amount(None), b=Amount(307.2, digits=3, form=".0f")),
]


@cache
def samples() -> list[tuple[Reading, list[str]]]:
    """Warnings of every code, by how they are read."""
    rest = [*warning_samples.of_data(), *warning_samples.of_work()]
    return [(DRIVE, [*warning_samples.of_drives(), *rest]), (SHAFT, [*warning_samples.of_shafts()])]


def pairs() -> Iterator[tuple[Reading, WarningText]]:
    for reading, warnings in samples():
        for text in warnings:
            assert isinstance(text, WarningText)
            yield reading, text


def test_the_english_of_a_sentence_is_in_plain_characters() -> None:
    assert [str(text) for text in SENTENCES[:4]] == [
        "1.6 m is more than 0.1 m; was it in mm?",
        "no values",
        "20,000 rows of 1",
        "/axes/0 (shaft.load): shaft.load: x: 1.6 m is more than 0.1 m; was it in mm?",
    ]
    assert Phrase("{a}, {b}", a=Amount(1e-6, "N*m"), b=20_000) == "1·10⁻⁶ N·m, 20\N{NARROW NO-BREAK SPACE}000"


@pytest.mark.parametrize("text", SENTENCES, ids=str)
def test_a_sentence_is_the_same_after_it_was_stored_and_in_another_process(text: Sentence) -> None:
    again = [sentence_of(json.loads(json.dumps(text.to_json()))), pickle.loads(pickle.dumps(text))]
    for one in again:
        assert one == text
        for spoken in ("en", "uk"):
            with language(spoken):
                assert DRIVE.say(one) == DRIVE.say(text)
                assert shown(one) == shown(text)


def test_there_is_a_warning_of_every_code() -> None:
    assert {text.code for _, text in pairs()} == {*get_args(WarningCode)}


def test_a_warning_is_whole_in_ukrainian_with_its_values() -> None:
    for reading, text in pairs():
        in_english = reading.warning(text)
        with language("uk"):
            in_ukrainian = reading.warning(text)
        assert not re.search(r"[A-Za-z]{3,}", KEPT.sub("", in_ukrainian)), in_ukrainian
        assert numbers(in_english) <= numbers(in_ukrainian), (in_english, in_ukrainian)
        assert not re.search(r"/(?:axes|base|derive|goal|run|starts|tolerances)\b", in_english), in_english


def numbers(text: str) -> set[str]:
    """The numbers of a text, whatever its decimal mark; a typed text has its own."""
    return set(re.findall(r"\d+(?:\.\d+)?", KEPT.sub("", re.sub("'[^']*'", "", text)).replace(",", ".")))


def test_a_warning_has_the_units_of_the_reader() -> None:
    (wide,) = (text for _, text in pairs() if "1.6 m" in text)
    assert DRIVE.warning(wide) == "Horizontal amplitude: 1600 mm is more than 100 mm; was it in mm?"
    assert replace(DRIVE, names="codes").warning(wide).startswith("excitation.amplitude_x: 1600 mm is")
    with language("uk"):
        assert DRIVE.warning(wide) == "Горизонтальна амплітуда: 1600 мм — це більше за 100 мм; чи не в мм його подано?"
    (beyond,) = (text for _, text in pairs() if "810328 Pa" in text)
    with language("uk"):
        assert "щонайбільше 8,10328 бар і за" in SHAFT.warning(beyond)


def test_a_warning_is_the_same_after_it_was_stored() -> None:
    for reading, text in pairs():
        (again,) = read_warnings(write_warnings([text]))
        assert (again, getattr(again, "code", "")) == (text, text.code)
        with language("uk"):
            assert reading.warning(again) == reading.warning(text)


def test_an_earlier_release_reads_what_is_stored_now() -> None:
    """It takes the first two of each."""
    for _, text in pairs():
        ((code, english, *_sentence),) = json.loads(write_warnings([text]))
        assert (code, english) == (text.code, str(text))


def test_a_command_says_a_warning_with_code_names() -> None:
    (wide,) = (text for _, text in pairs() if "1.6 m" in text)
    assert [*warning_lines([wide])] == [f"warning: {wide}"]
    with language("uk"):
        (line,) = warning_lines([wide])
    assert line.startswith("застереження: /axes/0 (excitation.amplitude_x): 1,6 м — це більше за 0,1 м;")


@pytest.mark.parametrize(
    ("error", "english", "ukrainian"),
    [
        (StudyNotFoundError("st_1"), "There is no study 'st_1'.", "Немає дослідження 'st_1'."),
        (
            TransitionError(StudyState.FINISHED, StudyEvent.PAUSE),
            "A study that is finished cannot take 'pause'.",
            "Для дослідження в стані «завершене» неможлива дія 'pause'.",
        ),
        (StoreError("the disk is broken"), "The disk is broken.", "The disk is broken."),
        (FaultError("queue-full", Sentence(MANY_STUDIES, count="64")), "64 studies have not ended yet.",
         "Досліджень, які ще не закінчилися: 64."),
    ],
)  # fmt: skip
def test_a_problem_is_a_sentence_in_every_language(error: Exception, english: str, ukrainian: str) -> None:
    problem = as_api_error(error)
    assert problem is not None
    assert problem.detail == english
    with language("uk"):
        assert shown_stored(problem.detail) == ukrainian


def test_greek_letters_are_symbols_in_titles() -> None:
    assert [DRIVE.say_name(Phrase(text)) for text in ("μ*", "share", "зсув")] == ["μ*", "Share", "Зсув"]


def test_people_count_parts_from_1() -> None:
    assert SHAFT.caption("drive.stages.1.ratio") == "Ratio, stage 2"
    assert SHAFT.caption("operation.steps.0.value") == "Resistance in step 1"
    assert DRIVE.caption("pendulums.0.mass").endswith(", pendulum 1")
    assert DRIVE.caption("clutch.coefficients.1") == "Clutch coefficient of degree 1"
    assert part_name("pendulums.0.clutch") == "Pendulum 1, clutch"


@pytest.mark.parametrize("value", [0.005, 0.3 * np.pi / 180.0, 0.0872664625997, 1.0, 0.1234567891])
def test_an_angle_in_a_column_of_units_can_be_typed_back(value: float) -> None:
    text, unit = Reading("vibration-drive", Units({"rad": "deg"})).number_and_unit(value, "rad")
    assert parse_quantity(f"{text} {unit}", "rad") == pytest.approx(value, rel=1e-13)
