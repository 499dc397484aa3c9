"""The only access to numba: decorators, bits of numbers, and lane loops of the way that is in use (``ways``)."""

from sprag.engine.compile.bits import bits_of, of_bits
from sprag.engine.compile.places import use_cache
from sprag.engine.compile.vectors import use_full_vectors
from sprag.engine.compile.ways import PLAIN, WAY

if WAY == PLAIN:
    from sprag.engine.compile.plain import (
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
    from sprag.engine.compile.decorators import compiled, inlined, part, unmanaged
    from sprag.engine.compile.lowering import constant_record, constant_shape, lane_loops, lane_mask, lowest

use_cache()
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
