"""The store of a service at its start: checked, and asked again where a database server does not answer at once."""

from __future__ import annotations

import logging
import time
from typing import TYPE_CHECKING, Final

from sprag_study.service.storage.errors import DatabaseError
from sprag_study.service.storage.store import Store

if TYPE_CHECKING:
    from collections.abc import Callable

    from sprag_study.service.settings import Settings
    from sprag_study.worker.chunking import Chunking

_LOG = logging.getLogger("sprag.service")

#: Seconds between the attempts to reach a server, which may be starting itself.
AGAIN_SECONDS: Final = (0.5, 1.0, 2.0, 4.0, 8.0)


def sound_store(settings: Settings, chunking: Chunking, wait: Callable[[float], None] = time.sleep) -> Store:
    """The store of ``settings``; raises DatabaseError where it cannot be used, of a server after `AGAIN_SECONDS`."""
    for seconds in AGAIN_SECONDS:
        try:
            return _opened(settings, chunking)
        except DatabaseError as error:
            if error.code != "database-unreachable" or settings.database_url.startswith("sqlite"):
                raise
            text = str(error)
            _LOG.warning("%s%s; it is tried again in %g s.", text[:1].upper(), text[1:], seconds)
            wait(seconds)
    return _opened(settings, chunking)


def _opened(settings: Settings, chunking: Chunking) -> Store:
    store = Store.open(settings.database_url, chunking=chunking)
    try:
        store.require_sound()
    except BaseException:
        store.close()
        raise
    return store
