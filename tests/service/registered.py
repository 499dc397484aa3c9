"""Models that tests alone know: registered for a while, with their table in a database."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from sprag_study.service.settings import Settings
from sprag_study.service.storage.database.session import Session
from sprag_study.service.storage.tables import METADATA, results_table
from sprag_study.worker import models
from sprag_study.worker.models.model import Model


@contextmanager
def registered(model: Model) -> Iterator[None]:
    """Have the program know a model whose studies are all of the variant ""."""
    models.register(model)
    try:
        yield
    finally:
        METADATA.remove(results_table(model.name, ""))
        results_table.cache_clear()
        models.unregister(model.name)


def create_table(settings: Settings, name: str) -> None:
    """Make the table of a model in the database of a service, as a migration would."""
    session = Session(settings.database_url)
    with session.write() as connection:
        results_table(name, "").create(connection, checkfirst=True)
    session.close()
