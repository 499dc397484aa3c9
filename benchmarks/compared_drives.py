"""Counts of a comparison of random drives with scipy; each drive that differs is printed."""

from __future__ import annotations

import argparse
from collections.abc import Callable


def compare_all(description: str | None, compare: Callable[[int], bool]) -> int:
    """The exit code: 1 where a drive differs.

    Parameters
    ----------
    description : of the command, which has the option ``--drives``
    compare : whether the drive of a number is insensitive enough to conclude something; AssertionError where it differs
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--drives", type=int, default=300)
    drives = parser.parse_args().drives
    agree = sensitive = 0
    wrong: list[str] = []
    for number in range(drives):
        try:
            concluded = compare(number)
        except AssertionError as error:
            wrong.append(f"drive {number}: {str(error).splitlines()[0]}")
            continue
        agree += concluded
        sensitive += not concluded
    print(f"{agree} of {drives} drives agree, {sensitive} are too sensitive, {len(wrong)} differ")
    for line in wrong:
        print(line)
    return 1 if wrong else 0
