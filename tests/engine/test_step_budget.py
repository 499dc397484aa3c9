"""A search for settled motion has one step budget: what it takes in all is bounded, and other cases keep their bits."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.engine import run as run_module
from sprag_study.engine.endings import ENDINGS, Ending
from sprag_study.engine.run import SettledRun
from sprag_study.engine.vibration_drive import irregular, search
from sprag_study.engine.vibration_drive.integration import Integration, integrate
from sprag_study.engine.vibration_drive.layout import OUT_STEPS
from sprag_study.engine.vibration_drive.settle import settle
from tests.engine.vibration_drive.drive import batch_of, drive

#: A drive that settles within 60 periods, and one whose orbit a search of 1,000 periods does not find.
QUICK = drive(1, shaft__load=0.1) | {"excitation.frequency": 25.0}
LONG = drive(1, shaft__load=0.02) | {
    "excitation.frequency": 33.0, "excitation.amplitude_x": 0.004, "excitation.amplitude_y": 0.004,
}  # fmt: skip


class Counted:
    """Integrations whose steps are added up."""

    def __init__(self) -> None:
        self.steps = 0.0

    def __call__(self, *given: object, **named: object) -> Integration:
        done = integrate(*given, **named)  # type: ignore[arg-type]
        self.steps += float(np.nansum(done.sums[:, OUT_STEPS]))
        return done


def counted(monkeypatch: pytest.MonkeyPatch, budget: float | None) -> Counted:
    counts = Counted()
    for module in (search, irregular):
        monkeypatch.setattr(module, "integrate", counts)
    if budget is not None:
        monkeypatch.setattr(run_module, "_LEAST_STEPS", budget / search.RUNS)
        monkeypatch.setattr(run_module, "_STEPS_PER_CYCLE", 0.0)
    return counts


def test_a_search_ends_when_its_budget_is_used_up(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = counted(monkeypatch, None)
    assert ENDINGS[int(settle(LONG, SettledRun(), cases=1).endings[0])] is Ending.OK
    assert whole.steps > 20_000.0
    budget = 4_000.0
    some = counted(monkeypatch, budget)
    done = settle(LONG, SettledRun(), cases=1)
    assert ENDINGS[int(done.endings[0])] is Ending.STEP_BUDGET
    assert np.isnan(done.values).all()
    # The runs beside each other of one step of Newton's method each may take what was left.
    assert budget <= some.steps <= 7.0 * budget


def test_other_cases_of_the_batch_keep_their_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = settle(QUICK, SettledRun(), cases=1)
    counted(monkeypatch, 12_000.0)
    both = settle(batch_of([LONG, QUICK]), SettledRun(), cases=2)
    assert [ENDINGS[int(code)] for code in both.endings] == [Ending.STEP_BUDGET, Ending.OK]
    assert both.values[1].tobytes() == alone.values[0].tobytes()


def test_an_unloaded_shaft_has_the_budget_too(monkeypatch: pytest.MonkeyPatch) -> None:
    counts = counted(monkeypatch, 300.0)
    done = settle(QUICK | {"shaft.load": 0.0}, SettledRun(), cases=1)
    assert ENDINGS[int(done.endings[0])] is Ending.STEP_BUDGET
    assert counts.steps <= 14.0 * 300.0
