"""A search with further generations: one action, whose study has all designs of the one before."""

from __future__ import annotations

import numpy as np

from sprag_study.worker.rounds import Rounds
from tests.service.conftest import API, Service
from tests.service.rounds import run_round
from tests.service.searching import rows_of, search

ONE = {"best": [{"result": "efficiency", "max": True}], "subject_to": [{"result": "shaft.speed.mean", "at_most": 8}]}


def _run(service: Service, study_id: str) -> None:
    store = service.store
    number, epoch, planner = store.studies.get(study_id).number, store.work.take_over("test"), Rounds(store.work)
    while planner.advance(epoch, number, store.studies.study(study_id)) is not None:
        run_round(store, number, epoch, rows_of)


def _points(service: Service, study_id: str) -> set[bytes]:
    study = service.store.studies.study(study_id)
    return {row.tobytes() for row in study.points(range(study.cases))}


def test_a_longer_search_has_the_designs_of_the_shorter_one(service: Service) -> None:
    study_id = search(service, **ONE, generations=4, polish=False)
    answer = service.http.post(f"{API}/studies/{study_id}:extend", json={"generations": 3})
    assert answer.status_code == 202
    longer = answer.json()["id"]
    assert longer != study_id
    spec = service.get(f"/studies/{longer}")["spec"]
    assert (spec["goal"]["generations"], spec["name"]) == (7, "search, extended")
    assert "least_gain" not in spec["goal"], "it may still end by itself"
    run_round(service.store, service.store.studies.get(longer).number, service.store.work.take_over("test"), rows_of)
    _run(service, longer)
    before, after = _points(service, study_id), _points(service, longer)
    assert before < after
    assert len(after) == 2 * 8 * 7


def test_a_search_that_ended_by_itself_goes_on_from_there(service: Service) -> None:
    study_id = search(service, **ONE, generations=500, least_gain="50 %", polish=False)
    reached = service.store.studies.rounds(study_id)[-1].summary["generation"]
    assert reached < 500
    service.http.post(f"{API}/studies/{study_id}:cancel")
    service.store.work.settle(service.store.work.take_over("test"), service.store.studies.get(study_id).number)
    assert service.store.studies.get(study_id).over
    longer = service.http.post(f"{API}/studies/{study_id}:extend", json={"generations": 40}).json()["id"]
    goal = service.get(f"/studies/{longer}")["spec"]["goal"]
    assert (goal["generations"], goal["least_gain"]) == (reached + 40, 0)


def test_a_search_that_still_runs_goes_on_beyond_its_last_generation(service: Service) -> None:
    study_id = search(service, 2, **ONE, generations=60)
    assert not service.store.studies.get(study_id).over
    longer = service.http.post(f"{API}/studies/{study_id}:extend", json={"generations": 3}).json()["id"]
    goal = service.get(f"/studies/{longer}")["spec"]["goal"]
    assert goal["generations"] == 63
    assert "least_gain" not in goal


def test_the_page_has_the_action(service: Service) -> None:
    study_id = search(service, **ONE, generations=2)
    assert 'name="generations"' in service.http.get(f"/studies/{study_id}").text
    answer = service.http.post(f"/studies/{study_id}/extend", data={"generations": "5"}, follow_redirects=False)
    assert answer.status_code == 303
    longer = answer.headers["location"].removeprefix("/studies/")
    assert service.get(f"/studies/{longer}")["spec"]["goal"]["generations"] == 7
    wrong = service.http.post(f"/studies/{study_id}/extend", data={"generations": "0"})
    assert wrong.status_code == 422
    assert 'aria-describedby="wrong:generations" aria-invalid="true"' in wrong.text


def test_what_is_wrong_is_named(service: Service) -> None:
    study_id, grid = search(service, **ONE, generations=2), service.submit()
    for study, addition, pointer, code in (
        (study_id, {"generations": 0}, "/generations", "out-of-range"),
        (study_id, {"generations": 10_000}, "/generations", "out-of-range"),
        (study_id, {"generations": "many"}, "/generations", "wrong-type"),
        (study_id, {"generations": 3, "axes": []}, "", "exactly-one"),
        (grid, {"generations": 3}, "/generations", "conflict"),
    ):
        answer = service.http.post(f"{API}/studies/{study}:extend", json=addition)
        assert answer.status_code == 422, addition
        faults = [(fault["pointer"], fault["code"]) for fault in answer.json()["errors"]]
        assert (pointer, code) in faults, (addition, faults)


def test_the_page_names_the_limits_that_bind_and_derivatives_are_no_designs(service: Service) -> None:
    study_id = search(service, **ONE, generations=4)
    page = service.http.get(f"/studies/{study_id}").text
    assert "At the limit" in page or "No limit binds" in page
    rounds = service.store.studies.rounds(study_id)
    aside = [record for record in rounds if record.summary.get("derivatives")]
    listed = {design["design"] for design in service.get(f"/studies/{study_id}/front")["designs"]}
    hidden = {case // 2 for record in aside for case in record.cases}
    assert hidden
    assert not listed & hidden
    assert np.isfinite(rounds[-1].summary["best"][0])
