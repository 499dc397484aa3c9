"""Which studies a dispatcher takes up: its share of those of the database, as soon as their kernels are loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Sentence
from sprag_study.worker import fingerprint
from sprag_study.worker.sharing import gives, takes
from sprag_study.worker.stages import Stage

if TYPE_CHECKING:
    from collections.abc import Collection, Sequence

    from sprag_study.worker.ports import ActiveStudy, Clock, Executor, Peer, Store
    from sprag_study.worker.stages import Stages
    from sprag_study.worker.study import Study

#: Number of studies active at the same time; the others wait in order of submission. Each owner may have one, however
#: many others have.
OPEN_STUDIES = 8
#: Seconds that a study waits for its kernel before this is reported; cached kernels load sooner.
NOTE_SECONDS = 3.0
COMPILING = Sentence(
    "The kernel of this study is being compiled, once, which can take a minute; other studies continue."
)


class Opening:
    """Studies on their way to being run. ``only``: the number of the only one to be run."""

    def __init__(self, store: Store, clock: Clock, only: int | None, stages: Stages) -> None:
        self.epoch = 0
        #: Every study as it was polled last.
        self.polled: dict[int, ActiveStudy] = {}
        self._store = store
        self._clock = clock
        self._only = only
        self._stages = stages
        #: Studies waiting for their kernels, and those that cannot run at present; with the time when this began.
        self._compiling: dict[int, float] = {}
        self._short: dict[int, float] = {}
        #: The reasons recorded on studies.
        self._notes: dict[int, str | None] = {}
        #: Number of studies of this dispatcher, and the other dispatchers, at the latest poll.
        self._own = 0
        self._peers: list[Peer] = []
        #: Whether nothing could be run then.
        self._stuck = False

    def studies(self) -> list[ActiveStudy]:
        """The unfinished studies that belong to this dispatcher or to none."""
        found = self._store.active_studies()
        self.polled = {study.number: study for study in found}
        return [study for study in found if study.dispatcher in {None, self.epoch}]

    def chosen(self, study: ActiveStudy) -> bool:
        """Whether this dispatcher runs such studies."""
        return self._only in {None, study.number}

    def is_ours(self, study: ActiveStudy) -> bool:
        """Whether the study belonged to this dispatcher when it was polled."""
        return study.dispatcher == self.epoch

    def given(self, studies: Sequence[ActiveStudy], shortage: str | None) -> int | None:
        """The study that is to be given to another dispatcher; None for none. ``shortage``: why nothing can be run."""
        ours = [study for study in studies if self.is_ours(study)]
        self._own, self._stuck = len(ours), shortage is not None
        # Nobody is asked where there is nothing to share.
        shared = self._only is None and bool(studies) and (self._stuck or len(ours) > 1 or len(ours) < len(studies))
        self._peers = self._store.peers(self.epoch) if shared else []
        return gives([study for study in ours if study.state.going], self._peers, stuck=self._stuck)

    def adopted(self, study: ActiveStudy) -> bool:
        """Whether the study belongs to this dispatcher now, however many it has."""
        return self.is_ours(study) or self._store.adopt(self.epoch, study.number)

    def may_open(self, study: ActiveStudy, active: Collection[int]) -> bool:
        """Whether a study may become active, and belongs to this dispatcher.

        Those that wait for kernels or come after it do not count among the ``active`` ones.
        """
        if study.number in self._compiling:
            return True
        if not all(self._has_place(study, group) for group in (active, self._compiling)):
            return False
        if self.is_ours(study):
            return True
        if not takes(study, fingerprint.digest(), self._own, self._peers, stuck=self._stuck):
            return False
        if not self.adopted(study):
            return False
        self._own += 1
        return True

    def _has_place(self, study: ActiveStudy, group: Collection[int]) -> bool:
        """Whether a study can join those of a group that do not come after it."""
        others = [self.polled[number] for number in group if number in self.polled]
        mine = sum(other.owner == study.owner and _order(other) >= _order(study) for other in others)
        return not mine or mine + sum(o.owner != study.owner and o.rank >= study.rank for o in others) < OPEN_STUDIES

    def loaded(self, number: int, study: Study, executor: Executor) -> bool:
        """Whether the kernel of a study is loaded; if not, this is reported after a while. Raises KernelError."""
        now = self._clock.monotonic()
        with self._stages.of_study(number):
            ready = executor.ready(study)
        if ready or executor.shortage is not None:
            self._stages.end(number, Stage.COMPILING)
        else:
            self._stages.begin(number, Stage.COMPILING)
        if ready:
            self._compiling.pop(number, None)
            self._notes.pop(number, None)
            self._store.note(self.epoch, number, None)  # the reason may come from an earlier dispatcher
            return True
        if now - self._compiling.setdefault(number, now) >= NOTE_SECONDS:
            self._note(number, executor.shortage or COMPILING)
        return False

    def tell_shortage(self, number: int, executor: Executor) -> None:
        """Record on an active study that nothing can be run, when this persists."""
        shortage, now = executor.shortage, self._clock.monotonic()
        if shortage is None:
            self._short.pop(number, None)
            self._note(number, None)
        elif now - self._short.setdefault(number, now) >= NOTE_SECONDS:
            self._note(number, shortage)

    def _note(self, number: int, note: str | None) -> None:
        if self._notes.get(number) != note:
            self._store.note(self.epoch, number, note)
            self._notes[number] = note

    @property
    def compiling(self) -> bool:
        """Whether any study waits for its kernel."""
        return bool(self._compiling)

    def stop_waiting(self, number: int) -> bool:
        """Let a study no longer wait for its kernel; whether it did."""
        self._stages.end(number, Stage.COMPILING)
        return self._compiling.pop(number, None) is not None

    def forget(self, number: int) -> None:
        """Drop what is known of a study."""
        self._stages.end(number, Stage.COMPILING)
        for known in (self._compiling, self._short, self._notes):
            known.pop(number, None)

    def unnoted(self, number: int) -> None:
        """Another reason was recorded on a study."""
        self._notes.pop(number, None)


def _order(study: ActiveStudy) -> tuple[int, int]:
    """By which studies of one owner go first, the largest first."""
    return study.rank, study.priority
