"""What became of due times: the true outcome in answers, pages and commands, kept when studies are deleted."""

from __future__ import annotations

import json
from dataclasses import replace
from datetime import UTC, datetime
from typing import TYPE_CHECKING, Any

import pytest

from sprag_study.service import languages
from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.fields import read_fields
from sprag_study.service.schedules.outcomes import Outcome, Result
from sprag_study.worker.models import WINDUP_OUT_OF_DATA
from tests.service.conftest import made_up
from tests.service.schedules.conftest import NEW_YEAR
from tests.service.timed_spec import SPEC

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from sprag_study.worker.models import ChunkResult
    from sprag_study.worker.study import Study
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock


def due_at_one(service: Service, clock: Clock, **given: Any) -> tuple[str, str]:
    """Ids of a schedule that was due at 01:00, and of its study."""
    fields = {"spec": SPEC, "cron": "0 1 * * *", "name": "nightly", **given}
    kept = service.store.schedules.create(read_fields(fields, NEW_YEAR))
    clock.set("2026-01-01T01:00")
    Scheduler(service.store).look()
    return kept.id, service.store.studies.page().studies[0].id


def last(store: Store, schedule: str) -> Outcome:
    return store.schedules.runs(schedule)[0].outcome


def test_a_finished_study_has_its_failures_and_flags(service: Service, clock: Clock) -> None:
    schedule, study = due_at_one(service, clock)
    assert last(service.store, schedule).result is Result.QUEUED
    clock.set("2026-01-01T01:30")
    made = service.fill(study)
    clock.set("2026-01-01T02:00")
    Scheduler(service.store).look()
    outcome, failed = last(service.store, schedule), len(made.endings) - made.endings.count("ok")
    assert (outcome.result, outcome.cases, outcome.done) == (Result.FINISHED, len(made.endings), len(made.endings))
    assert outcome.endings == {"chatter": failed}
    assert outcome.flags == {WINDUP_OUT_OF_DATA: made.flags.count(WINDUP_OUT_OF_DATA)}
    assert (outcome.trouble, outcome.ended_at) == (True, datetime(2026, 1, 1, 1, 30, tzinfo=UTC))
    shown = service.get(f"/schedules/{schedule}")["last_run"]["outcome"]
    assert (
        shown["sentence"]
        == f"Finished: {outcome.cases} of {outcome.cases} cases are done, and {outcome.ok} of them ended ok."
    )
    assert (shown["endings"], shown["flags"], shown["trouble"]) == (outcome.endings, outcome.flags, True)


def test_cases_that_ended_ok_and_are_unsettled_need_attention(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A night of nothing else is not "all ended ok", in answers, reports and the exit code of the command."""
    schedule, study = due_at_one(service, clock)

    def unsettled(study: Study) -> ChunkResult:
        made = made_up(study)
        return replace(
            made, endings=["ok"] * study.cases, flags=["unsettled", *["irregular,unsettled"] * (study.cases - 1)]
        )

    monkeypatch.setattr("tests.service.conftest.made_up", unsettled)
    cases = service.store.studies.get(study).cases
    service.fill(study)
    Scheduler(service.store).look()
    outcome = last(service.store, schedule)
    assert (outcome.result, outcome.ok, outcome.flags) == (Result.FINISHED, cases, {"unsettled": cases})
    assert outcome.trouble
    assert "all" not in outcome.sentence
    assert outcome.sentence.endswith(f"The motions of {cases} cases are unsettled.")
    assert service.get("/night")["trouble"] == 1
    with languages.language("uk"):
        assert "не усталені" in outcome.sentence
    assert not Outcome(Result.FINISHED, "st_1", "", 9, 9, 9, {}, {"jumped": 3}).trouble


def test_flags_are_unknown_until_they_are_counted(service: Service, clock: Clock) -> None:
    """Between the end of a study and the next look of the scheduler, and after a study was changed."""
    schedule, study = due_at_one(service, clock)
    assert last(service.store, schedule).flags is None
    made = service.fill(study)
    outcome = last(service.store, schedule)
    assert (outcome.result, outcome.endings, outcome.flags) == (Result.FINISHED, None, None)
    shown = service.get(f"/schedules/{schedule}")["last_run"]["outcome"]
    assert (shown["endings"], shown["flags"]) == (None, None)
    assert service.http.get("/nights").status_code == 200
    (run,) = service.get("/night")["runs"]
    counted = {WINDUP_OUT_OF_DATA: made.flags.count(WINDUP_OUT_OF_DATA)}
    assert run["outcome"]["flags"] == counted, "the night counts them at once"
    Scheduler(service.store).look()
    assert last(service.store, schedule).flags == counted
    service.store.studies.retry(study)
    service.fill(study)
    assert service.get("/night")["runs"][0]["outcome"]["flags"] is not None


def test_the_outcome_is_kept_when_the_study_is_deleted(service: Service, clock: Clock) -> None:
    schedule, study = due_at_one(service, clock)
    service.fill(study)
    Scheduler(service.store).look()
    before = last(service.store, schedule)
    service.store.studies.delete(study)
    Scheduler(service.store).look()
    assert last(service.store, schedule) == before
    assert service.store.schedules.runs(schedule)[0].study is None


def test_a_study_that_was_deleted_before_its_end_says_so(service: Service, clock: Clock) -> None:
    schedule, study = due_at_one(service, clock)
    service.store.studies.cancel(study)
    service.store.work.settle(service.store.work.take_over("test"), service.store.studies.get(study).number)
    service.store.studies.delete(study)
    Scheduler(service.store).look()
    assert (last(service.store, schedule).result, last(service.store, schedule).trouble) == (Result.DELETED, True)


def test_a_study_that_is_held_by_its_deadline_has_its_coverage(service: Service, clock: Clock) -> None:
    store = service.store
    schedule, study = due_at_one(service, clock, finish_by="06:00")
    record = store.studies.get(study)
    service.fill(study, range(record.cases // 2))
    clock.set("2026-01-01T06:00")
    store.work.time_is_over(store.work.take_over("test"), record.number)
    Scheduler(store).look()
    outcome = last(store, schedule)
    assert outcome.result is Result.DEADLINE
    assert 0 < outcome.done < outcome.cases
    assert "complete" in str(outcome.coverage)
    assert outcome.coverage in outcome.sentence
    store.studies.resume(study)
    assert last(store, schedule).result is Result.QUEUED, "somebody resumed it: the run is not over"
    service.fill(study)
    assert last(store, schedule).result is Result.FINISHED


def test_cancelled_paused_and_refused_runs(service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch) -> None:
    store = service.store
    schedule, study = due_at_one(service, clock)
    store.studies.pause(study)
    assert last(store, schedule).result is Result.HELD
    store.studies.cancel(study)
    store.work.settle(store.work.take_over("test"), store.studies.get(study).number)
    assert last(store, schedule).result is Result.CANCELLED
    monkeypatch.setattr("sprag_study.service.jobs.submission.MAX_WAITING_STUDIES", 0)
    clock.set("2026-01-04T01:00")
    Scheduler(store).look()
    waiting = last(store, schedule)
    assert (waiting.result, waiting.missed) == (Result.WAITING, 2)
    clock.set("2026-01-05T01:00")
    Scheduler(store).look()
    refused = store.schedules.runs(schedule)[1].outcome
    assert refused.result is Result.REFUSED
    assert refused.sentence.startswith("No study was submitted: 0 studies have not ended yet.")
    assert refused.sentence.endswith("2 due times before it were not run.")


def test_an_outcome_is_concluded_once(service: Service, clock: Clock) -> None:
    store = service.store
    schedule, study = due_at_one(service, clock)
    service.fill(study)
    (ended,) = store.runs.ended()
    assert store.runs.conclude(ended, ended.outcome)
    assert not store.runs.conclude(ended, ended.outcome)
    assert store.runs.ended() == []
    assert last(store, schedule).ended_at is not None


def test_the_last_night_has_trouble_first(service: Service, clock: Clock) -> None:
    store = service.store
    due_at_one(service, clock, name="<b>odd</b>", zone="Europe/Berlin", cron="0 2 * * *")
    study = store.studies.page().studies[0].id
    service.fill(study)
    store.schedules.create(read_fields({"spec": SPEC, "at": "2026-01-01T03:00", "name": "late"}, NEW_YEAR))
    clock.set("2026-01-01T06:00")
    Scheduler(store).look()
    found = service.get("/night")
    assert (found["since"], found["until"]) == ("2025-12-31T06:00:00.000000Z", "2026-01-01T06:00:00.000000Z")
    assert [(run["name"], run["outcome"]["result"]) for run in found["runs"]] == [
        ("<b>odd</b>", "finished"),
        ("late", "queued"),
    ]
    assert (found["trouble"], found["runs"][0]["due_local"]) == (1, "2026-01-01T02:00:00+01:00")
    page = service.http.get("/nights").text
    assert "&lt;b&gt;odd&lt;/b&gt;" in page
    assert "2026-01-01 01:00</time>" in page
    assert "1 run of 2 needs attention" in page
    assert f"/api/v1/studies/{study}/curves?format=svg&amp;units=workshop" in page
    ukrainian = service.http.get("/nights", params={"units": "si,rpm", "language": "uk"}).text
    assert f"/api/v1/studies/{study}/curves?format=svg&amp;units=si%2Crpm&amp;language=uk" in ukrainian
    clock.set("2026-01-01T05:00")
    assert [run["name"] for run in service.get("/night", hours=3)["runs"]] == ["late"]
    for wrong in ("0", "745", "x", "nan"):
        assert service.http.get(f"/api/v1/night?hours={wrong}").status_code == 422
        assert service.http.get(f"/nights?hours={wrong}").status_code == 422


def test_the_night_of_a_deleted_schedule_is_shown(service: Service, clock: Clock) -> None:
    schedule, _ = due_at_one(service, clock)
    service.store.schedules.delete(schedule)
    assert [run["schedule"] for run in service.get("/night")["runs"]] == [schedule]
    assert service.http.get("/nights").status_code == 200


@pytest.mark.parametrize("result", list(Result))
def test_every_outcome_survives_storage_and_has_a_sentence(result: Result) -> None:
    outcome = Outcome(
        result, "st_1", "n", 9, 8, 7, {"chatter": 1}, {"f": 2}, "pass 1 of 3", "because", 1, NEW_YEAR, 2.5
    )
    assert Outcome.of_json(json.loads(json.dumps(outcome.to_json()))) == outcome
    assert outcome.sentence.endswith("1 due time before it was not run.")
    assert not Outcome(Result.FINISHED, "st_1", "n", 9, 9, 9).trouble
    assert Outcome(Result.FINISHED, "st_1", "n", 9, 9, 9).sentence == "Finished: all 9 cases ended ok."
