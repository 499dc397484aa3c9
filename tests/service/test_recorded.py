"""Sentences that came in English only are found again by those who read them."""

from __future__ import annotations

from datetime import time

import pytest

from sprag_study.service import languages
from sprag_study.service.languages import earlier, recorded
from sprag_study.service.results.regimes import motion_sentence
from sprag_study.service.schedules.times import Window
from sprag_study.worker.opening import COMPILING
from sprag_study.worker.order import Coverage


def test_the_window_of_a_schedule() -> None:
    text = recorded.OUTSIDE_WINDOW.format(window=Window(time(22), time(6), "Europe/Kyiv"))
    assert text == "outside its window, 22:00 to 06:00 (Europe/Kyiv); it continues by itself"
    assert earlier.said(text) == text
    with languages.language("uk"):
        assert earlier.said(text) == "поза своїм вікном часу (від 22:00 до 06:00 (Europe/Kyiv)); продовжиться само"


def test_a_full_disk() -> None:
    text = recorded.NO_ROOM.format(limit=recorded.DISK.format(path="/data/sprag.db", free="3.2"))
    with languages.language("uk"):
        said = earlier.said(text)
    assert said.startswith("бракує місця: на диску, де лежить /data/sprag.db, залишилося 3.2 МБ;")


@pytest.mark.parametrize("template", earlier._ALL)
def test_every_sentence_has_a_translation(template: str) -> None:
    with languages.language("uk"):
        assert earlier.said(template) != template


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (COMPILING, "Ядро цього дослідження компілюється"),
        (str(Coverage(0, 4, 0, ())), "жодного проходу з 4 ще не завершено"),
        (str(Coverage(2, 4, 9, (3, 3))), "прохід 2 з 4 завершено, сітка з 3 x 3 значень"),
        (str(Coverage(2, 4, 9, ())), "прохід 2 з 4 завершено, випадків: 9"),
        (
            recorded.LATE_PART.format(time="2027-01-31T06:00:00+00:00", done=4, cases=9, part=Coverage(0, 4, 0, ())),
            "готово 4 з 9 випадків; жодного проходу з 4 ще не завершено. Продовжте",
        ),
        (
            recorded.TRIED_AGAIN.format(problem=recorded.MANY_STUDIES.format(count="1,000"), time="06:00"),
            "Досліджень, які ще не закінчилися: 1,000. Спроби повторюються до 06:00.",
        ),
        (
            recorded.NOTHING_RAN.format(due="06:00", why=recorded.WAITS.format(problem=COMPILING.removesuffix("."))),
            "інші дослідження продовжуються.",
        ),
        (recorded.SILENT.format(process="host:12", since="06:00"), "обчислювач (процес host:12) не відповідає з 06:00"),
    ],
)
def test_sentences_are_found_in_sentences_of_others(text: str, said: str) -> None:
    assert earlier.said(text) == text
    with languages.language("uk"):
        assert said in earlier.said(text)


def test_other_texts_stay_as_they_are() -> None:
    with languages.language("uk"):
        assert earlier.said("not enough sleep") == "not enough sleep"


@pytest.mark.parametrize(
    ("order", "english", "ukrainian"),
    [
        (None, "a whole number of excitation periods", "ціле число періодів збудження"),
        (1, "one excitation period", "один період збудження"),
        (2, "2 excitation periods", "2 періоди збудження"),
        (5, "5 excitation periods", "5 періодів збудження"),
    ],
)
def test_the_sentence_of_a_motion(order: int | None, english: str, ukrainian: str) -> None:
    sentence = motion_sentence("periodic", order)
    assert f"after {english}, and" in sentence
    with languages.language("uk"):
        assert ukrainian in sentence.said(None)
