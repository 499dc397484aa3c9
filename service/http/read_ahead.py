"""Reads the columns of large studies once they have ended, so that the first question about all cases is quick too."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING, Final

from sprag_study.service.http.problems import ApiError
from sprag_study.service.http.threads import in_thread
from sprag_study.service.views import explore
from sprag_study.worker.pool.child_pool import JobStoppedError
from sprag_study.worker.ports import StoreError

if TYPE_CHECKING:
    from sprag_study.service.http.context import Context

_LOG = logging.getLogger("sprag.service")

#: Seconds between two looks for studies that have ended.
LOOK_SECONDS: Final = 10.0


async def keep_reading_ahead(context: Context) -> None:
    """Look for ended studies and read their columns in a checking process, until cancelled."""
    tried: set[str] = set()
    while True:
        try:
            await read_ahead(context, tried)
        except StoreError as error:
            _LOG.debug("columns are not read ahead for now: %s", error)
        except Exception:  # whatever it is, the studies that end later are read
            _LOG.exception("The columns of ended studies cannot be read ahead.")
        await asyncio.sleep(LOOK_SECONDS)


async def read_ahead(context: Context, tried: set[str]) -> None:
    """Read the columns of every study that waits for it, each once: where that fails, the first question reads them."""
    for study_id in await in_thread(context.library.columns.waiting):
        if study_id not in tried:
            tried.add(study_id)
            try:
                await context.checker.run(explore.read_ahead, context.library, study_id)
            except (ApiError, StoreError, JobStoppedError) as error:
                _LOG.info("The columns of the study %s are not read ahead: %s", study_id, error)
