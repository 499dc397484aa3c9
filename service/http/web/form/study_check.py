"""Check of a filled form: functions for the checking processes."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag_study.service.http.web.form.check import Checked, look_over
from sprag_study.service.jobs.submission import Order, Submission, submission
from sprag_study.service.views.library import Library

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime

    from sprag_study.service.reading.reader import Choice


def form(library: Library, values: Mapping[str, str], now: datetime, choice: Choice) -> Checked:
    """Check a filled form; ``choice`` has the units and names of the sentence about it."""
    store = library.store
    # The study itself is not returned: it can be large, and no page shows it.
    return replace(look_over(values, store.dispatchers.chunking, store.reuse.count, now, choice), parsed=None)


def form_study(library: Library, values: Mapping[str, str], now: datetime) -> tuple[Checked, Submission | None]:
    """Check a filled form; also its study, None where the form has faults."""
    store = library.store
    checked = look_over(values, store.dispatchers.chunking, store.reuse.count, now)
    made = None
    if checked.parsed is not None:
        made = submission(checked.parsed, store, Order(now, finish_by=checked.finish))
    return replace(checked, parsed=None), made
