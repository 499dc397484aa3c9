"""Statements that SQLAlchemy has compiled once serve every database of the same driver: each test opens its own."""

from __future__ import annotations

from functools import cache
from typing import Any

import sqlalchemy as sa


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


@cache
def share() -> None:
    """Let every connection of this process look among them: compiling was a fifth of the time of tests with a store."""
    compiled = Compiled()
    sa.event.listen(
        sa.Engine, "engine_connect", lambda connection: connection.execution_options(compiled_cache=compiled)
    )
