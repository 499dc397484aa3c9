"""The fields of a schedule as a client gives them, checked like a spec: every fault has its JSON Pointer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import timedelta
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import characters
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.schedules.deadline import ALLOWED_OF_RUNS, FinishError, check_run_finish, run_finish_at
from sprag_study.service.schedules.policies import GRACE_ALLOWED, CatchUp, Overlap, Policies, check_grace
from sprag_study.service.schedules.report_to import ReportTo, ReportWhen, read_report_to
from sprag_study.service.schedules.times import (
    Timing,
    TimingError,
    Window,
    check_cron,
    local_time,
    read_moment,
    read_time_of_day,
)
from sprag_study.service.schedules.trouble import read_trouble_flags
from sprag_study.service.spec.described import Described, choice, named
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.service.zones import zones
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from datetime import datetime

PLAIN: Final = named(
    Described("priority", "", "priority of its studies", "whole", -MAX_PRIORITY, MAX_PRIORITY, 0),
    Described("fresh", "", "run every case, including those that other studies already have", "flag", default=False),
    Described("enabled", "", "whether it is due at all", "flag", default=True),
    choice(
        "overlap",
        "at a due time while an earlier study of the schedule is queued, running or held by its window: queue, its "
        "study waits its turn; skip, the due time has no study; replace, the earlier study is cancelled",
        *Overlap,
        default=Overlap.QUEUE,
    ),
    choice(
        "catch_up",
        "which of several due times are run that passed while no worker was running: latest; all, up to the latest 50; "
        "none",
        *CatchUp,
        default=CatchUp.LATEST,
    ),
    choice(
        "report_when",
        "whether it reports after every run, or only after those that need attention",
        *ReportWhen,
        default=ReportWhen.ALWAYS,
    ),
)
FIELDS: Final = (
    *("name", "spec", "cron", "at", "zone", "window", "finish_by", *PLAIN, "misfire_grace", "paused_until"),
    *("trouble_flags", "report_email", "report_webhook"),
)
CRON_ALLOWED: Final = N_(
    'five fields, such as "0 22 * * 1-5": at 22:00 from Monday to Friday; or "@daily" and the like'
)
AT_ALLOWED: Final = N_("a future time, such as 2027-01-31 22:00")
_WHEN_ALLOWED: Final = N_(
    'either `cron`, five fields, such as "0 22 * * 1-5": at 22:00 from Monday to Friday; or "@daily" and the like; or '
    "`at`, a future time, such as 2027-01-31 22:00"
)
_WINDOW_ALLOWED: Final = N_("two different times of day, such as 22:00 and 06:00")
_LONGEST_CRON: Final = 200
#: Runs of a new schedule whose window is compared with their deadline.
_RUNS_LOOKED_AT: Final = 7


@dataclass(frozen=True, slots=True)
class ScheduleFields:
    """A complete schedule: what is run (``spec``, the user's own), when, and how.

    Each run is held at ``finish_by``, whether finished or not: a time of day in the zone, or a duration. Cases with one
    of ``trouble_flags`` need attention; None: `usual_flags` of the model.
    """

    name: str
    spec: dict[str, Any]
    timing: Timing
    window: Window | None
    priority: int
    fresh: bool
    enabled: bool
    finish_by: str | None = None
    policies: Policies = field(default_factory=Policies)
    report_to: ReportTo = field(default_factory=ReportTo)
    trouble_flags: tuple[str, ...] | None = None

    @property
    def times(self) -> tuple[Timing, Window | None, str | None, bool, datetime | None]:
        """The fields that determine when its runs begin, may run and end."""
        return self.timing, self.window, self.finish_by, self.enabled, self.policies.paused_until

    def next_due(self, now: datetime) -> datetime | None:
        """The next due time; None for a schedule that is disabled or over."""
        paused = self.policies.paused_until
        if not self.enabled:
            return None
        if paused is None or paused <= now:
            return self.timing.next_after(now)
        # One that is due at the end of the pause runs then.
        return self.timing.next_after(paused - timedelta(microseconds=1))

    def to_json(self) -> dict[str, Any]:
        """The fields as `read_fields` reads them."""
        timing, window, policies = self.timing, self.window, self.policies
        when: dict[str, Any] = {"cron": timing.cron}
        if timing.at is not None:
            when = {"at": local_time(timing.at, timing.zone)}
        paused = policies.paused_until
        return {
            "name": self.name,
            "spec": self.spec,
            **when,
            "zone": timing.zone,
            "window": None if window is None else [f"{window.begin:%H:%M}", f"{window.end:%H:%M}"],
            "priority": self.priority,
            "fresh": self.fresh,
            "finish_by": self.finish_by,
            "overlap": policies.overlap.value,
            "catch_up": policies.catch_up.value,
            "misfire_grace": policies.misfire_grace,
            "enabled": self.enabled,
            "paused_until": None if paused is None else local_time(paused, timing.zone),
            "trouble_flags": None if self.trouble_flags is None else list(self.trouble_flags),
            **self.report_to.to_json(),
        }


def read_fields(data: object, now: datetime) -> ScheduleFields:
    """Read the fields of a new schedule; raises SpecError with all faults."""
    return _read(data, now)


def change_fields(fields: ScheduleFields, data: object, now: datetime) -> ScheduleFields:
    """Replace the fields given in ``data``; raises SpecError."""
    report = Report(data)
    node = Node(report, "", data)
    node.has(FIELDS)
    report.raise_if_any()
    given = node.value
    whole = fields.to_json()
    if {"cron", "at"} & set(given):
        whole.pop("cron", None)
        whole.pop("at", None)
    # A time that is not given anew may have passed.
    return _read({**whole, **given}, now, old=None if "at" in given else fields)


def _read(data: object, now: datetime, old: ScheduleFields | None = None) -> ScheduleFields:
    report = Report(data)
    node = Node(report, "", data)
    found = node.value if node.has(FIELDS) else {}
    zone = _read_zone(report, found.get("zone", "UTC"))
    timing = _read_timing(report, found, zone, now, old)
    window = _read_window(report, found.get("window"), zone)
    priority, fresh, enabled, overlap, catch_up, when = (plain.read(node) for plain in PLAIN.values())
    finish_by = _read_duration(report, "finish_by", found, check_run_finish, ALLOWED_OF_RUNS)
    grace = _read_duration(report, "misfire_grace", found, check_grace, GRACE_ALLOWED)
    paused_until = _read_pause(report, found.get("paused_until"), zone, now, old)
    report_to = read_report_to(report, found, when)
    title, spec = _read_spec(report, found, old)
    flags = read_trouble_flags(report, found, spec.get("model"))
    name = _read_name(report, found.get("name"), title)
    report.raise_if_any()
    assert timing is not None
    if timing.at is not None and paused_until is not None and paused_until > timing.at:
        report.fault(
            "/paused_until", "conflict", "is later than `at`", found["paused_until"], allowed="a time before `at`"
        )
        report.raise_if_any()
    policies = Policies(Overlap(overlap), CatchUp(catch_up), grace, paused_until)
    fields = ScheduleFields(name, spec, timing, window, priority, fresh, enabled, finish_by, policies, report_to, flags)
    if old is None or fields.times != old.times:
        _require_open_window(report, fields, now)
        report.raise_if_any()
    return fields


def _require_open_window(report: Report, fields: ScheduleFields, now: datetime) -> None:
    """Refuse a window that is closed from each due time to its deadline: no case would ever run."""
    window, finish_by = fields.window, fields.finish_by
    if window is None or finish_by is None:
        return
    due, looked_at = fields.next_due(now), 0
    while due is not None and looked_at < _RUNS_LOOKED_AT:
        if window.opens_between(due, run_finish_at(finish_by, fields.timing.zone, due)):
            return
        due, looked_at = fields.timing.next_after(due), looked_at + 1
    if looked_at:
        report.fault(
            "/window",
            "conflict",
            Sentence(
                "is closed from each due time to its deadline ({deadline}), so that no case would run",
                deadline=finish_by,
            ),
            [f"{window.begin:%H:%M}", f"{window.end:%H:%M}"],
            allowed=_WINDOW_ALLOWED,
        )


def _read_spec(report: Report, found: Mapping[str, Any], old: ScheduleFields | None) -> tuple[str, dict[str, Any]]:
    if "spec" not in found:
        report.fault("/spec", "required", "is missing", allowed="a study spec")
        return "", {}
    if old is not None and found["spec"] == old.spec:
        return old.name, old.spec
    try:
        parsed = parse_spec(found["spec"])
    except SpecError as error:
        report.faults += [replace(item, where=f"/spec{item.where}") for item in error.faults]
        return "", {}
    return parsed.study.name, parsed.spec


def _read_name(report: Report, value: object, title: str) -> str:
    if value is None:
        return title
    if not isinstance(value, str) or not value.isprintable() or not 1 <= len(value) <= MAX_NAME_LENGTH:
        report.fault(
            "/name",
            "invalid-text",
            "must be a printable text in one line",
            value,
            allowed=characters(1, MAX_NAME_LENGTH),
        )
        return ""
    return value


def _read_zone(report: Report, value: object) -> str:
    if isinstance(value, str) and value in zones():
        return value
    hint = did_you_mean(value, zones()) if isinstance(value, str) else Sentence("")
    report.fault(
        "/zone", "unknown-name", Sentence("is not a time zone{hint}", hint=hint), value,
        allowed='a name such as "Europe/Berlin" or "UTC"',
    )  # fmt: skip
    return "UTC"


def _read_timing(
    report: Report, found: Mapping[str, Any], zone: str, now: datetime, old: ScheduleFields | None
) -> Timing | None:
    cron, at = found.get("cron"), found.get("at")
    if (cron is None) == (at is None):
        report.fault(
            "/cron", "exactly-one", "is required: the time to run" if cron is None else "is given beside `at`", cron,
            allowed=_WHEN_ALLOWED,
        )  # fmt: skip
        return None
    if cron is not None:
        try:
            if not isinstance(cron, str) or len(cron) > _LONGEST_CRON:
                raise TimingError("invalid-time", "is not a cron expression")
            check_cron(cron)
        except TimingError as error:
            report.fault("/cron", error.code, error.message, cron, allowed=CRON_ALLOWED)
            return None
        return Timing(" ".join(cron.split()), None, zone)
    try:
        if not isinstance(at, str):
            raise TimingError("wrong-type", "is not a time")
        moment = read_moment(at, zone)
        if moment <= now and not (old is not None and old.timing.at == moment):
            raise TimingError("out-of-range", "is in the past")
    except TimingError as error:
        report.fault("/at", error.code, error.message, at, allowed=AT_ALLOWED)
        return None
    return Timing(None, moment, zone)


def _read_pause(report: Report, value: object, zone: str, now: datetime, old: ScheduleFields | None) -> datetime | None:
    if value is None:
        return None
    try:
        if not isinstance(value, str):
            raise TimingError("wrong-type", "is not a time")
        moment = read_moment(value, zone)
        if moment <= now and not (old is not None and old.policies.paused_until == moment):
            raise TimingError("out-of-range", "is in the past")
    except TimingError as error:
        report.fault("/paused_until", error.code, error.message, value, allowed=AT_ALLOWED)
        return None
    return moment


def _read_duration(
    report: Report, name: str, found: Mapping[str, Any], check: Callable[[str], str], allowed: str
) -> str | None:
    value = found.get(name)
    if value is None:
        return None
    try:
        if not isinstance(value, str):
            raise FinishError("wrong-type", "must be a text")
        return check(value)
    except FinishError as error:
        report.fault(f"/{name}", error.code, error.message, value, allowed=allowed)
        return None


def _read_window(report: Report, value: object, zone: str) -> Window | None:
    if value is None:
        return None
    if not (isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(item, str) for item in value)):
        report.fault("/window", "wrong-type", "is not a time window", value, allowed=_WINDOW_ALLOWED)
        return None
    try:
        begin, end = map(read_time_of_day, value)
        if begin == end:
            raise TimingError("invalid-range", "begins and ends at the same time")
    except TimingError as error:
        report.fault("/window", error.code, error.message, value, allowed=_WINDOW_ALLOWED)
        return None
    return Window(begin, end, zone)
