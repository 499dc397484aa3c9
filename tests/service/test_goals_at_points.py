"""Goals and limits of a search that count at operating points of their own, or at the best or the mean of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.worker.planning.goals import GoalPlan
from tests.service.searching import search_of, spec_of
from tests.service.spec_sample import schema

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from tests.service.conftest import Service

#: The made-up efficiency is frequency/40 - load/10, which falls from idle to overload by 0.05.
POINTS = [
    {"name": "idle", "shaft.load": 0}, {"shaft.load": "0.2 N*m"}, {"name": "overload", "shaft.load": "0.5 N*m"},
]  # fmt: skip
LOADS = np.array([0.0, 0.2, 0.5])
GOAL: dict[str, Any] = {
    "at": POINTS, "best": [{"result": "shaft.irregularity"}], "population": 20, "generations": 4,
}  # fmt: skip


def judged(service: Service, **fields: Any) -> tuple[dict[str, Any], NDArray[np.float64], NDArray[np.bool_]]:
    """The answer of a search, and of each design its efficiency at each point, and whether a case of it failed."""
    study_id = search_of(service, spec_of(**{**GOAL, **fields}))
    study = service.store.studies.study(study_id)
    columns = study.columns(range(0, study.cases, 3))
    efficiency = columns["excitation.frequency"][:, None] / 40.0 - LOADS / 10.0
    failed = (columns["excitation.frequency"] > 35.0) & (columns["shaft.inertia"] < 0.0015)
    assert parse_spec(spec_of(**{**GOAL, **fields})).study.plan == GoalPlan.from_json(study.plan or {}).to_json()
    return service.get(f"/studies/{study_id}/front", limit=500), efficiency, failed


@pytest.mark.parametrize(
    ("counted", "taken"),
    [
        ({}, lambda values: values.min(axis=1)),
        ({"at": "idle"}, lambda values: values[:, 0]),
        ({"at": {"shaft.load": "200 N*mm"}}, lambda values: values[:, 1]),
        ({"over": "mean"}, lambda values: values.mean(axis=1)),
        ({"over": "best"}, lambda values: values.max(axis=1)),
    ],
)
def test_a_limit_holds_where_it_counts(service: Service, counted: dict[str, Any], taken: Any) -> None:
    limit = {"result": "efficiency", "at_least": 0.62, **counted}
    found, efficiency, failed = judged(service, subject_to=[limit])
    meets = (taken(efficiency) >= 0.62) & ~failed
    assert 0 < np.count_nonzero(meets) < len(meets)
    listed = {one["design"] for one in found["designs"]}  # all but those that serve derivatives
    assert len(listed) >= 20 * 4
    assert {one["design"] for one in found["designs"] if one["feasible"]} == listed & set(np.flatnonzero(meets))
    (told,) = found["subject_to"]
    assert told.get("points") == ([0] if counted.get("at") == "idle" else [1] if "at" in counted else None)
    assert told.get("over") == counted.get("over")
    where = {"": "", "idle": "at idle"}.get(str(counted.get("at", "")), "at point 2")
    assert told["result"] == " ".join(["efficiency", *(f"({text})" for text in (counted.get("over"), where) if text)])


def test_goals_and_limits_at_different_points_do_not_mix(service: Service) -> None:
    """Two limits on one result, each at a point of its own, and a goal that counts at its best point."""
    limits = [
        {"result": "efficiency", "at": "idle", "at_most": 0.8},
        {"result": "efficiency", "at": "overload", "at_least": 0.6},
        {"result": "shaft.speed.mean", "is": "8 rad/s", "within": "20 %", "at": "idle"},
    ]
    found, efficiency, _ = judged(
        service, best=[{"result": "efficiency", "max": True, "over": "best"}], subject_to=limits, generations=6
    )
    feasible = [one for one in found["designs"] if one["feasible"]]
    assert feasible
    for one in feasible:
        idle, overload = (one["results"][f"efficiency (at {name})"] for name in ("idle", "overload"))
        assert (idle[1:], overload[:2]) == ([None, None], [None, None])
        assert idle[0] <= 0.8
        assert overload[2] >= 0.6
        assert one["goals"]["efficiency (best)"] == pytest.approx(efficiency[one["design"], 0])
    assert found["names"] == ["idle", "", "overload"]
    study_id = found["study"]
    page = service.http.get(f"/studies/{study_id}").text
    assert "idle" in page
    for path in ("rows", "matters"):
        assert service.http.get(f"/studies/{study_id}/{path}").status_code == 200
    csv = service.http.get(f"/api/v1/studies/{study_id}/front", params={"format": "csv"}).text
    assert "best.efficiency (best)" in csv.splitlines()[0]
    report = service.http.get(f"/api/v1/studies/{study_id}/report")
    assert report.status_code == 200


@pytest.mark.parametrize(
    ("fields", "place", "code"),
    [
        ({"best": [{"result": "efficiency", "at": "idles"}]}, "/goal/best/0/at", "unknown-name"),
        ({"best": [{"result": "efficiency", "at": {"shaft.load": 0.3}}]}, "/goal/best/0/at", "unknown-value"),
        ({"best": [{"result": "efficiency", "at": {"gravity": 9}}]}, "/goal/best/0/at/gravity", "invalid-path"),
        ({"best": [{"result": "efficiency", "at": []}]}, "/goal/best/0/at", "wrong-type"),
        ({"best": [{"result": "efficiency", "over": "sum"}]}, "/goal/best/0/over", "invalid-choice"),
        ({"subject_to": [{"result": "efficiency", "is": 1, "over": "best"}]}, "/goal/subject_to/0/over", "conflict"),
        ({"subject_to": [{"result": "efficiency", "is": 1, "over": 2}]}, "/goal/subject_to/0/over", "invalid-choice"),
        ({"at": [], "best": [{"result": "efficiency", "at": "idle"}]}, "/goal/best/0/at", "conflict"),
        ({"at": [{"name": "a<b", "shaft.load": 0}]}, "/goal/at/0/name", "invalid-text"),
        ({"at": [{"name": "a"}]}, "/goal/at/0", "required"),
        ({"at": [{"name": "a", "shaft.load": 0}, {"name": "a", "shaft.load": 1}]}, "/goal/at/1/name", "repeated"),
        ({"best": [{"result": "efficiency", "at": "idle"}] * 2}, "/goal/best/1/result", "repeated"),
    ],
)  # fmt: skip
def test_what_is_refused_names_the_field(fields: dict[str, Any], place: str, code: str) -> None:
    with pytest.raises(SpecError) as caught:
        parse_spec(spec_of(**{**GOAL, "subject_to": [], **fields}))
    assert (place, code) in [(fault.where, fault.code) for fault in caught.value.faults]


def test_the_schema_knows_them() -> None:
    limit = {"result": "efficiency", "at_least": 0.6, "at": "idle", "over": "best"}
    schema().validate(spec_of(**{**GOAL, "over": "best", "subject_to": [limit]}))
