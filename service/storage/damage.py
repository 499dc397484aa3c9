"""What is said of parts of a study that changed on the disk."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

import sqlalchemy as sa

from sprag.service.storage.errors import DatabaseError

if TYPE_CHECKING:
    from collections.abc import Iterator


def undecodable(error: sa.exc.DBAPIError) -> bool:
    """Whether a text that was read is none: a bit of it was flipped."""
    return "Could not decode" in str(error.orig)


@contextmanager
def readable(study_id: str) -> Iterator[None]:
    """Raise DatabaseError for a text of a study that is none."""
    try:
        yield
    except sa.exc.DBAPIError as error:
        if not undecodable(error):
            raise
        raise DatabaseError(changed(study_id, "inputs"), "database-damaged") from error


def changed(study_id: str, what: str) -> str:
    """A sentence on that part of a study."""
    return (
        f"the {what} of the study {study_id} changed on the disk: put a backup in place, or delete the study and "
        "submit it again"
    )
