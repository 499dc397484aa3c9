"""The names under which dispatchers take over, and what they say about a study that its run has left."""

from typing import Final

#: Between the process and the study in the name of an owner that runs one study only.
_RUNS: Final = " runs "


def run_owner(process: str, study_id: str) -> str:
    """The name of a dispatcher that takes over for one study, of its own."""
    return f"{process}{_RUNS}{study_id}"


def own_study(owner: str) -> str:
    """The study for which a `run_owner` took over; "" of any other dispatcher."""
    return owner.partition(_RUNS)[2]


def why_abandoned(owner: str) -> str:
    """The reason of a study that a `run_owner` has left unfinished."""
    return (
        f"`sprag run` (process {owner.partition(_RUNS)[0]}) ended before its study did; resume the study to have a "
        "worker go on with it, or give the same `sprag run` again, which takes the done cases from it"
    )
