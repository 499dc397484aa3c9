"""Pages and figures: no code name where a caption should stand, and the units that were chosen."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.worker import models
from tests.service.figures.seen import seen as picture_of

if TYPE_CHECKING:
    from tests.service.conftest import Service

#: What people read of a page: without the spec itself, code, scripts and attributes.
_HIDDEN = re.compile(r"<(pre|code|style|script|title)\b.*?</\1>|<[^>]*>|Name in specs.*?</table>", re.DOTALL)
_PARTS = ("", "?x=excitation.frequency", "?z=efficiency", "/rows", "/rows?plot=points", "/cases/0")
_PICTURES = ("curves?x=shaft.load&y=shaft.speed.mean&y=torque.mean&by=excitation.frequency&", "answers?")


def names_of(service: Service, study_id: str) -> set[str]:
    """Code names that nobody should have to read."""
    study = service.store.studies.study(study_id)
    every = {info.name for info in models.study_results(study)} | {*study.base, *study.axis_paths}
    return {name for name in every if "." in name}


@pytest.fixture
def study_id(service: Service, spec: dict[str, Any]) -> str:
    made = service.submit(spec)
    service.fill(made)
    return made


def test_no_code_name_stands_where_a_caption_should(service: Service, study_id: str) -> None:
    names = names_of(service, study_id)
    assert len(names) > 40
    for part in _PARTS:
        page = service.http.get(f"/studies/{study_id}{part}")
        assert page.status_code == 200, part
        seen = _HIDDEN.sub(" ", page.text)
        assert sorted(name for name in names if re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", seen)) == [], part
    for address in _PICTURES:
        figure = service.http.get(f"/api/v1/studies/{study_id}/{address}format=svg").text
        assert "<svg" in figure
        assert sorted(name for name in names if name in figure) == [], address


def test_a_comparison_is_read_as_its_first_study(service: Service, study_id: str) -> None:
    other = service.submit()
    service.fill(other)
    names = names_of(service, study_id)
    query = f"study={study_id}&study={other}&units=torque%3DN*mm"
    seen = _HIDDEN.sub(" ", service.http.get(f"/compare?{query}").text)
    assert "Load torque (N·mm)" in seen
    assert sorted(name for name in names if name in seen) == []
    figure = picture_of(service.http.get(f"/compare?{query}").text)
    assert figure.has("Load torque (N·mm)")
    most = 1e3 * max(service.store.studies.study(study_id).columns(range(9))["shaft.load"])
    assert figure.panels[0].curves[0].values[:, 0].max() == pytest.approx(most, rel=1e-3)
    picture = service.http.get(f"/compare/picture.svg?{query}")
    assert (picture.status_code, picture.headers["content-type"]) == (200, "image/svg+xml")


def test_code_names_are_shown_on_request(service: Service, study_id: str) -> None:
    seen = _HIDDEN.sub(" ", service.http.get(f"/studies/{study_id}?names=codes").text)
    assert "shaft.speed.mean" in seen
    assert "Mean shaft speed" not in seen


def test_units_are_chosen_once_and_kept(service: Service, study_id: str) -> None:
    form = {"rest": "si", "speed": "rpm", "torque": "N*mm", "names": "captions", "back": f"/studies/{study_id}/cases"}
    answer = service.http.post("/me", data=form, follow_redirects=False)
    assert (answer.status_code, answer.headers["location"]) == (303, f"/studies/{study_id}/cases")
    row = service.store.rows.case(study_id, 0)
    assert row is not None
    speed = row.results["shaft.speed.mean"]
    assert isinstance(speed, float)
    shown = service.http.get(f"/api/v1/studies/{study_id}/cases/0").json()["results"]["shaft.speed.mean"]
    assert shown == speed  # the interface stays in SI
    curves = {"x": "shaft.load", "y": "shaft.speed.mean", "by": "excitation.frequency"}
    table = service.http.get(f"/api/v1/studies/{study_id}/curves", params={**curves, "format": "csv", "units": "rpm"})
    head, first = table.text.splitlines()[:2]
    cell = dict(zip(head.split(","), first.split(","), strict=True))["shaft.speed.mean [rpm]"]
    assert float(cell) == pytest.approx(speed * 30.0 / math.pi, rel=1e-12)
    page = service.http.get(f"/studies/{study_id}").text
    assert 'Mean shaft speed <span class="soft">rpm</span>' in page
    assert re.search(r'href="[^"]*/curves\?[^"]*speed%3Drpm[^"]*format=csv"', page)  # its files are in the same units
    chart = page.partition('<figure id="chart"')[2].partition("</figure>")[0]
    assert ">Mean shaft speed (rpm)<" in chart
    assert ">Load torque (N·mm)<" in chart


def test_what_is_chosen_on_a_page_leads_back_to_a_page(service: Service) -> None:
    answered = service.http.post("/parts", data={"kind": "belt"}).text  # the address may have no page of its own
    assert 'href="/me"' in answered
    assert 'name="back" value="/"' in answered
    assert 'href="/me"' in service.http.get("/").text
    for length, back in ((3000, f"/compare?x={'a' * 3000}"), (5000, "/")):
        page = service.http.get("/me", params={"back": f"/compare?x={'a' * length}"})
        assert page.status_code == 200
        assert f'name="back" value="{back}"' in page.text


def test_units_that_are_not_known_are_refused(service: Service, study_id: str) -> None:
    for address in (f"/studies/{study_id}?units=furlong", f"/api/v1/studies/{study_id}/curves?units=furlong"):
        assert service.http.get(address).status_code == 422


def test_a_value_of_an_axis_with_many_is_typed_in_the_unit_beside_it(service: Service, spec: dict[str, Any]) -> None:
    spec["axes"] = [
        {"path": "excitation.frequency", "values": [20, 25]},
        {"path": "pendulums.0.mass", "values": [0.4, 0.5]},
        {"path": "shaft.load", "linspace": [0, 0.5, 201]},
    ]
    study_id = service.submit(spec)
    over = "x=excitation.frequency&units=torque%3DN*mm&at%3Apendulums.0.mass=0.5&at%3Ashaft.load="
    for chart in ("", "&z=efficiency"):
        for typed in ("105", "0.105 N*m"):
            answer = service.http.get(f"/studies/{study_id}?{over}{typed}{chart}")
            assert answer.status_code == 200, chart
            field = re.search(r'<input name="at:shaft\.load" value="([^"]*)"', answer.text)
            assert field is not None, chart
            assert field[1] == "105", chart
        refused = service.http.get(f"/studies/{study_id}?{over}0.105{chart}")
        assert (refused.status_code, "the axis has no such value" in refused.text) == (422, True), chart
    service.fill(study_id)
    assert "Load torque = 105 N·mm" in service.http.get(f"/studies/{study_id}?{over}105").text


def test_a_bare_number_is_in_the_unit_beside_it(service: Service, study_id: str) -> None:
    page = service.http.get(f"/studies/{study_id}?units=torque%3DN*mm&point=100").text
    assert "100 N·mm" in page or "100 N*mm" in page
    rows = service.http.get(f"/studies/{study_id}/rows?units=torque%3DN*mm&max%3Ashaft.load=150").text
    stated = re.search(r"<b role=\"status\">(\d+) of (\d+)", rows)
    assert stated
    answer = service.get(f"/studies/{study_id}/explore", where="shaft.load <= 0.15")
    assert [int(number) for number in stated.groups()] == [answer["selected"], answer["known"]]
    assert 0 < answer["selected"] < answer["known"]
