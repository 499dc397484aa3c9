"""A study run here, without a service: the study that a service has, with the same methods and results."""

from __future__ import annotations

import weakref
from contextlib import ExitStack
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.queries import spec_of
from sprag_study.service.client.synchronous.study import Study
from sprag_study.service.here import Here
from sprag_study.service.jobs.local import opened, pool_size, run_folder, run_stored
from sprag_study.service.jobs.start_from import with_components
from sprag_study.service.plain_data import plain
from sprag_study.service.settings import Settings
from sprag_study.service.spec.component_axes import names_components
from sprag_study.service.spec.document import SpecError, parse_spec
from sprag_study.service.storage.store import Store
from sprag_study.service.storage.studies.copying import copy_study
from sprag_study.worker.chunking import Chunking
from sprag_study.worker.ports import StoreError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from datetime import datetime
    from os import PathLike

    import numpy as np
    import pandas as pd

    from sprag_study.service.client.queries import Spec
    from sprag_study.service.storage.studies.records import Progress, StudyRecord

#: How other libraries ask an object for its table.
_AS_TABLE: Final = ("__dataframe__", "__arrow_c_stream__")


class LocalStudy(Study):
    """A study that was run here. It has every method of a study of a service that makes sense of one that has ended.

    It is its own table, too: ``study["efficiency"]``, ``len(study)``, ``study.attrs["units"]``, ``study.head()`` and
    whatever else a pandas table has and a study has not are those of one table, which is read once; `table` gives a new
    one. Without a database of its own it lasts as long as this object, or until `close`; a pickle or a copy of it has
    its rows, and no other study of its database.
    """

    _client: _Local

    def __repr__(self) -> str:
        if not self._client.open:
            return f"Study({self.id!r}, closed)"
        detail = self.detail()
        progress = detail["progress"]
        return f"Study({detail['name'] or self.id!r}: {progress['total']:,} cases, {progress['ok']:,} ok)"

    def close(self) -> None:
        """Close the database; a temporary one is deleted."""
        self._client.close()

    def __enter__(self) -> LocalStudy:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self._client.content(self.id), self.id)

    @property
    def attrs(self) -> dict[Any, Any]:
        """Units of the columns, warnings about the spec, and the number of cases of each ending."""
        return self._table.attrs

    @cached_property
    def _table(self) -> pd.DataFrame:
        return self.table()

    def __len__(self) -> int:
        return len(self._table)

    def __iter__(self) -> Iterator[Any]:
        return iter(self._table)

    def __contains__(self, column: object) -> bool:
        return column in self._table

    def __getitem__(self, key: Any) -> Any:
        return self._table[key]

    def __setitem__(self, key: Any, value: Any) -> None:
        self._table[key] = value

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        return self._table.to_numpy(dtype)

    if not TYPE_CHECKING:  # a type checker knows the methods of a study only

        def __getattr__(self, name: str) -> Any:
            if name.startswith("_") and name not in _AS_TABLE:
                raise AttributeError(f"a study has no {name!r}")
            try:
                return getattr(self._table, name)
            except AttributeError:
                raise AttributeError(f"neither a study nor its table has {name!r}") from None


class _Local(Here):
    """A database that is open as long as somebody has it; studies run in it with so many processes."""

    def __init__(self, database: str | None = None, processes: int | None = None, content: bytes | None = None) -> None:
        given = {"database": database, "processes": processes}
        known = {name: value for name, value in given.items() if value is not None}
        settings = Settings(**known)  # type: ignore[arg-type]
        self._processes, self._kept = processes, database is not None
        stack = ExitStack()
        url = settings.database_url if self._kept else None
        chunking = Chunking(settings.chunk_cases, settings.pool_processes, settings.chunk_timeout)
        super().__init__(stack.enter_context(opened(url, chunking, content)), settings)
        # After those of the folders, so that it comes before them where the program ends.
        self._release = weakref.finalize(self, stack.close)

    @property
    def open(self) -> bool:
        """Whether the database is open."""
        return self._release.alive

    def require_open(self) -> None:
        """Raise StoreError where it is not."""
        if not self.open:
            raise StoreError(
                "the study is closed: use it inside `with`, or keep its rows in a database (`database=`)", "closed"
            )

    def close(self) -> None:
        """Close the database; a temporary one is deleted."""
        self._release()

    def run(self, record: StudyRecord, on_progress: Callable[[Progress], None] | None = None) -> StudyRecord:
        """Run a study to its end; StoreError and ExecutorError."""
        store, settings = self.library.store, self._settings
        most, asked = settings.pool_processes, self._processes is not None
        size = 0 if self._processes == 0 else pool_size(store.studies.study(record.id), most, asked=asked)
        timeout = settings.chunk_timeout
        return run_stored(
            store, record, processes=size, chunk_timeout=timeout, kept=self._kept, on_progress=on_progress
        )

    def content(self, study_id: str) -> bytes:
        """The file of a database that has that study and nothing else; StoreError."""
        self.require_open()
        with run_folder() as folder:
            file = folder / "copy.sqlite3"
            with Store.open(f"sqlite:///{file}") as copy:
                copy_study(self.library.store.session, copy.session, study_id)
            return file.read_bytes()


def _restored(content: bytes, study_id: str) -> LocalStudy:
    """The study of a pickle."""
    return LocalStudy(_Local(content=content), study_id)


def run(
    spec: Spec | str | PathLike[str],
    *,
    cases: object = None,
    processes: int | None = None,
    database: str | None = None,
    fresh: bool = False,
    finish_by: datetime | None = None,
    on_progress: Callable[[Progress], None] | None = None,
) -> LocalStudy:
    """Run a study here, to its end.

    Parameters
    ----------
    spec : mapping, str or path
        A spec, the name of a JSON or TOML file with one, or the name of a study that comes with Sprag. Values may be
        numbers of numpy and decimal, arrays, columns of pandas and quantities of pint.
    cases : table, optional
        The cases in place of those of the spec: a frame of pandas or polars, a dataset of xarray, a mapping of columns
        or a sequence of mappings, with a column for each parameter, such as "shaft.load", and a row for each case.
        Numbers are in the units of ``attrs["units"]``, by default SI.
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
    Study
        The study as `Client.submit` gives it once it has ended: ``curves``, ``map``, ``answers``, ``explore``,
        ``table``, ``grid``, ``export``, ``plot`` and so on. It has the columns, ``attrs`` and methods of its table,
        too; ``attrs["warnings"]`` has the warnings about the spec.

    Raises
    ------
    SpecFileError, SpecError
        For an unreadable file and for an invalid spec: every fault with pointer, value and allowed range.
    StoreError, ExecutorError
        When the database or a process fails. All of them are a SpragError.
    """
    data, faults = plain(spec_of(spec, cases))
    if faults:
        raise SpecError(faults)
    if database is not None and names_components(data):
        with Store.open(Settings(database=database).database_url) as store:
            data = with_components(store, data)
    parsed = parse_spec(data)
    here = _Local(database, processes)
    try:
        record = here.library.store.studies.create(
            parsed.spec, parsed.study, warnings=parsed.warnings, fresh=fresh, finish_by=finish_by
        )
        here.run(record, on_progress)
    except BaseException:
        here.close()
        raise
    return LocalStudy(here, record.id)
