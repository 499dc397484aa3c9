"""The fields of a schedule as a client gives them, checked like a spec: every fault has its JSON Pointer."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from datetime import timedelta
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeVar

from sprag_study.sentences import Sentence
from sprag_study.service.languages import N_
from sprag_study.service.reading.limits import characters
from sprag_study.service.reading.texts import did_you_mean
from sprag_study.service.schedules.deadline import ALLOWED_OF_RUNS, check_run_finish, run_finish_at
from sprag_study.service.schedules.policies import GRACE_ALLOWED, CatchUp, Overlap, Policies, check_grace
from sprag_study.service.schedules.report_to import (
    LONGEST_WEBHOOK,
    MOST_RECIPIENTS,
    ReportTo,
    ReportWhen,
    read_report_to,
)
from sprag_study.service.schedules.times import (
    ALIASES,
    Timing,
    TimingError,
    Window,
    check_cron,
    local_time,
    read_moment,
    read_time_of_day,
)
from sprag_study.service.schedules.trouble import read_trouble_flags
from sprag_study.service.spec.described import Described, Record, choice, named
from sprag_study.service.spec.document import parse_spec
from sprag_study.service.spec.node import Node
from sprag_study.service.spec.report import Report, SpecError
from sprag_study.service.zones import zones
from sprag_study.worker.codes import FLAG_MASKS
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_PRIORITY

if TYPE_CHECKING:
    from collections.abc import Callable
    from datetime import datetime

R = TypeVar("R")

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
CRON_ALLOWED: Final = N_(
    'five fields, such as "0 22 * * 1-5": at 22:00 from Monday to Friday; or "@daily" and the like'
)
AT_ALLOWED: Final = N_("a future time, such as 2027-01-31 22:00")
_WHEN_ALLOWED: Final = N_(
    'either `cron`, five fields, such as "0 22 * * 1-5": at 22:00 from Monday to Friday; or "@daily" and the like; or '
    "`at`, a future time, such as 2027-01-31 22:00"
)
_WINDOW_ALLOWED: Final = N_("two different times of day, such as 22:00 and 06:00")
_TIME_OF_DAY: Final = {"type": "string", "pattern": "^([01]?[0-9]|2[0-3]):[0-5][0-9]$"}
#: A schedule as a client gives it.
SCHEDULE: Final = Record(
    {
        "name": {
            "type": ["string", "null"],
            "minLength": 1,
            "maxLength": MAX_NAME_LENGTH,
            "description": "name of its studies; by default the spec's name",
        },
        "spec": {"$ref": "#/components/schemas/Spec"},
        "cron": {
            "type": ["string", "null"],
            "description": "recurring: minute, hour, day of the month, month, day of the week, in `zone`; or "
            + ", ".join(f"`{name}`" for name in ALIASES),
        },
        "at": {
            "type": ["string", "null"],
            "description": "once: a future time, in `zone` unless it has its own offset",
        },
        "zone": {"type": "string", "default": "UTC", "description": "name of the time zone"},
        "window": {
            "type": ["array", "null"],
            "minItems": 2,
            "maxItems": 2,
            "items": _TIME_OF_DAY,
            "description": "its studies run between these times of day, in `zone`, and are held outside",
        },
        "finish_by": {
            "type": ["string", "null"],
            "maxLength": 80,
            "description": f"deadline: each study is run coarse to fine and held then: {ALLOWED_OF_RUNS}",
        },
        **PLAIN,
        "misfire_grace": {
            "type": ["string", "null"],
            "maxLength": 80,
            "description": f"longest delay with which a due time is still run; null: any; {GRACE_ALLOWED}",
        },
        "paused_until": {
            "type": ["string", "null"],
            "description": "the schedule is not due before: a future time, in `zone` unless it has its own offset",
        },
        "trouble_flags": {
            "type": ["array", "null"],
            "uniqueItems": True,
            "items": {"enum": list(FLAG_MASKS)},
            "default": None,
            "description": "a run with a case that has one of these flags of its model needs attention; an empty list: "
            "flags do not matter; null: those of motions that had not settled, `unsettled` and `not_settled`",
        },
        "report_email": {
            "type": "array",
            "maxItems": MOST_RECIPIENTS,
            "items": {"type": "string", "format": "email", "maxLength": 254},
            "default": [],
            "description": "addresses to which its runs are reported; needs `SPRAG_SMTP_URL`",
        },
        "report_webhook": {
            "type": ["string", "null"],
            "maxLength": LONGEST_WEBHOOK,
            "description": "address to which its runs are reported by a signed POST; its origin must be allowed by "
            "`SPRAG_WEBHOOK_ORIGINS`",
        },
    },
    "A study and when it is to run; either `cron` or `at`.",
    required=("spec",),
)
CHANGE: Final = Record(SCHEDULE.fields, "The fields of a schedule to change.")
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
            "window": None if window is None else window.to_json(),
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
    node = Node(Report(data), "", data)
    CHANGE.read(node)
    node.report.raise_if_any()
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
    SCHEDULE.read(node)
    zone = _read_zone(node["zone"].otherwise("UTC"))
    timing = _read_timing(node, zone, now, None if old is None else old.timing.at)
    window = _optional(node["window"], partial(_window, zone=zone), _WINDOW_ALLOWED)
    priority, fresh, enabled, overlap, catch_up, when = (plain.read(node) for plain in PLAIN.values())
    finish_by = _optional(node["finish_by"], partial(_duration, check=check_run_finish), ALLOWED_OF_RUNS)
    grace = _optional(node["misfire_grace"], partial(_duration, check=check_grace), GRACE_ALLOWED)
    ends = partial(_moment, zone=zone, now=now, kept=None if old is None else old.policies.paused_until)
    paused_until = _optional(node["paused_until"], ends, AT_ALLOWED)
    report_to = read_report_to(node, when)
    title, spec = _read_spec(node["spec"], old)
    flags = read_trouble_flags(node["trouble_flags"], spec.get("model"))
    name = title if node["name"].value is None else _read_name(node["name"])
    report.raise_if_any()
    assert timing is not None
    if timing.at is not None and paused_until is not None and paused_until > timing.at:
        node["paused_until"].refuse("conflict", "is later than `at`", allowed="a time before `at`")
        report.raise_if_any()
    policies = Policies(Overlap(overlap), CatchUp(catch_up), grace, paused_until)
    fields = ScheduleFields(name, spec, timing, window, priority, fresh, enabled, finish_by, policies, report_to, flags)
    if old is None or fields.times != old.times:
        _require_open_window(node["window"], fields, now)
        report.raise_if_any()
    return fields


def _require_open_window(node: Node, fields: ScheduleFields, now: datetime) -> None:
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
        closed = Sentence(
            "is closed from each due time to its deadline ({deadline}), so that no case would run", deadline=finish_by
        )
        node.refuse("conflict", closed, window.to_json(), allowed=_WINDOW_ALLOWED)


def _read_spec(node: Node, old: ScheduleFields | None) -> tuple[str, dict[str, Any]]:
    """The name of the study and its spec, which is not read again where it is that of the ``old`` schedule."""
    if not node.given:
        node.refuse("required", "is missing", allowed="a study spec")
        return "", {}
    if old is not None and node.value == old.spec:
        return old.name, old.spec
    try:
        parsed = parse_spec(node.value)
    except SpecError as error:
        node.report.faults += [replace(item, where=f"/spec{item.where}") for item in error.faults]
        return "", {}
    return parsed.study.name, parsed.spec


def _read_name(node: Node) -> str:
    value = node.value
    if isinstance(value, str) and value.isprintable() and 1 <= len(value) <= MAX_NAME_LENGTH:
        return value
    node.refuse("invalid-text", "must be a printable text in one line", allowed=characters(1, MAX_NAME_LENGTH))
    return ""


def _read_zone(node: Node) -> str:
    value = node.value
    if isinstance(value, str) and value in zones():
        return value
    hint = did_you_mean(value, zones()) if isinstance(value, str) else Sentence("")
    message = Sentence("is not a time zone{hint}", hint=hint)
    node.refuse("unknown-name", message, allowed='a name such as "Europe/Berlin" or "UTC"')
    return "UTC"


def _read_timing(schedule: Node, zone: str, now: datetime, kept: datetime | None) -> Timing | None:
    cron, at = schedule["cron"], schedule["at"]
    if (cron.value is None) == (at.value is None):
        missing = cron.value is None
        cron.refuse("exactly-one", "is required: the time to run" if missing else "is given beside `at`",
                    allowed=_WHEN_ALLOWED)  # fmt: skip
        return None
    expression = _optional(cron, _cron, CRON_ALLOWED)
    moment = _optional(at, partial(_moment, zone=zone, now=now, kept=kept), AT_ALLOWED)
    return None if expression is None and moment is None else Timing(expression, moment, zone)


def _optional(node: Node, parse: Callable[[Any], R], allowed: str) -> R | None:
    """What ``parse`` makes of a value; None for null, and, with a fault recorded, where it raises TimingError."""
    return None if node.value is None else node.parsed(parse, allowed=allowed)


def _cron(value: object) -> str:
    if not isinstance(value, str) or len(value) > _LONGEST_CRON:
        raise TimingError("invalid-time", "is not a cron expression")
    check_cron(value)
    return " ".join(value.split())


def _moment(value: object, *, zone: str, now: datetime, kept: datetime | None) -> datetime:
    """A future time; that which is ``kept`` may have passed."""
    if not isinstance(value, str):
        raise TimingError("wrong-type", "is not a time")
    moment = read_moment(value, zone)
    if moment <= now and moment != kept:
        raise TimingError("out-of-range", "is in the past")
    return moment


def _duration(value: object, *, check: Callable[[str], str]) -> str:
    if not isinstance(value, str):
        raise TimingError("wrong-type", "must be a text")
    return check(value)


def _window(value: object, *, zone: str) -> Window:
    if not (isinstance(value, list | tuple) and len(value) == 2 and all(isinstance(item, str) for item in value)):
        raise TimingError("wrong-type", "is not a time window")
    begin, end = map(read_time_of_day, value)
    if begin == end:
        raise TimingError("invalid-range", "begins and ends at the same time")
    return Window(begin, end, zone)
