"""Extending a study: the new one has all cases of the old one, which are not run again."""

from __future__ import annotations

import itertools
import tomllib
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service.presets import preset_text
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.spec.extend import parse_extended
from sprag_study.service.storage.part import SystemClock
from sprag_study.worker.dispatcher import Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.study import Study
from tests.service.spec_sample import parsed
from tests.service.storage.test_reuse import Engine

if TYPE_CHECKING:
    from tests.service.conftest import Service

API = "/api/v1"
GRID = {
    "/axes": [
        {"path": "excitation.frequency", "linspace": [16, 35, 3]},
        {"path": "shaft.load", "values": [0.02, 0.1]},
    ]
}


def cases(study: Study) -> list[tuple[tuple[str, float], ...]]:
    """Parameters of every case, what does not vary included."""
    return [tuple(sorted({**study.base, **values}.items())) for values in study.values_with(range(study.cases))]


def extend(changes: dict[str, Any], addition: Any) -> tuple[Study, Study]:
    old = parsed(changes)
    return old.study, parse_extended(old.spec, old.study, addition).study


def test_further_values_and_a_further_axis_make_a_larger_grid() -> None:
    old, new = extend(
        GRID,
        {
            "axes": [
                {"path": "shaft.load", "values": ["0.3 N*m", 0.1]},
                {"path": "pendulums.0.mass", "values": [0.6]},
            ],
            "name": "larger",
        },
    )
    assert (new.combine, new.shape, new.name) == ("grid", (3, 3, 2), "larger")
    assert [axis.values for axis in new.axes[1:]] == [(0.02, 0.1, 0.3), (0.5, 0.6)]
    assert set(cases(old)) < set(cases(new))


def test_a_machine_shaft_is_extended_by_any_of_its_numbers() -> None:
    old = parse_spec(tomllib.loads(preset_text("press")[1]))
    addition = {"axes": [{"path": "mechanism.slider_crank.ram_mass", "values": ["30 kg"]}]}
    new = parse_extended(old.spec, old.study, addition).study
    assert new.shape == (*old.study.shape, 2)
    assert new.axes[-1].values == (20.0, 30.0)


def test_an_extended_study_has_a_name_of_its_own() -> None:
    for addition in ({"axes": [{"path": "shaft.load", "values": [0.3]}]}, {"cases": [{"points": "shaft.load\n0.9\n"}]}):
        old, new = extend({**GRID, "/name": "feeder"}, addition)
        assert (old.name, new.name) == ("feeder", "feeder, extended")


def test_further_cases_come_after_those_there_are() -> None:
    addition = {"cases": [{"points": "excitation.frequency,shaft.load\n16,0.02\n17,0.9\n"}]}
    old, new = extend(GRID, addition)
    assert cases(new)[:6] == cases(old)
    assert [dict(case)["shaft.load"] for case in cases(new)[6:]] == [0.9]
    pair = [
        {"path": "shaft.load", "values": [0.1, 0.1, 0.2]},
        {"path": "excitation.frequency", "values": [20, 21, 21]},
    ]
    zipped = {"/combine": "zip", "/axes": pair}
    old, new = extend(zipped, addition)
    assert cases(new)[:3] == cases(old)
    assert new.cases == 5
    # And once more, of what came out.
    again = parse_extended({**parsed(zipped).spec}, new, {"cases": [{"path": "shaft.load", "values": [0.7]}]}).study
    assert cases(again)[:5] == cases(new)


@pytest.mark.parametrize(
    ("addition", "pointer", "code"),
    [
        ({}, "", "exactly-one"),
        ({"axes": [], "cases": []}, "", "exactly-one"),
        ({"axes": []}, "/axes", "wrong-type"),
        ({"axes": [{"path": "shaft.load", "values": [-1]}]}, "/axes/0/values/0", "out-of-range"),
        ({"axes": [{"path": "shaft.lode", "values": [1]}]}, "/axes/0/path", "invalid-path"),
        (
            {"axes": [{"path": ["excitation.frequency", "shaft.load"], "values": [1]}]},
            "/axes/0/path",
            "wrong-unit",
        ),
        ({"cases": [{"points": "shaft.load\n-1\n"}]}, "/cases/0/points", "out-of-range"),
        ({"extra": 1}, "/extra", "unknown-field"),
        ([], "", "wrong-type"),
    ],
)
def test_what_is_wrong_is_named(addition: Any, pointer: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        extend(GRID, addition)
    (problem,) = caught.value.faults
    assert (problem.where, problem.code) == (pointer, code)


def test_axes_side_by_side_take_cases_only() -> None:
    zipped = {"/combine": "zip", "/axes": [{"path": "shaft.load", "values": [0.1, 0.2]}]}
    with pytest.raises(SpecError) as refused:
        extend(zipped, {"axes": [{"path": "shaft.load", "values": [0.3]}]})
    assert [(fault.where, fault.code) for fault in refused.value.faults] == [("/axes", "conflict")]


def test_over_http_only_new_cases_are_run(service: Service, spec: dict[str, Any]) -> None:
    engine = Engine()

    def run(study_id: str) -> dict[str, Any]:
        store = service.store
        Dispatcher(store.work, InlineExecutor(engine), SystemClock()).run(
            lambda: store.studies.get(study_id).state.terminal
        )
        study: dict[str, Any] = service.get(f"/studies/{study_id}")
        return study

    first = run(service.submit(spec))
    done = len(engine.ran)
    body = {"axes": [{"path": "shaft.load", "values": [0.5, "0.6 N*m"]}]}
    answer = service.http.post(f"{API}/studies/{first['id']}:extend", json=body)
    assert answer.status_code == 202
    assert answer.headers["location"].endswith(answer.json()["id"])
    second = run(answer.json()["id"])
    assert (second["reused"], second["progress"]["ok"]) == (first["cases"], second["cases"])
    frequencies = {frequency for frequency, _ in engine.ran[:done]}
    assert set(engine.ran[done:]) == set(itertools.product(frequencies, (0.5, 0.6)))
    refused = service.http.post(f"{API}/studies/{first['id']}:extend", json={"axes": 1})
    assert refused.status_code == 422
    assert service.http.post(f"{API}/studies/st_0/:extend", json=body).status_code == 404


def test_nothing_new_makes_no_study(service: Service) -> None:
    study, body = service.submit(), {"axes": [{"path": "shaft.load", "values": ["100 N*mm"]}]}
    address = f"{API}/studies/{study}:extend"
    again = service.http.post(address, json=body)
    assert (again.status_code, again.json()["id"]) == (202, study)
    page = service.http.post(f"/studies/{study}/extend", data={"axis:shaft.load": "100 N*mm"})
    assert (page.status_code, "The study has all of these cases." in page.text) == (422, True)
    assert len(service.get("/studies")["studies"]) == 1
    named = service.http.post(address, json={**body, "name": "another"})
    assert named.json()["id"] != study


def test_studies_that_follow_have_names_of_their_own(service: Service) -> None:
    address, names = f"{API}/studies/{service.submit()}:extend", []
    for load in (0.7, 0.8, 0.9):
        body, key = {"axes": [{"path": "shaft.load", "values": [load]}]}, {"Idempotency-Key": f"load-{load}"}
        first, again = (service.http.post(address, json=body, headers=key).json() for _ in range(2))
        assert first["id"] == again["id"]
        names.append(first["name"])
        assert service.get(f"/studies/{first['id']}")["spec"]["name"] == first["name"]
    assert names == [names[0], f"{names[0]} 2", f"{names[0]} 3"]
    chosen = [service.http.post(address, json={**body, "name": "more"}).json()["name"] for _ in range(2)]
    assert chosen == ["more", "more"]


def test_the_same_key_extends_once(service: Service) -> None:
    study, body = service.submit(), {"axes": [{"path": "shaft.load", "values": [0.123]}]}
    address, key = f"{API}/studies/{study}:extend", {"Idempotency-Key": "once"}
    first, again = (service.http.post(address, json=body, headers=key).json() for _ in range(2))
    assert first["id"] == again["id"]
    other = {"axes": [{"path": "shaft.load", "values": [0.124]}]}
    assert service.http.post(address, json=other, headers=key).status_code == 422
