"""Numbers of endings, regimes and flags: files written long ago still mean the same."""

from sprag_study.engine.vibration_drive.regimes import Regime
from sprag_study.worker import models
from sprag_study.worker.codes import ENDING_CODES, FLAG_MASKS, PENDING, REGIME_CODES

#: What files that exist hold. Lines are added here, never changed or taken away.
GIVEN = {
    "pending": -1,
    "ok": 0,
    "accuracy_not_reached": 1,
    "chatter": 2,
    "step_budget": 3,
    "diverged": 4,
    "inertia_insufficient": 5,
    "unbalanced_work": 6,
    "cannot_assemble": 7,
    "negative_inertia": 8,
    "motor_stalled": 9,
    "quadrature_not_reached": 10,
    "motor_overrun": 11,
    "near_singular": 12,
    "unstable_motion": 13,
    "crashed": 100,
    "timed_out": 101,
    "cancelled": 102,
}
GIVEN_REGIMES = {"none": 0, "periodic": 1, "held": 2, "coasting": 3, "irregular": 4, "unsettled": 5}
GIVEN_FLAGS = {"windup_out_of_data": 1, "not_settled": 2}


def test_numbers_once_given_stay() -> None:
    assert {name: ENDING_CODES[name] for name in GIVEN} == GIVEN
    assert {name: REGIME_CODES[name] for name in GIVEN_REGIMES} == GIVEN_REGIMES
    assert {name: FLAG_MASKS[name] for name in GIVEN_FLAGS} == GIVEN_FLAGS


def test_every_ending_and_flag_has_a_number_of_its_own() -> None:
    assert ENDING_CODES.keys() >= {PENDING, *models.ENDING_SENTENCES}
    assert len(set(ENDING_CODES.values())) == len(ENDING_CODES)
    assert all(-1 <= code < 1 << 15 for code in ENDING_CODES.values())
    assert FLAG_MASKS.keys() >= {flag for model in models.model_names() for flag in models.flags_of(model)}
    assert sorted(FLAG_MASKS.values()) == [1 << bit for bit in range(len(FLAG_MASKS))]


def test_the_numbers_of_regimes_are_those_of_the_engine() -> None:
    assert {regime.name.lower(): regime.value for regime in Regime} == REGIME_CODES
