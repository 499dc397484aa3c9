"""Lists, ranges and quantities as people type them: each means what they mean, or is refused with a question."""

from __future__ import annotations

from typing import Final

import pytest

from sprag_study.service.reading.faults import message
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.report import SpecError
from tests.service.spec_sample import changed

LOAD: Final = "shaft.load"
FREQUENCY: Final = "excitation.frequency"
AMPLITUDE: Final = "excitation.amplitude_x"
SEVERAL: Final = "one value or several"
HOW_MANY: Final = "in which steps, or how many values"

#: What is typed, and the SI values that it means.
MEANT: Final[list[tuple[str, str, list[float]]]] = [
    (LOAD, "0.3 N*m", [0.3]),
    (LOAD, "300 N·mm", [0.3]),
    (LOAD, "300 Нмм", [0.3]),
    (LOAD, "3e-1 Nm", [0.3]),
    (LOAD, "3·10⁻¹ N·m", [0.3]),
    (LOAD, "3 x 10^-1 N*m", [0.3]),
    (LOAD, "3*10^-1 N*m", [0.3]),
    (LOAD, "1/2 N*m", [0.5]),
    (LOAD, "0.1; 0.2; 0.3 N*m", [0.1, 0.2, 0.3]),
    (LOAD, "0.1, 0.2, 0.3 N*m", [0.1, 0.2, 0.3]),
    (LOAD, "0,1; 0,2; 0,3 Нм", [0.1, 0.2, 0.3]),
    (LOAD, "0.1 N*m; 200 N*mm", [0.1, 0.2]),
    (LOAD, "0 to 0.4 step 0.1 N*m", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (LOAD, "from 0 to 0.4 N*m in steps of 0.1", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (LOAD, "0 до 0,4 з кроком 0,1 Нм", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (LOAD, "від 0 до 0,4 Нм через 0,1", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (LOAD, "0…0,4 Нм через 0,1", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (LOAD, "0..400 N*mm step 100", [0.0, 0.1, 0.2, 0.3, 0.4]),
    (FREQUENCY, "1500 rpm", [25.0]),
    (FREQUENCY, "1500 об/хв", [25.0]),
    (FREQUENCY, "1500 об/мин", [25.0]),
    (FREQUENCY, "1500 1/min", [25.0]),
    (FREQUENCY, "1500 min^-1", [25.0]),
    (FREQUENCY, "1\u202f500 rpm", [25.0]),
    (FREQUENCY, "25 Гц", [25.0]),
    (FREQUENCY, "20, 25, 30 Гц", [20.0, 25.0, 30.0]),
    (FREQUENCY, "20 Hz, 25 Hz", [20.0, 25.0]),
    (FREQUENCY, "20-35 Hz step 5", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "20..35 Hz, 4 values", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "20 – 35 Hz; 4 points", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "20 to 35 Hz by 5 Hz", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "35 to 20 Hz step -5", [35.0, 30.0, 25.0, 20.0]),
    (FREQUENCY, "20–35 Гц, 4 значення", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "1200 до 1800 об/хв кроком 300", [20.0, 25.0, 30.0]),
    (FREQUENCY, "20 to 35 Hz in 4", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "from 20 to 35 Hz in 4 values", [20.0, 25.0, 30.0, 35.0]),
    (FREQUENCY, "10 to 40 Hz in 3 geometric", [10.0, 20.0, 40.0]),
    (FREQUENCY, "10 до 40 Гц, 3 значення геометрично", [10.0, 20.0, 40.0]),
    (AMPLITUDE, "1 to 2 in in 2", [0.0254, 0.0508]),
    (AMPLITUDE, "1.5mm", [0.0015]),
    (AMPLITUDE, "2 mm; 3 mm", [0.002, 0.003]),
    (AMPLITUDE, "1/2; 3/4 in", [0.0127, 0.01905]),
    (AMPLITUDE, "1e-3 m", [0.001]),
]
#: What is typed as one quantity, and the SI value that it means.
ALONE: Final = [
    ("/base/shaft/load", "0,3 Нм", 0.3),
    ("/base/shaft/load", "0,3 Н·м", 0.3),
    ("/base/shaft/load", "1 500 N*mm", 1.5),
    ("/base/excitation/amplitude_x", "1,5 мм", 0.0015),
    ("/base/excitation/amplitude_x", "2,5·10⁻³ m", 0.0025),
    ("/base/excitation/phase", "90°", 1.5707963267948966),
    ("/base/excitation/phase", "−90 град", -1.5707963267948966),
    ("/base/excitation/phase", "–90 deg", -1.5707963267948966),
]
#: What is typed, and what is asked.
ASKED: Final = [
    (LOAD, "0.1 0.2 0.3", SEVERAL),
    (LOAD, "0.1 0.2 0.3 N*m", SEVERAL),
    (LOAD, "0,1 0,2 0,3 Нм", SEVERAL),
    (LOAD, "0,1,0,2", SEVERAL),
    (LOAD, "0.1,0.2,0.3 N*m", SEVERAL),
    (LOAD, "0:0.1:0.4", SEVERAL),
    (LOAD, "0.1 and 0.2 N*m", SEVERAL),
    (LOAD, "0.1 / 0.2 / 0.3 N*m", SEVERAL),
    (LOAD, "0.3 ± 0.1 N*m", SEVERAL),
    (LOAD, "0..0.4 N*m", HOW_MANY),
    (LOAD, "0.1–0.4 N*m", HOW_MANY),
    (LOAD, "від 0 до 0,4 Нм", HOW_MANY),
    (LOAD, "10 %", "not a unit of this field"),
    (FREQUENCY, "20-35 Hz", HOW_MANY),
    (FREQUENCY, "20 to 35 Hz in 3 steps", SEVERAL),
    (FREQUENCY, "20 to 35 Hz refined", "is refined between two ends"),
    (FREQUENCY, "1,200 to 1,500 rpm in 4", "decimal or separate thousands"),
    (FREQUENCY, "20,25 Hz", SEVERAL),
    (FREQUENCY, "25 30 Hz", SEVERAL),
    (FREQUENCY, "1 200; 1 500 об/хв", SEVERAL),
    (FREQUENCY, "1,200; 1,500 rpm", "decimal or separate thousands"),
    (AMPLITUDE, "2mm 3mm", SEVERAL),
    (AMPLITUDE, "90°", "not a unit of this field"),
    (AMPLITUDE, "1.5; 2", "needs its unit"),
    (AMPLITUDE, "2 grad", "deg or gon"),
]


def _read(path: str, text: str, *, listed: bool) -> list[float]:
    """The values of an axis, typed as one text, or as a form gives it: a list of what stands between separators."""
    values = [part.strip() for part in text.replace(", ", ";").split(";")] if listed else text
    return parse_spec(changed({"/axes": [{"path": path, "values": values}]})).study.axes[0].array.tolist()


def test_there_are_sixty_of_them() -> None:
    assert len(MEANT) + len(ALONE) + len(ASKED) >= 60


@pytest.mark.parametrize(("path", "text", "wanted"), MEANT, ids=[text for _, text, _ in MEANT])
def test_it_means_what_people_mean(path: str, text: str, wanted: list[float]) -> None:
    assert _read(path, text, listed=False) == pytest.approx(wanted, rel=1e-15, abs=0.0)


@pytest.mark.parametrize(("pointer", "text", "wanted"), ALONE, ids=[text for _, text, _ in ALONE])
def test_one_quantity_means_what_people_mean(pointer: str, text: str, wanted: float) -> None:
    path = pointer.removeprefix("/base/").replace("/", ".")
    assert parse_spec(changed({pointer: text})).study.base[path] == wanted


@pytest.mark.parametrize("text", ["20 – 35 Hz; 4 points", "20–35 Гц, 4 значення", "20-35 Hz step 5"])
def test_a_form_that_splits_at_commas_says_the_same(text: str) -> None:
    assert _read(FREQUENCY, text, listed=True) == [20.0, 25.0, 30.0, 35.0]


@pytest.mark.parametrize(("path", "text", "question"), ASKED, ids=[text for _, text, _ in ASKED])
def test_it_is_refused_with_a_question(path: str, text: str, question: str) -> None:
    with pytest.raises(SpecError) as caught:
        _read(path, text, listed=False)
    assert question in " ".join(str(message(fault)) for fault in caught.value.faults)
