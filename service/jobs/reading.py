"""How somebody reads a stored study."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag.service.reading.reader import Choice, Reading, reading_for

if TYPE_CHECKING:
    from sprag.service.storage.store import Store


def reading_of(store: Store, study_id: str, choice: Choice) -> Reading:
    """The reading of a choice; raises StudyNotFoundError, and SelectionError for units that cannot be shown."""
    return reading_for(store.studies.study(study_id), store.studies.spec(study_id), choice)
