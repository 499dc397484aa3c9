"""A spec whose base machine has an unstable motion: read with a warning, and its cases end as such."""

from __future__ import annotations

from typing import Any

from sprag_study.service.spec.document import parse_spec
from sprag_study.worker import models


def _parsed(formula: str) -> Any:
    base = {
        "mean_speed": "12 rad/s", "drive": {"inertia": "2 kg*m^2"},
        "operation": {"quantity": "torque", "formula": formula},
    }  # fmt: skip
    axes = [{"path": "mean_speed", "values": ["10 rad/s", "12 rad/s"]}]
    return parse_spec({"sprag": 1, "model": "machine-shaft", "name": "n", "base": base, "axes": axes})


def test_an_unstable_base_is_read_with_a_warning() -> None:
    parsed = _parsed("100/omega*(1 + 0.5*sin(phi))")
    assert "unstable-motion" in [warning.code for warning in parsed.warnings]
    assert "unstable-motion" not in [warning.code for warning in _parsed("0.1*omega^2").warnings]
    done = models.run_chunk(parsed.study, 0, 2)
    assert done.endings == ["unstable_motion"] * 2
    names = [info.name for info in models.study_results(parsed.study)]
    assert (done.values[:, names.index("cycle.multiplier")] > 1.0).all()


def test_a_base_that_may_turn_at_several_speeds_is_read_with_a_warning() -> None:
    """A load with humps over the speed: 20 + 10 sin w + 0.1 w is at 5.789 rad/s what it is at 12 rad/s."""
    texts = {warning.code: str(warning) for warning in _parsed("20 + 10*sin(omega) + 0.1*omega").warnings}
    assert "balance at about 5.78" in texts["several-speeds"]
    assert "several-speeds" not in {warning.code for warning in _parsed("0.1*omega^2").warnings}
