"""Names under which dispatchers take over, and the reason they imply for a study abandoned by its run."""

from typing import Final

from sprag.sentences import Sentence

#: Separator between process and study in the name of an owner that runs a single study.
_RUNS: Final = " runs "


def run_owner(process: str, study_id: str) -> str:
    """The name of a dispatcher that takes over for a single study."""
    return f"{process}{_RUNS}{study_id}"


def own_study(owner: str) -> str:
    """The study for which a `run_owner` took over; "" for any other dispatcher."""
    return owner.partition(_RUNS)[2]


def why_abandoned(owner: str) -> str:
    """The reason of a study that its `run_owner` left unfinished."""
    return Sentence(
        "`sprag run` (process {process}) ended before its study did; resume the study to have a worker continue it, or "
        "repeat the same `sprag run`, which reuses its finished cases",
        process=owner.partition(_RUNS)[0],
    )
