"""The interface of a model, and of what only some models can do."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from sprag_study.worker.models.presentation import Presentation

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from sprag_study.engine import Ending
    from sprag_study.engine.catalogue import Parameter, ResultInfo
    from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycles
    from sprag_study.engine.machine_shaft.transient_course import Course, Transient
    from sprag_study.engine.outcome import Basin, Duty, Engagements, Portrait, Trajectory
    from sprag_study.worker.models.branches import Along, CaseBranch
    from sprag_study.worker.models.common import ChunkResult, ChunkTask, Extent, KernelShape
    from sprag_study.worker.models.forces import Bearing, Forces
    from sprag_study.worker.models.ramps import Ramps, StartUp
    from sprag_study.worker.models.sections import CaseSections, Sampling
    from sprag_study.worker.models.turns import CaseTurn
    from sprag_study.worker.study import Study

    Floats = NDArray[np.float64]


class Clutches(Protocol):
    """The machines of a model have clutches."""

    def engagements(self, study: Study, case: int) -> Engagements:
        """Engagements of the clutches of one case."""
        ...

    def duty(self, study: Study, case: int, exponent: float | None) -> Duty:
        """What the clutches of one case have to bear; ``exponent`` is that of the Wöhler curve."""
        ...


class Reactions(Protocol):
    """The machines of a model vibrate with a table, on which they act."""

    def bearing(self, study: Study, case: int) -> Bearing:
        """What the parameters of one case say of the bearings of its shaft."""
        ...

    def forces(self, study: Study, case: int, bearing: Bearing, points: int) -> Forces:
        """Forces of one case, with ``points`` equally spaced times."""
        ...


class Strobes(Protocol):
    """The cases of a model have strobes, one state per excitation period, and begin with initial values."""

    def portrait(self, study: Study, case: int) -> Portrait:
        """How one case approaches its motion."""
        ...

    def turn(self, study: Study, case: int, points: int) -> CaseTurn:
        """The settled motion of a case of a settled study."""
        ...

    def branch(self, study: Study, case: int, along: Along) -> CaseBranch:
        """The branch through the settled motion of a case."""
        ...

    def branch_results(self, study: Study) -> tuple[str, ...]:
        """Names of the results of a branch."""
        ...

    def sections(self, study: Study, case: int, asked: Sampling) -> CaseSections:
        """Strobes of settled motions along a parameter of a case."""
        ...

    def basin(self, study: Study, case: int, paths: tuple[str, str], x: Floats, y: Floats) -> Basin:
        """The regimes to which one case comes from a grid of the initial values ``x`` and ``y`` (SI) of two paths."""
        ...

    def end_state(self, study: Study, case: int) -> dict[str, float] | None:
        """Initial values (SI) by path that go on from the end of one case; None where it does not end ok."""
        ...


class StartUps(Protocol):
    """The cases of a model start up with ramps of their excitation and load."""

    def shape(self, study: Study) -> KernelShape:
        """The kernel of ramps, which is compiled apart from that of the cases."""
        ...

    def run(self, study: Study, case: int, ramps: Ramps, points: int) -> StartUp:
        """The start-up of a case with ``points`` equally spaced times."""
        ...


class Transients(Protocol):
    """The machines of a model run up, are loaded anew and coast over time, beside their cases."""

    def has_motor(self, study: Study) -> bool:
        """Whether a motor drives the machine, whose torque follows the speed."""
        ...

    def shape(self, study: Study) -> KernelShape:
        """The kernel of transients, which is compiled apart from that of the cases."""
        ...

    def run(self, study: Study, case: int, course: Course, points: int) -> Transient:
        """A transient of a case with ``points`` equally spaced times."""
        ...


class Speeds(Protocol):
    """The machines of a model have torques that follow the speed, and steady cycles at one speed or several."""

    def has(self, study: Study) -> bool:
        """Whether torques of the machine follow the speed."""
        ...

    def run(self, study: Study, case: int, load: float) -> SteadyCycles:
        """Every steady cycle of a case with a factor on the torque of its operations."""
        ...


class Model(Protocol):
    """A model: turns a study's columns into a call of the engine and its output into results.

    A subclass must define ``name`` and every method without a body here.
    """

    def __hash__(self) -> int:
        """There is one object of each model, by which catalogues are kept."""
        return id(self)

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
        """Every variant with a table of results; studies of one variant have the same results and share a table."""
        return ("",)

    def variant_of(self, study: Study) -> str:
        """The variant of a study: at most 40 lower-case letters, digits and hyphens."""
        return ""

    def table_of(self, variant: str) -> str:
        """The variant of `variants` whose table has the rows of this one: its results are among that one's."""
        return variant

    def further_results(self, study: Study) -> tuple[ResultInfo, ...]:
        """The results that the study would have, besides its own, if its run had `loads`."""
        return ()

    def joints(self, study: Study) -> tuple[str, ...]:
        """Names of the joints of its machine whose forces are results, in the order of their numbers."""
        return ()

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
    def reactions(self) -> Reactions | None:
        """The forces of its machines on a vibrating table; None where they have none."""
        return None

    @property
    def strobes(self) -> Strobes | None:
        """The strobes and initial values of its cases; None where they have none."""
        return None

    @property
    def start_ups(self) -> StartUps | None:
        """The start-ups of its cases; None where they have none."""
        return None

    @property
    def transients(self) -> Transients | None:
        """The transients of its machines; None where they have none."""
        return None

    @property
    def speeds(self) -> Speeds | None:
        """The steady cycles of its machines; None where motions do not repeat by themselves."""
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
