"""Flags of sensitive starts: against runs whose errors are others, and against starts that lead elsewhere."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.workloads import W1
from sprag_study.engine.run import Run, SettledRun, Span
from sprag_study.engine.vibration_drive.settle import settle
from sprag_study.engine.vibration_drive.simulate import simulate
from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models
from sprag_study.worker.models.registry import model_of
from tests.service.spec_sample import changed

#: Cases of W1 with the flag, and others whose search takes more than 70 periods, too.
SENSITIVE, LONG = [32, 40], [33, 178, 217, 300]
CASES = np.array([*SENSITIVE, *LONG])


def _turn(columns: dict[str, Any], tolerance: float) -> NDArray[np.float64]:
    """Turn of the shaft in 20 periods after 120."""
    window = (Span(120.0), Span(140.0))
    batch = simulate(columns, Run(duration=Span(140.0), window=window, tolerance=tolerance), cases=len(CASES))
    return batch.values[:, 4]


def test_errors_of_the_integration_grow_in_cases_with_the_flag_only() -> None:
    """Tolerances that choose other steps of the same order part as far as a disturbance of the start does."""
    columns = W1.columns(CASES)
    batch = settle(columns, SettledRun(), cases=len(CASES), examine_starts=True)
    assert batch.repeats.all()
    assert batch.sensitive is not None
    np.testing.assert_array_equal(batch.sensitive, np.isin(CASES, SENSITIVE))
    turns = [_turn(columns, tolerance) for tolerance in (1.0e-9, 0.7e-9)]
    apart = np.abs(turns[1] / turns[0] - 1.0)
    assert apart[: len(SENSITIVE)].min() > 1e-7
    assert apart[len(SENSITIVE) :].max() < 1e-10


def test_the_examination_changes_no_result_and_is_the_same_in_any_batch() -> None:
    columns = W1.columns(CASES)
    examined = settle(columns, SettledRun(), cases=len(CASES), examine_starts=True)
    plain = settle(columns, SettledRun(), cases=len(CASES))
    assert plain.sensitive is None
    for name in ("values", "endings", "regimes", "points"):
        np.testing.assert_array_equal(getattr(examined, name), getattr(plain, name))
    alone = settle(W1.columns(CASES[:1]), SettledRun(), cases=1, examine_starts=True)
    assert alone.sensitive is not None
    assert alone.sensitive.tolist() == [True]


def test_starts_beside_a_flagged_start_have_another_regime() -> None:
    """Of starts that differ by 1e-9, some come to the orbit of case 32, and others are irregular, at another speed."""
    angles = np.array([0.0, *np.linspace(1e-9, 2e-9, 23)])
    columns = {**W1.columns(np.array([32])), "pendulums.0.initial_angle": angles}
    batch = settle(columns, SettledRun(), cases=24, examine_starts=True)
    assert batch.repeats[0]
    assert set(batch.orders.tolist()) == {0, batch.orders[0]}
    speed = batch.values[:, 0]
    assert np.ptp(speed[batch.repeats]) < 1e-8
    assert (np.abs(speed[~batch.repeats] / speed[0] - 1.0) > 0.01).all()
    assert batch.sensitive is not None
    np.testing.assert_array_equal(batch.sensitive, batch.repeats)


def test_rows_and_turns_have_the_flag_and_studies_with_starts_have_none() -> None:
    axes = [
        {"path": "excitation.frequency", "values": [108.0 / (2.0 * math.pi)]},
        {"path": ["excitation.amplitude_x", "excitation.amplitude_y"], "values": [1e-3]},
        {"path": "shaft.load", "values": [0.02, 0.06]},
    ]
    spec = changed({"/run": {"until": "settled"}, "/axes": axes})
    study = parse_spec(spec).study
    rows = models.run_chunk(study, 0, 2)
    assert rows.flags == ["sensitive_start", ""]
    assert models.usable(study.model, rows.endings, rows.flags).all()
    strobes = model_of(study.model).strobes
    assert strobes is not None
    assert [strobes.turn(study, case, 64).flags for case in range(2)] == [("sensitive_start",), ()]
    few = {"count": 2, "ranges": {"pendulums.0.initial_angle": ["0 rad", "1e-3 rad"]}}
    started = parse_spec({**spec, "starts": few}).study
    assert "sensitive_start" not in models.run_chunk(started, 0, 1).flags[0]
