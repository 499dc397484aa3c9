"""Presentation of a model on pages, in pictures and reports: what is shown first, and in which words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from sprag_study.worker.models.form import Form
from sprag_study.worker.models.laboratory import Laboratory

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.engine.outcome import Trajectory


@dataclass(frozen=True, slots=True)
class Panel:
    """One plot of a motion: its lines are pairs of a variable and its label."""

    title: str
    unit: str
    lines: tuple[tuple[str, str], ...]


@dataclass(frozen=True, slots=True)
class Reference:
    """A line beside the variables of a panel, such as a level or a sum; arrays of shape (m,).

    ``style`` is the number of its dash; a ``wide`` one stands for the whole of the others.
    """

    label: str
    x: NDArray[np.float64]
    y: NDArray[np.float64]
    style: int = 0
    wide: bool = False


#: How an answer is read off a curve of a result: its value where x is 0, its largest or smallest value with the x of
#: it, the x from which on it is 0, or its value at the working point.
AnswerKind = Literal["at_zero", "largest", "smallest", "until_zero", "here"]
#: Which of two values of an answer is the better one; "" where that depends on the machine's purpose.
Better = Literal["larger", "smaller", ""]


@dataclass(frozen=True, slots=True)
class Answer:
    """A number that people ask of a study first, such as the largest useful power and the load of it.

    Attributes
    ----------
    name : in the API
    title : for people
    result : the result that it is read from
    kind : how it is read
    along : path of the axis along which it has a meaning; "" for any
    better : whether a larger or a smaller value is the better one
    """

    name: str
    title: str
    result: str
    kind: AnswerKind
    along: str = ""
    better: Better = ""


@dataclass(frozen=True, slots=True)
class Clauses:
    """What is said of cases: clauses in which ``{places}`` stand for results, such as ``it runs at {speed}``.

    Attributes
    ----------
    results : the result of each place; the first is what a case is judged by
    here : of one case, the fullest first; the first one counts whose results are all known and not 0
    still : of a case whose first result is 0
    left : of a case with less than half of the first result that its neighbour has
    stalls : that the first result is 0 from somewhere between ``{low}`` and ``{high}``
    batch : of drives whose first result has its median at ``{middle}``, and 9 of 10 between ``{low}`` and ``{high}``
    """

    results: Mapping[str, str] = field(default_factory=dict)
    here: tuple[str, ...] = ()
    still: str = ""
    left: str = ""
    stalls: str = ""
    batch: str = ""

    @property
    def texts(self) -> tuple[str, ...]:
        """Every clause."""
        return tuple(filter(None, (*self.here, self.still, self.left, self.stalls, self.batch)))


def panels_by_unit(names: Sequence[str], units: Sequence[str]) -> tuple[Panel, ...]:
    """A panel for each unit, with all variables that have it."""
    pairs = tuple(zip(names, units, strict=True))
    lines = {unit: tuple((name, name) for name, own in pairs if own == unit) for unit in dict.fromkeys(units)}
    return tuple(Panel(", ".join(name for name, _ in found), unit, found) for unit, found in lines.items())


def _no_phases(_: Sequence[str]) -> tuple[tuple[str, str, str], ...]:
    return ()


def _no_references(_: Trajectory) -> Mapping[str, tuple[Reference, ...]]:
    return {}


@dataclass(frozen=True, slots=True)
class Presentation:
    """Presentation of a model; names that a study does not have are skipped, and every field is optional.

    Attributes
    ----------
    title : what the model is called; "" for its name
    along, apart : paths of the axes to draw along, and of those distinguished by colour, in order of preference
    drawn : results of the main curve
    main : the main results of a machine; ``heading`` is their common title
    below : results of the chart below that of the first result of ``clauses``, in order of preference
    answers : what a page says first; where there are none, the largest and smallest values of the drawn results
    wanted : parameter with the wanted value of a result, by the name of the result
    clauses : what is said of a case in a sentence
    shares : results that are a share of something, with N and K for indices: people may read them in per cent
    workshop : units in which a workshop reads its quantities; SI where it has none
    columns : results that the table of cases shows first
    operating_point : paths of parameters that every picture must state
    checks : first parts of the names of results that describe the computation rather than the machine
    balance : rows of a balance of means: sign, result, label; ``residual`` is the result with the remainder
    panels : plots of a motion, from the names and units of its variables
    first_panels : titles of the plots of a motion that are shown first; all of them where none is named
    references : further lines of a motion, by the title of their panel
    states : colour and pattern of each state; either alone distinguishes them
    phases : lines of the phase portrait, from the names of the variables: (angle, speed, label)
    portrait : description of the phase portrait; "" where there is none
    motion, motion_note : short description of the plots, and a note for the reader
    symbols : symbol of the catalogue -> base and index as in print
    captions : what people read instead of a name of the catalogue, with N and K for indices; ``{}`` is the last
        index, ``{number}`` the same for people, who count from 1
    letters : base and index, as in print, of results
    form : its machine as fields of a form
    laboratory : what its machine answers while it is drawn
    theory : beginning of paths without indices -> page of docs/ and heading that explain it, as in a URL
    """

    title: str = ""
    along: tuple[str, ...] = ()
    apart: tuple[str, ...] = ()
    drawn: tuple[str, ...] = ()
    main: tuple[str, ...] = ()
    heading: str = "Main results"
    below: tuple[str, ...] = ()
    answers: tuple[Answer, ...] = ()
    wanted: Mapping[str, str] = field(default_factory=dict)
    clauses: Clauses = field(default_factory=Clauses)
    shares: tuple[str, ...] = ()
    workshop: tuple[str, ...] = ("deg", "rpm", "mm", "bar", "N/mm", "%")
    columns: tuple[str, ...] = ()
    operating_point: tuple[str, ...] = ()
    checks: tuple[str, ...] = ()
    balance: tuple[tuple[str, str, str], ...] = ()
    residual: str = ""
    panels: Callable[[Sequence[str], Sequence[str]], tuple[Panel, ...]] = panels_by_unit
    first_panels: tuple[str, ...] = ()
    references: Callable[[Trajectory], Mapping[str, tuple[Reference, ...]]] = _no_references
    states: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    phases: Callable[[Sequence[str]], tuple[tuple[str, str, str], ...]] = _no_phases
    portrait: str = ""
    motion: str = "Motion of the case"
    motion_note: str = ""
    symbols: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    captions: Mapping[str, str] = field(default_factory=dict)
    letters: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    form: Form = field(default_factory=Form)
    laboratory: Laboratory = field(default_factory=Laboratory)
    theory: Mapping[str, str] = field(default_factory=dict)

    def is_best_small(self, result: str) -> bool:
        """Whether a result is the better the smaller it is, such as an irregularity."""
        return any(one.result == result and one.better == "smaller" for one in self.answers)

    def explained(self, path: str) -> str:
        """Page of docs/ and heading that explain a parameter or another entry of the base; "" where none does."""
        parts = [part for part in path.split(".") if not part.isdigit() and part not in {"N", "K"}]
        beginnings = (".".join(parts[:length]) for length in range(len(parts), 0, -1))
        return next((self.theory[own] for own in beginnings if own in self.theory), "")
