"""What schedules did lately: due times with their outcomes, those that need attention first."""

from __future__ import annotations

from dataclasses import replace
from datetime import timedelta
from typing import TYPE_CHECKING, Final

from sprag_study.sentences import Sentence
from sprag_study.service.answers import filled
from sprag_study.service.answers.schedules import Night, NightRun, RunOutcome, SentReport, StageSeconds
from sprag_study.service.delivery import origin_of
from sprag_study.service.jobs.reports.watchdog import late_json, late_runs
from sprag_study.service.json_text import timestamp
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.stages import report_stages, study_stages
from sprag_study.service.schedules.times import local_time
from sprag_study.service.schedules.trouble import usual_flags
from sprag_study.service.storage.errors import StudyNotFoundError
from sprag_study.worker import models

if TYPE_CHECKING:
    from collections.abc import Iterable

    from sprag_study.service.schedules.outcomes import Outcome
    from sprag_study.service.storage.schedules.reports import ReportRecord
    from sprag_study.service.storage.schedules.runs import EndedRun
    from sprag_study.service.storage.schedules.runs import NightRun as Run
    from sprag_study.service.storage.store import Store

#: Hours that are looked back on by default, and at most.
HOURS: Final = 24
MOST_HOURS: Final = 24 * 31
#: Most due times in an answer, the latest ones.
MOST_RUNS: Final = 1000


def whole_outcome(store: Store, run: EndedRun | Run) -> Outcome:
    """The outcome of a run, with the endings, flags and coverage of its study where it is over; raises StoreError.

    The flags are judged once, as its schedule says by then; irregular motion is a regime like others, unless the
    schedule names it.
    """
    outcome = run.outcome
    if outcome.study is None or not outcome.result.final or outcome.flags is not None:
        return outcome
    try:
        study, progress = store.studies.look(outcome.study)
        kinds, times = store.rows.kinds(outcome.study), store.times.of_study(outcome.study)
    except StudyNotFoundError:  # it was deleted in the meantime
        return outcome
    usual = usual_flags(study.model)
    trouble = usual if run.trouble_flags is None else run.trouble_flags
    return replace(
        outcome,
        endings={name: count for name, count in progress.endings.items() if name != "ok"},
        flags={
            name: count
            for name, count in kinds.flags.items()
            if name in {*trouble, *usual} or name not in models.REGIME_SENTENCES
        },
        trouble_flags=trouble,
        coverage=None if progress.covered is None else progress.covered.sentence,
        stages=study_stages(run.due, times, outcome.ended_at or store.clock.now()),
    )


def conclude_runs(store: Store) -> int:
    """Keep the outcomes of the due times that are over by now; returns how many."""
    return sum(store.runs.conclude(run, whole_outcome(store, run)) for run in store.runs.ended())


def outcome_json(outcome: Outcome) -> RunOutcome:
    """An outcome for answers."""
    return filled(RunOutcome, outcome)


def report_json(report: ReportRecord) -> SentReport:
    """A report for answers; the path of a webhook can be a secret of its receiver."""
    target = origin_of(report.target) or "" if report.channel == "webhook" else report.target
    return filled(SentReport, report, target=target)


def _stages(run: Run, reports: Iterable[ReportRecord]) -> list[StageSeconds] | None:
    """What took how long, from the due time to the end of the study or to its last report; None until it is over."""
    outcome = run.outcome
    if outcome.stages is None:
        return None
    stages = outcome.stages
    if outcome.ended_at is not None:
        sent = (report.ended_at for report in reports if report.kind == "run" and report.ended_at is not None)
        stages += report_stages(outcome.ended_at, sent)
    return [
        filled(
            StageSeconds,
            stage,
            begin_local=local_time(stage.begin, run.zone),
            end_local=local_time(stage.end, run.zone),
        )
        for stage in stages
    ]


def why_off(store: Store) -> str | None:
    """Why no schedule runs: the database is a copy; None where they run."""
    return Sentence(recorded.COPY) if store.schedules.any() and store.deployment.is_copy() else None


def night(store: Store, hours: float = HOURS) -> Night:
    """The due times of the last ``hours``: first those that need attention, each group latest first."""
    until = store.clock.now()
    since = until - timedelta(hours=hours)
    found, sent = store.runs.between(since, until, MOST_RUNS), store.reports.between(since, until)
    # Those that ended a moment ago, or were changed since, have not been counted yet.
    found = [replace(run, outcome=whole_outcome(store, run)) for run in found]
    runs = [
        filled(
            NightRun,
            run,
            due_local=local_time(run.due, run.zone),
            outcome=outcome_json(run.outcome),
            reports=[report_json(report) for report in sent.get((run.schedule, run.due), ())],
            stages=_stages(run, sent.get((run.schedule, run.due), ())),
        )
        for run in sorted(found, key=lambda run: not run.outcome.trouble)
    ]
    return {
        "since": timestamp(since),
        "until": timestamp(until),
        "off": why_off(store),
        "trouble": sum(run.outcome.trouble for run in found),
        "late": [late_json(late) for late in late_runs(store)],
        "runs": runs,
    }
