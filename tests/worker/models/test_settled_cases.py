"""Settled studies in the worker: their rows are those of the engine, and their cost is that of a search."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from sprag.engine.run import SettledRun
from sprag.engine.vibration_drive.regimes import Regime
from sprag.engine.vibration_drive.settle import settle
from sprag.service.spec.document import parse_spec
from sprag.worker import models
from tests.service.spec_sample import changed

SPEC = changed({"/run": {"until": "settled"}, "/axes": [{"path": "shaft.load", "values": [0, 0.2, 0.7, 1.6]}]})


def test_a_chunk_of_a_settled_study_has_the_results_of_the_engine() -> None:
    study = parse_spec(SPEC).study
    done = models.run_chunk(study, 0, study.cases)
    columns: dict[str, Any] = {**study.base, **study.columns(range(study.cases))}
    batch = settle(columns, SettledRun(), cases=study.cases)
    np.testing.assert_array_equal(done.values, batch.values + 0.0)
    names = [info.name for info in models.study_results(study)]
    rows = [dict(zip(names, values, strict=True)) for values in done.values.tolist()]
    assert [Regime(int(row["regime"])) for row in rows][:2] == [Regime.COASTING, Regime.PERIODIC]
    assert rows[1]["shaft.speed.mean"] == pytest.approx(22.8350116679, abs=1e-9)
    assert rows[1]["regime.order"] == 2
    for row, flags in zip(rows, done.flags, strict=True):
        for name in ("irregular", "unsettled"):
            assert (name in flags.split(",")) == (Regime(int(row["regime"])).name.lower() == name)
        assert "not_settled" not in flags


def test_settled_and_transient_cases_do_not_share_rows() -> None:
    from sprag.worker.reuse import kin_hash

    settled, timed = (parse_spec(changed({"/run": run})).study for run in ({"until": "settled"}, {"duration": 2}))
    longer = parse_spec(changed({"/run": {"at_most": "2000 periods"}})).study
    assert len({kin_hash(study, models.ENGINE_VERSION) for study in (settled, timed, longer)}) == 3
    assert len({models.variant_of(study) for study in (settled, timed)}) == 2
    assert models.variant_of(longer) == models.variant_of(settled)


def test_a_settled_case_is_estimated_by_what_a_search_takes() -> None:
    settled, timed, longer = (
        models.estimate_seconds_per_case(parse_spec(changed({"/run": run})).study)
        for run in ({"until": "settled"}, {"duration": "60 periods"}, {"at_most": "10000 periods"})
    )
    # A run of a given time is followed on, too, if not as far.
    assert 1.1 < settled / timed < 2.0
    assert 3.0 < longer / settled < 8.0
