"""Taking a study in: the one way for the interface, the form and the schedules."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING

from service.errors import ApiError
from service.finish import finish_warnings
from service.preview import estimated_bytes, estimated_seconds
from service.storage.room import RESERVE_BYTES
from worker.limits import MAX_WAITING_STUDIES

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from service.spec import ParsedSpec
    from service.storage.records import StudyRecord
    from service.storage.store import Store


def accept(
    store: Store,
    parsed: ParsedSpec,
    idempotency_key: str | None = None,
    priority: int = 0,
    fresh: bool = False,
    finish_by: datetime | None = None,
    given: Mapping[str, object] | None = None,
) -> StudyRecord:
    """Take a study in, warnings and all; ApiError when its results would not fit on the disk.

    One key means one spec with one set of ``given`` parameters, as the client wrote them: a deadline "8 h" is another
    moment at each sending.
    """
    asked = [parsed.spec, dict(given)] if given else parsed.spec
    body_hash = hashlib.sha256(json.dumps(asked, sort_keys=True).encode("ascii")).hexdigest()
    known = store.study_of_key(idempotency_key, body_hash) if idempotency_key else None
    if known is not None:
        return known
    if store.waiting_studies() >= MAX_WAITING_STUDIES:
        raise ApiError("queue-full", f"{MAX_WAITING_STUDIES:,} studies have not ended yet.")
    _require_room(store, parsed)
    warnings = (*parsed.warnings, *store.chunking.warnings(parsed.study))
    if finish_by is not None:
        to_run = parsed.study.cases - (0 if fresh else store.reusable(parsed.study))
        seconds = estimated_seconds(parsed.study, store.chunking, to_run)
        left = (finish_by - store.clock.now()).total_seconds()
        warnings += finish_warnings(parsed.study, seconds, left)
    return store.create_study(
        parsed.spec,
        parsed.study,
        warnings=warnings,
        idempotency_key=idempotency_key,
        body_hash=body_hash,
        priority=priority,
        fresh=fresh,
        finish_by=finish_by,
    )


def _require_room(store: Store, parsed: ParsedSpec) -> None:
    """Refuse a study whose results would not fit on the disk."""
    needed, left = estimated_bytes(parsed.study), max(store.room() - RESERVE_BYTES, 0)
    if needed > left:
        raise ApiError(
            "storage-full",
            f"The results would take about {_size(needed)}; the database has room for {_size(left)} more.",
        )


def _size(count: int) -> str:
    return f"{count / 1e9:.3g} GB" if count >= 1e8 else f"{count / 1e6:.3g} MB"
