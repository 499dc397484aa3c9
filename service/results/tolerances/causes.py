"""Which tolerances the spread of a result or the yield is owed to."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.tolerances.shares import LEAST_DRIVES, Share, shares

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.study import Study

#: Places of a line over which the shares are taken, evenly divided, and drives of it.
_MOST_PLACES: Final = 33
_MOST_DRIVES: Final = 20_000


@dataclass(frozen=True, slots=True)
class Causes:
    """What a spread is owed to.

    Attributes
    ----------
    shares : the share of each tolerance, in their order; None where it is not known
    rest : the share of what tolerances do together, which no single one of them has; None where it is not known
    why : why shares are not known; "" where they are
    missing : drives that are left out of known shares, because they have no results
    """

    shares: tuple[Share | None, ...]
    rest: float | None
    why: str = ""
    missing: int = 0

    @property
    def note(self) -> str:
        """Why shares are not known, and how many drives are left out."""
        left_out = Phrase("drives without results, left out of the shares: {count}", count=self.missing)
        return joined("; ", filter(None, (self.why, left_out if self.missing else "")))


class Matrix:
    """The results of drives at some places of a line, for their shares: bounded, whatever the size of the study."""

    def __init__(self, places: int, drives: int) -> None:
        wanted = np.unique(np.linspace(0, places - 1, min(places, _MOST_PLACES)).round().astype(np.int64))
        self._column = np.full(places, -1, dtype=np.int64)
        self._column[wanted] = np.arange(wanted.size)
        self.values = np.full((min(drives, _MOST_DRIVES), wanted.size), np.nan)

    def take(self, at: slice, values: Floats) -> None:
        """The results at some neighbouring places, shape (places, drives)."""
        columns = self._column[at]
        kept = columns >= 0
        self.values[:, columns[kept]] = values[kept, : len(self.values)].T


def causes_of(study: Study, matrix: Matrix) -> Causes:
    """The shares of the variance of a result over the drives that have it at every place of the matrix."""
    return variance_causes(study, matrix.values)


def variance_causes(study: Study, values: Floats) -> Causes:
    """The same of ``values``, shape (drives, columns), of the first drives of the study; NaN for missing ones."""
    spread = study.spread
    if spread is None:
        raise ValueError("the study has no tolerances")
    tied = correlated(study)
    known = np.isfinite(values).all(axis=1)
    missing = int((~known).sum())
    found = shares(spread.array[: len(values)][known], values[known])
    nothing: tuple[None, ...] = (None,) * len(spread.tolerances)
    if found is None:
        enough = int(known.sum())
        note = Phrase("there is no variance: all drives have the same value")
        if enough < LEAST_DRIVES:
            text = N_("shares need {least} drives with results, {count} have them")
            note = Phrase(text, least=LEAST_DRIVES, count=enough)
        return Causes(nothing, None, note)
    own = tuple(None if name in tied else share for name, share in zip(spread.names, found, strict=True))
    names = joined(", ", (Name(name, within=True) for name in sorted(tied)))
    why = Phrase("{names} are correlated: they have no shares of their own", names=names) if tied else ""
    # Estimates of shares that are 0 scatter around it; added up they would count as interactions.
    rest = None if tied else max(1.0 - sum(max(share.value, 0.0) for share in found), 0.0)
    return Causes(own, rest, why, missing)


def correlated(study: Study) -> set[str]:
    """Names of the tolerances that are drawn together with others."""
    if study.spread is None:
        return set()
    correlated = {path for item in study.spread.about.get("correlations", ()) for path in item["between"]}
    among = re.compile("|".join(re.escape(path).replace(r"\*", r"[^.]+") for path in correlated) or "(?!)")
    return {one.name for one in study.tolerances if any(among.fullmatch(path) for path in (one.name, *one.paths))}
