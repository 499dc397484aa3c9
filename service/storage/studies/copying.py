"""A copy of one study in a database of its own: what was asked, its rows, and nothing of people or of other studies."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import sqlalchemy as sa

from sprag_study.service.storage.moving import TableOf
from sprag_study.service.storage.part import row_of
from sprag_study.service.storage.rows.case_keys import NOT_YET
from sprag_study.service.storage.saved_views import SAVED_VIEWS
from sprag_study.service.storage.tables import CHUNKS, FINGERPRINTS, OF_STUDIES, STUDIES, tables_of_rows

if TYPE_CHECKING:
    from sprag_study.service.storage.database.session import Session

#: Rows that are in memory at once.
_ROWS: Final = 5_000
#: Values in the copy of what refers to people, to other studies and to the work on the database.
_APART: Final[dict[str, Any]] = {"owner": None, "dispatcher": None, "keyed": NOT_YET, "trace": ""}


def copy_study(source: Session, target: Session, study_id: str) -> None:
    """Copy a study with its rows and the views saved of it into another database, which has no study of its number.

    It belongs to nobody there. StudyNotFoundError, and DatabaseError where one of the databases cannot be used.
    """
    with source.read() as reading, target.write() as writing:
        study = row_of(reading, study_id, STUDIES.c.number, STUDIES.c.model, STUDIES.c.variant)
        of_study = (CHUNKS, *OF_STUDIES, *tables_of_rows(study.model, study.variant), SAVED_VIEWS)
        _copy(reading, writing, STUDIES, STUDIES.c.number == study.number)
        for table in of_study:
            _copy(reading, writing, table, table.c.study == study.number)
        computed_by = [
            sa.select(STUDIES.c.fingerprint).where(STUDIES.c.number == study.number),
            sa.select(CHUNKS.c.fingerprint).where(CHUNKS.c.study == study.number),
        ]
        _copy(reading, writing, FINGERPRINTS, FINGERPRINTS.c.digest.in_(sa.union(*computed_by)))


def _copy(reading: sa.Connection, writing: sa.Connection, table: sa.Table, which: sa.ColumnElement[bool]) -> None:
    """Copy those rows of a table, as the database has them."""
    cells = [
        sa.literal(_APART[column.name], column.type)
        if column.name in _APART
        else sa.type_coerce(column, _plain(column))
        for column in table.c
    ]
    with reading.execute(sa.select(*cells).where(which), execution_options={"yield_per": _ROWS}) as rows:
        for part in rows.partitions():
            TableOf(table).put(writing, list(map(tuple, part)), replace=False)


def _plain(column: sa.Column[Any]) -> sa.types.TypeEngine[Any]:
    """The type of a column as the database has it."""
    return sa.String() if isinstance(column.type, sa.Enum) else column.type
