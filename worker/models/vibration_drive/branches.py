"""Branches of a vibration drive's motion along a parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sprag_study.engine.vibration_drive.cases import pendulum_count
from sprag_study.engine.vibration_drive.results import orbit_infos
from sprag_study.worker.models.branches import Along, BranchContact, CaseBranch, SpecialPoint
from sprag_study.worker.models.common import case_machine
from sprag_study.worker.models.parameters import allowed_values, machines_along
from sprag_study.worker.models.vibration_drive.settled import settings_of, settled_study
from sprag_study.worker.models.vibration_drive.swept import start_of

if TYPE_CHECKING:
    from sprag_study.engine.continuation.problem import Special
    from sprag_study.worker.study import Study


def branch_results(study: Study) -> tuple[str, ...]:
    """Names of the results of a branch."""
    return tuple(info.name for info in orbit_infos(pendulum_count(case_machine(study, 0))))


def branch_of(study: Study, case: int, along: Along) -> CaseBranch:
    """The branch through the settled motion of a case; a study of runs of a given time is settled for it."""
    from sprag_study.engine.continuation.follow import Range
    from sprag_study.engine.vibration_drive.branches import NoOrbitError, branch

    own = case_machine(study, case)
    value = own[along.paths[0]]
    infos = orbit_infos(pendulum_count(own))
    names, units = tuple(info.name for info in infos), tuple(info.unit for info in infos)
    settings = settings_of(settled_study(study).run)
    bounds = allowed_values(study, along.paths)
    try:
        made = branch(
            machines_along(study, case, along.paths), value, settings, Range(along.low, along.high), bounds,
            start_of(study, case),
        )  # fmt: skip
    except NoOrbitError as error:
        nothing = np.empty(0)
        return CaseBranch(
            value, 0, nothing, nothing, np.empty(0, dtype=np.bool_), names, units, np.empty((0, len(names))), (),
            ("", ""), error.sentence,
        )  # fmt: skip
    return CaseBranch(
        value,
        made.order,
        np.array([point.parameter for point in made.points]),
        np.array([point.multiplier for point in made.points]),
        np.array([point.stable for point in made.points]),
        names,
        units,
        made.values,
        tuple(map(_special, made.specials)),
        (made.ends[0].sentence, made.ends[1].sentence),
    )


def _special(found: Special) -> SpecialPoint:
    contacts = tuple(BranchContact(one.part, one.state, one.before, one.after) for one in found.contacts)
    kind, meaning = found.kind.value, found.kind.sentence
    return SpecialPoint(kind, meaning, found.parameter, found.index, found.multipliers, contacts)
