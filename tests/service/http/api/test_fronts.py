"""The designs of a study with a goal over HTTP: ranked, with limits, as JSON and as a table."""

from __future__ import annotations

import csv
import io
import math
import re

import pytest

from sprag_study.service.answers.goals import FrontReport
from tests.service.conftest import API, Service
from tests.service.searching import rows_of, search
from tests.service.shapes import fits


def test_designs_of_an_ended_search(service: Service) -> None:
    study_id = search(service)
    assert service.get(f"/studies/{study_id}")["state"] == "finished"
    found = service.get(f"/studies/{study_id}/front")
    fits(FrontReport, found)
    study, designs = service.store.studies.study(study_id), found["designs"]
    assert found["variables"][1]["paths"] == ["excitation.amplitude_x", "excitation.amplitude_y"]
    assert found["variables"][2]["values"] == [0.001, 0.002]
    assert [(goal["result"], goal["unit"], goal["max"]) for goal in found["best"]] == [
        ("efficiency", "1", True),
        ("shaft.irregularity", "1", False),
    ]
    assert found["subject_to"] == [{"result": "shaft.speed.mean", "unit": "rad/s", "is": 8.0, "within": 1.6}]
    assert found["at"] == [{"shaft.load": 0.2}, {"shaft.load": 0.3}]

    counts = found["counts"]
    # The first round of the polish serves its derivatives only.
    probes = next(one.cases for one in service.store.studies.rounds(study_id) if one.summary.get("phase") == "polish")
    listed = set(range(study.cases // 2)) - set(range(probes.start // 2, probes.stop // 2))
    assert counts["known"] == len(listed) == len(designs)
    assert counts["pending"] == 0
    for name in ("feasible", "failed", "exact"):
        assert counts[name] == sum(design[name] for design in designs)
    assert 0 < counts["exact"] < counts["feasible"] < counts["known"]
    assert {design["design"] for design in designs} == listed
    for design in designs:
        assert design["cases"] == [2 * design["design"], 2 * design["design"] + 1]
        row = rows_of(study, range(design["cases"][0], design["cases"][1] + 1))
        assert design["failed"] == (row.endings[0] != "ok")
        speed = 4000.0 * design["variables"]["excitation.amplitude_x"]
        if design["failed"]:
            assert design["goals"] == {"efficiency": None, "shaft.irregularity": None}
            assert design["violation"] is None
        else:  # the worst operating point is that of the larger load
            assert design["goals"]["efficiency"] == design["results"]["efficiency"][1]
            assert design["feasible"] == (abs(speed - 8.0) <= 1.6)
            assert design["exact"] == (abs(speed - 8.0) <= 8e-6)

    assert [design["rank"] for design in designs] == sorted(design["rank"] for design in designs)
    best = [design["goals"]["efficiency"] for design in designs if design["rank"] == 0]
    assert len(best) == counts["front"]
    assert best == sorted(best, reverse=True)
    assert {design["phase"] for design in designs} == {"search", "polish"}
    assert all(design["round"] == 1 + design["design"] // 8 for design in designs if design["round"] < 3)
    assert [item["generation"] for item in found["history"]][:2] == [1, 2]
    assert found["history"][-1]["phase"] == "ended"
    assert found["history"][-1]["feasible"] == counts["feasible"]


def test_exact_designs_alone_are_feasible_where_that_is_asked(service: Service) -> None:
    study_id = search(service)
    both = [service.get(f"/studies/{study_id}/front", exact=exact)["counts"] for exact in (False, True)]
    assert both[1]["feasible"] == both[0]["exact"] > 0
    first = service.get(f"/studies/{study_id}/front", exact=True, limit=1)["designs"]
    assert [(design["exact"], design["rank"]) for design in first] == [(True, 0)]


def test_a_search_that_is_running_shows_what_has_its_rows(service: Service) -> None:
    study_id = search(service, rounds=1)
    before = service.get(f"/studies/{study_id}/front")
    assert (before["counts"]["known"], before["counts"]["pending"]) == (8, 8)
    assert before["history"][0]["phase"] == "search"
    told = service.get(f"/studies/{study_id}")["progress"]["rounds"]["sentence"]
    assert told.startswith(f"generation 2 of 2, {before['counts']['feasible']} feasible, best ")


def test_a_table_has_a_column_for_each_operating_point(service: Service) -> None:
    study_id = search(service, rounds=1)
    answer = service.http.get(f"{API}/studies/{study_id}/front", headers={"Accept": "text/csv"})
    rows = list(csv.DictReader(io.StringIO(answer.text)))
    designs = service.get(f"/studies/{study_id}/front")["designs"]
    assert [int(row["design"]) for row in rows] == [design["design"] for design in designs]
    for row, design in zip(rows, designs, strict=True):
        if not design["failed"]:
            assert float(row["efficiency.2"]) == float(row["worst.efficiency"]) == design["goals"]["efficiency"]
            assert float(row["shaft.inertia"]) == design["variables"]["shaft.inertia"]
    assert "attachment" in answer.headers["Content-Disposition"]
    text = service.http.get(f"{API}/studies/{study_id}/front?format=csv&units=rpm,kg*cm^2").text
    for row, read in zip(rows, csv.DictReader(io.StringIO(text)), strict=True):
        assert float(read["shaft.inertia [kg*cm^2]"]) == pytest.approx(1e4 * float(row["shaft.inertia"]))
        for name in ("shaft.speed.mean.1", "shaft.speed.mean.2"):
            assert (read[f"{name} [rpm]"] == "") == (row[name] == "")
            if row[name]:
                assert float(read[f"{name} [rpm]"]) == pytest.approx(float(row[name]) * 30.0 / math.pi)


def test_one_goal_and_a_study_without_any_row(service: Service) -> None:
    goal = [{"result": "efficiency", "max": True}]
    study_id = search(service, rounds=0, best=goal, at=[{"shaft.load": "0.2 N*m"}])
    found = service.get(f"/studies/{study_id}/front")
    assert (found["designs"], found["history"], found["counts"]["pending"]) == ([], [], 8)
    table = service.http.get(f"{API}/studies/{study_id}/front?format=csv").text.splitlines()
    assert len(table) == 1
    assert re.search(r",shaft\.inertia,efficiency,shaft\.speed\.mean(,regime)?,flags\Z", table[0])


@pytest.mark.parametrize("form", ["json", "csv"])
def test_a_study_without_a_goal_has_no_designs(service: Service, form: str) -> None:
    study_id = service.submit()
    answer = service.http.get(f"{API}/studies/{study_id}/front", params={"format": form})
    assert (answer.status_code, answer.json()["type"]) == (422, "/problems/invalid-selection")
    assert answer.json()["errors"][0]["code"] == "conflict"
