"""Usable results: the one rule by which a row counts, for planners, curves, answers, yields, reports and all others.

A row is usable where its case ended ok and no flag of it says that the motion had not settled (`Model.unsettled`).
Results that tell what a motion needs count without one (`Model.without_motion`). What is not usable is a missing value:
it is neither interpolated nor compared with others. Any other flag stands beside a result that counts: a held motion
that depends on its run-up ("history_dependent") is a steady motion of the machine. A usable mean of irregular motion
has a half width ("NAME.half_width"), which counts against every limit.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from sprag_study.engine import Ending
from sprag_study.worker.models.registry import model_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_HALF_WIDTH: Final = ".half_width"


def usable(
    model: str, endings: Sequence[str | None], flags: Sequence[str], result: str | None = None
) -> NDArray[np.bool_]:
    """Which rows count; of a ``result`` that tells what a motion needs, also those without one.

    Parameters
    ----------
    model : str
        Name of the model.
    endings : sequence of str or None, length m
        None for a case without a row.
    flags : sequence of str, length m or 0
        Those of each row, joined by commas; of length 0 where no row has any.
    result : str, optional
        For readers of one result. Planners, yields and whoever else asks whether a machine works leave it out.

    Returns
    -------
    bool array, shape (m,)
    """
    counting: set[str | None] = {Ending.OK}
    counting |= {ending for ending, names in model_of(model).without_motion.items() if result in names}
    ok = np.fromiter((ending in counting for ending in endings), dtype=np.bool_, count=len(endings))
    return ok & ~unsettled(model, flags) if len(flags) else ok


def usable_each(
    model: str, endings: Sequence[str | None], flags: Sequence[str], results: Sequence[str]
) -> dict[str, NDArray[np.bool_]]:
    """`usable` of each of several results, by name."""
    needs = frozenset[str]().union(*model_of(model).without_motion.values())
    rows = usable(model, endings, flags)
    return {name: usable(model, endings, flags, name) if name in needs else rows for name in results}


def unsettled(model: str, flags: Sequence[str]) -> NDArray[np.bool_]:
    """Which rows have a flag that says that the motion had not settled, shape (m,); ``flags`` as of `usable`."""
    raised = model_of(model).unsettled
    kinds = {text: not raised.isdisjoint(text.split(",")) for text in set(flags)}
    return np.fromiter((kinds[text] for text in flags), dtype=np.bool_, count=len(flags))


def half_width(name: str) -> str:
    """Name of the result with the half width of the interval of a mean of irregular motion."""
    return name + _HALF_WIDTH


def with_half_widths(names: Iterable[str], known: Iterable[str]) -> list[str]:
    """Names of results, each once, then those of their half widths that are among the ``known`` ones of a study."""
    names, every = list(dict.fromkeys(names)), set(known)
    return list(dict.fromkeys([*names, *(own for name in names if (own := half_width(name)) in every)]))


def against(
    kind: Literal["is", "at_least", "at_most"], bound: Floats | float, values: Floats, widths: Floats | None
) -> Floats:
    """Values moved by their half widths (NaN: none) to where the limit ``bound`` of that kind is hardest to meet."""
    if widths is None:
        return values
    wide = np.where(np.isfinite(widths), widths, 0.0)
    if kind == "is":
        return np.asarray(values + np.copysign(wide, values - bound))
    return np.asarray(values - wide if kind == "at_least" else values + wide)
