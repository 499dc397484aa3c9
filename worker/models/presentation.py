"""What pages, pictures and reports know about a model: what people are shown first, and in which words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot of a motion: its lines are pairs of a variable and what it is called."""

    title: str
    unit: str
    lines: tuple[tuple[str, str], ...]


def panels_by_unit(names: Sequence[str], units: Sequence[str]) -> tuple[Panel, ...]:
    """A panel for each unit, with all variables that have it."""
    pairs = tuple(zip(names, units, strict=True))
    lines = {unit: tuple((name, name) for name, own in pairs if own == unit) for unit in dict.fromkeys(units)}
    return tuple(Panel(", ".join(name for name, _ in found), unit, found) for unit, found in lines.items())


def _no_phases(_: Sequence[str]) -> tuple[tuple[str, str, str], ...]:
    return ()


@dataclass(frozen=True, slots=True)
class Presentation:
    """What is shown of a model; names that a study does not have are passed over, and every field may be left out.

    Attributes
    ----------
    along, apart : paths of the axes to draw along, and of those told apart by colour, first choice first
    drawn : results of the main curve
    main : results that tell most of a machine; ``heading`` is what they are called together
    columns : results that the table of cases shows first
    operating_point : paths of parameters without which a picture tells nobody what it shows
    checks : first parts of names of results that tell of the computation rather than of the machine
    balance : rows of a balance of means: sign, result, words; ``residual`` is the result with what is left over
    panels : plots of a motion, from the names and units of its variables
    states : how states look, colour and two patterns (plotly's, matplotlib's), so that either alone tells them
    phases : lines of the phase portrait, from the names of the variables: (angle, speed, what it is of)
    portrait : what the phase portrait shows; "" where there is none
    motion, motion_note : what the plots show in a few words, and what a reader has to know of them
    symbols : letter of the catalogue -> base and index as books print them
    """

    along: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()
    drawn: tuple[str, ...] = ()
    main: tuple[str, ...] = ()
    heading: str = "Main results"
    columns: tuple[str, ...] = ()
    operating_point: tuple[str, ...] = ()
    checks: tuple[str, ...] = ()
    balance: tuple[tuple[str, str, str], ...] = ()
    residual: str = ""
    panels: Callable[[Sequence[str], Sequence[str]], tuple[Panel, ...]] = panels_by_unit
    states: Mapping[str, tuple[str, str, str]] = field(default_factory=dict)
    phases: Callable[[Sequence[str]], tuple[tuple[str, str, str], ...]] = _no_phases
    portrait: str = ""
    motion: str = "Motion of the case"
    motion_note: str = ""
    symbols: Mapping[str, tuple[str, str]] = field(default_factory=dict)
