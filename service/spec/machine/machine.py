"""The machine of a spec (`base`) of any model: numbers by flat path, and the paths that axes can vary.

Fields are nested like the paths: the number at ``mechanism.slider_crank.crank`` is the one at
``/base/mechanism/slider_crank/crank``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sprag_study.sentences import Sentence
from sprag_study.service.reading.texts import did_you_mean

if TYPE_CHECKING:
    from sprag_study.worker.models import ClutchFit, Parameter
    from sprag_study.worker.models.components import Components


@dataclass
class Machine:
    """The base of a spec, as far as it could be read.

    Attributes
    ----------
    values : flat path -> SI number; incomplete when faults were recorded
    parameters : flat path -> parameter, for every number that an axis can vary
    structure : its non-numeric part as stored in a study; None where the model has none or it could not be read
    derive : flat path -> formula in SI numbers, for every number that is derived from others
    components : those among which the study chooses
    """

    values: dict[str, float] = field(default_factory=dict)
    parameters: dict[str, Parameter] = field(default_factory=dict)
    structure: dict[str, Any] | None = None
    derive: dict[str, str] = field(default_factory=dict)
    components: tuple[Components, ...] = ()

    def component_of(self, path: str) -> str | None:
        """The kind of the component that gives a parameter its value; None where none does."""
        return next((one.path for one in self.components if path in one.columns), None)

    @property
    def fits(self) -> dict[str, ClutchFit]:
        """JSON Pointer of each fitted clutch -> its fit."""
        return {}

    def assumed(self, path: str) -> bool:  # noqa: ARG002 - some models need it
        """Whether ``path`` may belong to a part of the base that could not be read."""
        return False

    def why_not(self, path: str) -> Sentence:
        """A sentence that explains why an axis cannot vary ``path``, and what it can vary."""
        known = tuple(self.parameters)
        hint = did_you_mean(path.removeprefix("base."), known)
        return Sentence("is not a numeric parameter of the base{hint}", hint=hint)
