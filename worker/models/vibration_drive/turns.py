"""The settled motion of one case of a vibration drive."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.vibration_drive.cases import pendulum_count
from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.turns import CaseTurn
from sprag_study.worker.models.vibration_drive.settled import settings_of
from sprag_study.worker.models.vibration_drive.swept import start_of

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from numpy.typing import NDArray

    from sprag_study.engine.catalogue import ResultInfo
    from sprag_study.worker.study import Study


def turn_of(
    study: Study,
    case: int,
    points: int,
    flags_of: Callable[[Iterable[ResultInfo], NDArray[np.float64], NDArray[np.bool_] | None], list[str]],
) -> CaseTurn:
    """The settled motion of a case of a settled study; ``flags_of`` gives the flags of rows of results, and of what is
    known of their starts.
    """
    from sprag_study.engine.vibration_drive.turn import settled_turn

    machine = case_machine(study, case)
    found = settled_turn(machine, settings_of(study.run), points, start_of(study, case))
    infos = settled_infos(pendulum_count(machine))
    # Adding zero makes negative zeros positive, as in the rows of a study.
    values = found.values + 0.0
    results = {
        info.name: None if np.isnan(value) else value for info, value in zip(infos, values.tolist(), strict=True)
    }
    flags = tuple(filter(None, flags_of(infos, values[None, :], found.sensitive)[0].split(",")))
    regime = found.regime.name.lower() if found.regime else ""
    return CaseTurn(found.ending.value, flags, results, regime, found.order, found.motion, found.state)
