"""All rows of a study as a file, in all common formats, written piece by piece for any number of rows.

CSV, JSON and JSON lines (`text`), Parquet and Arrow (`arrow`), spreadsheets (`xlsx`), labelled grids (`netcdf`).
Numbers read back as the same doubles; values that could not be computed are empty, null or NaN, never 0.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Final

from sprag_study.service.exports.source import MissingRowsError, Source, StoredRows, stored
from sprag_study.service.exports.spool import room_required
from sprag_study.service.exports.text import (
    csv_pieces,
    json_pieces,
    read_table,
    row_json,
    rows_json,
    stacked,
    table_csv,
)
from sprag_study.service.formats import Format

__all__ = [
    "MissingRowsError",
    "Source",
    "StoredRows",
    "csv_pieces",
    "export",
    "json_pieces",
    "read_table",
    "room_required",
    "row_json",
    "rows_json",
    "stacked",
    "stored",
    "table_csv",
]

#: Module and function that write each format; only the libraries of the requested one are loaded.
_WRITERS: Final[dict[Format, tuple[str, str]]] = {
    "csv": ("text", "csv_pieces"),
    "json": ("text", "json_pieces"),
    "jsonl": ("text", "json_lines_pieces"),
    "parquet": ("arrow", "parquet_pieces"),
    "arrow": ("arrow", "arrow_pieces"),
    "xlsx": ("xlsx", "xlsx_pieces"),
    "netcdf": ("netcdf", "netcdf_pieces"),
}


#: Those that are built as a file before their first piece.
_BUILT: Final[frozenset[Format]] = frozenset({"xlsx", "netcdf"})


def export(source: Source, form: Format, folder: Path | None = None) -> Iterator[bytes]:
    """The file in pieces of about one block of rows.

    What cannot be written piece by piece is built in ``folder``, by default one that is removed with the last piece.
    Raises FaultError "storage-full" where the folder for temporary files has no room, MissingRowsError where rows of a
    stored study are missing.
    """
    module, write = _WRITERS[form]
    further = (folder,) if form in _BUILT else ()
    with room_required(tempfile.gettempdir()):
        yield from getattr(import_module(f"{__name__}.{module}"), write)(source, *further)
