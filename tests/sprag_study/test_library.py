"""The library as docs/python.md shows it, and what it says where an extra is missing."""

from __future__ import annotations

import json
import re
import runpy
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import sprag_study as sprag
from sprag_study.engine.vibration_drive.simulate import simulate as plain_simulate
from sprag_study.service.http.views import preset_of
from tests.engine.vibration_drive.drive import drive, periods

ROOT = Path(__file__).resolve().parents[2]
PAGE = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
SPEC: dict[str, Any] = {
    "sprag": 1,
    "model": "vibration-drive",
    "base": {
        "excitation": {"frequency": "20 Hz", "amplitude_x": "2 mm", "amplitude_y": "2 mm"},
        "pendulums": [
            {"inertia": 1e-3, "mass": 0.5, "arm": 0.03, "spring_rate": 9000, "spring_arm": 0.05, "damping": 0.01}
        ],
        "shaft": {"inertia": 2e-3},
        "clutch": {"coefficients": [0, 200, 0, 2e4]},
    },
    "run": {"duration": "12 periods", "window": ["8 periods", "12 periods"]},
    "axes": [{"path": "shaft.load", "values": ["0 N*m", "0.1 N*m", "0.2 N*m"]}],
}


def section(title: str) -> str:
    """The program of one section of the page."""
    text = PAGE.split(f"\n## {title}\n")[1].split("\n## ")[0]
    return "\n".join(re.findall(r"```python\n(.*?)```", text, re.DOTALL))


def python(*arguments: str, cwd: Path = ROOT) -> subprocess.CompletedProcess[str]:
    """Run Python in a process of its own."""
    return subprocess.run([sys.executable, *arguments], cwd=cwd, capture_output=True, text=True, check=False)


def test_the_page_runs_as_a_script(tmp_path: Path) -> None:
    """With processes of its own, which import it."""
    script = tmp_path / "script.py"
    script.write_text(section("Studies run here"), encoding="utf-8")
    done = python(str(script))
    assert done.returncode == 0, done.stderr
    assert "rad/s" in done.stdout


@pytest.mark.parametrize("title", ["A spec in Python", "Goals of one's own", "SQL", "The engine"])
def test_the_page_runs(title: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    script = tmp_path / "script.py"
    script.write_text(section(title), encoding="utf-8")
    runpy.run_path(str(script), run_name="__main__")
    assert "rad/s" in capsys.readouterr().out


def test_the_example_of_derived_parameters_has_the_numbers_of_the_guide() -> None:
    page = (
        (ROOT / "docs" / "guide.md")
        .read_text(encoding="utf-8")
        .split("\n### Derived parameters\n")[1]
        .split("\n## ")[0]
        .split("\n### ")[0]
    )
    (fields,) = re.findall(r"```json\n(.*?)```", page, re.DOTALL)
    spec = json.loads((ROOT / "examples" / "one_pendulum.json").read_text(encoding="utf-8"))
    del spec["base"]["pendulums"][0]["inertia"]
    spec |= json.loads(f"{{{fields}}}")
    table = sprag.run(spec, processes=0).table()
    head, _, *rows = [
        [cell.strip() for cell in line.strip("|").split("|")] for line in page.split("\n") if line.startswith("|")
    ]
    names = [cell.split("`")[1] for cell in head]
    assert len(rows) == len(table)
    for name, told in zip(names, np.array(rows, dtype=np.float64).T, strict=True):
        np.testing.assert_allclose(table[name], told, rtol=1e-3, err_msg=name)
    np.testing.assert_allclose(
        table["pendulums.0.inertia"], 1.1 * table["pendulums.0.mass"] * 0.03**2 + 2e-4, rtol=1e-15
    )
    assert table.attrs["units"]["pendulums.0.inertia"] == "kg*m^2"
    # The same machines, given number by number.
    base, axes = spec["base"]["pendulums"][0], spec["axes"]
    base["inertia"] = 1e-3
    axes.append({"path": "pendulums.0.inertia", "values": table["pendulums.0.inertia"].tolist()})
    plain = sprag.run({**spec, "derive": {}, "axes": axes, "combine": "zip"}, processes=0).table()
    pd.testing.assert_frame_equal(plain[table.columns], table)


def test_a_study_run_here_has_rows_and_units() -> None:
    told: list[int] = []
    table = sprag.run(SPEC, processes=0, on_progress=lambda progress: told.append(progress.done))
    assert table["shaft.load"].tolist() == [0.0, 0.1, 0.2]
    assert set(table["ending"]) == {"ok"}
    units = table.attrs["units"]
    assert (units["shaft.load"], units["shaft.speed.mean"], units["efficiency"]) == ("N*m", "rad/s", "1")
    assert set(units) == set(table.columns) - {"case", "ending", "flags"}
    assert told[-1] == 3


def test_a_study_of_a_file_and_a_database(tmp_path: Path) -> None:
    import json

    path = tmp_path / "study.json"
    path.write_text(json.dumps(SPEC), encoding="utf-8")
    database = str(tmp_path / "kept.sqlite3")
    first = sprag.run(path, processes=0, database=database).table()
    pd.testing.assert_frame_equal(first, sprag.run(str(path), processes=0, database=database).table())


def test_what_is_wrong_with_a_study_is_named() -> None:
    from sprag_study.service.spec.report import SpecError

    with pytest.raises(SpecError) as refused:
        sprag.run(SPEC | {"base": SPEC["base"] | {"shaft": {"inertia": -1.0}}})
    assert [problem.where for problem in refused.value.faults] == ["/base/shaft/inertia"]
    with pytest.raises(sprag.SpecFileError, match="no-such-file"):
        sprag.run("no-such-file.toml")


def test_the_engine_takes_arrays_and_frames() -> None:
    loads = np.array([0.0, 0.1, 0.2])
    run = periods(12.0, 8.0, 12.0)
    columns = drive(1, shaft__load=loads)
    results = sprag.engine.simulate(columns, run)
    batch = plain_simulate(columns, run, cases=3)
    np.testing.assert_array_equal(results.drop(columns="ending").to_numpy(dtype=float), batch.values)
    assert results["ending"].tolist() == ["ok"] * 3
    assert results.attrs["units"]["shaft.speed.mean"] == "rad/s"
    frame = pd.DataFrame(columns, index=["a", "b", "c"])
    again = sprag.engine.simulate(frame, run)
    assert again.index.tolist() == ["a", "b", "c"]
    np.testing.assert_array_equal(again["shaft.speed.mean"], results["shaft.speed.mean"])
    assert len(sprag.engine.simulate(drive(1), run)) == 1
    assert len(sprag.engine.simulate(frame.iloc[:0], run)) == 0


def test_the_library_runs_cases_of_any_model() -> None:
    press = preset_of("press")["spec"]
    inertias = np.array([15.0, 30.0])
    frame = pd.DataFrame({"drive.inertia": inertias}, index=["a", "b"])
    results = sprag.simulate(frame, model="machine-shaft", base=press["base"])
    table = sprag.run(press | {"axes": [{"path": "drive.inertia", "values": inertias}]}, processes=0)
    np.testing.assert_array_equal(results["irregularity"], table["irregularity"])
    assert results.index.tolist() == ["a", "b"]
    assert results["ending"].tolist() == ["ok", "ok"]
    assert results.attrs["units"]["omega.mean"] == "rad/s"
    with pytest.raises(sprag.SpecError, match="/base/drive: is required"):
        sprag.simulate({"drive.inertia": 1.0}, model="machine-shaft")
    with pytest.raises(ValueError, match="run: not used by machine-shaft"):
        sprag.simulate({"drive.inertia": 1.0}, sprag.engine.Run(), model="machine-shaft", base=press["base"])
    with pytest.raises(ValueError, match="base: not used by vibration-drive"):
        sprag.simulate(drive(1), base={})


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"shaft.lode": 1.0}, "shaft.lode is not a parameter of the vibration drive"),
        ({"pendulums.0.inertia": [1e-3, -1.0]}, r"pendulums.0.inertia is -1 in case 1; allowed: > 0 kg\*m\^2 and <= 1"),
        (
            {"shaft.load": [0.1, 0.2], "shaft.inertia": [1.0] * 3},
            "arrays differ in length: shaft.inertia 3, shaft.load 2",
        ),
        ({"shaft.load": [[0.1, 0.2]]}, "shaft.load must be a number or an array of one dimension, not of 2"),
        ({"shaft.load": float("nan")}, "shaft.load is nan in case 0"),
    ],
)
def test_what_is_wrong_with_arrays_is_named(change: dict[str, Any], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        sprag.engine.simulate(drive(1) | change)


def test_the_client_is_there_without_the_rest() -> None:
    program = """
import sys
for name in ("numpy", "pandas", "numba", "sqlalchemy", "fastapi", "pyarrow", "pydantic"):
    sys.modules[name] = None
import sprag_study as sprag
sprag.Client, sprag.AsyncClient, sprag.RefusedError, sprag.__version__
for ask in (lambda: sprag.run, lambda: sprag.simulate):
    try:
        ask()
    except sprag.MissingExtraError as error:
        print(error)
"""
    done = python("-c", program)
    assert done.returncode == 0, done.stderr
    first, second = done.stdout.splitlines()
    assert re.fullmatch(r"sprag\.run needs the package '\w+': pip install \"sprag-study\[server\]\"", first)
    assert re.fullmatch(r"sprag\.simulate needs the package '\w+': pip install \"sprag-study\[server\]\"", second)


#: As if only what the base installation has were there.
BASE_ONLY = """
import sys
for name in ("numpy", "pandas", "xarray", "numba", "sqlalchemy", "fastapi", "pydantic", "pydantic_settings", "pint"):
    sys.modules[name] = None
"""


#: Commands that ask a service, each of which would import another part of the program.
REMOTE = (
    "list",
    "submit examples/press.toml",
    "study watch st_1",
    "study cancel st_1",
    "show st_1 curves --x shaft.load --y efficiency",
    "export st_1 -o rows.xlsx",
    "export st_1 -o report.pdf",
    "schedule list",
)


def test_commands_for_a_running_service_need_no_extra() -> None:
    program = f"""
from sprag_study.service.cli import main
for command in {REMOTE}:
    sys.argv[1:] = [*command.split(), "--server", "http://127.0.0.1:9"]
    try:
        main()
    except SystemExit as ended:
        print(ended.code)
"""
    done = python("-c", BASE_ONLY + program)
    assert (done.returncode, done.stdout.split()) == (0, ["3"] * len(REMOTE)), done.stderr
    assert done.stderr.count("No Sprag service at http://127.0.0.1:9") == len(REMOTE)


def test_answers_are_shown_without_an_extra() -> None:
    program = """
from sprag_study.service.cli.console import OK
from sprag_study.service.cli.shown import show_curves
from sprag_study.service.cli.remote import show_study
progress = {"done": 2, "total": 2, "ok": 1, "endings": {OK: 1, "chatter": 1}}
about = {"id": "st_1", "name": "one", "model": "m", "state": "finished", "time_over": False}
show_study({**about, "progress": progress})
curve = {"by": {}, "at": {}, "x": [1.0, 2.0], "y": {"efficiency": [0.5, None]}, "endings": [OK, "chatter"]}
results = {"efficiency": {"unit": "1"}}
show_curves({"x": {"path": "shaft.load", "unit": "N*m"}, "results": results, "units": {}, "curves": [curve]})
"""
    done = python("-c", BASE_ONLY + program)
    assert done.returncode == 0, done.stderr
    assert "1 chatter" in done.stderr
    assert done.stdout.count("chatter") == 1


def test_the_name_of_the_good_ending_is_that_of_the_models() -> None:
    from sprag_study.service.cli.console import OK
    from sprag_study.worker import models

    assert OK == models.OK


def test_tables_name_the_extra_that_they_need() -> None:
    program = """
import sys
sys.modules["pandas"] = sys.modules["xarray"] = None
import sprag_study as sprag
from sprag_study.service.client.frames import grid_of, table_of
data = {"x": {"path": "x"}, "curves": [], "results": {}, "units": {}}
for ask in (lambda: table_of(b""), lambda: grid_of(b""), sprag.Curves(data).to_pandas, sprag.Curves(data).to_xarray):
    try:
        ask()
    except sprag.MissingExtraError as error:
        print(error)
"""
    done = python("-c", program)
    assert done.stdout.count('pip install "sprag-study[tables]"') == 4, done.stderr


def test_a_command_names_the_extra_that_it_needs() -> None:
    blocked = "import sys; sys.modules.update(dict.fromkeys(['numpy', 'sqlalchemy', 'pydantic_settings', 'pydantic']))"
    command = (
        f"{blocked}; sys.argv[1:] = ['run', 'examples/press.toml']; from sprag_study.service.cli import main; main()"
    )
    done = python("-c", command)
    assert done.returncode == 3
    assert 'pip install "sprag-study[server]"' in done.stderr


def test_the_module_is_the_command_line_whatever_lies_in_the_folder(tmp_path: Path) -> None:
    (tmp_path / "worker.py").write_text("raise SystemExit('the wrong worker')")
    (tmp_path / "service").mkdir()
    (tmp_path / "service" / "__init__.py").write_text("raise SystemExit('the wrong service')")
    done = python("-m", "sprag_study", "--version", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, f"sprag {version('sprag-study')}\n"), done.stderr


def test_a_wrong_spec_is_one_error_here_and_of_a_service() -> None:
    """Code and faults are the same; so are those of errors of the database, the processes and the connection."""
    wrong = {**SPEC, "axes": [{"path": "shaft.load", "values": ["0 kg"]}]}
    with pytest.raises(sprag.SpragError) as here:
        sprag.run(wrong)
    assert isinstance(here.value, sprag.SpecError)
    errors = [fault.to_json() for fault in here.value.faults]
    refused = sprag.RefusedError(422, {"type": "/problems/invalid-spec", "detail": "no", "errors": errors})
    assert isinstance(refused, sprag.SpragError)
    assert (refused.code, refused.faults) == (here.value.code, here.value.faults)
    offered = [getattr(sprag, name) for name in sprag.__all__ if name.endswith("Error")]
    assert all(issubclass(error, sprag.SpragError) for error in offered)
    with pytest.raises(sprag.SpragError) as full:
        sprag.run(SPEC, processes=0, database="/dev/null/x.sqlite3")
    assert isinstance(full.value, sprag.StoreError)
    assert (full.value.code, full.value.faults) == ("write-failed", ())


def test_what_is_offered_is_listed_and_nothing_else_is_there() -> None:
    assert set(sprag.__all__) <= set(dir(sprag))
    for name in sprag.__all__:
        assert getattr(sprag, name) is not None
    with pytest.raises(AttributeError, match="nothing"):
        sprag.nothing  # noqa: B018
