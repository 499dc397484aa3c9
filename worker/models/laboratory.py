"""What a model answers while its machine is drawn, as data: proposed ends of its numbers, and the results in sight."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True, slots=True)
class SliderKind:
    """Numbers whose paths, within a part of a machine, fit a pattern: proposed ends as factors on their value."""

    path: str
    low: float = 0.5
    high: float = 2.0


@dataclass(frozen=True, slots=True)
class Laboratory:
    """What a machine answers while it is drawn.

    Attributes
    ----------
    note : a note on its figure
    sliders : ends proposed for its numbers; the first fits
    main : results that are always in sight, and their labels; by default those of the main curve
    along : the result that is drawn along each number in sight; "" for models that take longer
    studies : what an address can ask to vary, and the pattern of its paths
    """

    note: str = ""
    sliders: tuple[SliderKind, ...] = ()
    main: Mapping[str, str] = field(default_factory=dict)
    along: str = ""
    studies: Mapping[str, str] = field(default_factory=dict)
