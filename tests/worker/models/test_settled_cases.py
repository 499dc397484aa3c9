"""Settled studies in the worker: their rows are those of the engine, and their cost is that of a search."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models
from tests.service.spec_sample import changed


class _Held(NamedTuple):
    regimes: NDArray[np.float64]
    torque: NDArray[np.float64]
    engaged: NDArray[np.float64]
    flags: list[str]


def _held(changes: dict[str, Any]) -> _Held:
    study = parse_spec(changed({"/run": {"until": "settled"}} | changes)).study
    done = models.run_chunk(study, 0, study.cases)
    names = [info.name for info in models.study_results(study)]
    columns = (names.index(name) for name in ("regime", "torque.mean", "pendulums.0.fraction.engaged"))
    return _Held(*(done.values[:, column] for column in columns), done.flags)


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
    from sprag_study.worker.reuse import kin_hash

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


def test_a_held_motion_that_keeps_the_windup_of_its_run_up_has_a_flag() -> None:
    """Two run-ups of one machine come to two shaken motions on a clutch that never lets go: both count, with a flag."""
    shaken = {"/base/excitation/amplitude_x": 5e-4, "/base/excitation/amplitude_y": 5e-4, "/base/shaft/load": 5}
    leaning = _held(shaken | {"/axes": [{"path": "pendulums.0.initial_angle", "values": [0.2, 0.25]}]})
    np.testing.assert_array_equal(leaning.regimes, [Regime.HELD, Regime.HELD])
    np.testing.assert_array_equal(leaning.engaged, 1.0)
    assert leaning.flags == ["history_dependent", "history_dependent"]
    assert abs(leaning.torque[1] - leaning.torque[0]) > 0.01 * leaning.torque[0] > 0.0
    assert models.usable("vibration-drive", ["ok", "ok"], leaning.flags).all()


def test_held_motions_that_every_run_up_comes_to_have_no_flag() -> None:
    """A clutch that is never wound up, and one that is wound up and let go in each turn."""
    shaken = {"/base/excitation/amplitude_x": 5e-4, "/base/excitation/amplitude_y": 5e-4}
    starts = [{"path": "pendulums.0.initial_angle", "values": [0, 0.2]}]
    free = _held(shaken | {"/base/pendulums/0/backlash": 10, "/axes": starts})
    np.testing.assert_array_equal(free.regimes, [Regime.HELD, Regime.HELD])
    assert free.flags == ["", ""]
    letting_go = _held({"/base/pendulums/0/damping": 0.2, "/base/shaft/load": 5, "/axes": starts})
    np.testing.assert_array_equal(letting_go.regimes, [Regime.HELD, Regime.HELD])
    assert ((letting_go.engaged > 0.0) & (letting_go.engaged < 1.0)).all()
    np.testing.assert_allclose(letting_go.torque[1], letting_go.torque[0], rtol=1e-8)
    assert letting_go.flags == ["", ""]
