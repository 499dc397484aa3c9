"""A study of cases of another whose motion was not settled, with more time for the search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from sprag.service.spec.run import TIMED_FIELDS
from sprag.worker.limits import MAX_NAME_LENGTH, MAX_SETTLED_PERIODS
from sprag.worker.models import SETTLED

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from sprag.worker.study import Study

#: How many times as long a search may take by default.
TIMES: Final = 4
_SUFFIX: Final = ", longer"


def longer_spec(
    spec: Mapping[str, Any], study: Study, cases: NDArray[np.int64], at_most: int | None = None
) -> dict[str, Any]:
    """The spec of a study of just these cases of a settled study, each run for at most ``at_most`` excitation periods.

    Parameters
    ----------
    spec : the study's own spec
    study : the same in SI numbers
    cases : numbers of cases, at least one
    at_most : by default `TIMES` as many as the study allows
    """
    most = min(TIMES * study.run["at_most"], MAX_SETTLED_PERIODS) if at_most is None else at_most
    kept = {key: value for key, value in spec.items() if key not in {"axes", "combine", "exclude"}}
    run = {key: value for key, value in spec.get("run", {}).items() if key not in TIMED_FIELDS}
    columns = study.columns(cases)
    axes = [{"path": list(axis.paths), "values": columns[axis.paths[0]].tolist()} for axis in study.axes]
    return {
        **kept,
        "name": study.name[: MAX_NAME_LENGTH - len(_SUFFIX)] + _SUFFIX,
        "run": {**run, "until": SETTLED, "at_most": f"{most} periods"},
        "combine": "zip",
        "axes": axes,
    }
