"""Functions for the processes that write files of rows: into a file, or piece by piece for who waits for them."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from sprag_study.service.exports import export, room_required, stored

if TYPE_CHECKING:
    from collections.abc import Iterator

    from sprag_study.service.formats import Format, Header
    from sprag_study.service.views.library import Library


def prepare() -> None:
    """Prepare a process: load this module."""


def pieces(library: Library, study_id: str, form: Format, units: str, header: Header, folder: str) -> Iterator[bytes]:
    """All rows of a study, with ``folder`` for what is built first (by default a new one).

    Raises StoreError, SelectionError, and FaultError "storage-full".
    """
    store = library.store
    record, study = store.studies.get(study_id), store.studies.study(study_id)
    return export(stored(store, record, study, units, header), form, Path(folder) if folder else None)


def write(library: Library, study_id: str, form: Format, units: str, header: Header, path: str, folder: str) -> None:
    """Write all rows of a study into a file, with ``folder`` for what is built first; raises what `pieces` raises."""
    with room_required(str(Path(path).parent)), Path(path).open("wb") as file:
        for piece in pieces(library, study_id, form, units, header, folder):
            file.write(piece)
