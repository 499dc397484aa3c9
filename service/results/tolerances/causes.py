"""Which tolerances the spread of a result or the yield is owed to, from the sample of drives itself.

The share of a tolerance is the first-order Sobol index, Var(E[y | x]) / Var(y). The conditional mean is fitted by a
straight line and cosines of the rank of x (COSI: Plischke, Environmental Modelling & Software 35 (2012) 10), or taken
for each value of an x that has a few only, and the share is corrected for the degrees of freedom as an adjusted
coefficient of determination is. The interval follows from the influence function of that index (Da Veiga and Gamboa,
Journal of Nonparametric Statistics 25 (2013) 573). For several columns of y the share is that of the sum of their
variances (Lamboni et al., Reliability Engineering & System Safety 96 (2011) 450).
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Name
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, joined

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Floats
    from sprag_study.worker.study import Study

#: Fewest drives from which shares are estimated.
LEAST_DRIVES: Final = 64
#: Cosines with which a conditional mean is fitted.
HARMONICS: Final = 6
#: Most different values of a tolerance that count as groups.
_GROUPS: Final = 12
#: Variances below this part of the square of the mean are rounding errors.
_ROUNDING: Final = 1e-26


@dataclass(frozen=True, slots=True)
class Share:
    """A share of the variance, and the half width of its 95 % interval."""

    value: float
    error: float


def shares(draws: Floats, y: Floats) -> list[Share] | None:
    """The share of each tolerance.

    Parameters
    ----------
    draws : array, shape (drives, tolerances)
        Independent of each other.
    y : array, shape (drives, columns)
        What is explained, finite.

    Returns
    -------
    list of Share, one for each tolerance; None where there are too few drives, or where ``y`` does not vary
    """
    count = len(y)
    if count < LEAST_DRIVES:
        return None
    centred = y - y.mean(axis=0)
    variance = float((centred**2).mean(axis=0).sum())
    if variance <= _ROUNDING * float((y**2).mean(axis=0).sum()):
        return None
    return [_share(column, centred, variance) for column in draws.T]


def _share(x: Floats, y: Floats, variance: float) -> Share:
    basis = _basis(x)
    count, functions = basis.shape
    if not functions:
        return Share(0.0, 0.0)
    coefficients, *_ = np.linalg.lstsq(basis, y, rcond=None)
    fitted = basis @ coefficients
    explained = float((fitted**2).mean(axis=0).sum()) / variance
    value = 1.0 - (1.0 - explained) * (count - 1.0) / (count - 1.0 - functions)
    influence = (2.0 * y * fitted - fitted**2 - explained * y**2).sum(axis=1) / variance
    # Where nothing depends on x the influence vanishes; the fit of noise remains.
    noise = math.sqrt(2.0 * functions) / count * (1.0 - min(max(value, 0.0), 1.0))
    return Share(value, 1.96 * math.hypot(float(influence.std()) / math.sqrt(count), noise))


def _basis(x: Floats) -> Floats:
    """Functions of x with mean 0 over the drives, shape (drives, functions)."""
    different, group = np.unique(x, return_inverse=True)
    count = len(x)
    if different.size <= min(_GROUPS, count // 8):
        functions = (group.reshape(-1)[:, None] == np.arange(different.size - 1)).astype(np.float64)
        return np.asarray(functions - functions.mean(axis=0))
    rank = np.empty(count)
    rank[np.argsort(x, kind="stable")] = (np.arange(count) + 0.5) / count
    cosines = np.cos(math.pi * np.arange(1, HARMONICS + 1) * rank[:, None])
    # Tails of a normal distribution need many cosines; the results of small deviations are nearly linear.
    return np.column_stack([(x - x.mean()) / x.std(), cosines])


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
