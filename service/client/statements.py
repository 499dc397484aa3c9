"""SQL over the rows of studies, by DuckDB in this process. DuckDB and the tables are loaded on first use.

A statement only reads: it reaches the tables of the studies, no file, no address, and no setting of DuckDB.
"""

from __future__ import annotations

import re
from contextlib import closing
from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.arrow_tables import require_columns, with_plain_numbers
from sprag_study.service.client.errors import ArgumentError, StatementError
from sprag_study.service.client.frames import arrow_of, units_of
from sprag_study.service.client.tabular import from_arrow
from sprag_study.service.extras import naming_extra

if TYPE_CHECKING:
    from collections.abc import Collection, Mapping, Sequence

    import duckdb
    import pandas as pd
    import polars as pl

#: The table of the cases: of one study, or of several with their names in the column `study`.
CASES: Final = "cases"
#: The connection has no place for files, not even for what does not fit into memory, and looks for no tables among the
#: variables of the program; afterwards it takes no setting.
_CLOSED: Final[dict[str, str | bool | int | float | list[str]]] = {
    "autoinstall_known_extensions": False,
    "autoload_known_extensions": False,
    "python_enable_replacements": False,
    "temp_directory": "",
}
_LOCKED: Final = "SET enable_external_access = false; SET lock_configuration = true"


def table_names(names: Collection[str]) -> None:
    """Refuse names of studies that cannot be those of tables side by side; ArgumentError."""
    if len({*map(str.casefold, names), CASES, ""}) <= len(names) + 1 or not names:
        allowed = 'one study or more, of different names, none of them empty or "cases"'
        raise ArgumentError("studies", ", ".join(names), allowed)


def read_only(statement: str) -> duckdb.Statement:
    """The only statement of a text; StatementError where it does not only read, or is no SQL."""
    with naming_extra("sql", "frames"):
        import duckdb

    try:
        parts = duckdb.extract_statements(statement)
    except duckdb.Error as error:
        raise StatementError(str(error)) from error
    if len(parts) != 1 or not _reads(parts[0]):
        raise StatementError(
            "sql takes one statement, which only reads: SELECT, FROM, WITH, PIVOT, DESCRIBE or SUMMARIZE"
        )
    return parts[0]


def _reads(part: duckdb.Statement) -> bool:
    """Whether a statement only reads.

    A PIVOT that looks for its columns itself is several statements to DuckDB, whatever is done with its rows; only one
    that reads can stand in brackets behind FROM.
    """
    import duckdb

    if part.type != duckdb.StatementType.MULTI:
        return part.type == duckdb.StatementType.SELECT
    try:
        return len(duckdb.extract_statements(f"FROM ({part.query.rstrip().rstrip(';')}\n)")) == 1
    except duckdb.Error:
        return False


def selected(statement: str, rows: Mapping[str, bytes], polars: bool) -> pd.DataFrame | pl.DataFrame:
    """What a statement selects from the rows of studies.

    Parameters
    ----------
    statement : str
        One SELECT of DuckDB.
    rows : mapping of str to bytes
        The rows of each study as a Parquet file, by the name of its table.
    polars : bool
        Whether the answer is a polars table; otherwise it is a pandas table, and ``attrs["units"]`` has the unit of
        each column that has the name of one of the studies'. Whole numbers are int64 and decimals float64. Where
        several columns have one name, DuckDB numbers the others: "a", "a_1".

    Raises
    ------
    StatementError
        For what is no single SELECT, for one that DuckDB refuses or has no memory for, and for columns that a table
        cannot have.
    """
    chosen = read_only(statement)
    with naming_extra("sql", "frames"):
        import duckdb
        import pandas  # noqa: F401 - pyarrow uses it

    tables = {name: arrow_of(parquet).read() for name, parquet in rows.items()}
    units = _common_units([units_of(table.schema) for table in tables.values()])
    with closing(duckdb.connect(config=_CLOSED)) as connection:
        try:
            for name, table in tables.items():
                connection.register(name, table)
            if CASES not in tables:
                connection.execute(f"CREATE VIEW {CASES} AS {_union(list(tables))}")
            connection.execute(_LOCKED)
            relation = connection.sql(chosen)
            names = relation.columns
            if len({*names}) < len(names):
                relation = relation.project("*")  # a subquery, whose columns DuckDB numbers
            answer: Any = relation.to_arrow_table()
        except duckdb.OutOfMemoryException as error:
            # The ways out that DuckDB names are settings, which are locked.
            reason = str(error).partition("\n")[0]
            raise StatementError(f"{reason}\nSelect fewer columns or cases, or group them") from error
        except duckdb.Error as error:
            columns = {column for table in tables.values() for column in table.column_names}
            raise StatementError(f"{error}{_hint(statement, columns)}") from error
    require_columns(answer, polars)
    answer = with_plain_numbers(answer)
    if polars:
        return from_arrow(answer)
    try:
        frame: pd.DataFrame = answer.to_pandas()
    except (ValueError, NotImplementedError) as error:  # such as a date beyond those of Python
        raise StatementError(f"a pandas table cannot have what is selected: {error}") from error
    shown = zip(frame.columns, names, strict=True)
    frame.attrs["units"] = {column: units[name] for column, name in shown if name in units}
    return frame


def _union(names: Sequence[str]) -> str:
    """All cases, with the name of their study in front; a column that a study lacks is null."""
    parts = [f"SELECT {_text(name)} AS study, * FROM {_identifier(name)}" for name in names]  # noqa: S608 - quoted
    return " UNION ALL BY NAME ".join(parts)


def _text(value: str) -> str:
    return "'" + value.replace("'", "''") + "'"


def _identifier(name: str) -> str:
    return '"' + name.replace('"', '""') + '"'


def _common_units(units: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """The units of all columns; ArgumentError where studies have one in different units."""
    known: dict[str, str] = {}
    for each in units:
        for name, unit in each.items():
            if known.setdefault(name, unit) != unit:
                raise ArgumentError("units", f"{name} in {known[name]} and in {unit}", "the same units of every study")
    return known


def _hint(statement: str, columns: set[str]) -> str:
    """What to do where a name with points stands without quotes."""
    dotted = (name for name in columns if "." in name)
    bare = [name for name in dotted if re.search(rf'(?<!["\w.]){re.escape(name)}', statement)]
    return f"\nA name with points stands in double quotes: {_identifier(max(bare, key=len))}" if bare else ""
