"""Submission of studies, shared by the HTTP interface, the form and the schedules."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass, field, replace
from itertools import chain, count
from typing import TYPE_CHECKING, Any, Final

from sprag_study.sentences import Amount, Sentence
from sprag_study.service.faults import FaultError
from sprag_study.service.jobs.preview import estimated_bytes, estimated_seconds
from sprag_study.service.languages import recorded
from sprag_study.service.schedules.deadline import finish_warnings
from sprag_study.service.spec.fields import renamed
from sprag_study.service.storage.studies.listing import names_beginning
from sprag_study.service.storage.studies.study_row import study_row
from sprag_study.service.storage.work.room import RESERVE_BYTES
from sprag_study.worker.limits import MAX_NAME_LENGTH, MAX_WAITING_STUDIES
from sprag_study.worker.planning import most_cases

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from sprag_study.service.spec.document import ParsedSpec
    from sprag_study.service.storage.schedules.runs import OpenRun
    from sprag_study.service.storage.store import Store
    from sprag_study.service.storage.studies.records import StudyRecord

#: Characters of the longest number behind a name, with its blank.
_NUMBER: Final = 8


@dataclass(frozen=True, slots=True)
class Order:
    """How a study is to be submitted.

    Attributes
    ----------
    now : time of the request
    given : the parameters of the request beside the spec, as the client wrote them: an idempotency key stands for one
        spec with one set of them, because a deadline "8 h" is a different time in each request
    fresh : whether cases run that other studies have
    finish_by : the deadline (UTC)
    """

    now: datetime
    given: Mapping[str, object] = field(default_factory=dict)
    fresh: bool = False
    finish_by: datetime | None = None


@dataclass(frozen=True, slots=True)
class Submission:
    """A checked study, ready to be stored.

    Attributes
    ----------
    row : dict
        See `sprag_study.service.storage.studies.study_row`.
    body_hash : str
        Hash of the spec and the parameters of the request, for the idempotency key.
    bytes : int
        Rough size of its results.
    order : Order
    same_as : str
        See `sprag_study.service.spec.document.ParsedSpec`.
    """

    row: dict[str, Any]
    body_hash: str
    bytes: int
    order: Order
    same_as: str = ""


def hash_of(asked: object) -> str:
    """Hash of a request, as plain data, for its idempotency key; the order of names does not matter."""
    return hashlib.sha256(json.dumps(asked, sort_keys=True).encode("ascii")).hexdigest()


def submission(parsed: ParsedSpec, store: Store, order: Order) -> Submission:
    """The submission of ``parsed`` to ``store``, with all its warnings."""
    asked = [parsed.spec, dict(order.given)] if order.given else parsed.spec
    if parsed.follows:  # not in the hash: the same request has the same key when its study is there
        parsed = _named_apart(parsed, store)
    warnings = (*parsed.warnings, *store.dispatchers.chunking.warnings(parsed.study))
    if order.finish_by is not None:
        to_run = most_cases(parsed.study) - (0 if order.fresh else store.reuse.count(parsed.study))
        seconds = estimated_seconds(parsed.study, store.dispatchers.chunking, to_run)
        warnings += finish_warnings(parsed.study, seconds, (order.finish_by - order.now).total_seconds())
    size = estimated_bytes(parsed.study)
    row = {**study_row(parsed.spec, parsed.study, store.dispatchers.chunking, warnings), "estimated_bytes": size}
    return Submission(row, hash_of(asked), size, order, parsed.same_as)


def _named_apart(parsed: ParsedSpec, store: Store) -> ParsedSpec:
    """The study with a number behind a name that a study has already: *feeder, extended 2*."""
    name = parsed.study.name
    names = names_beginning(store.session, name[: MAX_NAME_LENGTH - _NUMBER])
    numbered = (renamed(name, f" {number}") for number in count(2))
    free = next(free for free in chain([name], numbered) if free not in names)
    return replace(parsed, spec={**parsed.spec, "name": free}, study=replace(parsed.study, name=free))


def accept(
    store: Store,
    parsed: ParsedSpec,
    priority: int = 0,
    fresh: bool = False,
    finish_by: datetime | None = None,
    run: OpenRun | None = None,
) -> StudyRecord:
    """Accept a study with its warnings; errors as of `take_in`."""
    made = submission(parsed, store, Order(store.clock.now(), fresh=fresh, finish_by=finish_by))
    return take_in(store, made, priority=priority, run=run)


def take_in(
    store: Store,
    made: Submission,
    idempotency_key: str | None = None,
    priority: int = 0,
    run: OpenRun | None = None,
) -> StudyRecord:
    """Store a submission, unless a study has all of its cases: then it is that one.

    FaultError when there are too many studies, or no room for its results.

    It is the study of ``run``, the due time of a schedule: RunClosedError where this has an outcome by now.
    """
    known = store.studies.of_key(idempotency_key, made.body_hash) if idempotency_key else None
    if known is not None:
        return known
    if made.same_as:
        return store.studies.get(made.same_as)
    _require_room(store, made.bytes)
    return store.studies.insert(
        made.row,
        idempotency_key=idempotency_key,
        body_hash=made.body_hash,
        priority=priority,
        fresh=made.order.fresh,
        finish_by=made.order.finish_by,
        run=run,
        queue=MAX_WAITING_STUDIES,
    )


def _require_room(store: Store, needed: int) -> None:
    """Refuse a study whose results would not fit on the disk."""
    left = max(store.room.left() - RESERVE_BYTES, 0)
    if needed > left:
        raise FaultError(
            "storage-full",
            Sentence(recorded.NO_ROOM_FOR_RESULTS, size=_size(needed), room=_size(left)),
        )


def _size(count: int) -> Amount:
    return Amount(count / 1e9, "GB", 3) if count >= 1e8 else Amount(count / 1e6, "MB", 3)
