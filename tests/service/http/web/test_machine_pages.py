"""Pages of studies of a machine shaft, with its own results: rows, charts, and what it cannot be asked."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Final

import pytest

from sprag_study.service.http.web.sheet.machine import machine_of
from sprag_study.service.reading.reader import Choice
from sprag_study.service.views.library import reading_of
from tests.service.http.web.test_accessibility import preset
from tests.service.rounds import computed
from tests.service.spec.machine.test_shaft import PRESS

if TYPE_CHECKING:
    from tests.service.conftest import Service

HTML: Final = {"Accept": "text/html"}


@pytest.fixture
def chunk_cases() -> int:
    """All cases at once."""
    return 200


@pytest.fixture
def press(service: Service) -> str:
    return computed(service, PRESS)


def page(service: Service, address: str, status: int = 200) -> str:
    answer = service.http.get(address, headers=HTML)
    assert answer.status_code == status, answer.text
    return answer.text


def test_cases_over_one_cycle_cannot_be_run_longer(service: Service, press: str) -> None:
    assert "rows/longer" not in page(service, f"/studies/{press}/rows")
    answer = service.http.post(f"/studies/{press}/rows/longer", data={"case": ["3", "5"]}, headers=HTML)
    assert answer.status_code == 409
    assert "over one cycle" in answer.text
    answer = service.http.post(f"/api/v1/studies/{press}:longer")
    assert answer.status_code == 409
    assert "over one cycle" in answer.json()["detail"]


def test_rows_begin_with_the_evenest_machine(service: Service, press: str) -> None:
    text = page(service, f"/studies/{press}/rows?show=irregularity")
    rows = [float(value) for value in re.findall(r'<td class="num goal">([\d.]+)</td>', text)]
    assert len(rows) == 25
    assert rows == sorted(rows)
    assert "wanted: 0.1<" in text
    assert 'class="wanted"' in page(service, f"/studies/{press}/rows")


def test_rows_lead_beyond_their_page(service: Service, press: str) -> None:
    text = page(service, f"/studies/{press}/rows")
    last = re.findall(r'<tr data-case="(\d+)"', text)[-1]
    text = page(service, f"/studies/{press}/rows?row={last}")
    assert "No. 25 of 52" in text
    after = re.search(r'href="(\?[^"]*)" rel="next">next', text)
    assert after is not None
    text = page(service, f"/studies/{press}/rows{after[1].replace('&amp;', '&')}")
    assert "No. 26 of 52" in text
    before = re.search(r'href="(\?[^"]*)" rel="prev">‹', text)
    assert before is not None
    assert f"row={last}" in before[1]
    assert "skip" not in before[1]
    assert f'data-row="{last}"' in text


def test_numbers_of_an_axis_differ(service: Service, press: str) -> None:
    text = page(service, f"/studies/{press}/rows?show=irregularity&show=omega.angle_at_min")
    axis = text[text.index('data-name="omega.angle_at_min"') :]
    numbers = re.findall(r'class="end">([^<]+)<', axis[: axis.index("</g>")])
    assert len(set(numbers)) == 3


def test_a_result_without_numbers_has_no_chart(service: Service) -> None:
    study_id = computed(service, preset("slotter"))
    text = page(service, f"/studies/{study_id}")
    assert 'value="energy.fluctuation" checked' in text
    assert 'name="lower" value="required_inertia"' not in text


def test_curves_that_are_not_drawn_can_be(service: Service) -> None:
    study_id = computed(service, preset("compressor"))
    text = page(service, f"/studies/{study_id}")
    assert "All 9 curves (6 are drawn)" in text
    every = page(service, f"/studies/{study_id}?every=1")
    select = every[every.index('<select name="curve">') :]
    assert select[: select.index("</select>")].count("<option") == 9


def test_the_legend_looks_as_the_curves_do(service: Service, press: str) -> None:
    text = page(service, f"/studies/{press}")
    chart = text[text.index('<figure id="chart"') :]
    chart = chart[: chart.index("</figure>")]
    assert "var(--ink)" in chart
    assert "var(--series-" not in chart


def test_an_interval_whose_ends_read_the_same_is_one_number(service: Service, press: str) -> None:
    numbers = re.findall(r'<dd class="value">([^<]+)', page(service, f"/studies/{press}?point=17"))
    assert "41.9 " in numbers
    assert [text for text in numbers if " to " in text] == ["0.209 to 0.263", "1250 to 1571 "]


def test_a_report_says_how_many_points_have_a_row(service: Service, press: str) -> None:
    assert "Mean speed = 120 rpm; 10 of 13 points" in page(service, f"/studies/{press}/document")


def test_the_drawing_of_a_best_design_has_its_operating_points(service: Service) -> None:
    spec = preset("least_flywheel")
    study_id = service.submit(spec)
    study, reading = service.store.studies.study(study_id), reading_of(service.store, study_id, Choice("workshop"))
    drawn = machine_of(study, service.store.studies.spec(study_id), reading, {"drive.inertia": 57.0}, "/new?clone=it")
    values = {caption: value for caption, value, _ in drawn.others}
    assert values == {"Inertia of the drive": "57 kg·m²", "Mean speed": "100…140 rpm"}


def test_parts_that_are_alike_have_their_values_once(service: Service) -> None:
    spec = preset("four_cylinder_engine")
    spec["base"]["parts"][2]["mechanism"]["slider_crank"]["crank"] = "35 mm"
    study_id = service.submit(spec)
    study, reading = service.store.studies.study(study_id), reading_of(service.store, study_id, Choice("workshop"))
    drawn = machine_of(study, service.store.studies.spec(study_id), reading, {}, "/new?clone=it").drawings
    values = [re.findall(r"= ?</tspan>([^<]+)|</tspan>([0-9][^<]*)", drawing) for drawing in drawn]
    assert [drawing.partition("</svg>")[2] for drawing in drawn] == [
        "", *(f'<p class="soft">{text}</p>' for text in (
            "Part 2, like part 1", "Part 3, otherwise like part 1", "Part 4, like part 1"
        )),
    ]  # fmt: skip
    assert [len(each) for each in values] == [7, 0, 1, 0]


def test_a_name_that_ends_with_a_number_is_apart_from_its_value(service: Service) -> None:
    study_id = computed(service, preset("slotter"))
    assert "Curve: resistance in step 1 = 4000 N" in page(service, f"/studies/{study_id}")


def test_the_form_speaks_of_steps_and_of_means_in_words(service: Service) -> None:
    text = page(service, "/new?preset=slotter")
    assert "Mean speed means" in text
    assert "middle of largest and smallest" in text
    assert "Resistance in step 1" in text
    assert "Steps 0" not in text
    assert "quick return (whitworth)" in text.lower()


def test_a_case_has_no_code_names_in_its_results_and_its_motion(service: Service, press: str) -> None:
    text = page(service, f"/studies/{press}/cases/30")
    for name in ("omega_0", "/omega.", "T = T_mean", "T_0", "φ_c"):
        assert name not in text
    motion = service.http.get(f"/studies/{press}/cases/30/motion.svg").text
    assert {"Tₘₑₐₙ", "Tₘᵢₙ", "T₀"} <= set(re.findall(r">([^<>]+)</text>", motion))
    assert "difference of largest and smallest speed over half their sum" in text
