"""Every safety mechanism is necessary: without it, the corresponding test fails.

    python -m benchmarks.mutants

Every mutant is a copy of the program with one change; the test must pass on a copy without it.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
_FOLDERS = ("sprag", "engine", "worker", "service", "migrations", "tests", "benchmarks")
_FAULTS = "tests/acceptance/test_faults.py::"
_KILLS = "tests/acceptance/test_kills.py::"
_ROUNDS = "tests/contract/test_rounds.py::"
_CERTIFICATE = "tests/engine/test_certificate.py::"
_STARTS = "tests/engine/vibration_drive/test_starts.py::"
_FOLDS = "tests/engine/continuation/test_folds.py::"


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file, and the tests one of which has to fail."""

    name: str
    file: str
    before: str
    after: str
    tests: tuple[str, ...]


MUTANTS = (
    Mutant(
        "no epoch check",
        "service/storage/part.py",
        "        if latest != epoch:",
        "        if latest != epoch and not latest:",
        (f"{_KILLS}test_a_dispatcher_that_was_stopped_commits_nothing_and_gives_up",),
    ),
    Mutant(
        "claims of older epochs are not returned",
        "service/storage/work.py",
        "    connection.execute(sa.update(CHUNKS).where(CLAIMED).values(_WAITING))",
        "    connection.execute(sa.update(CHUNKS).where(CLAIMED, CHUNKS.c.epoch < 0).values(_WAITING))",
        (f"{_KILLS}test_killed_processes_lose_nothing",),
    ),
    Mutant(
        "no IMMEDIATE transaction",
        "service/storage/session.py",
        '"write": "BEGIN IMMEDIATE"',
        '"write": "BEGIN"',
        (f"{_FAULTS}test_clients_do_not_hear_of_locks", "tests/contract/test_concurrency.py"),
    ),
    Mutant(
        "no FULL synchronisation",
        "service/storage/sqlite_files.py",
        '"synchronous = FULL"',
        '"synchronous = NORMAL"',
        (f"{_FAULTS}test_a_power_cut_takes_nothing_that_was_acknowledged",),
    ),
    Mutant(
        "rows and the chunk's end in two transactions",
        "service/storage/work.py",
        "        endings = Counter(result.endings)",
        '        connection.exec_driver_sql("COMMIT")\n        connection.exec_driver_sql("BEGIN IMMEDIATE")\n'
        "        endings = Counter(result.endings)",
        (f"{_FAULTS}test_a_power_cut_takes_nothing_that_was_acknowledged",),
    ),
    Mutant(
        "a round and its chunks in two transactions",
        "service/storage/rounds.py",
        "            chunks = [Chunk(number, first + start, size) for start, size in sizes]",
        '            connection.exec_driver_sql("COMMIT")\n            connection.exec_driver_sql("BEGIN")\n'
        "            chunks = [Chunk(number, first + start, size) for start, size in sizes]",
        (f"{_ROUNDS}test_a_round_that_breaks_off_changes_nothing",),
    ),
    Mutant(
        "a round is appended twice",
        "service/storage/rounds.py",
        "    return row.done == row.cases and cases in {None, row.cases}",
        "    return bool(row.done == row.cases)",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a round is appended before its predecessor is complete",
        "service/storage/rounds.py",
        "    return row.done == row.cases and cases in {None, row.cases}",
        "    return cases in {None, row.cases}",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a held study gets its next round",
        "service/storage/rounds.py",
        "    if row is None or row.most_cases is None or not StudyState(row.state).going:",
        "    if row is None or row.most_cases is None or StudyState(row.state).terminal:",
        (f"{_ROUNDS}test_a_round_is_appended_once_and_only_while_the_study_is_going",),
    ),
    Mutant(
        "a study ends between its rounds",
        "service/storage/work.py",
        "            goes_on = most_cases is not None and summary is None",
        "            goes_on = False",
        (f"{_ROUNDS}test_a_study_with_rounds_is_not_ended_between_them",),
    ),
    Mutant(
        "no quarantine",
        "worker/dispatch.py",
        "            known.suspects.append(Quarantine(chunk, WorkerEnding.CRASHED, event.detail))\n"
        "            return []",
        "            known.waiting.appendleft(chunk)\n            return [PutBack(chunk, event.detail)]",
        ("tests/worker/test_dispatch.py::test_one_success_forgives_the_crashes_before_it",),
    ),
    Mutant(
        "a broken engine is the cases' fault",
        "worker/dispatch.py",
        "            if disjoint(known.crashed) >= FAULT_CRASHES:",
        "            if disjoint(known.crashed) >= FAULT_CRASHES and known.proven:",
        ("tests/worker/test_dispatch.py::test_when_everything_crashes_the_study_is_held_and_nobody_blamed",),
    ),
    Mutant(
        "children outlive their parent",
        "worker/pool/processes.py",
        "    ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, int(number), 0, 0, 0)\n",
        "    ctypes.CDLL(None, use_errno=True)\n",
        (f"{_KILLS}test_killed_processes_lose_nothing",),
    ),
    Mutant(
        "no reserve for a full disk",
        "service/storage/room.py",
        "    if free >= RESERVE_BYTES and not (capped and limit - size - log < RESERVE_BYTES):",
        "    if True:",
        ("tests/service/storage/test_room.py",),
    ),
    Mutant(
        "unstable orbits count as settled",
        "engine/vibration_drive/search.py",
        "STABLE = 1.0 - 1e-4",
        "STABLE = math.inf",
        (f"{_CERTIFICATE}test_an_unstable_orbit_does_not_count",),
    ),
    Mutant(
        "orbits with a multiplier up to 1.1 count as settled",
        "engine/vibration_drive/search.py",
        "STABLE = 1.0 - 1e-4",
        "STABLE = 1.1",
        (f"{_CERTIFICATE}test_an_unstable_orbit_does_not_count",),
    ),
    Mutant(
        "states of clutches and shaft not compared",
        "engine/vibration_drive/orbits.py",
        "    if a[SHAFT] != b[SHAFT]:",
        "    return True\n    if a[SHAFT] != b[SHAFT]:",
        (f"{_CERTIFICATE}test_strobes_of_other_states_are_not_the_same",),
    ),
    Mutant(
        "an order that is not the least",
        "engine/vibration_drive/search.py",
        "        again = np.flatnonzero(found.least < found.orders)",
        "        again = np.flatnonzero(found.least > found.orders)",
        (f"{_CERTIFICATE}test_the_order_is_the_least",),
    ),
    Mutant(
        "orbits far from the run count as settled",
        "engine/vibration_drive/search.py",
        "AWAY = 0.005",
        "AWAY = math.inf",
        (f"{_CERTIFICATE}test_an_orbit_far_from_the_run_does_not_count",),
    ),
    Mutant(
        "orbits that the run does not come nearer to count as settled",
        "engine/vibration_drive/orbits.py",
        "        found[case] = third > 0 and late < early * exponential(rate * third)",
        "        found[case] = third > 0",
        ("tests/engine/test_slow_orbits.py",),
    ),
    Mutant(
        "steps of the parameter instead of the arc length",
        "engine/continuation/follow.py",
        "node.at(self._size), node.tangent)",
        "node.at(self._size), [*[0.0] * (len(node.z) - 1), 1.0])",
        (f"{_FOLDS}test_a_branch_goes_around_its_folds",),
    ),
    Mutant(
        "stability by the opposite of its test",
        "engine/continuation/problem.py",
        "return self.multiplier < 1.0 - _ROUNDING",
        "return self.multiplier > 1.0 - _ROUNDING",
        (f"{_FOLDS}test_a_branch_goes_around_its_folds",),
    ),
    Mutant(
        "doublings where a multiplier passes +1",
        "engine/continuation/locate.py",
        "product *= value + 1.0",
        "product *= value - 1.0",
        (f"{_FOLDS}test_one_impact_orbits_have_their_closed_form",),
    ),
    Mutant(
        "unstable motions drawn as stable ones",
        "service/results/figures/branch.py",
        'Line("unstable", *_part(made.parameters, values, ~full), _UNSTABLE, 1,',
        'Line("unstable", *_part(made.parameters, values, ~full), _UNSTABLE, 0,',
        ("tests/service/results/figures/test_branch.py::test_stable_parts_are_full_and_unstable_ones_dashed",),
    ),
    Mutant(
        "a sweep that starts every case from rest",
        "engine/vibration_drive/sweep.py",
        "            starts[cases], begun[cases] = _after(",
        "            _, begun[cases] = _after(",
        ("tests/engine/test_sweeps.py::test_the_direction_of_a_sweep_decides_between_two_motions",),
    ),
    Mutant(
        "a sweep that always goes up",
        "worker/sweeps.py",
        "    ordered = np.where(columns[-1] == DOWN, -values, values)",
        "    ordered = values",
        ("tests/worker/test_sweeps.py::test_a_killed_sweep_goes_on_with_the_same_bits",),
    ),
    Mutant(
        "chunks that split a line",
        "worker/chunking.py",
        "math.ceil(lines / MAX_CHUNKS)) * length",
        "math.ceil(lines / MAX_CHUNKS)) * (length - 1)",
        ("tests/worker/test_sweeps.py::test_a_killed_sweep_goes_on_with_the_same_bits",),
    ),
    Mutant(
        "starts: any two orbits of one kind are the same",
        "engine/vibration_drive/same_motions.py",
        "SAME_ORBIT = 1e-4",
        "SAME_ORBIT = math.inf",
        (f"{_STARTS}test_motions_of_one_mean_speed_are_told_apart",),
    ),
    Mutant(
        "starts: orbits compared at one phase only",
        "engine/vibration_drive/same_motions.py",
        "            for shift in range(order):",
        "            for shift in range(1):",
        (f"{_STARTS}test_copies_of_an_orbit_a_period_apart_are_one_regime",),
    ),
    Mutant(
        "starts: orbits of different orders are never the same",
        "engine/vibration_drive/same_motions.py",
        "        for other in np.unique(self.orders[lanes[alike]]).tolist():",
        "        for other in [order]:",
        (f"{_STARTS}test_orbits_that_repeat_for_ever_alike_are_one_whatever_their_orders",),
    ),
    Mutant(
        "starts: the own start's regime first",
        "engine/vibration_drive/same_motions.py",
        "key=lambda group: (-len(group), int(group[0])))",
        "key=lambda group: int(group[0]))",
        (f"{_STARTS}test_motions_of_one_mean_speed_are_told_apart",),
    ),
    Mutant(
        "starts: transients count as motions",
        "engine/vibration_drive/starts.py",
        "    for times in LONGER:",
        "    for times in ():",
        (f"{_STARTS}test_starts_without_an_orbit_are_run_longer_before_they_count_as_another_motion",),
    ),
    Mutant(
        "starts: transients are run longer only once",
        "engine/vibration_drive/starts.py",
        "LONGER = (4, 16)",
        "LONGER = (4,)",
        (f"{_STARTS}test_starts_without_an_orbit_are_run_longer_before_they_count_as_another_motion",),
    ),
    Mutant(
        "starts: failed starts do not count in shares",
        "engine/vibration_drive/starts.py",
        "    share = reached / len(lanes)",
        "    share = reached / reached.sum()",
        (f"{_STARTS}test_starts_that_fail_belong_to_no_regime_and_count_in_the_shares",),
    ),
    Mutant(
        "starts: intervals of another probability",
        "engine/vibration_drive/starts.py",
        "_NORMAL = 1.959963984540054",
        "_NORMAL = 1.644853626951473",
        (f"{_STARTS}test_shares_have_the_intervals_of_wilson",),
    ),
    Mutant(
        "starts: intervals without the correction for few starts",
        "engine/vibration_drive/starts.py",
        "    middle = (share + square / (2 * starts)) / (1 + square / starts)",
        "    middle = share / (1 + square / starts)",
        (f"{_STARTS}test_shares_have_the_intervals_of_wilson",),
    ),
    Mutant(
        "starts: intervals of the starts that end ok",
        "engine/vibration_drive/starts.py",
        "    low, high = wilson(reached, len(lanes))",
        "    low, high = wilson(reached, int(reached.sum()))",
        (f"{_STARTS}test_starts_that_fail_belong_to_no_regime_and_count_in_the_shares",),
    ),
    Mutant(
        "starts: any two irregular motions are the same",
        "engine/vibration_drive/same_motions.py",
        "HALF_WIDTHS = 2.0",
        "HALF_WIDTHS = 1e9",
        (f"{_STARTS}test_irregular_motions_are_distinguished_by_their_means",),
    ),
)


_PASSED, _FAILED, _ENDLESS = "passed", "failed", "came to no end"


def copy_program(tree: Path) -> None:
    """Copy the program and its tests; the links in ``sprag/`` stay links, so that the changed copy is imported."""
    for name in _FOLDERS:
        shutil.copytree(ROOT / name, tree / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "examples"):
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, tree / name)


def outcome(tree: Path, tests: tuple[str, ...]) -> str:
    """How the tests end in that copy. What a mutant loses is waited for in vain: some tests come to no end."""
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *tests]
    try:
        done = subprocess.run(
            command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree), "CI": "true"}, capture_output=True,
            timeout=180, check=False,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return _ENDLESS
    assert done.returncode in (0, 1), done.stdout.decode()[-2000:]
    return _FAILED if done.returncode else _PASSED


def main() -> None:
    """Run every test on the program and on its mutant; exit code 1 when some mutant lives."""
    wanted = sys.argv[1:]
    alive = []
    with tempfile.TemporaryDirectory(prefix="sprag-mutant-") as folder:
        tree = Path(folder)
        copy_program(tree)
        for mutant in MUTANTS:
            if wanted and not any(word in mutant.name for word in wanted):
                continue
            begin = time.monotonic()
            sound = outcome(tree, mutant.tests) == _PASSED
            file = tree / mutant.file
            original = file.read_text()
            assert original.count(mutant.before) == 1, f"{mutant.name}: the place to change is not there"
            file.write_text(original.replace(mutant.before, mutant.after))
            found = outcome(tree, mutant.tests)
            file.write_text(original)
            dead = sound and found != _PASSED
            if not dead:
                alive.append(mutant.name)
            verdict = f"dead, its test {found}" if dead else "ALIVE" if sound else "the test fails without it"
            print(f"{mutant.name}: {verdict} ({time.monotonic() - begin:.0f} s)", flush=True)
    if alive:
        raise SystemExit(1)


if __name__ == "__main__":
    main()
