"""Mutants of what computes motions: engine, sweeps, branches."""

from __future__ import annotations

from typing import Final

from benchmarks.mutants.mutant import Mutant

_CERTIFICATE = "tests/engine/test_certificate.py::"
_STARTS = "tests/engine/vibration_drive/test_starts.py::"
_FOLDS = "tests/engine/continuation/test_folds.py::"

MOTION: Final = (
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
        "service/figures/branch.py",
        'Line(Phrase("unstable"), *_part(made.parameters, values, ~full), _UNSTABLE, 1,',
        'Line(Phrase("unstable"), *_part(made.parameters, values, ~full), _UNSTABLE, 0,',
        ("tests/service/figures/test_branch.py::test_stable_parts_are_full_and_unstable_ones_dashed",),
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
