"""The laboratory of a model as data: which numbers have sliders in sight, what it shows, and what studies it makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SliderKind:
    """Numbers whose sliders are always in sight.

    Attributes
    ----------
    path : pattern of their paths, without the row of a machine of several parts
    label, group, symbol, help : "" for those of the number; numbers without a group stand first
    low, high : ends of the slider as factors on the machine's own value
    least : the upper end is at least so large (SI)
    ends : ends (SI) that do not depend on the machine's own value
    beside : further paths, the largest value of which counts
    unit : they are numbers in this unit that are not 0; "" for any
    """

    path: str
    label: str = ""
    group: str = ""
    low: float = 0.5
    high: float = 2.0
    least: float = 0.0
    ends: tuple[float, float] | None = None
    beside: tuple[str, ...] = ()
    logarithmic: bool = False
    unit: str = ""
    symbol: str = ""
    help: str = ""


@dataclass(frozen=True, slots=True)
class Laboratory:
    """The laboratory of a model.

    Attributes
    ----------
    address : last part of its address, by default the name of the model; "" where it is the first laboratory
    template : of its page
    title, lead, curves, note : its heading and what it is for; what its figure shows, and a note on that
    sliders : numbers that are always in sight, in their order; the other numbers follow
    angles : last names of angles whose sliders do not depend on the machine's own value, and their ends (rad)
    shown_in : pattern of paths and a unit in which their sliders move unless the reader chooses another; the first fits
    numbered : list of the base -> label of a number of one of its rows
    main : results that are always in sight, and their labels; by default those of the main curve
    further : the other results; by default all
    states : last names of the initial values from which the next setting starts, and of those of clutches
    held : machines that can be held beside the current one
    studies : studies of a setting: what they vary, and the pattern of the paths
    each : of those, studies that vary several different numbers, each on an axis of its own
    against, values : name of such a study, and number of its values
    questions : questions to be estimated: what happens, the factor on which numbers, and their units
    by_name : whether examples are called by their names instead of their titles
    without : fields of a spec, and beginnings of names, of examples that are no machine of their own
    """

    address: str | None = None
    template: str = "laboratory.html"
    title: str = ""
    lead: str = "Change the numbers of a machine: its results are recomputed and redrawn immediately."
    curves: str = "Motion of the machine"
    note: str = ""
    sliders: tuple[SliderKind, ...] = ()
    angles: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    shown_in: tuple[tuple[str, str], ...] = ()
    numbered: Mapping[str, str] = field(default_factory=dict)
    main: Mapping[str, str] = field(default_factory=dict)
    further: tuple[str, ...] = ()
    states: tuple[str, ...] = ()
    of_clutches: tuple[str, ...] = ()
    held: int = 3
    studies: Mapping[str, tuple[str, str]] = field(default_factory=dict)
    each: tuple[str, ...] = ()
    against: str = "{machine}: results against {what}"
    values: int = 25
    questions: Mapping[str, tuple[str, float, str, tuple[str, ...]]] = field(default_factory=dict)
    by_name: bool = False
    without: tuple[str, ...] = ()
