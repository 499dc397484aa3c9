"""The settled motion of one case as a whole: results, one turn, and the state from which it goes on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from sprag.engine.vibration_drive.cases import pendulum_count
from sprag.engine.vibration_drive.regimes import settled_infos
from sprag.worker.models.common import case_machine
from sprag.worker.models.model import model_of
from sprag.worker.models.settled import settings_of
from sprag.worker.models.swept import start_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from sprag.engine.catalogue import ResultInfo
    from sprag.engine.outcome import Trajectory
    from sprag.worker.study import Study


@dataclass(frozen=True, slots=True)
class CaseTurn:
    """The settled motion of one case.

    Attributes
    ----------
    ending : str
    flags : tuple of str
    results : dict
        Every result of the study by name, SI; None where it could not be computed.
    regime : str
        "" where the case did not end ok.
    order : int
        Excitation periods in one turn; 0 where the motion has no orbit.
    motion : Trajectory
        One turn of the orbit, or some periods of a motion without one, from the start of an excitation period on; no
        points where the case did not end ok.
    state : dict or None
        Initial values (SI) by path that go on from the motion; None where the case did not end ok.
    """

    ending: str
    flags: tuple[str, ...]
    results: dict[str, float | None]
    regime: str
    order: int
    motion: Trajectory
    state: dict[str, float] | None


def case_turn(study: Study, case: int, points: int) -> CaseTurn:
    """The settled motion of a case of a settled study, with approximately so many samples.

    ValueError where its machine has no strobes. The case is run here.
    """
    return model_of(study.model).turn(study, case, points)


def drive_turn(
    study: Study,
    case: int,
    points: int,
    flags_of: Callable[[Iterable[ResultInfo], NDArray[np.float64]], list[str]],
) -> CaseTurn:
    """That of a vibration drive; ``flags_of`` gives the flags of rows of results, joined by commas."""
    from sprag.engine.vibration_drive.turn import settled_turn

    machine = case_machine(study, case)
    found = settled_turn(machine, settings_of(study.run), points, start_of(study, case))
    infos = settled_infos(pendulum_count(machine))
    # Adding zero makes negative zeros positive, as in the rows of a study.
    values = found.values + 0.0
    results = {
        info.name: None if np.isnan(value) else value for info, value in zip(infos, values.tolist(), strict=True)
    }
    flags = tuple(filter(None, flags_of(infos, values[None, :])[0].split(",")))
    regime = found.regime.name.lower() if found.regime else ""
    return CaseTurn(found.ending.value, flags, results, regime, found.order, found.motion, found.state)
