"""A filled form, looked over: functions for the processes that check."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from sprag.service.http.web.form.check import Checked, look_over
from sprag.service.jobs.checks import Library
from sprag.service.jobs.submission import Submission, submission

if TYPE_CHECKING:
    from collections.abc import Mapping
    from datetime import datetime


def form(library: Library, values: Mapping[str, str], now: datetime) -> Checked:
    """A filled form, looked over."""
    store = library.store
    # The study itself stays here: it can be large, and nobody shows it.
    return replace(look_over(values, store.chunking, store.reusable, now), parsed=None)


def form_study(library: Library, values: Mapping[str, str], now: datetime) -> tuple[Checked, Submission | None]:
    """A filled form, and the study that it is; None where something is wrong with it."""
    store = library.store
    checked = look_over(values, store.chunking, store.reusable, now)
    made = None
    if checked.parsed is not None:
        made = submission(checked.parsed, store.chunking, store.reusable, now, finish_by=checked.finish)
    return replace(checked, parsed=None), made
