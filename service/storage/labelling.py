"""Names, notes and tags of studies, and their archive."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from sprag.service.faults import Fault, FaultError
from sprag.service.spec.labels import folded
from sprag.service.storage.audit import note, require_own
from sprag.service.storage.editions import require_edition
from sprag.service.storage.listing import Listing
from sprag.service.storage.searching import search_text
from sprag.service.storage.tables import STUDIES
from sprag.service.storage.users import TEXTS, size_of_texts
from sprag.worker.limits import MAX_TAGS

if TYPE_CHECKING:
    from collections.abc import Collection

    from sprag.service.spec.labels import StudyChange
    from sprag.service.storage.records import StudyRecord


class Labelling(Listing):
    """What people write about studies."""

    def change_study(self, study_id: str, change: StudyChange, read: Collection[str] | None = None) -> StudyRecord:
        """Change what people write about a study; raises StudyNotFoundError.

        FaultError where it would have more than `MAX_TAGS` tags, or its longer texts exceed the quota of the present
        user. ``read``: the editions (`StudyRecord.etag`) that the
        change is meant for; ChangedMeanwhileError for any other.
        """
        c = STUDIES.c
        with self.session.write() as connection:
            row = self._row(connection, study_id, c.number, c.owner, c.name, c.notes, c.tags, c.search, c.archived_at)
            require_own("study", study_id, row.owner)
            require_edition("study", study_id, self._study_record(connection, study_id).etag, read)
            name = row.name if change.name is None else change.name
            notes = row.notes if change.notes is None else change.notes
            tags = _tags(tuple(row.tags.split("\n")[1:-1]), change)
            archived_at = row.archived_at
            if change.archived is not None:
                archived_at = (archived_at or self._now()) if change.archived else None
            values: dict[str, Any] = {
                "name": name,
                "notes": notes,
                "tags": "".join(("\n", "\n".join(tags), "\n")) if tags else "",
                "archived_at": archived_at,
            }
            changed = {field: value for field, value in values.items() if value != getattr(row, field)}
            if changed:
                written = {**changed, "search": search_text(name, tags, notes)}
                before: dict[str, str] = {field: getattr(row, field) for field in TEXTS if field in written}
                self._require_quota(connection, 0, size_of_texts(written) - size_of_texts(before))
                self._change(connection, row.number, **written)
                detail = {field: value for field, value in changed.items() if field == "name"}
                if "tags" in changed:
                    detail["tags"] = list(tags)
                if "archived_at" in changed:
                    detail["archived"] = archived_at is not None
                note(connection, self._now(), "study.change", study_id, fields=sorted(changed), **detail)
            return self._study_record(connection, study_id)


def _tags(present: tuple[str, ...], change: StudyChange) -> tuple[str, ...]:
    """The tags after a change, in the order in which they came."""
    lost = set(map(folded, change.remove_tags))
    tags: dict[str, str] = {}
    for tag in (*(present if change.tags is None else change.tags), *change.add_tags):
        tags.setdefault(folded(tag), tag)
    found = tuple(tag for key, tag in tags.items() if key not in lost)
    if len(found) > MAX_TAGS:
        place = "/add_tags" if change.add_tags else "/tags"
        fault = Fault(place, "too-many", "the study would have too many tags", len(found), f"at most {MAX_TAGS} tags")
        raise FaultError("invalid-body", str(fault), (fault,))
    return found
