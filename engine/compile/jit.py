"""The only access to numba: decorators, bits of numbers, and lane loops of the way that is in use (``ways``)."""

from sprag_study.engine.compile.bits import bits_of, of_bits
from sprag_study.engine.compile.vectors import use_full_vectors
from sprag_study.engine.compile.ways import PLAIN, WAY

if WAY == PLAIN:
    from sprag_study.engine.compile.plain import (
        compiled,
        constant_record,
        constant_shape,
        inlined,
        lane_loops,
        lane_mask,
        lowest,
        part,
        unmanaged,
    )
else:
    from sprag_study.engine.compile.decorators import compiled, inlined, part, unmanaged
    from sprag_study.engine.compile.lowering import constant_record, constant_shape, lane_loops, lane_mask, lowest

use_full_vectors()

__all__ = [
    "bits_of",
    "compiled",
    "constant_record",
    "constant_shape",
    "inlined",
    "lane_loops",
    "lane_mask",
    "lowest",
    "of_bits",
    "part",
    "unmanaged",
]
