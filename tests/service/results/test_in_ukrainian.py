"""Phrases, captions, figures, faults and warnings in the reader's language; programs read English."""

from __future__ import annotations

import pickle
import re
from dataclasses import replace

import numpy as np
import pytest

from sprag_study.engine import Ending
from sprag_study.sentences import Amount, Sentence, WarningText
from sprag_study.service import languages
from sprag_study.service.faults import Fault
from sprag_study.service.figures.branch import special_text
from sprag_study.service.figures.figure import Figure, Line, Note, Panel, Quantity
from sprag_study.service.figures.orders import motion_text
from sprag_study.service.figures.pictures import draw_figure
from sprag_study.service.figures.read import read_figure
from sprag_study.service.figures.svg import svg
from sprag_study.service.languages.elsewhere import speak
from sprag_study.service.reading.faults import allowed_text, fault_text
from sprag_study.service.reading.reader import CODES, Phrase, Reading, joined, part_label, plural, shown, term, titled
from sprag_study.service.reading.wording import typed_text, unit_text
from sprag_study.service.results.key_answer_words import curve_named
from sprag_study.service.results.tolerances.conditions import read_conditions
from sprag_study.worker.models import ResultInfo
from sprag_study.worker.models.branches import BranchContact, SpecialPoint
from tests.service.figures.seen import seen

DRIVE, SHAFT = Reading("vibration-drive"), Reading("machine-shaft")


def test_a_phrase_is_english_until_it_is_said_in_another_language() -> None:
    phrase = plural("{count} jump, within {width}", "{count} jumps, each within {width}", 3, width=Amount(0.25, "N*m"))
    with languages.language("uk"):
        assert phrase == "3 jumps, each within 0.25 N·m"
        assert phrase.said(DRIVE) == "3 стрибки, кожен у межах 0,25 Н·м"
        assert pickle.loads(pickle.dumps(phrase)).said(DRIVE) == phrase.said(DRIVE)
        assert Phrase("no case at {x}", x=Amount(1.5, "rad/s")).said(DRIVE) == "немає випадку за 1,5 рад/с"
        assert joined("; ", (term("not_settled"), Phrase("± {width} (95 %)", width=Amount(0.5, "W")))).said(DRIVE) == (
            "не усталено; ± 0,5 Вт (95 %)"
        )
        assert Phrase("{low} m", low=Amount(0.25, "N*m")) == "0.25 N·m m", "the same for programs in every language"
    assert phrase.said(DRIVE) == phrase


@pytest.mark.parametrize(("count", "text"), [(1, "1 привод"), (3, "3 приводи"), (11, "11 приводів")])
def test_ukrainian_has_three_forms_of_a_number(count: int, text: str) -> None:
    with languages.language("uk"):
        assert shown(plural("{count} drive", "{count} drives", count)) == text


def test_braces_of_other_texts_are_no_places() -> None:
    assert Phrase("{name} fit".replace("fit", "law"), name="a {b}") == "a {b} law"
    assert shown(part_label("{odd}")) == "{odd}"


def test_captions_are_made_of_translated_parts() -> None:
    with languages.language("uk"):
        assert DRIVE.caption("pendulums.1.spring_rate") == "Жорсткість пружини, маятник 2"
        assert DRIVE.caption("torque.mean.half_width") == "Середній момент муфт, півширина"
        assert SHAFT.caption("omega.harmonics.3") == "Гармоніка 3 швидкості"
        assert DRIVE.within("shaft.load") == "момент навантаження"
        assert DRIVE.title("shaft.load", "N*m") == "Момент навантаження (Н·м)"
        assert replace(DRIVE, names=CODES).caption("shaft.load") == "shaft.load"
        assert DRIVE.caption("sweep") == "Прохід"
        tied = "excitation.amplitude_x = excitation.amplitude_y"
        assert DRIVE.caption(tied) == "Горизонтальна амплітуда = вертикальна амплітуда"
    assert DRIVE.caption(tied) == "Horizontal amplitude = vertical amplitude"
    assert DRIVE.caption("pendulums.1.spring_rate") == "Spring rate, pendulum 2"


def test_words_of_codes_and_units() -> None:
    with languages.language("uk"):
        assert titled("take_up") == "Вибирання люфту"
        assert motion_text("2 periods") == "2 періоди"
        assert motion_text("irregular") == "нерегулярний"
        assert shown(part_label("Pendulum 0")) == "Маятник 0"
        assert [unit_text(unit) for unit in ("kg*m^2", "rad^2/s^2", "rpm", "N*m*s/rad", "1")] == [
            "кг·м²", "рад²/с²", "об/хв", "Н·м·с/рад", ""
        ]  # fmt: skip


def test_figures_are_read_in_the_language() -> None:
    x = np.array([0.0, 0.5, 1.0])
    line = Line("", x, x, "#0072b2", cases=np.arange(3), key="0")
    panel = Panel(Quantity("power.useful.mean", "W"), (line,), notes=(Note(0.5, 0.5, "#0072b2", "largest", key="0"),))
    figure = Figure(Quantity("shaft.load", "N*m"), (panel,), note="")
    english = draw_figure(read_figure(figure, DRIVE), "", "svg")
    with languages.language("uk"):
        read = read_figure(figure, DRIVE)
        page = svg(read, cases="/studies/st_0/cases/")
        assert seen(page).has("Момент навантаження (Н·м)", "Середня корисна потужність (Вт)", "0,2")
        assert seen(page).has("найбільше на своїй кривій")
        assert "випадок 2</title>" in page
        assert draw_figure(read, "", "svg") != english
    assert seen(english).has("0.2")


def test_special_points_conditions_and_scales_are_in_words() -> None:
    grazing = SpecialPoint("grazing", "", 0.25, 0, (), (BranchContact("pendulums.0", "engaged", 0, 1),))
    (condition,) = read_conditions([ResultInfo("efficiency", "1", "")], ["efficiency >= 90 % of nominal"])
    strobes = Figure(Quantity("", "1"), (), scale=Phrase("excitation period"))
    assert condition.text == "efficiency ≥ 90 % of nominal"
    assert special_text(grazing, "N*m") == "grazing at 0.25 N·m: pendulum 1 engaged 0 → 1"
    with languages.language("uk"):
        assert DRIVE.say(special_text(grazing, "N*m")) == "дотик за 0,25 Н·м: маятник 1 зчеплена 0 → 1"
        assert DRIVE.say(condition.text) == "ККД ≥ 90 % від номінального"
        assert read_figure(strobes, DRIVE).scale == "Період збудження"


def test_a_curve_is_named_in_addresses_the_same_by_all_readers() -> None:
    names = [Phrase("{value}", value=Amount(value, "m")) for value in (0.001, 0.002)]
    for code, text in (("en", "0.002 m"), ("uk", "0.002 m"), ("en", "0,002 м"), ("uk", "0,002 м")):
        with languages.language(code):
            assert curve_named(names, text) == 1
    assert curve_named(names, "0.003 m") is None


def test_every_ending_has_a_sentence_of_its_own() -> None:
    with languages.language("uk"):
        said = [languages.gettext(ending.sentence) for ending in Ending]
    assert len(set(said)) == len(said)
    assert not {ending.sentence for ending in Ending} & set(said)


def test_a_fault_of_a_service_is_the_meaning_of_its_code_with_value_and_range() -> None:
    fault = Fault("/base/shaft/load", "out-of-range", "is too small", -1.0, ">= 0", "N*m")
    with languages.language("uk"):
        assert fault_text(fault) == "Значення поза дозволеними межами"
        ends = {"low": Amount(0.05, digits=6), "high": Amount(1.5, "m", 6)}
        assert allowed_text(Sentence("{low} to {high}", **ends)) == "від 0,05 до 1,5 м"
        assert allowed_text("each path on one axis") == "кожен шлях на одній осі"
        assert allowed_text("grid, zip") == "grid, zip"
        assert allowed_text(None) == ""
    assert fault_text(fault) == "is too small"
    assert allowed_text("0.05 to 1.5 m") == "0.05 to 1.5 m"


def test_a_warning_has_its_place_and_its_numbers() -> None:
    text = "/axes/0 (excitation.frequency): 5e+03 Hz is more than 1000 Hz; was it in rpm? (in 3 of 12 cases)"
    warning = WarningText(text, "implausible-value")
    with languages.language("uk"):
        said = DRIVE.warning(warning)
        assert said.startswith("Частота збудження: Значення далеко поза тим")
        assert re.search(r"\(5.?000 Гц; 1.?000 Гц; у 3 з 12 випадків\)$", said)
        assert DRIVE.warning("stored by an earlier version") == "stored by an earlier version"
    assert re.match(r"Excitation frequency: 5.?000 Hz is more than 1.?000 Hz; was it in rpm\?", DRIVE.warning(warning))


def test_another_process_gets_the_language_of_the_task() -> None:
    with languages.language("uk"):
        given = languages.current()
    assert speak(given, titled, "held") == "Утримується"
    assert languages.current() == languages.ENGLISH


def test_the_word_in_is_no_inch() -> None:
    """Of what is allowed, and of placeholders: a unit stands after a number and before no word."""
    with languages.language("uk"):
        for words in (
            "1 to 200 printable characters in one line",
            "at most 3 in a row",
            "a number in Hz, in all cases",
        ):
            assert "\u0434\u044e\u0439\u043c" not in unit_text(allowed_text(words))
            assert "\u0434\u044e\u0439\u043c" not in typed_text(words)
        assert unit_text("in") == "\u0434\u044e\u0439\u043c"
        assert unit_text(allowed_text("0.1 to 4 in")).endswith("4 \u0434\u044e\u0439\u043c")
        assert unit_text("> 2 in").endswith("\u0434\u044e\u0439\u043c")
        assert typed_text("2 in; 3 in") == "2 \u0434\u044e\u0439\u043c; 3 \u0434\u044e\u0439\u043c"
