"""Columns and rows have names; what code goes through by number stands side by side, or says so at once."""

from __future__ import annotations

import numpy as np
import pytest

from sprag_study.engine.run import Run
from sprag_study.engine.vibration_drive import layout
from sprag_study.engine.vibration_drive.cases import Column, PendulumColumn, case_matrix, pendulum_column, stop_column

COLUMNS = {
    "excitation.frequency": 25.0, "excitation.amplitude_x": 0.002, "excitation.amplitude_y": 0.001,
    "shaft.inertia": 0.02, "shaft.load": 0.3,
    **{f"pendulums.{i}.{name}": value + i for i in range(2) for name, value in (
        ("inertia", 1.0), ("mass", 2.0), ("arm", 3.0), ("backlash", 0.5), ("initial_angle", 0.1),
        ("initial_speed", 4.0))},
    "clutch.coefficients.0": 0.0, "clutch.coefficients.1": 200.0, "clutch.windup_limit": 0.05,
}  # fmt: skip


def test_a_case_is_read_by_the_names_of_its_columns() -> None:
    (row,) = case_matrix(COLUMNS, Run(), 1)
    assert row[[Column.PERIOD, Column.LOAD, Column.INERTIA]].tolist() == [0.04, 0.3, 0.02]
    assert row[Column.ACC_X] == pytest.approx(0.002 * row[Column.NU] ** 2, rel=1e-15)
    assert row[[stop_column(3), stop_column(3) + 1]].tolist() == [59.0, 1.0]
    names = (PendulumColumn.INERTIA, PendulumColumn.BACKLASH, PendulumColumn.LIMIT, PendulumColumn.SPEED)
    assert [row[pendulum_column(2, 1, name)] for name in names] == [2.0, 1.5, 0.05, 5.0]
    assert row.size == pendulum_column(2, 2, 0)


def test_copied_columns_stand_in_the_order_of_their_rows() -> None:
    copied = [f"p_{column.name.lower()}" for column in PendulumColumn if column < PendulumColumn.ANGLE]
    lay = layout.make_layout(2, 3, 10, 8)
    assert [getattr(lay, name) - lay.p_ml for name in copied] == np.arange(len(copied)).tolist()


def test_rows_that_do_not_stand_side_by_side_are_refused() -> None:
    layout._beside("p_phi p_u")
    with pytest.raises(ValueError, match="p_u p_phi"):
        layout._beside("p_u p_phi")
