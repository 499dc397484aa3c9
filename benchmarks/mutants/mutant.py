"""A change of the program that its tests must notice."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of one file, and the tests one of which has to fail."""

    name: str
    file: str
    before: str
    after: str
    tests: tuple[str, ...]
