"""What databases of tests, of which each test opens its own, need not do.

Statements that SQLAlchemy has compiled once serve every database of the same driver, and nothing waits for the disk, as
no test cuts the power of its own machine.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sqlalchemy as sa

from sprag_study.service.storage.database.sqlite_files import DatabaseFile

#: How connections are set up outside tests.
SET_PRAGMAS = DatabaseFile._set_pragmas


class Compiled(dict[Any, Any]):
    """Compiled statements by driver: keys of SQLAlchemy begin with the dialect, of which each engine has its own."""

    def get(self, key: Any, default: Any = None) -> Any:
        """The statement, whichever engine it was compiled for."""
        return super().get(_of_driver(key), default)

    def __setitem__(self, key: Any, compiled: Any) -> None:
        super().__setitem__(_of_driver(key), compiled)


def _of_driver(key: Any) -> Any:
    dialect, *rest = key
    return dialect.name, dialect.dbapi, dialect.server_version_info, *rest


def _unsynchronised(file: DatabaseFile, connection: Any) -> None:
    SET_PRAGMAS(file, connection)
    connection.execute("PRAGMA synchronous = OFF")


@cache
def share() -> None:
    """Let every connection of this process look among the statements, and wait for no disk.

    Compiling was a fifth of the time of tests with a store, and waiting a half.
    """
    compiled = Compiled()
    sa.event.listen(
        sa.Engine, "engine_connect", lambda connection: connection.execution_options(compiled_cache=compiled)
    )
    DatabaseFile._set_pragmas = _unsynchronised  # type: ignore[method-assign]
