"""The page of the designs of a search: figures, table, and the way from a design to a study of its own."""

from __future__ import annotations

import pickle
import re
from typing import Any
from xml.etree import ElementTree

import pytest

from sprag.service.http.web.front_view import front_view
from sprag.service.results.fronts import Designs, designs_of
from sprag.service.spec.design import design_spec
from sprag.service.spec.document import parse_spec
from tests.service.conftest import API, Service
from tests.service.rounds import run_round
from tests.service.searching import rows_of, search


def test_the_page_shows_the_best_designs_with_their_links(service: Service) -> None:
    study_id = search(service)
    overview = service.http.get(f"/studies/{study_id}").text
    assert f'data-figure="/studies/{study_id}/figures/front?units=workshop"' in overview
    assert f'href="/studies/{study_id}/front"' in overview
    answer = service.http.get(f"/studies/{study_id}/front")
    assert answer.status_code == 200
    found = service.get(f"/studies/{study_id}/front")
    assert re.findall(r'data-design="(\d+)"', answer.text) == [str(item["design"]) for item in found["designs"][:100]]
    first = found["designs"][0]["cases"][0]
    for link in (f"/studies/{study_id}/cases/{first}", f"/new?clone={study_id}&amp;case={first}&amp;along=shaft.load"):
        assert f'href="{link}"' in answer.text
    assert (
        f'<img src="{API}/studies/{study_id}/front?x=efficiency&amp;y=shaft.irregularity&amp;units=workshop&amp;'
        'format=svg"' in answer.text
    )
    for path in (f"{API}/studies/{study_id}/front?format=svg", f"/studies/{study_id}/front/search.svg"):
        assert ElementTree.fromstring(service.http.get(path).text).tag.endswith("svg")


def points(figure: dict[str, Any]) -> dict[str, list[int]]:
    """The first cases of the drawn designs by their kind."""
    return {trace["name"]: sorted(trace["customdata"]) for trace in figure["data"]}


def test_the_scatter_has_every_design_that_has_not_failed(service: Service) -> None:
    study_id = search(service)
    figure = service.http.get(f"/studies/{study_id}/figures/front").json()
    designs = service.get(f"/studies/{study_id}/front")["designs"]
    shown = points(figure)
    assert shown["front"] == sorted(item["cases"][0] for item in designs if item["feasible"] and item["rank"] == 0)
    assert len(shown["front"]) + len(shown["feasible"]) == sum(item["feasible"] for item in designs)
    assert (figure["layout"]["dragmode"], figure["cases"]) == ("select", True)
    assert all(trace["mode"] == "markers" for trace in figure["data"])
    other = service.http.get(f"/studies/{study_id}/figures/front?x=excitation.frequency&y=shaft.speed.mean").json()
    assert other["layout"]["xaxis"]["title"]["text"] == "Excitation frequency (Hz)"
    progress = service.http.get(f"/studies/{study_id}/figures/search").json()
    history = service.get(f"/studies/{study_id}/front")["history"]
    assert progress["data"][0]["x"] == [1.0, 2.0]
    assert progress["data"][0]["y"][-1] == history[-1]["best"][0]


def test_designs_that_serve_the_derivatives_of_the_polish_are_not_listed(service: Service) -> None:
    study_id = search(service)
    first = next(one for one in service.store.studies.rounds(study_id) if one.summary.get("phase") == "polish")
    answer = service.get(f"/studies/{study_id}/front")
    cases = {case for item in answer["designs"] for case in item["cases"]}
    assert len(first.cases) > 0
    assert cases | set(first.cases) == set(range(service.store.studies.get(study_id).cases))
    assert not cases & set(first.cases)
    assert answer["counts"]["known"] == len(answer["designs"])


def test_what_no_generation_has_is_not_drawn(service: Service) -> None:
    study_id = search(service, subject_to=[{"result": "shaft.speed.mean", "at_least": "1e6 rad/s"}])
    progress = service.http.get(f"/studies/{study_id}/figures/search").json()
    assert [(trace["name"], set(trace["y"])) for trace in progress["data"]] == [("feasible designs", {0.0})]


def test_what_is_drawn_must_be_a_quantity_of_a_design(service: Service) -> None:
    study_id = search(service, rounds=1, best=[{"result": "efficiency", "max": True}])
    page = service.http.get(f"/studies/{study_id}/front?x=mass")
    assert page.status_code == 422
    assert "is not a goal, a variable or a numeric limit" in page.text
    figure = service.http.get(f"/studies/{study_id}/figures/front").json()
    assert figure["layout"]["xaxis"]["title"]["text"] == "Design"
    refused = service.http.get(f"{API}/studies/{study_id}/front?format=png&y=mass")
    assert (refused.status_code, refused.json()["errors"][0]["parameter"]) == (422, "y")


def test_a_search_without_any_result_has_a_page_and_other_studies_have_none(service: Service) -> None:
    study_id = search(service, rounds=0)
    text = service.http.get(f"/studies/{study_id}/front").text
    assert "No design has its results yet." in text
    assert (
        "Waiting for round 1 of at most 13. 0 designs: 0 within the limits, 0 on the front, 8 still to be run." in text
    )
    service.store.studies.cancel(study_id)
    service.store.work.settle(service.store.work.take_over("test"), service.store.studies.get(study_id).number)
    assert "8 not run." in service.http.get(f"/studies/{study_id}/front").text
    none = search(service, subject_to=[{"result": "shaft.speed.mean", "at_least": 1e6}])
    assert "No design is within the limits;" in service.http.get(f"/studies/{none}/front").text
    assert service.http.get(f"/studies/{study_id}/figures/front").json()["note"]
    assert service.http.get(f"/studies/{study_id}/figures/search").json()["note"]
    other = service.submit()
    assert service.http.get(f"/studies/{other}/front").status_code == 422
    assert "Designs" not in service.http.get(f"/studies/{other}").text


def test_a_design_becomes_a_study_of_its_own(service: Service) -> None:
    study_id = search(service, rounds=1)
    study, spec = service.store.studies.study(study_id), service.store.studies.spec(study_id)
    alone = parse_spec(design_spec(spec, study, 5)).study
    assert (alone.cases, alone.plan) == (1, None)
    assert {path: alone.base[path] for path in study.axis_paths} == study.case_parameters(5)
    along = parse_spec(design_spec(spec, study, 5, "shaft.load")).study
    assert along.axes[0].values[0] == 0.0
    assert along.axes[0].values[-1] == 2.0 * study.case_parameters(5)["shaft.load"]
    stiff = parse_spec(design_spec(spec, study, 5, "shaft.inertia")).study  # 0 is not allowed
    assert 0.0 < stiff.axes[0].values[0] < 0.1 * stiff.axes[0].values[-1]
    form = service.http.get(f"/new?clone={study_id}&case=5&along=shaft.load").text
    inertia = study.case_parameters(5)["shaft.inertia"]
    assert f'name="/base/shaft/inertia" value="{inertia!r} kg*m^2"' in form
    assert 'value="search, design of case 5"' in form
    assert service.http.get(f"/new?clone={study_id}&case=99").status_code == 404


def test_designs_are_ranked_once_for_all_that_shows_them(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    ranked: list[bool] = []

    def rank(*args: Any, exact: bool) -> Designs:
        ranked.append(exact)
        return designs_of(*args, exact=exact)

    monkeypatch.setattr("sprag.service.views.kept.designs_of", rank)
    study_id = search(service, rounds=1)
    pages = [
        f"/studies/{study_id}{page}" for page in ("/front", "/figures/front", "/figures/search", "/front/search.svg")
    ]
    pages += [f"{API}{pages[0]}", f"{API}{pages[0]}?format=csv"]
    assert {service.http.get(page).status_code for page in pages} == {200}
    assert ranked == [False]
    before = service.http.get(pages[0]).text.count("data-design=")
    record = service.store.studies.get(study_id)
    run_round(service.store, record.number, service.store.work.take_over("test"), rows_of)
    assert service.http.get(pages[0]).text.count("data-design=") > before
    assert {service.http.get(f"{page}?exact=true").status_code for page in pages[:2]} == {200}
    assert ranked == [False, False, True]


def test_many_designs_are_ranked_by_another_process(service: Service, monkeypatch: pytest.MonkeyPatch) -> None:
    study_id = search(service)
    text = service.http.get(f"/studies/{study_id}/front").text
    service.checker.calls.clear()
    monkeypatch.setattr("sprag.service.views.study_view.FEW", 100)
    assert service.http.get(f"/studies/{study_id}/front").text == text
    assert [function.__name__ for function, *_ in service.checker.calls] == ["front_view"]
    assert pickle.loads(pickle.dumps(front_view(*service.checker.calls[0][1:]))).axes == (
        "efficiency",
        "shaft.irregularity",
    )
