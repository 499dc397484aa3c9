"""Rows as Apache Arrow: Parquet for data tools, an Arrow stream for programs. The fields' metadata have the units."""

from __future__ import annotations

import io
import json
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import pyarrow as pa

from sprag_study.service.exports.inputs import column_description
from sprag_study.service.exports.source import machine
from sprag_study.service.reading.directions import is_named

if TYPE_CHECKING:
    from sprag_study.service.exports.source import Source
    from sprag_study.service.storage.studies.records import RowBlock

#: Rows of one group of a Parquet file: about 20 MB of numbers.
_GROUP_ROWS: Final = 50_000
#: Type of the column of each kind of result.
_TYPES: Final = {"real": pa.float64(), "count": pa.int64(), "category": pa.string()}


class _Pieces(io.RawIOBase):
    """A file object that returns the bytes written to it piece by piece."""

    def __init__(self) -> None:
        super().__init__()
        self._held: list[bytes] = []

    def writable(self) -> bool:
        """Always."""
        return True

    def write(self, data: Any) -> int:
        """Keep the bytes until they are taken."""
        piece = bytes(data)
        self._held.append(piece)
        return len(piece)

    def take(self) -> bytes:
        """Everything written since the last time."""
        piece = b"".join(self._held)
        self._held.clear()
        return piece


def schema(source: Source) -> pa.Schema:
    """Columns ``case``, axis and derived paths, ``ending``, ``flags``, results; each with its unit and meaning.

    The schema's metadata contain the study itself, as JSON of `machine` under ``sprag``.
    """
    study = source.study
    fields = [pa.field("case", pa.int64(), nullable=False)]
    fields += [
        pa.field(
            path,
            pa.string() if is_named(study, path) else pa.float64(),
            nullable=False,
            metadata={"unit": source.unit(path), "description": column_description(study, path)},
        )
        for path in study.column_paths
    ]
    fields += [
        pa.field("ending", pa.string(), nullable=False),
        pa.field("flags", pa.list_(pa.string()), nullable=False),
    ]
    fields += [
        pa.field(
            info.name,
            _TYPES[info.kind],
            metadata={"unit": info.unit, "description": info.description},
        )
        for info in source.infos
    ]
    return pa.schema(fields, metadata={"sprag": json.dumps({**source.about, **machine(source)})})


def batch(source: Source, block: RowBlock, made: pa.Schema) -> pa.RecordBatch:
    """The cases of a block as a batch of `schema`; NaN becomes null."""
    flags = [text.split(",") if text else [] for text in block.flags]
    arrays = [pa.array(block.cases), *map(pa.array, source.parameters(block.cases).values())]
    arrays += [pa.array(block.endings, pa.string()), pa.array(flags, made.field("flags").type)]
    for index, info in enumerate(source.infos):
        column = np.ascontiguousarray(block.values[:, index])
        missing = np.isnan(column)
        if info.kind == "category":
            arrays.append(pa.array(map(info.cell, column.tolist()), pa.string()))
            continue
        if info.kind == "count":
            column = np.where(missing, 0.0, column).astype(np.int64)
        arrays.append(pa.array(column, mask=missing))
    return pa.RecordBatch.from_arrays(arrays, schema=made)


def parquet_pieces(source: Source) -> Iterator[bytes]:
    """A Parquet file, a piece for each group of rows."""
    import pyarrow.parquet as pq

    source = source.in_units()
    made, sink = schema(source), _Pieces()
    held: list[pa.RecordBatch] = []
    with pq.ParquetWriter(sink, made, compression="zstd", use_dictionary=_repeating(source)) as writer:
        for block in source.blocks:
            held.append(batch(source, block, made))
            if sum(map(len, held)) >= _GROUP_ROWS:
                writer.write_table(pa.Table.from_batches(held, schema=made), row_group_size=_GROUP_ROWS * 2)
                held.clear()
                yield sink.take()
        if held:
            writer.write_table(pa.Table.from_batches(held, schema=made), row_group_size=_GROUP_ROWS * 2)
    yield sink.take()


def _repeating(source: Source) -> list[str]:
    """Columns with many repeated values; results hardly ever repeat, and trying costs time."""
    repeating = [info.name for info in source.infos if info.kind != "real"]
    return [*source.study.column_paths, "ending", *repeating]


def arrow_pieces(source: Source) -> Iterator[bytes]:
    """An Arrow IPC stream, a piece for each block."""
    source = source.in_units()
    made, sink = schema(source), _Pieces()
    with pa.ipc.new_stream(sink, made) as writer:
        for block in source.blocks:
            writer.write_batch(batch(source, block, made))
            yield sink.take()
    yield sink.take()
