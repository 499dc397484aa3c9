"""A study of 64 drives from its spec to its rows: the same bits as a plain study of the drawn values."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pandas as pd

import sprag_study as sprag
from sprag_study.worker.spread import DRIVE
from tests.sprag_study.test_library import SPEC

DRIVES = 64
BACKLASH, MASS, LOAD = "pendulums.0.backlash", "pendulums.0.mass", "shaft.load"


def spec_of(**fields: Any) -> dict[str, Any]:
    spec = copy.deepcopy(SPEC)
    spec["base"]["pendulums"][0]["backlash"] = "0.3 deg"
    spec["base"]["shaft"]["load"] = 0.1
    return {**spec, **fields}


def test_the_rows_of_drives_are_those_of_their_drawn_values() -> None:
    spec = spec_of(
        axes=[{"path": LOAD, "values": ["0.05 N*m", "0.1 N*m", "0.2 N*m"]}],
        tolerances=[
            {"path": "pendulums.*.backlash", "plus_minus": "60 %"},
            {"path": MASS, "plus_minus": "5 %", "distribution": "triangular"},
            {"path": LOAD, "plus_minus": "2 %", "distribution": "uniform"},
        ],
        correlations=[{"between": [BACKLASH, MASS], "coefficient": -0.5}],
        drives=DRIVES,
        seed=5,
    )
    drives = sprag.run(spec, processes=0)
    assert len(drives) == 3 * (DRIVES + 1)
    assert set(drives["ending"]) == {"ok"}
    nominal = drives[drives[DRIVE] == 0]
    assert nominal[LOAD].tolist() == [0.05, 0.1, 0.2]
    varied = [LOAD, BACKLASH, MASS]
    # Each place has the same drives.
    by_drive = drives.groupby(DRIVE)
    assert (by_drive[[BACKLASH, MASS]].nunique() == 1).all(axis=None)
    np.testing.assert_allclose((by_drive[LOAD].max() / by_drive[LOAD].min()).to_numpy(), 4.0, rtol=1e-12)

    text = drives[varied].to_csv(index=False)
    plain = sprag.run(spec_of(axes=[{"points": text}]), processes=0)
    results = [name for name in drives.columns if name not in {*varied, "case", DRIVE, "flags"}]
    pd.testing.assert_frame_equal(drives[varied + results], plain[varied + results], check_exact=True)
    # The drives differ at every load.
    assert (drives.groupby(np.repeat([0, 1, 2], DRIVES + 1))["shaft.speed.mean"].nunique() == DRIVES + 1).all()
