"""The command `sprag show ID settled`."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sprag_study.engine.vibration_drive.regimes import settled_infos
from sprag_study.service.languages import language
from sprag_study.service.reading.reader import shown
from sprag_study.service.results.regimes import motion_sentence, rotation_sentences
from tests.conftest import Finished

Sprag = Callable[..., Finished]
_DRIVE = "one_pendulum.json"


def test_one_case_is_shown_with_its_regime(sprag: Sprag, examples: Path) -> None:
    done = sprag("show", "settled", examples / _DRIVE, "--case", 178)
    assert done.code == 0
    assert "22.835" in done.out
    assert motion_sentence("periodic", 2) in " ".join(done.err.split())
    assert "regime.multiplier" in done.out
    assert "regime.exponent\t\t" in done.out, "every table has the same lines"
    assert "1 periodic" in done.err


def test_rows_have_parameters_ending_regime_and_every_result(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    file = tmp_path / "settled.csv"
    assert sprag("show", "settled", examples / _DRIVE, "--case", 178, "--case", 176, "-o", file).code == 0
    rows = list(csv.DictReader(io.StringIO(file.read_text(encoding="utf-8"))))
    assert [row["case"] for row in rows] == ["178", "176"]
    assert [row["regime"] for row in rows] == ["periodic", "coasting"]
    assert float(rows[0]["shaft.load"]) == 0.2
    assert float(rows[0]["shaft.speed.mean"]) == pytest.approx(22.8350116679, abs=1e-9)
    assert set(rows[0]) > {info.name for info in settled_infos(1)}
    assert rows[0]["regime.exponent"] == ""


def test_json_is_null_where_there_is_no_value(sprag: Sprag, examples: Path) -> None:
    (row,) = sprag("show", "settled", examples / _DRIVE, "--case", 178, "--json").data
    assert row["results"]["regime"] == "periodic"
    assert row["results"]["regime.order"] == 2
    assert row["results"]["regime.exponent"] is None


def test_every_regime_of_a_case_with_many_starts_is_shown(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    spec = examples / "coexisting_motions.json"
    done = sprag("show", spec, "settled", "--case", 2)
    assert "2 regimes, to which its 32 starts come" in done.err
    assert "2 periodic" in done.err
    share = next(line for line in done.out.splitlines() if line.startswith("regime.share\t"))
    assert ("0.625" in share, "0.375" in share) == (True, True)
    file = tmp_path / "settled.csv"
    sprag("show", spec, "settled", "--case", 2, "--case", 0, "-o", file)
    rows = list(csv.DictReader(io.StringIO(file.read_text(encoding="utf-8"))))
    assert [(row["case"], row["regime.number"]) for row in rows] == [("2", "0"), ("2", "1"), ("0", "0")]
    assert [float(row["shaft.speed.mean"]) for row in rows[:2]] == pytest.approx([0.392266, 0.558988], abs=1e-6)
    listed = sprag("show", spec, "settled", "--case", 2, "--json").data
    assert [row["results"]["regime.start"] for row in listed] == [0, 1]
    told = sprag("show", spec, "settled", "--case", 2, "--case", 0, "-o", tmp_path / "settled.json", "--json").data
    assert (told["cases"], told["regimes"], told["endings"]) == (2, {"periodic": 3}, {"ok": 2})


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("press.toml",), "/model"),
        ((_DRIVE, "--case", 512), "0 .. 511"),
        ((_DRIVE, "--at-most", 50), "100"),
    ],
)
def test_what_cannot_be_settled_is_refused(sprag: Sprag, examples: Path, arguments: tuple[Any, ...], told: str) -> None:
    done = sprag("show", "settled", examples / arguments[0], *arguments[1:])
    assert done.code == 2
    assert told in done.err
    assert done.out == ""


def test_a_load_that_swings_with_the_angle_has_no_settled_motion(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    spec = json.loads((examples / _DRIVE).read_text(encoding="utf-8"))
    spec["base"]["shaft"]["cyclic_load"] = 0.5
    spec["run"] = {"duration": "40 periods"}
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(spec), encoding="utf-8")
    done = sprag("show", path, "settled", "--case", 178)
    assert done.code == 2
    assert "shaft.cyclic_load" in done.err
    done = sprag("show", path, "diagram", "--case", 178, "--along", "excitation.frequency")
    assert done.code == 2
    assert "shaft.cyclic_load" in done.err


def test_a_case_that_ends_otherwise_is_told(sprag: Sprag, examples: Path, tmp_path: Path) -> None:
    spec = json.loads((examples / _DRIVE).read_text(encoding="utf-8"))
    spec["base"]["pendulums"][0] |= {"spring_rate": 0, "damping": 0, "mass": 1e3, "arm": 1e3}
    spec["base"]["shaft"] |= {"inertia": 1e-9}
    path = tmp_path / "spec.json"
    path.write_text(json.dumps(spec), encoding="utf-8")
    (row,) = sprag("show", path, "settled", "--case", 178, "--json", "--at-most", 100).data
    assert row["ending"] != "ok"
    assert set(row["results"].values()) == {None}


def test_turns_in_either_direction_are_said_in_both_languages() -> None:
    row = {"regime.order": 3, "pendulums.0.winding": -1, "pendulums.1.winding": 0, "pendulums.2.winding": 2}
    assert list(rotation_sentences(row)) == [
        "Pendulum 1 turns over clockwise: 1 whole turn in 3 excitation periods.",
        "Pendulum 3 turns over counter-clockwise: 2 whole turns in 3 excitation periods.",
    ]
    with language("uk"):
        assert shown(rotation_sentences(row)[1]) == (
            "Маятник 3 обертається проти годинникової стрілки: 2 повні оберти за 3 періоди збудження."
        )
