"""Deadlines from the request to the half-finished curve: parsed, shown, kept by the dispatcher, drawn."""

from __future__ import annotations

import json
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from sprag_study.service.answers import studies
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.results.curves import Curve, Map
from sprag_study.service.results.refined import Line
from sprag_study.service.schedules.deadline import (
    TimingError,
    check_run_finish,
    finish_at,
    finish_warnings,
    run_finish_at,
)
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.schedules.times import Timing, Window, read_time_of_day
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.dispatcher import POLL_SECONDS, Dispatcher
from sprag_study.worker.executors.inline import InlineExecutor
from sprag_study.worker.models import study_results
from sprag_study.worker.states import StudyState
from tests.faults import refused
from tests.service import refined_study
from tests.service.figures.seen import chart_of
from tests.service.shapes import fits
from tests.service.timed_spec import SPEC
from tests.worker import fakes

if TYPE_CHECKING:
    from conftest import Service

    from sprag_study.worker.models import ChunkResult, ChunkTask

STUDIES = "/api/v1/studies"
NOW = datetime(2026, 3, 1, 12, tzinfo=UTC)
LOADS = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]


class Ticking(fakes.HandClock):
    """The time of day stands still until it is moved; the other clock goes on with every look."""

    def __init__(self) -> None:
        super().__init__()
        self._ticks = 0.0

    def monotonic(self) -> float:
        self._ticks += POLL_SECONDS
        return self._ticks


@pytest.fixture
def clock(service: Service) -> Iterator[fakes.HandClock]:
    clock, before = Ticking(), service.store.dispatchers.base_chunking
    service.store.dispatchers.base_chunking = Chunking(cases=2)
    with fakes.clocked(service.store, clock):
        yield clock
    service.store.dispatchers.base_chunking = before


def nine_loads() -> dict[str, Any]:
    spec: dict[str, Any] = json.loads(json.dumps(SPEC))
    spec["axes"] = [{"path": "shaft.load", "values": LOADS}]
    return spec


def dispatch(service: Service, clock: fakes.HandClock, chunks: int) -> None:
    """Run the studies that there are; the clock goes on by two hours while chunk number ``chunks`` is being run."""
    ran = 0

    def run(task: ChunkTask) -> ChunkResult:
        nonlocal ran
        ran += 1
        if ran == chunks:
            clock.seconds += 7200.0
        return fakes.run(task)

    def idle() -> bool:
        return not [study for study in service.store.work.active_studies() if study.state is not StudyState.PAUSED]

    Dispatcher(service.store.work, InlineExecutor(run), clock).run(idle)


# What is taken for a deadline


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("8 h", NOW + timedelta(hours=8)),
        (" 90 min ", NOW + timedelta(minutes=90)),
        ("2 days", NOW + timedelta(days=2)),
        ("1.5 d", NOW + timedelta(hours=36)),
        ("2 weeks", NOW + timedelta(weeks=2)),
        ("1w", NOW + timedelta(weeks=1)),
        ("0,5 доби", NOW + timedelta(hours=12)),
        ("8 год", NOW + timedelta(hours=8)),
        ("2026-03-02T06:00+01:00", datetime(2026, 3, 2, 5, tzinfo=UTC)),
        ("2026-03-02T06:00:00Z", datetime(2026, 3, 2, 6, tzinfo=UTC)),
    ],
)
def test_a_time_with_its_offset_or_a_duration_is_a_deadline(text: str, expected: datetime) -> None:
    assert finish_at(text, NOW) == expected


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("2026-03-02T06:00", "invalid-time"),
        ("2026-03-02T06:00 01:00", "invalid-time"),
        ("2026-03-01T12:00Z", "out-of-range"),
        ("2027-03-03T00:00Z", "out-of-range"),
        ("9999-12-31T23:59-23:59", "out-of-range"),
        ("0.5 s", "out-of-range"),
        ("-8 h", "out-of-range"),
        ("0 h", "out-of-range"),
        ("9000 h", "out-of-range"),
        ("367 days", "out-of-range"),
        ("0 weeks", "out-of-range"),
        ("2 months", "invalid-time"),
        ("2 W", "invalid-time"),
        ("1 day 2 h", "invalid-time"),
        ("1e999 h", "invalid-time"),
        ("8", "invalid-time"),
        ("8 kg", "invalid-time"),
        ("", "invalid-time"),
        ("tomorrow", "invalid-time"),
        ("\ud800", "invalid-time"),
    ],
)
def test_what_is_no_deadline_is_refused(text: str, code: str) -> None:
    with refused(TimingError, code):
        finish_at(text, NOW)


def test_a_deadline_may_be_weeks_ahead() -> None:
    assert finish_at("367 h", NOW) == NOW + timedelta(hours=367)


def test_a_run_of_a_schedule_ends_at_the_next_such_time_of_day() -> None:
    # 12:00 UTC is 13:00 in Berlin; the clocks go forward on 29 March.
    assert run_finish_at("06:00", "Europe/Berlin", NOW) == datetime(2026, 3, 2, 5, tzinfo=UTC)
    assert run_finish_at("13:30", "Europe/Berlin", NOW) == datetime(2026, 3, 1, 12, 30, tzinfo=UTC)
    assert run_finish_at("13:00", "Europe/Berlin", NOW) == datetime(2026, 3, 2, 12, tzinfo=UTC)
    before = datetime(2026, 3, 28, 21, tzinfo=UTC)
    assert run_finish_at("06:00", "Europe/Berlin", before) == datetime(2026, 3, 29, 4, tzinfo=UTC)
    assert run_finish_at("8 h", "Europe/Berlin", before) == before + timedelta(hours=8)
    assert (check_run_finish(" 6:00"), check_run_finish("8 h")) == ("06:00", "8 h")


# Over HTTP


def test_a_study_with_a_deadline_is_run_coarse_to_fine_and_held_then(service: Service, clock: fakes.HandClock) -> None:
    made = service.http.post(STUDIES, json=nine_loads(), params={"finish_by": "1 h"})
    assert made.status_code == 202
    body = made.json()
    fits(studies.StudySummary, body)
    deadline = clock.now() + timedelta(hours=1)
    assert (datetime.fromisoformat(body["finish_by"]), body["time_over"]) == (deadline, False)
    dispatch(service, clock, chunks=3)
    held = service.get(f"/studies/{body['id']}")
    fits(studies.StudyDetail, held)
    assert (held["state"], held["time_over"], held["progress"]["done"]) == ("paused", True, 6)
    assert held["progress"]["passes"] == {"complete": 3, "total": 4, "cases": 5, "values": [5]}
    assert "6 of 9 cases are done; pass 3 of 4 is complete, a grid of 5 values" in held["reason"]
    curve = service.get(f"/studies/{body['id']}/curves", x="shaft.load", y="shaft.speed.mean")["curves"][0]
    # Both ends, the middle, the quarters, and the first of the eighths.
    assert [case for case, ending in enumerate(curve["endings"]) if ending == "ok"] == [0, 1, 2, 4, 6, 8]
    assert service.http.get(f"{STUDIES}/{body['id']}/cases/4").json()["parameters"]["shaft.load"] == 0.4
    # It goes on when somebody wants it to, and comes to the same end as any study.
    resumed = service.http.post(f"{STUDIES}/{body['id']}:resume")
    assert (resumed.status_code, resumed.json()["finish_by"], resumed.json()["time_over"]) == (202, None, False)
    dispatch(service, clock, chunks=0)
    ended = service.get(f"/studies/{body['id']}")
    assert (ended["state"], ended["progress"]["ok"], ended["reason"]) == ("finished", 9, None)
    rows = service.get(f"/studies/{body['id']}/results", format="json")
    assert [row["case"] for row in rows["rows"]] == list(range(9))


def test_without_a_deadline_nothing_changes(service: Service, clock: fakes.HandClock) -> None:
    study = service.http.post(STUDIES, json=nine_loads()).json()
    assert (study["finish_by"], study["time_over"]) == (None, False)
    dispatch(service, clock, chunks=0)
    ended = service.get(f"/studies/{study['id']}")
    assert (ended["state"], ended["progress"]["passes"], ended["progress"]["in_time"]) == ("finished", None, None)


def test_a_wrong_deadline_is_refused_wherever_it_is_given(service: Service, clock: fakes.HandClock) -> None:
    study_id = service.submit()
    for address in (STUDIES, f"{STUDIES}:preview", f"{STUDIES}/{study_id}:extend"):
        for text in ("2020-01-01T00:00Z", "2030-01-01T00:00", "soon"):
            refused = service.http.post(address, json=nine_loads(), params={"finish_by": text})
            assert refused.status_code == 422
            (item,) = refused.json()["errors"]
            assert (item["parameter"], item["value"]) == ("finish_by", text)
            assert "1 s to 366 days ahead" in item["allowed"]


def test_preview_and_study_say_when_the_time_will_hardly_do(service: Service, clock: fakes.HandClock) -> None:
    spec = json.loads(json.dumps(SPEC))
    spec["axes"] = [
        {"path": "shaft.load", "linspace": [0, 1, 2000]},
        {"path": "excitation.frequency", "linspace": ["16 Hz", "35 Hz", 1000]},
    ]
    service.store.dispatchers.base_chunking = Chunking()
    seconds = service.http.post(f"{STUDIES}:preview", json=spec).json()["estimated_seconds"]
    assert seconds > 20.0
    found = service.http.post(f"{STUDIES}:preview", json=spec, params={"finish_by": f"{seconds / 4:.3f} s"}).json()
    warning = found["warnings"][found["warning_codes"].index("late")]
    # A quarter of the time is 500,000 cases: 513 x 513 of the passes before make 263,169, 1000 x 1025 are too many.
    assert "enough for about 5" in warning
    assert "of 2,000,000 cases" in warning
    assert "a grid of 513 x 513 values" in warning
    plenty = service.http.post(f"{STUDIES}:preview", json=spec, params={"finish_by": f"{seconds * 4:.3f} s"}).json()
    assert "late" not in plenty["warning_codes"]
    submitted = service.http.post(STUDIES, json=spec, params={"finish_by": f"{seconds / 4:.3f} s"}).json()
    assert "a grid of 513 x 513 values" in submitted["warnings"][submitted["warning_codes"].index("late")]


def test_an_extension_takes_what_is_known_and_runs_the_rest_coarse_to_fine(
    service: Service, clock: fakes.HandClock
) -> None:
    study_id = service.http.post(STUDIES, json=nine_loads(), params={"finish_by": "1 h"}).json()["id"]
    dispatch(service, clock, chunks=2)
    more = service.http.post(
        f"{STUDIES}/{study_id}:extend",
        json={"axes": [{"path": "shaft.load", "values": [0.9]}]},
        params={"finish_by": "1 h"},
    ).json()
    dispatch(service, clock, chunks=0)
    ended = service.get(f"/studies/{more['id']}")
    assert (ended["state"], ended["reused"], ended["progress"]["ok"]) == ("finished", 4, 10)


def test_a_study_whose_time_is_over_can_be_deleted(service: Service, clock: fakes.HandClock) -> None:
    study_id = service.http.post(STUDIES, json=nine_loads(), params={"finish_by": "1 h"}).json()["id"]
    dispatch(service, clock, chunks=1)
    assert service.get(f"/studies/{study_id}")["time_over"]
    assert f'href="/studies/{study_id}/delete"' in service.http.get(f"/studies/{study_id}").text
    assert "Delete the study and its results" in service.http.get(f"/studies/{study_id}/delete").text
    assert service.http.delete(f"{STUDIES}/{study_id}").status_code == 204
    assert service.http.get(f"{STUDIES}/{study_id}").status_code == 404


# Pages, pictures, schedules


def test_pages_show_the_deadline_and_what_is_complete(service: Service, clock: fakes.HandClock) -> None:
    study_id = service.http.post(STUDIES, json=nine_loads(), params={"finish_by": "1 h"}).json()["id"]
    running = service.http.get(f"/studies/{study_id}").text
    assert "Runs coarse to fine until" in running
    assert "no pass of 4 is complete yet" in running
    assert "To be finished by" in running
    dispatch(service, clock, chunks=3)
    held = service.http.get(f"/studies/{study_id}").text
    assert "pass 3 of 4 is complete, a grid of 5 values" in held
    assert "Resume it to run the others too." in held


def test_the_form_takes_a_deadline_and_says_what_is_wrong_with_it(service: Service, clock: fakes.HandClock) -> None:
    fields = {"/text": json.dumps(nine_loads()), "format": "json", "key": "k"}
    checked = service.http.post("/new/check", data={**fields, "finish_by": "soon"}).json()
    assert "neither a time nor a duration" in checked["faults"]["finish_by"][0]
    refused = service.http.post("/new", data={**fields, "finish_by": "2030-01-01T00:00", "do": "submit"})
    assert refused.status_code == 422
    assert "no offset from UTC" in refused.text
    assert "finish_by=8+h" in service.http.post("/new/check", data={**fields, "finish_by": "8 h"}).json()["panel"]
    made = service.http.post("/new", data={**fields, "finish_by": "8 h", "do": "submit"}, follow_redirects=False)
    assert made.status_code == 303
    (study,) = service.store.studies.page().studies
    assert study.finish_by == clock.now() + timedelta(hours=8)
    assert 'name="finish_by"' in service.http.get("/new").text


def test_a_picture_joins_the_cases_that_were_run_and_leaves_failures_open() -> None:
    endings = ["ok", "pending", "ok", "pending", "chatter", "cancelled", "ok"]
    y = np.array([1.0, np.nan, 3.0, np.nan, np.nan, np.nan, 7.0])
    curve = Curve(Line({}, {}, tuple(map(float, range(7))), np.arange(7)), {"y": y}, endings)
    assert curve.run().tolist() == [0, 2, 4, 6]
    assert np.isnan(curve.y["y"][curve.run()]).tolist() == [False, False, True, False]


@pytest.mark.parametrize(
    ("picture", "rows", "columns"),
    [
        # Every second of both, and a finer row that is half done; a row still to come; all; nothing.
        (["x.x.x", "xxx..", "x.x.x", ".....", "x.x.x"], [0, 2, 4], [0, 2, 4]),
        (["xxx", "xxx", "x.."], [0, 1], [0, 1, 2]),
        (["xx", "xx"], [0, 1], [0, 1]),
        (["..", ".."], [0, 1], [0, 1]),
    ],
)
def test_a_map_shows_the_part_that_is_complete(picture: list[str], rows: list[int], columns: list[int]) -> None:
    endings = [["ok" if mark == "x" else "pending" for mark in line] for line in picture]
    height, width = len(picture), len(picture[0])
    cases = np.arange(height * width).reshape(height, width)
    info = study_results(fakes.study(1))[0]
    whole = Map(
        "x", "y", ("1", "1"), ("x", "y"), (), tuple(map(float, range(width))), tuple(map(float, range(height))), {}, {},
        info, cases, cases.astype(float), endings,
    )  # fmt: skip
    shown = whole.run()
    assert (shown.y_values, shown.x_values) == (tuple(map(float, rows)), tuple(map(float, columns)))
    assert shown.cases.tolist() == [[row * width + column for column in columns] for row in rows]
    assert [len(line) for line in shown.endings] == [len(columns)] * len(rows)
    assert shown.values.tolist() == shown.cases.tolist()


def test_a_map_of_a_coarser_study_is_the_coarser_grid(service: Service, clock: fakes.HandClock) -> None:
    spec = nine_loads()
    spec["axes"].append({"path": "excitation.frequency", "values": [20.0, 25.0, 30.0]})
    study_id = service.http.post(STUDIES, json=spec, params={"finish_by": "1 h"}).json()["id"]
    dispatch(service, clock, chunks=2)
    asked = {"x": "shaft.load", "up": "excitation.frequency", "z": "shaft.speed.mean"}
    page = service.http.get(f"/studies/{study_id}", params=asked).text
    assert len(chart_of(page).panels[0].cases) == 4
    assert "without a result" not in page


def test_each_run_of_a_schedule_gets_its_deadline(service: Service, clock: fakes.HandClock) -> None:
    given = {"spec": nine_loads(), "cron": "0 22 * * *", "zone": "Europe/Berlin", "finish_by": "6:00"}
    kept = service.http.post("/api/v1/schedules", json=given)
    assert (kept.status_code, kept.json()["finish_by"]) == (201, "06:00")
    due = service.store.schedules.get(kept.json()["id"]).next_due
    assert due is not None
    clock.seconds += (due - clock.now()).total_seconds()
    Scheduler(service.store).look()
    (study,) = service.store.studies.page().studies
    assert study.coarse
    assert study.finish_by == due + timedelta(hours=8)
    assert "finished by 06:00" in service.http.get("/nights").text
    changed = service.http.patch(f"/api/v1/schedules/{kept.json()['id']}", json={"finish_by": None})
    assert changed.json()["finish_by"] is None
    refused = service.http.post("/api/v1/schedules", json={**given, "finish_by": "25:00"})
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/finish_by"
    assert read_fields({**given, "finish_by": "8 h"}, clock.now()).finish_by == "8 h"


@pytest.mark.parametrize(
    ("zone", "text", "begin", "due"),
    [
        ("Europe/Berlin", "02:30", "2026-03-29T00:00+01:00", "2026-03-29T01:00+00:00"),
        ("Europe/Berlin", "02:00", "2026-03-28T23:00+01:00", "2026-03-29T01:00+00:00"),
        ("Europe/Berlin", "03:00", "2026-03-28T23:00+01:00", "2026-03-29T01:00+00:00"),
        ("America/New_York", "02:59", "2026-03-08T01:00-05:00", "2026-03-08T07:00+00:00"),
        ("Australia/Lord_Howe", "02:15", "2026-10-04T00:00+10:30", "2026-10-03T15:30+00:00"),
        # It has passed in the first of two equal hours.
        ("Europe/Berlin", "02:30", "2026-10-25T02:10+01:00", "2026-10-26T01:30+00:00"),
        ("Europe/Berlin", "02:30", "2026-10-25T00:10+02:00", "2026-10-25T00:30+00:00"),
    ],
)
def test_a_deadline_in_a_skipped_hour_is_where_due_times_and_windows_are(
    zone: str, text: str, begin: str, due: str
) -> None:
    """At the end of the gap; the instants are worked out by hand from the rules of the zones."""
    moment, expected = datetime.fromisoformat(begin), datetime.fromisoformat(due)
    assert run_finish_at(text, zone, moment) == expected
    hour, minute = text.split(":")
    assert Timing(f"{int(minute)} {int(hour)} * * *", None, zone).next_after(moment.astimezone(UTC)) == expected
    opening = Window(read_time_of_day(text), read_time_of_day("05:00"), zone)
    second = timedelta(seconds=1)
    assert opening.opens_between(moment, expected + second)
    assert not opening.opens_between(moment, expected)


def test_the_warning_of_rounds_has_the_code_of_other_late_studies() -> None:
    study = parse_spec(refined_study.SPEC).study
    assert study.plan is not None
    (warning,) = finish_warnings(study, 7200.0, 3600.0)
    assert getattr(warning, "code", None) == "late"
    assert "All its rounds" in warning
