"""The interface of a model, and the registry of models."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sprag.worker.models.presentation import Presentation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sprag.engine import Ending
    from sprag.engine.catalogue import Parameter, ResultInfo
    from sprag.engine.outcome import Trajectory
    from sprag.worker.models.abilities import Clutches, Strobes, Transients
    from sprag.worker.models.common import ChunkResult, ChunkTask, Extent, KernelShape
    from sprag.worker.study import Study

    Floats = NDArray[np.float64]


class Model(Protocol):
    """A model: turns a study's columns into a call of the engine and its output into results.

    A subclass must define ``name`` and every method without a body here.
    """

    @property
    def name(self) -> str:
        """Name of the model in specs, such as "vibration-drive"."""
        ...

    @property
    def endings(self) -> frozenset[Ending]:
        """Endings that a case can have besides ok."""
        return frozenset()

    @property
    def flags(self) -> Mapping[str, str]:
        """The flags that a case can have, with their descriptions."""
        return {}

    @property
    def unsettled(self) -> frozenset[str]:
        """The flags of cases whose results are missing values, because their motion had not settled."""
        return frozenset()

    @property
    def without_motion(self) -> Mapping[Ending, frozenset[str]]:
        """Results of cases with that ending that count as others do: they tell what a motion needs."""
        return {}

    @property
    def presentation(self) -> Presentation:
        """Presentation of the model to users."""
        return Presentation()

    def presentation_of(self, study: Study) -> Presentation:
        """The presentation of a study; that of the model unless its machine has more to show."""
        return self.presentation

    def parameters(self) -> tuple[Parameter, ...]:
        """Every numeric parameter: paths in a spec, with placeholders for indices and names."""
        ...

    def parameters_of(self, study: Study) -> dict[str, Parameter]:
        """The parameters of the study's own machine by path; empty where `parameters` is complete."""
        return {}

    def variants(self) -> tuple[str, ...]:
        """Every variant; studies of one variant have the same results and share a table."""
        return ("",)

    def variant_of(self, study: Study) -> str:
        """The variant of a study: at most 40 lower-case letters, digits and hyphens."""
        return ""

    def results(self, variant: str) -> tuple[ResultInfo, ...]:
        """Every result of a variant, in the order of the columns of `ChunkResult.values`."""
        ...

    def numbered_by(self, variant: str) -> str | None:
        """Result that numbers the rows of a case of that variant, from 0; None where a case has one row."""
        return None

    def result_catalogue(self) -> tuple[ResultInfo, ...]:
        """Every result for a catalogue, with placeholders for indices."""
        return self.results(self.variants()[0])

    def shape_of(self, study: Study) -> KernelShape:
        """The compiled kernel that the cases of the study need."""
        ...

    def sweeps(self, run: Mapping[str, Any]) -> bool:
        """Whether cases with that run can start from the settled motion of their neighbours (`ChunkTask.lines`)."""
        return False

    def invalid(self, study: Study, columns: Mapping[str, Any], count: int) -> NDArray[np.bool_]:
        """Which of some cases, shape (count,), are no machine although each of their numbers is in its range.

        It is asked for studies with tolerances only: the axes of other studies are checked with their spec.
        """
        return np.zeros(count, dtype=np.bool_)

    def run(self, task: ChunkTask) -> ChunkResult:
        """Run the cases of a task; a physical failure is an ending in the result, never an exception."""
        ...

    def extent(self, study: Study, case: int) -> Extent:
        """The independent variable of the instantaneous values of a case."""
        ...

    def trajectory(self, study: Study, case: int, start: float, end: float, points: int) -> Trajectory:
        """Instantaneous values of one case at ``points`` equally spaced points of its `extent`."""
        ...

    @property
    def clutches(self) -> Clutches | None:
        """The clutches of its machines; None where they have none."""
        return None

    @property
    def strobes(self) -> Strobes | None:
        """The strobes and initial values of its cases; None where they have none."""
        return None

    @property
    def transients(self) -> Transients | None:
        """The transients of its machines; None where they have none."""
        return None

    def lanes_per_case(self, study: Study) -> int:
        """Runs of the engine that one case of the study takes side by side."""
        return 1

    def estimate_seconds_per_case(self, study: Study) -> float:
        """Rough time of one case on one core, in s."""
        ...

    def estimate_compile_seconds(self, shape: KernelShape) -> float:
        """Rough time of compiling the kernel of that shape, in s."""
        return 0.0

    def prepare(self) -> None:
        """Load the model's engine with its compiler."""

    def load(self, shape: KernelShape) -> None:
        """Compile the kernel of that shape into the on-disk cache, or load it from there."""

    def known_answers(self, shape: KernelShape) -> bytes:
        """Results of a short case by the loaded kernel of that shape; the same bytes on every sound processor."""
        return b""


_MODELS: dict[str, Model] = {}


def register(model: Model) -> None:
    """Register a model. Raises ValueError where its name is taken."""
    if model.name in _MODELS:
        raise ValueError(f"there already is a model {model.name!r}")
    _MODELS[model.name] = model


def unregister(name: str) -> None:
    """Remove a model; KeyError for an unknown name."""
    del _MODELS[name]


def model_of(name: str) -> Model:
    """The model of that name; ValueError for an unknown name."""
    try:
        return _MODELS[name]
    except KeyError:
        raise ValueError(f"unknown model {name!r}; known models: {', '.join(_MODELS)}") from None


def model_names() -> tuple[str, ...]:
    """Names of all models."""
    return tuple(_MODELS)


def all_models() -> tuple[Model, ...]:
    """Every model."""
    return tuple(_MODELS.values())
