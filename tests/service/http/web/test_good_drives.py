"""The page of a batch: one figure, what its spread comes from, its worst drives, and the fields of its conditions."""

from __future__ import annotations

import html
import json
import re
from typing import TYPE_CHECKING, Any

import pytest
from starlette.datastructures import QueryParams

from sprag_study.service.http.web.good_drives import condition_rows, condition_texts, has_rows
from sprag_study.service.presets import preset_text
from sprag_study.service.reading.quantities import Units
from sprag_study.service.reading.reader import Reading
from sprag_study.service.spec.document import format_of, load_spec, parse_spec
from tests.service.rounds import computed

if TYPE_CHECKING:
    from tests.service.conftest import Service

BATCH: dict[str, Any] = {**json.loads(preset_text("tolerances")[1]), "drives": 40}
PRESS: dict[str, Any] = {
    **{key: value for key, value in load_spec(preset_text("press")[1], format_of(preset_text("press")[0])).items()
       if key != "axes"},
    "axes": [{"path": "mean_speed", "values": ["90 rpm", "120 rpm"]}],
    "tolerances": [
        {"path": "drive.inertia", "plus_minus": "10 %"},
        {"path": "mechanism.slider_crank.ram_mass", "plus_minus": "5 %"},
    ],
    "drives": 100,
}  # fmt: skip


@pytest.fixture
def chunk_cases() -> int:
    """Cases to a chunk."""
    return 100


def page_of(service: Service, study_id: str, **asked: str | list[str]) -> str:
    """The text of the page, as people read it."""
    answer = service.http.get(f"/studies/{study_id}/matters", params={"ask": "tolerances", **asked})
    assert answer.status_code == 200
    return html.unescape(answer.text)


def table_of(page: str, title: str) -> list[list[str]]:
    """The cells of the rows of a table."""
    body = page.partition(f"<caption>{title}</caption>")[2].partition("<tbody>")[2].partition("</tbody>")[0]
    rows = [re.findall(r"<td[^>]*>(.*?)</td>", row) for row in body.split("</tr>")]
    return [[re.sub("<[^>]+>", "", cell) for cell in row] for row in rows if row]


def test_one_figure_has_the_spread_and_the_yield(service: Service) -> None:
    study_id = service.submit(BATCH)
    service.fill(study_id)
    page = page_of(service, study_id)
    main = page.partition("<main")[2].partition("</main>")[0]
    assert main.count("<figure>") == 1
    assert "Yield, with its 95 % interval (%)" in main.partition("<figure>")[2].partition("</figure>")[0]
    assert 'class="figure double"' in main, "as wide as the column"
    assert main.index("Yield</dt>") < main.index("<figure>") < main.index('class="tables"')
    assert main.count(' class="screen downloads"') == 1
    assert len(re.findall(r'href="[^"]*format=(?:csv|json|svg|png|pdf)[^"]*" download', main)) == 12


def test_the_spread_comes_from_the_inertia_of_a_press(service: Service) -> None:
    """The irregularity of a stiff machine falls with its inertia, and hardly depends on the mass of its ram."""
    study_id = computed(service, PRESS)
    page = page_of(service, study_id, condition="irregularity <= 101 % of nominal")
    rows = table_of(page, "Where the spread of irregularity comes from")
    assert [row[0] for row in rows] == ["Inertia of the drive", "Mass of the ram", "Several together"]
    assert float(rows[0][1]) > 90.0
    whole = re.search(r"([\d.]+) % of 100 drives \(95 % interval", page)
    assert whole is not None
    assert float(rows[0][3]) > float(whole[1]), "of the half near the nominal inertia more are good"
    study = service.store.studies.study(study_id)
    assert study.spread is not None
    draws, names = study.spread.array, study.spread.names
    worst = table_of(page, "Drives with the least margin")
    assert len(worst) == 5
    for drive, *_place, value, cause in worst:
        change = 100.0 * (draws[int(drive) - 1, names.index("drive.inertia")] - 1.0)
        assert change < 0.0
        assert cause == f"Inertia of the drive: {-change:.3g} % less"
        assert float(value) > 0.0
    full = table_of(page, "Worst drives, each where it is worst; of tolerances the deviation from nominal")
    assert [row[0] for row in full[:5]] == [row[0] for row in worst]


def test_the_yield_above_is_that_of_the_conditions(service: Service) -> None:
    study_id = computed(service, PRESS)
    fact = r"Yield</dt><dd class=\"value\">([\d.]+).*?<dd>(.*?)</dd>"
    usual = re.search(fact, page_of(service, study_id), re.DOTALL)
    assert usual is not None
    assert usual[2] == "irregularity ≤ 110 % of nominal, at 120 rpm"
    asked = re.search(fact, page_of(service, study_id, condition="irregularity <= 0.1"), re.DOTALL)
    assert asked is not None
    assert (asked[1], asked[2]) == ("0", "irregularity ≤ 0.1, at 120 rpm")


def test_conditions_are_typed_as_fields_and_kept_as_texts(service: Service) -> None:
    study_id = service.submit(BATCH)
    service.fill(study_id)
    own = f"/studies/{study_id}/matters"
    rows = [("of", "shaft.speed.mean"), ("is", ">="), ("value", "200"), ("part", "")]
    rows += [("of", "efficiency"), ("is", ">="), ("value", "95 %"), ("part", "nominal")]
    rows += [("of", ""), ("is", ">="), ("value", ""), ("part", "nominal")]
    query = [("ask", "tolerances"), ("units", "rpm"), ("condition", "no condition"), *rows]
    sent = service.http.get(own, params=query, follow_redirects=False)
    assert sent.status_code == 303
    asked = QueryParams(sent.headers["location"].partition("?")[2])
    texts = ["shaft.speed.mean >= 200 rpm", "efficiency >= 95 % of nominal"]
    assert asked.getlist("condition") == ["no condition", *texts]
    assert asked["ask"] == "tolerances"
    assert not {"of", "is", "value", "part"} & set(asked)
    page = html.unescape(service.http.get(own, params={"ask": "tolerances", "condition": texts}).text)
    fields = page.partition('<fieldset class="good">')[2].partition("</fieldset>")[0]
    assert re.findall(r'<option value="([\w.]+)" selected>([^<]*)', fields) == [
        ("shaft.speed.mean", "Mean shaft speed"), ("efficiency", "Efficiency"), ("nominal", "% of the nominal drive"),
        ("nominal", "% of the nominal drive"),
    ]  # fmt: skip
    assert re.findall(r'name="value" value="([^"]*)"', fields) == ["200 rpm", "95", ""]
    assert "half width" not in fields
    refused = service.http.get(own, params={"ask": "tolerances", "condition": "no condition"})
    assert refused.status_code == 422
    assert 'name="condition" value="no condition"' in refused.text
    assert '<svg class="figure ' in refused.text, "the spread is there all the same"


def test_fields_of_conditions_go_there_and_back() -> None:
    study = parse_spec(BATCH).study
    reading = Reading("vibration-drive", Units({"rad/s": "rpm"}))
    texts = ["shaft.speed.mean >= 20 rad/s", "regime = periodic", "shaft.speed.max <= 110 % of nominal"]
    rows, others = condition_rows(["\n".join([*texts, "speed > 3"])], study)
    assert others == ["speed > 3"]
    pairs = [(name, value) for row in rows for name, value in
             (("of", row.of), ("is", row.relation), ("value", row.value), ("part", row.part))]  # fmt: skip
    assert condition_texts(QueryParams(pairs), study, reading) == texts
    (bare, _empty), _ = condition_rows(["shaft.speed.mean >= 20"], study)
    assert bare.value == "20 rad/s", "texts are in SI, fields in the shown units"
    assert not has_rows(QueryParams("condition=x"))
    taken_away = QueryParams([("of", "efficiency"), ("is", ">="), ("value", " "), ("part", "")])
    assert condition_texts(taken_away, study, reading) == []


def test_panels_of_one_result_can_be_compared(service: Service) -> None:
    axes = [{"path": "shaft.load", "values": [0.05, 0.1, 0.2]}, {"path": "shaft.inertia", "values": [0.002, 0.00201]}]
    spec = {key: value for key, value in BATCH.items() if key not in ("tolerances", "drives", "seed", "axes")}
    study_id = computed(service, {**spec, "axes": axes})
    page = service.http.get(f"/studies/{study_id}/matters?y=shaft.speed.mean").text
    picture = page.partition('class="figure double"')[2].partition("</svg>")[0]
    numbers = [text for text in re.findall(r">(\d+)</text>", picture) if float(text) > 50.0]  # rpm, not kg·cm²
    assert len(set(numbers)) > 2
    assert {numbers.count(text) for text in numbers} == {2}
