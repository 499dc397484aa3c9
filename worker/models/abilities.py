"""What only some models can do, each an object of its model, or None: clutches, reactions, strobes and
so on.

Every function is a module's own, so that another process can run it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

from sprag_study.worker.models.registry import model_of

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycles
    from sprag_study.engine.machine_shaft.transient_course import Course, Transient
    from sprag_study.engine.outcome import Basin, Duty, Engagements, Portrait
    from sprag_study.worker.models.branches import Along, CaseBranch
    from sprag_study.worker.models.common import KernelShape
    from sprag_study.worker.models.forces import Bearing, Forces
    from sprag_study.worker.models.model import StartUps, Strobes, Transients
    from sprag_study.worker.models.ramps import Ramps, StartUp
    from sprag_study.worker.models.sections import CaseSections, Sampling
    from sprag_study.worker.models.turns import CaseTurn
    from sprag_study.worker.study import Study

    Floats = NDArray[np.float64]

Ability = TypeVar("Ability")


def has_clutches(study: Study) -> bool:
    """Whether the machine of ``study`` has clutches."""
    return model_of(study.model).clutches is not None


def has_reactions(study: Study) -> bool:
    """Whether the machine of ``study`` acts on a vibrating table."""
    return model_of(study.model).reactions is not None


def has_start_ups(study: Study) -> bool:
    """Whether the cases of ``study`` start up with ramps of their excitation and load."""
    return model_of(study.model).start_ups is not None


def has_strobes(study: Study) -> bool:
    """Whether the cases of ``study`` have a `run_portrait`."""
    return model_of(study.model).strobes is not None


def has_transients(study: Study) -> bool:
    """Whether the machine of the study has transients."""
    return model_of(study.model).transients is not None


def has_speeds(study: Study) -> bool:
    """Whether torques of the machine follow the speed, so that it has steady cycles at certain speeds."""
    speeds = model_of(study.model).speeds
    return speeds is not None and speeds.has(study)


def run_engagements(study: Study, case: int) -> Engagements:
    """Engagements of the clutches of one case; ValueError where its machine has none."""
    return _of(study, model_of(study.model).clutches, "clutches").engagements(study, case)


def run_duty(study: Study, case: int, exponent: float | None) -> Duty:
    """What the clutches of one case have to bear; ValueError where its machine has none.

    ``exponent`` is that of the Wöhler curve for the equivalent torques; None: they are NaN.
    """
    return _of(study, model_of(study.model).clutches, "clutches").duty(study, case, exponent)


def bearing_of(study: Study, case: int) -> Bearing:
    """What the parameters of one case say of the bearings of its shaft; ValueError where its machine has none."""
    return _of(study, model_of(study.model).reactions, "forces on a table").bearing(study, case)


def run_forces(study: Study, case: int, bearing: Bearing, points: int) -> Forces:
    """Forces of one case, with ``points`` equally spaced times; ValueError where its machine has none."""
    return _of(study, model_of(study.model).reactions, "forces on a table").forces(study, case, bearing, points)


def run_portrait(study: Study, case: int) -> Portrait:
    """How one case approaches its motion, strobe by strobe; ValueError where its machine has no strobes."""
    return _strobes(study).portrait(study, case)


def case_turn(study: Study, case: int, points: int) -> CaseTurn:
    """The settled motion of a case of a settled study, with approximately so many samples.

    ValueError where its machine has no strobes. The case is run here.
    """
    return _strobes(study).turn(study, case, points)


def run_branch(study: Study, case: int, along: Along) -> CaseBranch:
    """The branch through the settled motion of one case; ValueError where its machine has no strobes."""
    return _strobes(study).branch(study, case, along)


def branch_results(study: Study) -> tuple[str, ...]:
    """Names of the results of a branch; ValueError where the machine has no strobes."""
    return _strobes(study).branch_results(study)


def run_sections(study: Study, case: int, asked: Sampling) -> CaseSections:
    """Settle one case for each value of a parameter; ValueError where its machine has no strobes."""
    return _strobes(study).sections(study, case, asked)


def run_end_state(study: Study, case: int) -> dict[str, float] | None:
    """Initial values (SI) that go on from the end of one case, which is run for this; None where it does not end ok.

    ValueError where its machine has no initial values.
    """
    return _of(study, model_of(study.model).strobes, "initial values").end_state(study, case)


def run_basin(study: Study, case: int, paths: tuple[str, str], x: Floats, y: Floats) -> Basin:
    """The regimes to which one case of a settled study comes from a grid of initial values (SI) of two ``paths``.

    ValueError where its machine has no initial values.
    """
    return _of(study, model_of(study.model).strobes, "initial values").basin(study, case, paths, x, y)


def has_motor(study: Study) -> bool:
    """Whether a motor drives the machine, whose torque follows the speed; ValueError where it has no transients."""
    return _transients(study).has_motor(study)


def shape_of_transients(study: Study) -> KernelShape:
    """The kernel of transients, which is compiled apart from that of the cases; ValueError where there are none."""
    return _transients(study).shape(study)


def run_transient(study: Study, case: int, course: Course, points: int) -> Transient:
    """A transient of one case, with ``points`` equally spaced times; ValueError where its model has none."""
    return _transients(study).run(study, case, course, points)


def shape_of_start_ups(study: Study) -> KernelShape:
    """The kernel of ramps, which is compiled apart from that of the cases; ValueError where there are none."""
    return _start_ups(study).shape(study)


def run_start_up(study: Study, case: int, ramps: Ramps, points: int) -> StartUp:
    """The start-up of one case, with ``points`` equally spaced times; ValueError where its model has none."""
    return _start_ups(study).run(study, case, ramps, points)


def run_speeds(study: Study, case: int, load: float) -> SteadyCycles:
    """Every steady cycle of one case with a factor on its load; ValueError where no torque follows the speed."""
    return _of(study, model_of(study.model).speeds, "torques that follow the speed").run(study, case, load)


def _strobes(study: Study) -> Strobes:
    return _of(study, model_of(study.model).strobes, "strobes")


def _start_ups(study: Study) -> StartUps:
    return _of(study, model_of(study.model).start_ups, "start-ups")


def _transients(study: Study) -> Transients:
    return _of(study, model_of(study.model).transients, "transients")


def _of(study: Study, ability: Ability | None, name: str) -> Ability:
    if ability is None:
        raise ValueError(f"a machine of model {study.model} has no {name}")
    return ability
