"""Elementary functions made of IEEE sums, products, quotients and square roots: the same bits on every processor.

numpy and the C library choose among versions of theirs by the processor, whose last bits differ
(docs/adr/0031-processors-may-differ.md). Here are the functions of arrays; `angles` and `powers` are for compiled code.
"""

from sprag_study.engine.elementary.arrays import (
    arccos,
    arcsin,
    arctan,
    arctan2,
    cos,
    cosh,
    exp,
    log,
    power,
    sin,
    sinh,
    tan,
    tanh,
)

__all__ = [
    "arccos",
    "arcsin",
    "arctan",
    "arctan2",
    "cos",
    "cosh",
    "exp",
    "log",
    "power",
    "sin",
    "sinh",
    "tan",
    "tanh",
]
