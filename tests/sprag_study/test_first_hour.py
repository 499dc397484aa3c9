"""What a data scientist types in the first hour, with a drive of his own, without a service."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sprag_study as sprag

LOAD, SPEED, FREQUENCY = "shaft.load", "shaft.speed.mean", "excitation.frequency"


@pytest.fixture(scope="module")
def drive() -> sprag.Drive:
    """A drive from scratch, with numbers and texts with units."""
    return sprag.Drive(
        excitation={"frequency": 25, "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        pendulums=[
            {
                "inertia": 1e-3,
                "mass": 0.5,
                "arm": 0.03,
                "spring_rate": "9 N/mm",
                "spring_arm": "50 mm",
                "damping": 0.01,
            }
        ],
        shaft={"inertia": 2e-3},
        clutch={"coefficients": [0, 200, 0, 2e4]},
        run={"duration": "12 periods", "window": ["8 periods", "12 periods"]},
    )


@pytest.fixture(scope="module")
def study(drive: sprag.Drive) -> Any:
    """A grid of it."""
    return sprag.run(drive.vary(load=np.linspace(0, 0.2, 3), frequency=[20, 25]), processes=0)


def test_the_grid_as_tables(study: Any) -> None:
    assert len(study) == 6
    assert study.groupby(FREQUENCY)[SPEED].max().shape == (2,)
    assert study.attrs["units"][SPEED] == "rad/s"
    assert float(study.curves(LOAD, SPEED, by=FREQUENCY).to_xarray()[SPEED].sel({FREQUENCY: 25}).max()) > 0.0
    in_rpm = sprag.with_units(study.table())[SPEED].pint.to("rpm").pint.magnitude
    np.testing.assert_allclose(np.asarray(in_rpm, dtype=float), study[SPEED] * 30.0 / np.pi)
    assert study.sql(f'select max("{SPEED}") from cases').iloc[0, 0] == study[SPEED].max()
    assert len(pd.concat([study.table(), study.table()])) == 12
    assert repr(study.curves()).startswith(f"Curves({LOAD}")
    assert study.sensitivity(SPEED)["results"][0]["effects"][0]["paths"] in ([LOAD], [FREQUENCY])


def test_files_and_pictures(study: Any, tmp_path: Path) -> None:
    head = study.export(tmp_path / "rows.csv", decimal="comma").read_text(encoding="utf-8-sig").splitlines()[0]
    assert head.startswith(f"case;{LOAD};{FREQUENCY};ending;flags;")
    picture = study.plot(LOAD, SPEED, by=FREQUENCY, units="rpm", file=tmp_path / "curves.png")
    assert (tmp_path / "curves.png").read_bytes() == picture.content
    assert study.trajectory(1, points=10).to_pandas().shape[0] == 10


def test_further_studies_of_the_drive(drive: sprag.Drive) -> None:
    table = pd.DataFrame({LOAD: [50.0, 100.0]})
    table.attrs["units"] = {LOAD: "N*mm"}
    assert sprag.run(drive, cases=table, processes=0)[LOAD].tolist() == [0.05, 0.1]
    search = drive.hold(load=0.1).goal(vary={FREQUENCY: (20, 30)}, best={SPEED: "max"}, population=4, generations=1)
    assert len(sprag.run(search, processes=0).front()["designs"]) == 4
    prices = sprag.search(drive.goal(vary={"arm": (0.02, 0.04)}, best={"price": "min"}, population=4, generations=3))
    for designs in prices:
        prices.tell(designs["pendulums.0.arm"] ** 2)
    assert prices.best(1)["pendulums.0.arm"].item() < 0.025


def test_what_is_mistyped_is_named(drive: sprag.Drive, study: Any) -> None:
    for wrong, said in (
        (lambda: drive.vary(lod=[1, 2]), "a parameter, such as load"),
        (lambda: sprag.run(drive.hold(shaft__inertia=-1)), "/base/shaft/inertia: is out of range"),
        (lambda: sprag.Drive.of("one_pendulm"), "'one_pendulum'"),
        (lambda: study.plot(LOAD, SPEED), f"the axis {FREQUENCY} is left open: name it in by="),
        (lambda: study.sql("select * from cases where shaft.load > 0.1"), "double quotes"),
    ):
        with pytest.raises(sprag.SpragError) as refused:
            wrong()
        assert said in str(refused.value)
