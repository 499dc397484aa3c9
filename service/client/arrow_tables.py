"""Tables of Arrow as DuckDB gives them, made ready for pandas and polars. pyarrow is loaded on first use."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag_study.service.client.errors import StatementError

if TYPE_CHECKING:
    from collections.abc import Iterator

#: Types of columns that tables of a library do not have, by the word of SQL, and the test of Arrow.
_PANDAS: Final = {"UNION": "is_union"}
_POLARS: Final = {**_PANDAS, "INTERVAL": "is_interval"}


def require_columns(table: Any, polars: bool) -> None:
    """StatementError for a column of a table of Arrow that a table of polars, or else of pandas, cannot have."""
    import pyarrow as pa

    for field in table.schema:
        for word, test in (_POLARS if polars else _PANDAS).items():
            if any(map(getattr(pa.types, test), _parts(field.type))):
                library = "polars" if polars else "pandas"
                raise StatementError(
                    f'the column "{field.name}" has the type {word}, which tables of {library} do not have: cast it to '
                    "VARCHAR"
                )


def with_plain_numbers(table: Any) -> Any:
    """A table of Arrow whose decimals are numbers as others: int64 where they are whole and fit, float64 elsewhere.

    DuckDB gives sums of whole numbers, and literals such as 0.5, as decimals.
    """
    import pyarrow as pa

    for index, field in enumerate(table.schema):
        if any(map(pa.types.is_decimal, _parts(field.type))):
            column = table.column(index)
            try:
                numbers = column.cast(_plain(field.type, pa.int64()))
            except pa.ArrowInvalid:  # above 2^63
                numbers = column.cast(_plain(field.type, pa.float64()))
            table = table.set_column(index, field.name, numbers)
    return table


def _parts(kind: Any) -> Iterator[Any]:
    """A type of Arrow, and the types of its items and fields."""
    yield kind
    for index in range(kind.num_fields):
        yield from _parts(kind.field(index).type)


def _plain(kind: Any, whole: Any) -> Any:
    """A type of Arrow with ``whole`` for whole decimals, and float64 for others."""
    import pyarrow as pa

    if pa.types.is_decimal(kind):
        return pa.float64() if kind.scale else whole
    if pa.types.is_map(kind):
        return pa.map_(_plain(kind.key_type, whole), _plain(kind.item_type, whole))
    fields = [field.with_type(_plain(field.type, whole)) for field in map(kind.field, range(kind.num_fields))]
    if pa.types.is_struct(kind):
        return pa.struct(fields)
    if pa.types.is_fixed_size_list(kind):
        return pa.list_(fields[0], kind.list_size)
    return pa.list_(fields[0]) if fields else kind
