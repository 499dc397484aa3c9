"""Hashes of rows, and digests of chunks: sums of them, so that rows may be read in any order.

The hash is multilinear in the 64-bit patterns of a row's numbers: with odd factors, a change of one number always
changes it.
"""

from __future__ import annotations

import hashlib
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from sprag_study.worker.arrays import Floats, Ints

    Words = NDArray[np.uint64]

_MIX_A: Final = np.uint64(0xFF51AFD7ED558CCD)
_MIX_B: Final = np.uint64(0xC4CEB9FE1A85EC53)
#: Patterns of 64 bits as numbers with a sign; that of a negative zero is the least.
_NEGATIVE_ZERO: Final = -(2**63)
_NAN: Final = 0x7FF8000000000000
_FURTHER: Final = np.uint64(0x9E3779B97F4A7C15)
#: Numbers that are looked at together: few enough to stay in a processor's second cache meanwhile.
_TOGETHER: Final = 1 << 14


@lru_cache(maxsize=64)
def _factors(count: int) -> Words:
    """Odd factors, one for each word of a row, always the same."""
    text = b"".join(hashlib.blake2b(f"row {index}".encode(), digest_size=8).digest() for index in range(count))
    return np.frombuffer(text, dtype="<u8").astype(np.uint64) | np.uint64(1)


@lru_cache(maxsize=64)
def _places(generations: tuple[int, ...]) -> tuple[Words, Ints]:
    """The factors of a row's words with results of these generations, and which results are later than the first.

    Results of each generation follow those before it, wherever they stand: factors of the earlier ones do not move.
    """
    order = np.argsort(np.array(generations, dtype=np.int64), kind="stable")
    factors = _factors(len(generations) + 2).copy()
    factors[2 + order] = _factors(len(generations) + 2)[2:]
    return factors, np.flatnonzero(generations)


@lru_cache(maxsize=4096)
def _text_word(ending: str, flags: str) -> int:
    return int.from_bytes(hashlib.blake2b(f"{ending}\n{flags}".encode(), digest_size=8).digest(), "little")


def _text_words(endings: Sequence[str], flags: Sequence[str]) -> Words:
    """A word for the ending and the flags of each row; one for all where they are the same, which is faster."""
    if len(endings) and all(list(texts).count(texts[0]) == len(texts) for texts in (endings, flags)):
        return np.array(_text_word(endings[0], flags[0]), dtype=np.uint64)
    pairs = zip(endings, flags, strict=True)
    return np.array([_text_word(*pair) for pair in pairs], dtype=np.uint64)


def as_kept(values: Floats) -> Floats:
    """Numbers as databases keep them, C-contiguous: infinities are missing, zeros have no sign, NaN has one pattern.

    Not copied where they are so already: to write another 300 kB takes longer than to hash them.
    """
    kept = np.ascontiguousarray(values, dtype=np.float64)
    flat = kept.reshape(-1)
    if all(_is_kept(flat[first : first + _TOGETHER]) for first in range(0, flat.size, _TOGETHER)):
        return kept
    kept = kept + 0.0
    kept[~np.isfinite(kept)] = np.nan
    return kept


def _is_kept(values: Floats) -> bool:
    bits = values.view(np.int64)
    kept = np.count_nonzero(np.isfinite(values))
    if kept < values.size:
        kept += np.count_nonzero(bits == _NAN)
    return bool(kept == values.size and bits.min() != _NEGATIVE_ZERO)


def row_words(
    cases: Ints,
    endings: Sequence[str],
    flags: Sequence[str],
    values: Floats,
    *,
    generations: tuple[int, ...] = (),
    further: bool = False,
) -> Words:
    """A hash of each row, uint64 array of shape (rows,); ``values``, shape (rows, results), are as from `as_kept`.

    ``generations``: those of the results (`ResultInfo`); without them all are of the first. A row that lacks a later
    result has the hash that it had before there was that result. ``further``: the rows are those beside the first ones
    of their cases.
    """
    factors, later = _places(generations or (0,) * values.shape[1])
    # Half the time of the product of a matrix and a vector, for which numpy has no fast code with integers.
    words: Words = np.einsum("ij,j->i", values.view(np.uint64), factors[2:])
    if later.size:
        missing = np.isnan(values[:, later]).astype(np.uint64)
        words -= np.einsum("ij,j->i", missing, factors[2 + later] * np.uint64(_NAN))
    words += cases.astype(np.uint64) * factors[0]
    words += _text_words(endings, flags) * factors[1]
    if further:
        words ^= _FURTHER
    words ^= words >> np.uint64(33)
    words *= _MIX_A
    words ^= words >> np.uint64(33)
    words *= _MIX_B
    words ^= words >> np.uint64(33)
    return words


def digest_of(*parts: Words) -> int:
    """The digest of rows with those hashes, as the database keeps it: a signed number of 64 bits."""
    return signed(sum(int(words.sum(dtype=np.uint64)) for words in parts))


def digests_of(words: Words, counts: Sequence[int]) -> list[int]:
    """The digests of chunks with ``counts`` rows each, none of them 0, whose rows follow one another."""
    starts = np.cumsum([0, *counts[:-1]])
    digests: list[int] = np.add.reduceat(words, starts).view(np.int64).tolist()
    return digests


def signed(total: int) -> int:
    """The number of 64 bits with a sign that has the last 64 bits of ``total``."""
    return (total + 2**63) % 2**64 - 2**63
