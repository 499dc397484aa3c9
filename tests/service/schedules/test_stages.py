"""What took how long in a night: in answers, on the page, by the command."""

from __future__ import annotations

import re
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING

import pytest

from sprag_study.service.jobs.scheduler import Scheduler
from sprag_study.service.schedules.outcomes import Outcome
from sprag_study.service.schedules.stages import StageTime, report_stages, study_stages
from sprag_study.worker import ports
from sprag_study.worker.stages import Spent, Stage, Stages
from tests.service.schedule_command import runner
from tests.service.schedules.test_outcomes import due_at_one, last

if TYPE_CHECKING:
    from sprag_study.service.storage.store import Store
    from tests.service.conftest import Service
    from tests.service.schedules.conftest import Clock

DUE = datetime(2026, 1, 1, 22, tzinfo=UTC)


def after(**since: float) -> datetime:
    return DUE + timedelta(**since)


def seconds(stages: tuple[StageTime, ...]) -> dict[str, float]:
    return {stage.stage.value: stage.seconds for stage in stages}


def spent(seconds: float, begin: float, end: float) -> Spent:
    """Seconds of a stage between two times, in s after the due time."""
    return Spent(seconds, after(seconds=begin), after(seconds=end))


def test_the_stages_of_a_night_fill_its_time() -> None:
    measured = {
        Stage.CHECKING: spent(5.0, 5.0, 10.0),
        Stage.COMPILING: spent(40.0, 80.0, 120.0),
        Stage.COMPUTING: spent(7 * 3_600.0, 120.0, 8 * 3_600.0),
        Stage.WRITING: spent(60.0, 130.0, 8 * 3_600.0),
        Stage.PLANNING: spent(90.0, 500.0, 8 * 3_600.0),
    }
    stages = study_stages(DUE, measured, after(hours=8, seconds=1))
    assert seconds(stages) == {
        "waiting": 75.0,
        "checking": 5.0,
        "compiling": 40.0,
        "computing": 7 * 3_600.0,
        "writing": 60.0,
        "planning": 90.0,
        "interrupted": 3_600.0 - 120.0 - 60.0 - 90.0 + 1.0,
    }
    assert sum(seconds(stages).values()) == 8 * 3_600.0 + 1.0
    assert (stages[0].begin, stages[0].end) == (DUE, after(minutes=2))
    assert (stages[3].begin, stages[3].end) == (after(minutes=2), after(hours=8))


@pytest.mark.parametrize(
    ("measured", "shown"),
    [
        ({}, {"waiting": 60.0}),
        ({Stage.CHECKING: spent(1.0, 0.0, 1.0)}, {"waiting": 59.0, "checking": 1.0}),
        ({Stage.PLANNING: spent(30.0, 20.0, 60.0)}, {"waiting": 20.0, "planning": 30.0, "interrupted": 10.0}),
        ({Stage.COMPUTING: spent(1.0, 10.0, 11.0)}, {"waiting": 10.0, "computing": 1.0, "interrupted": 49.0}),
        (  # compiled again for the dispatcher that took over
            {Stage.COMPILING: spent(30.0, 10.0, 50.0), Stage.COMPUTING: spent(20.0, 20.0, 60.0)},
            {"waiting": 10.0, "compiling": 30.0, "computing": 20.0},
        ),
        (  # the clock was put back
            {Stage.COMPUTING: spent(50.0, 0.0, 50.0), Stage.PLANNING: spent(30.0, 50.0, 80.0)},
            {"computing": 50.0, "planning": 10.0},
        ),
    ],
)
def test_the_stages_add_up(measured: dict[Stage, Spent], shown: dict[str, float]) -> None:
    stages = seconds(study_stages(DUE, measured, after(seconds=60)))
    assert stages == shown
    assert sum(stages.values()) == 60.0


def test_the_report_follows_the_study() -> None:
    stages = report_stages(after(hours=8), [after(hours=8, seconds=30), after(hours=8, minutes=1)])
    assert seconds(stages) == {"report": 60.0}
    assert report_stages(after(hours=8), []) == ()


def test_an_outcome_is_kept_with_its_stages() -> None:
    stage = StageTime(Stage.COMPUTING, 3.5, DUE, after(seconds=4))
    outcome = replace(Outcome.of_json({**KEPT, "stages": None}), stages=(stage,))
    assert Outcome.of_json(outcome.to_json()) == outcome
    assert Outcome.of_json(KEPT).stages is None  # from before there were any


KEPT = {"result": "finished", "ended_at": None, "flags": None}


def compute(store: Store, clock: Clock, study: str, *times: tuple[str, str]) -> None:
    """Run the chunks of a study, each between two times of the first of January, the last ones together.

    Its kernel is compiled in the 30 s before the first one, and the last 2 s of the last one pass with writing.
    """
    epoch, number = store.work.take_over("test"), store.studies.get(study).number
    chunks = store.work.open_chunks(number)
    assert len(chunks) >= len(times)
    runs = [(chunk, *times[min(place, len(times) - 1)]) for place, chunk in enumerate(chunks)]
    stages = Stages(store.work, clock)
    clock.set(f"2026-01-01T{min(begin for _, begin, _ in runs)}")
    clock.seconds -= 30.0
    stages.begin(number, Stage.COMPILING)
    clock.seconds += 30.0
    stages.end(number, Stage.COMPILING)
    for begin in sorted({begin for _, begin, _ in runs}):
        clock.set(f"2026-01-01T{begin}")
        store.work.claim(epoch, [chunk for chunk, at, _ in runs if at == begin])
    for chunk, begin, end in sorted(runs, key=lambda run: run[2]):
        clock.set(f"2026-01-01T{begin}")
        since = clock.seconds
        with stages.chunk(chunk.first, chunk, chunk.count):
            clock.set(f"2026-01-01T{end}")
        store.work.quarantine(epoch, chunk, "crashed", "its process died")
        stages.chunk_ended(ports.Outcome(chunk.first, ports.Fate.CRASHED, seconds=clock.seconds - since))
    clock.seconds -= 2.0
    with stages.stage(Stage.WRITING, {number: 1}):
        clock.seconds += 2.0
    stages.keep({})
    store.work.settle(epoch, number)


def night_of(service: Service, clock: Clock, *times: tuple[str, str]) -> tuple[str, str]:
    """A schedule that was due at one, and its study, which ran between those times, or from 01:10 to 01:40."""
    schedule, study = due_at_one(service, clock, zone="Europe/Berlin", cron="0 2 * * *")
    compute(service.store, clock, study, *times or [("01:10", "01:40")])
    clock.set("2026-01-01T01:41")
    Scheduler(service.store).look()
    clock.set("2026-01-01T07:00")
    return schedule, study


def test_time_without_a_chunk_at_work_is_not_computing(service: Service, clock: Clock) -> None:
    night_of(service, clock, ("01:05", "01:15"), ("01:10", "01:20"), ("01:30", "01:40"))
    (run,) = service.get("/night")["runs"]
    found = {stage["stage"]: stage["seconds"] for stage in run["stages"]}
    assert (found["interrupted"], found["computing"]) == (600.0, 25 * 60.0 - 2.0)


def test_they_are_answered_and_kept_when_the_study_is_deleted(service: Service, clock: Clock) -> None:
    schedule, study = night_of(service, clock)
    (run,) = service.get("/night")["runs"]
    found = {stage["stage"]: stage["seconds"] for stage in run["stages"]}
    assert found == {"waiting": 570.0, "compiling": 30.0, "computing": 1_798.0, "writing": 2.0}
    computing = next(stage for stage in run["stages"] if stage["stage"] == "computing")
    assert computing["begin"] == "2026-01-01T01:10:00.000000Z"
    assert computing["begin_local"] == "2026-01-01T02:10:00+01:00"
    assert last(service.store, schedule).stages is not None
    service.store.studies.delete(study, at_once=True)
    service.store.purging.purge()
    (again,) = service.get("/night")["runs"]
    assert again["stages"] == run["stages"]


def test_the_page_says_what_took_longest(service: Service, clock: Clock) -> None:
    night_of(service, clock)
    page = service.http.get("/nights?hours=744", headers={"Accept-Language": "en"}).text
    assert "40 min in all, 30 min of them computing" in page
    assert re.findall(r'<td class="name">([A-Z][^<]+)</td>', page) == [
        "Waiting for its first case", "Compiling", "Computing", "Writing rows",
    ]  # fmt: skip
    assert "Обчислення" in service.http.get("/nights?hours=744", headers={"Accept-Language": "uk"}).text


def test_the_command_shows_them_on_the_clock_of_the_schedule(
    service: Service, clock: Clock, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    schedule, study = night_of(service, clock)
    name = service.get(f"/schedules/{schedule}")["name"] or schedule
    run = runner(service, monkeypatch, capsys)
    code, out, _ = run("night", "--hours", "744", "--stages")
    assert code == 4  # no case ended ok
    (line,) = (line.split("\t") for line in out.splitlines() if "Computing" in line)
    day = "2026-01-01T{}+01:00".format
    assert line == [name, study, "Computing", day("02:10:00"), day("02:39:58"), "1798.0"]
    assert "Computing" not in run("night", "--hours", "744")[1]
