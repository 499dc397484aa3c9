"""``sprag fit``: the report for people and for programs."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from sprag_study.service.cli.fit import law_text

Sprag = Callable[..., Any]


def test_the_example_is_fitted_and_the_report_kept_beside_it_agrees(sprag: Sprag, examples: Path) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", "--accuracy", "0.05", "--json")
    assert done.code == 0
    kept = json.loads((examples / "clutch_fit.json").read_text())
    assert done.data["degree"] == kept["degree"] == 3
    assert done.data["coefficients"] == pytest.approx(kept["coefficients"], rel=1e-9)
    assert done.data["residuals"] == pytest.approx(kept["residuals"], abs=1e-9)
    assert done.data["max_residual"] <= 0.05
    assert done.data["coefficients"][0] == 0.0


def test_the_report_for_people_names_every_degree_row_and_the_law(sprag: Sprag, examples: Path) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", "--accuracy", "50 N*mm")
    assert done.code == 0
    assert "condition number" in done.out
    assert "eigenvalues" in done.out
    assert "T(u) = 200.052 u - 2.16226 u^2 + 20019.9 u^3" in done.out
    assert len([line for line in done.out.splitlines() if line.strip()[:1].isdigit()]) == 3 + 12
    assert done.err == ""


def test_the_line_for_a_spec_keeps_the_end_of_the_data(sprag: Sprag, examples: Path) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", "--accuracy", "0.05")
    line = next(line for line in done.out.splitlines() if line.startswith("for a spec: "))
    clutch = json.loads("{" + line.removeprefix("for a spec: ") + "}")["clutch"]
    kept = json.loads((examples / "clutch_fit.json").read_text())
    assert clutch == {"coefficients": pytest.approx(kept["coefficients"]), "windup_limit": kept["windup_limit"]}


def test_units_that_are_assumed_are_said(sprag: Sprag, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_text("angle,torque\n1,3.6\n2,7.2\n3,10.8\n")
    done = sprag("fit", data, "--accuracy", "0.1")
    assert done.code == 0
    assert "angles are taken in rad and torques are taken in N*m" in done.err
    assert "172 degrees; was it in degrees?" not in done.out
    assert "was it in degrees?" in done.err
    assert len(sprag("fit", data, "--accuracy", "0.1", "--json").data["warnings"]) == 2


def test_lost_motion_that_would_not_be_used_is_refused(sprag: Sprag, examples: Path) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", "--accuracy", "0.05", "--backlash", "0.1 deg")
    assert done.code == 2
    assert "--angles-include-backlash" in done.err


def test_a_refusal_lists_each_degree_once(sprag: Sprag, examples: Path) -> None:
    command = ["fit", examples / "clutch_measured.csv", "--accuracy", "1e-6", "--max-degree", "3"]
    assert sprag(*command).err.count("degree 2") == 1
    failure = sprag(*command, "--json").failure
    assert (failure["code"], {item["code"] for item in failure["problems"]}) == ("invalid-data", {"out-of-range"})


def test_an_accuracy_that_no_degree_reaches_tells_the_best_of_each(sprag: Sprag, examples: Path) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", "--accuracy", "1e-6", "--max-degree", "3")
    assert done.code == 2
    assert [line.split(":")[0].strip() for line in done.err.splitlines()[1:]] == ["degree 1", "degree 2", "degree 3"]


def test_a_refusal_in_ukrainian_is_whole_sentences(sprag: Sprag, tmp_path: Path) -> None:
    (tmp_path / "m.csv").write_text("angle [rad],torque [N*m]\n0.1,1\n0.1,1.5\n0.2,2\n0.3,3\n", encoding="utf-8")
    refused = sprag("--language", "uk", "fit", tmp_path / "m.csv", "--accuracy", "0.1")
    assert refused.err.startswith(
        "sprag: точності 0,1 Н·м не досягнуто до степеня 3. Вищі степені мають більше невідомих, ніж різних "
        "закручувань у даних (3); виміряйте більше. Найкращий, степінь 3, найбільше відхиляється в рядку із "
        "закручуванням 0,1 рад"
    )


def test_the_full_polynomial_may_have_torque_at_zero_windup(sprag: Sprag, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_text("".join(f"{u},{1.0 + 100 * u}\n" for u in (0.0, 0.01, 0.02, 0.03)))
    assert sprag("fit", data, "--accuracy", "0.001").code == 2
    done = sprag("fit", data, "--accuracy", "0.001", "--full", "--json")
    assert done.data["coefficients"] == pytest.approx([1.0, 100.0], rel=1e-9)


def test_lost_motion_in_the_angles_is_taken_off(sprag: Sprag, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_text("angle_deg,torque_Nm\n" + "".join(f"{a + 0.3},{2 * a}\n" for a in (0.0, 1.0, 2.0, 3.0)))
    done = sprag("fit", data, "--accuracy", "0.001", "--angles-include-backlash", "--backlash", "0.3 deg", "--json")
    assert done.data["degree"] == 1
    assert done.data["windup_limit"] == pytest.approx(0.052359877559829, rel=1e-9)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (["--accuracy", "5 mm"], "--accuracy"),
        (["--accuracy", "nan"], "--accuracy"),
        (["--accuracy", "-1"], "--accuracy"),
        (["--accuracy", "1", "--max-degree", "99"], "--max-degree"),
        (["--accuracy", "1", "--backlash", "3 kg"], "--backlash"),
    ],
)
def test_a_wrong_option_is_named(sprag: Sprag, examples: Path, options: list[str], named: str) -> None:
    done = sprag("fit", examples / "clutch_measured.csv", *options)
    assert done.code == 2
    assert named in done.err
    assert done.out == ""


def test_a_row_out_of_range_is_named_by_its_line(sprag: Sprag, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_text("angle,torque\n0.01,1\n-0.02,2\n0.03,3\n")
    done = sprag("fit", data, "--accuracy", "0.1")
    assert done.code == 2
    assert "line 3" in done.err


def test_a_law_that_would_pull_the_shaft_back_is_refused(sprag: Sprag, tmp_path: Path) -> None:
    data = tmp_path / "data.csv"
    data.write_text("".join(f"{u},{-500 * u * (0.02 - u)}\n" for u in (0.005, 0.01, 0.015, 0.02, 0.025)))
    done = sprag("fit", data, "--accuracy", "0.01")
    assert done.code == 2
    assert "negative" in done.err


@pytest.mark.parametrize(
    ("coefficients", "text"),
    [
        ((0.0, 200.0, 0.0, 20000.0), "T(u) = 200 u + 20000 u^3"),
        ((1.5, -2.0), "T(u) = 1.5 - 2 u"),
        ((0.0,), "T(u) = 0"),
    ],
)
def test_the_law_as_people_write_it(coefficients: tuple[float, ...], text: str) -> None:
    assert law_text(coefficients) == text
