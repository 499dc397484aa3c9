"""A branch as a described figure: stable parts full, unstable ones dashed, special points ringed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from sprag_study.sentences import Amount
from sprag_study.service.figures.figure import PALETTE, Figure, Line, Panel, Quantity
from sprag_study.service.figures.sections import parameter_of
from sprag_study.service.reading.reader import Phrase, joined, plural, term
from sprag_study.worker.models.vocabulary import ordinal

if TYPE_CHECKING:
    from sprag_study.worker.arrays import Bools, Floats, Ints
    from sprag_study.worker.models.branches import Along, CaseBranch, SpecialPoint
    from sprag_study.worker.study import Study

#: Colours of stable and unstable parts, and of each kind of special point.
_STABLE, _UNSTABLE, _OWN = PALETTE[0], PALETTE[1], "#777777"
_KINDS: Final = {
    "fold": PALETTE[2], "doubling": PALETTE[3], "torus": PALETTE[4], "branching": PALETTE[5], "grazing": PALETTE[6],
}  # fmt: skip
#: Special points that are listed one by one.
_LISTED: Final = 12


@dataclass(frozen=True, slots=True)
class OwnCases:
    """The cases of the study along the branch's parameter: values (SI), results and numbers, shape (m,)."""

    x: Floats
    y: Floats
    cases: Ints


def branch_figure(made: CaseBranch, study: Study, along: Along, result: str, own: OwnCases | None = None) -> Figure:
    """One result over the parameter, with the study's own cases beside it."""
    x = parameter_of(study, along.paths)
    column = made.names.index(result)
    y = Quantity(result, made.units[column])
    if not made.order:
        return Figure(
            x,
            (Panel(y, (), x=x),),
            note=Phrase("There is no branch: {why}", why=made.note),
        )
    values = made.values[:, column]
    full = stable_segments(made)
    lines = [
        Line(Phrase("stable"), *_part(made.parameters, values, full), _STABLE, 0, key="stable"),
        Line(Phrase("unstable"), *_part(made.parameters, values, ~full), _UNSTABLE, 1, key="unstable"),
    ]
    lines = [line for line in lines if line.x.size]
    if own is not None and own.x.size:
        lines.append(Line(Phrase("cases of the study"), own.x, own.y, _OWN, 2, key="2", cases=own.cases, joined=False))
    lines += _marks(made, values, x.unit)
    heading = plural("orbits of {count} excitation period", "orbits of {count} excitation periods", made.order)
    return Figure(x, (Panel(y, tuple(lines), x=x),), heading=heading, below=_below(made))


def stable_segments(made: CaseBranch) -> Bools:
    """Whether the part between each point and the next one is stable, shape (points - 1,).

    At folds and the like a multiplier is 1 in modulus: the other end of a part decides.
    """
    marginal = np.zeros(len(made.stable), dtype=np.bool_)
    marginal[[special.index for special in made.specials if special.kind != "grazing"]] = True
    stable: Bools = made.stable | marginal
    both = marginal[:-1] & marginal[1:]
    return np.asarray(stable[:-1] & stable[1:] & ~both)


def _part(x: Floats, y: Floats, kept: Bools) -> tuple[Floats, Floats]:
    """The kept segments of a line, with NaN between stretches."""
    xs: list[float] = []
    ys: list[float] = []
    for k in np.flatnonzero(kept).tolist():
        if not k or not kept[k - 1]:
            if xs:
                xs.append(float(x[k]))
                ys.append(np.nan)
            xs.append(float(x[k]))
            ys.append(float(y[k]))
        xs.append(float(x[k + 1]))
        ys.append(float(y[k + 1]))
    return np.array(xs), np.array(ys)


def _marks(made: CaseBranch, values: Floats, unit: str) -> list[Line]:
    """A ring for each special point, named in the legend; many of them by their kinds."""
    if len(made.specials) <= _LISTED:
        groups = {special_text(special, unit): [special] for special in made.specials}
    else:
        groups = {}
        for special in made.specials:
            groups.setdefault(term(special.kind), []).append(special)
    lines = []
    for name, members in groups.items():
        places = [special.index for special in members]
        x = np.array([special.parameter for special in members])
        colour = _KINDS[members[0].kind]
        lines.append(Line(name, x, values[places], colour, 3, key=name, joined=False, ring=True))
    return lines


def special_text(special: SpecialPoint, unit: str) -> str:
    """A special point in words: its kind, its place, and of a grazing what changes."""
    text = Phrase("{kind} at {place}", kind=term(special.kind), place=Amount(special.parameter, unit, 8))
    changes = [
        Phrase(
            "{part} {state} {before} → {after}",
            part=_part_text(contact.part),
            state=term(contact.state),
            before=str(contact.before),
            after=str(contact.after),
        )
        for contact in special.contacts
    ]
    return joined(": ", (text, joined(", ", changes))) if changes else text


def _part_text(part: str) -> Phrase:
    """What a part of the machine is called: ``pendulum 1`` of ``pendulums.0``."""
    kind, _, number = part.rpartition("s.")
    return Phrase("{part} {number}", part=Phrase(kind), number=ordinal(number)) if kind else Phrase(part)


def _below(made: CaseBranch) -> str:
    begin, end = map(Phrase, made.ends)
    return Phrase("The branch begins at {begin} and ends at {end}.", begin=begin, end=end) if made.ends[0] else ""
