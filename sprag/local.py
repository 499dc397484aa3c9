"""A study run here, without a service: its rows as a frame with units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pandas as pd

from sprag.service.client.frames import table_of
from sprag.service.client.queries import spec_of
from sprag.service.exports import export, stored
from sprag.service.jobs.local import pool_size, run_here
from sprag.service.plain_data import plain
from sprag.service.reading.catalogue import unit_of
from sprag.service.settings import Settings
from sprag.service.spec.document import SpecError, parse_spec

if TYPE_CHECKING:
    from collections.abc import Callable
    from datetime import datetime
    from os import PathLike

    from sprag.service.client.queries import Spec
    from sprag.service.storage.studies.records import Progress


def run(
    spec: Spec | str | PathLike[str],
    *,
    processes: int | None = None,
    database: str | None = None,
    fresh: bool = False,
    finish_by: datetime | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> pd.DataFrame:
    """Run a study here, to its end.

    Parameters
    ----------
    spec : mapping, str or path
        A spec, or the name of a JSON or TOML file with one. Values may be numbers of numpy and decimal, arrays, columns
        of pandas and quantities of pint.
    processes : int, optional
        Number of processes; 0 runs the cases in this process. By default one per core, or 0 where the study takes about
        a second. A script that starts processes needs ``if __name__ == "__main__":`` around its own code.
    database : str, optional
        Database that stores the study, as in ``sprag run --db``; cases that it already has are not run again, unless
        ``fresh``. By default a temporary one.
    finish_by : datetime, optional
        An aware time at which the run ends with what is done, coarse to fine.
    on_progress : function, optional
        Called with the progress a few times a second.

    Returns
    -------
    DataFrame
        A row for each case: ``case``, the parameters that vary, ``ending``, ``flags``, the results. Numbers are in SI
        units, and missing where a result could not be computed. ``attrs["units"]`` has the unit of each parameter and
        result, ``attrs["warnings"]`` the warnings about the spec.

    Raises
    ------
    SpecFileError, SpecError
        For an unreadable file and for an invalid spec: every fault with pointer, value and allowed range.
    StoreError, ExecutorError
        When the database or a process fails. All of them are a SpragError.
    """
    data, faults = plain(spec_of(spec))
    if faults:
        raise SpecError(faults)
    parsed = parse_spec(data)
    study = parsed.study
    given = {"database": database, "processes": processes}
    settings = Settings(**{name: value for name, value in given.items() if value is not None})  # type: ignore[arg-type]
    with run_here(
        parsed.spec,
        study,
        processes=0 if processes == 0 else pool_size(study, settings.pool_processes, asked=processes is not None),
        database_url=None if database is None else settings.database_url,
        chunk_cases=settings.chunk_cases,
        chunk_timeout=settings.chunk_timeout,
        warnings=parsed.warnings,
        fresh=fresh,
        finish_by=finish_by,
        on_progress=on_progress,
    ) as done:
        source = stored(done.store, done.record, done.store.studies.study(done.record.id))
        table = table_of(b"".join(export(source, "parquet")))
    units = {path: unit_of(study, path) for path in study.column_paths}
    table.attrs["units"] = units | {info.name: info.unit for info in source.infos}
    table.attrs["warnings"] = list(parsed.warnings)
    return table
