"""A mechanism whose formula is a constant is a flywheel on the shaft."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.service.spec.document import parse_spec
from sprag_study.worker.models import run_chunk

_OPERATION = {"quantity": "torque", "formula": "-100 * (1 + sin(phi))"}


def _rows(inertia: str, **mechanism: object) -> np.ndarray:
    base = {"mean_speed": "100 rpm", "drive": {"inertia": inertia}, "operation": _OPERATION, **mechanism}
    axes = [{"path": "mean_speed", "values": ["90 rpm", "100 rpm"]}]
    study = parse_spec({"sprag": 1, "model": "machine-shaft", "base": base, "axes": axes}).study
    done = run_chunk(study, 0, 2)
    assert list(done.endings) == ["ok", "ok"]
    return done.values


def test_a_constant_inertia_of_a_mechanism_adds_to_that_of_the_drive() -> None:
    with_mechanism = _rows("15 kg*m^2", mechanism={"formula": "1 + 1"})
    alone = _rows("17 kg*m^2")
    assert np.isfinite(alone).sum() > 10
    apart = np.flatnonzero(~np.isclose(with_mechanism, alone, rtol=1e-9, atol=1e-9, equal_nan=True).all(axis=0))
    # Only where the inertia is differs: 15 and 2 kg*m^2, or all of it in the drive.
    assert with_mechanism[:, apart].tolist() == [[pytest.approx(15.0), pytest.approx(2.0)]] * 2
    assert alone[:, apart].tolist() == [[pytest.approx(17.0), pytest.approx(0.0)]] * 2
