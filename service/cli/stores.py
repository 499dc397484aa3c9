"""The database of a command, or the service that has it: only those that start or run something create a database, and
every answer names it."""

from __future__ import annotations

import os
from collections.abc import Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING

from sprag_study.service.cli.common import CURRENT, names_service, wants_json
from sprag_study.service.cli.configured import read_settings
from sprag_study.service.cli.console import WrongInputError, say, wrong_option
from sprag_study.service.cli.sources import refuse_here
from sprag_study.service.languages import N_, _
from sprag_study.service.login import profile

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from sprag_study.service.storage.store import Store


def database_of(db: str | None, *, create: bool = False) -> str:
    """The URL of the database of a command that works on one: that of ``db`` (the option), or of the settings.

    Raises WrongInputError where ``--server`` names a service, and unless it is created, for a file that does not exist.
    """
    if names_service():
        refuse_here(db=db)
        reason = N_("this command works on a database on its host: run it there, without --server")
        raise wrong_option("--server", "not-used", reason, CURRENT.get().server)
    return read_settings(database=db).database_url if create else _present(db)


def _present(db: str | None) -> str:
    """The URL of a database that is there; errors as of `database_of`."""
    from sprag_study.service.storage.database.session import file_of

    url = read_settings(database=db).database_url
    file = file_of(url)
    if file is not None and not file.exists():
        missing = _(
            "{file}: there is no database; `sprag serve`, `sprag run --db` and `sprag admin db upgrade` create one",
            file=file.absolute(),
        )
        raise WrongInputError("invalid-file", missing)
    return url


def asks_service(db: str | None) -> bool:
    """Whether a command of administrators asks the service, and not a database.

    It does with ``--server``, and on a machine without a database where ``SPRAG_SERVER`` or a login names a service;
    never with ``db`` (the option). Raises WrongInputError for both options.
    """
    if names_service():
        refuse_here(db=db)
        return True
    return db is None and bool(os.environ.get("SPRAG_SERVER") or "server" in profile()) and not _is_here()


def _is_here() -> bool:
    """Whether there is a database of the settings."""
    try:
        from sprag_study.service.storage.database.session import file_of

        file = file_of(read_settings().database_url)
    except ModuleNotFoundError:  # only the client is installed
        return False
    return file is None or file.exists()


def store_of(db: str | None) -> Store:
    """The store of the database of `database_of`; raises DatabaseError for an empty one. Close it at the end."""
    from sprag_study.service.storage.store import Store

    return Store.open(database_of(db), create=False)


def require_store(db: str | None) -> None:
    """Refuse a database that is not there, or is empty, where a study of a spec is kept in one (``db``).

    Errors as of `store_of`, except that ``--server`` may be given: what runs here does not ask it.
    """
    from sprag_study.service.storage.store import Store

    if db is not None:
        Store.open(_present(db), create=False).close()


def started_in(db: str | None, change: Callable[[object], object] | None = None) -> Callable[[object], object] | None:
    """What completes a spec: ``change``, then what it names of a database (``db``, the option).

    These are components, and the case from whose end its drive starts.
    """
    if db is None:
        return change

    def complete(spec: object) -> object:
        from sprag_study.service.jobs.start_from import completed
        from sprag_study.service.spec.component_axes import names_components
        from sprag_study.service.spec.machine.drive import START
        from sprag_study.service.storage.store import Store

        whole = spec if change is None else change(spec)
        base = whole.get("base") if isinstance(whole, Mapping) else None
        if not (isinstance(base, Mapping) and START in base) and not names_components(whole):
            return whole
        with Store.open(read_settings(database=db).database_url, create=False) as store:
            return completed(store, whole)

    return complete


@contextmanager
def named_store(db: str | None) -> Iterator[Store]:
    """The store of that database, which is named before the answer unless it is in the JSON."""
    with store_of(db) as store:
        yield store
        if not wants_json():
            say(_("database {database}:", database=store.session.location))
