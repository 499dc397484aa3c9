"""The names that commands had before version 1.0; for one release each is forwarded to its new name, with a line."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from typing import Final

_VERBS: Final = (
    "cancel", "delete", "edit", "extend", "longer", "narrow", "pause", "prioritize", "restore", "resume", "retry",
    "select", "watch",
)  # fmt: skip
_VIEWS: Final = (
    "answers", "basin", "branch", "calibration", "cases", "diagram", "engagements", "explore", "front", "map",
    "regimes", "ribbon", "rounds", "section", "sensitivity", "strobes", "trajectory", "transient", "yield",
)  # fmt: skip
#: What settings of a case are called as options, where this is not their name.
_OPTIONS: Final = {("diagram", "points"): "values", ("basin", "points"): "grid"}
#: Options that commands had, and what says the same.
GONE: Final = {
    ("show", "--processes"): "SPRAG_PROCESSES",
    ("check", "--processes"): "SPRAG_PROCESSES",
    ("show", "--format"): "-o FILE.csv",
    ("run", "--chunk"): "SPRAG_CHUNK_CASES",
    ("serve", "--chunk"): "SPRAG_CHUNK_CASES",
    ("serve", "--tls-certificate"): "SPRAG_TLS_CERTIFICATE",
    ("serve", "--tls-key"): "SPRAG_TLS_KEY",
    ("admin worker", "--processes"): "SPRAG_PROCESSES",
}
#: The new name by the old one; ID is the argument, which stands behind both.
OLD: Final = {
    "validate": "check",
    "preview": "check",
    "curve": "show ID curves",
    "settle": "show ID settled",
    "calibrate": "show ID calibration",
    "case": "show ID case",
    **{name: f"study {name}" for name in _VERBS},
    **{name: f"show ID {name}" for name in _VIEWS},
    **{name: f"admin {name}" for name in ("db", "doctor", "token", "user", "worker", "workers")},
}


def forwarded(words: Sequence[str]) -> tuple[list[str], str]:
    """The words of today for those of a command line, and the new name where the old one was used, else ``""``."""
    name, rest = (words[0], list(words[1:])) if words else ("", [])
    if (options := _audit(words)) is not None:
        return ["admin", "audit", *options], "admin audit"
    if name not in OLD:
        return list(words), ""
    new = [word for word in OLD[name].split() if word != "ID"]
    if name == "case":
        shown = _of_case(rest)
        return ["show", *shown], OLD[name] if shown[0] == "case" else f"show ID {shown[0]} --case N"
    return [*new, *rest], OLD[name]


def _audit(words: Sequence[str]) -> list[str] | None:
    """What else a line of ``[admin] db audit`` has, where ``--db URL`` may stand between the words; None for others."""
    named = [k for k, word in enumerate(words) if not word.startswith("-") and words[max(k - 1, 0)] != "--db"]
    for old in (["admin", "db", "audit"], ["db", "audit"]):
        if [words[k] for k in named[: len(old)]] == old:
            return [word for k, word in enumerate(words) if k not in named[: len(old)]]
    return None


def _of_case(words: Sequence[str]) -> list[str]:
    """``ID N [PART] --set NAME=VALUE`` of a case: its part is a view, its number and the settings are options."""
    named: list[str] = []
    options: list[str] = []
    part = next((word for word in words if word in _VIEWS), "")
    rest = iter(words)
    for word in rest:
        if word == "--set" or word.startswith("--set="):
            setting = word.removeprefix("--set=") if word != "--set" else next(rest, "")
            name, equals, value = setting.partition("=")
            option = _OPTIONS.get((part, name.strip()), name.strip().replace("_", "-"))
            options.append(f"--{option}{equals}{value.strip()}")
        elif word.startswith("-"):
            options += [word, *(islice(rest, 1) if word in ("-o", "--output") else ())]
        else:
            named.append(word)
    study, number, view = [*named, *[""] * 3][:3]
    return [view or "case", *filter(None, [study]), *(["--case", number] if number else []), *options, *named[3:]]


def without_gone(words: Sequence[str]) -> tuple[list[str], dict[str, str], list[tuple[str, str]]]:
    """The words without options that are gone, settings in their place, and each such option with what replaces it."""
    kept: list[str] = []
    settings: dict[str, str] = {}
    gone: list[tuple[str, str]] = []
    names = (" ".join(words[:1]), " ".join(words[:2]))
    rest = iter(words)
    for word in rest:
        option, equals, value = word.partition("=")
        instead = next((GONE[name, option] for name in names if (name, option) in GONE), None)
        if instead is None:
            kept.append(word)
            continue
        following = [] if equals else [*islice(rest, 1)]
        value = value if equals else "".join(following)
        gone.append((option, "--json" if value == "json" else instead))
        if instead.startswith("-") or not value.strip("0"):  # read as before, or refused: 0 is no value of an option
            kept += [word, *following]
        else:
            settings[instead] = value
    return kept, settings, gone
