"""SQL over the rows of several studies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal, overload

from sprag_study.service.answers.differing import unique_names
from sprag_study.service.client.statements import read_only, selected, table_names

if TYPE_CHECKING:
    import pandas as pd
    import polars as pl

    from sprag_study.service.client.synchronous.study import Study


@overload
def sql(
    statement: str,
    studies: Sequence[Study] | Mapping[str, Study],
    *,
    units: str | None = None,
    polars: Literal[False] = False,
) -> pd.DataFrame: ...


@overload
def sql(
    statement: str,
    studies: Sequence[Study] | Mapping[str, Study],
    *,
    units: str | None = None,
    polars: Literal[True],
) -> pl.DataFrame: ...


def sql(
    statement: str,
    studies: Sequence[Study] | Mapping[str, Study],
    *,
    units: str | None = None,
    polars: bool = False,
) -> pd.DataFrame | pl.DataFrame:
    """What a SELECT of DuckDB gives of several studies, of a service or run here.

    Each study is a table with its name, as in ``from "Feeder motor"``. The table ``cases`` has the rows of all of them,
    with the column ``study`` in front; what a study does not have is null there. Otherwise as `Study.sql`.

    Parameters
    ----------
    statement : str
    studies : sequence of Study, or mapping of str to Study
        With a mapping, tables have its names.
    units : str, optional
        As for `Study.table`.
    polars : bool
        A polars table instead of a pandas table.

    Raises
    ------
    StatementError
        For a statement that does not only read, that DuckDB refuses, or whose columns a table cannot have.
    ArgumentError
        Where two names are equal, also but for capitals, or one is empty or "cases", and where studies have a column
        in different units.
    """
    if isinstance(studies, Mapping):
        named = dict(studies)
    else:
        details = [study.detail() for study in studies]
        unique = unique_names([detail["name"] for detail in details], [detail["id"] for detail in details])
        named = dict(zip(unique, studies, strict=True))
    table_names(named)
    read_only(statement)  # before any row is asked for
    rows = {name: study._parquet(units) for name, study in named.items()}
    return selected(statement, rows, polars)
