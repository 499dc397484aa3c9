"""The study spec, version 1: raw JSON or TOML data in, a study in SI numbers out, or all that is wrong with it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from service.spec_messages import Problem, SpecError
from worker.study import Study

if TYPE_CHECKING:
    from worker.kernels import ClutchFit

__all__ = ["ParsedSpec", "Problem", "SpecError"]


@dataclass(frozen=True)
class ParsedSpec:
    """A spec that can be run.

    Attributes
    ----------
    study : Study
        The same in SI numbers, clutch data fitted, axes expanded.
    warnings : tuple of str
        What is allowed but probably not meant, each a sentence with its numbers.
    fits : dict
        JSON Pointer of a clutch given as measured data -> its fit.
    spec : dict
        The user's own spec, as it was given.
    """

    study: Study
    warnings: tuple[str, ...]
    fits: dict[str, ClutchFit] = field(default_factory=dict)
    spec: dict[str, Any] = field(default_factory=dict)
