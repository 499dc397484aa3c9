"""The planner of a search for designs: generations, the polish of equalities, the finish of one goal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.cma import LEAST, LEAST_BEFORE_FINISH, Cma
from sprag_study.worker.planning.goals.finish import Finish, finish_designs, finish_rounds
from sprag_study.worker.planning.goals.fresh import FRESH, best_places, most_fresh
from sprag_study.worker.planning.goals.nsga2 import Nsga2
from sprag_study.worker.planning.goals.polish import MET, MOST_STARTS, MOST_TRIALS, Polish, polish_designs
from sprag_study.worker.planning.goals.ranking import ranks
from sprag_study.worker.planning.goals.record import Record
from sprag_study.worker.planning.goals.scores import Scores, judge, outputs_of
from sprag_study.worker.planning.goals.space import Space, keys
from sprag_study.worker.planning.rounds import Rows, Step

if TYPE_CHECKING:
    from collections.abc import Container

    from sprag_study.worker.planning.goals.plan import GoalPlan

Floats = NDArray[np.float64]

#: Generations in a row without a new design after which a search has ended.
_IDLE = 10


class Search(Protocol):
    """How generations follow from those before."""

    def propose(self, generation: int, known: Container[bytes]) -> Floats:
        """Coordinates of the designs of a generation, shape (designs, dimensions); ``known`` has keys of designs."""

    def take(self, coordinates: Floats, scores: Scores) -> None:
        """Take the scores of the designs proposed last."""

    def survivors(self) -> tuple[Floats, Scores]:
        """The best designs so far, coordinates and scores."""

    def settled(self, least: float, /) -> bool:
        """Whether a search that began anew has gained at most that share of its goal, so that it may end."""


class End(Protocol):
    """What follows the generations: the polish, then the finish."""

    @property
    def done(self) -> bool:
        """Whether nothing is left to try."""

    @property
    def differentiates(self) -> bool:
        """Whether the designs of this round serve the derivatives only."""

    def propose(self) -> Floats:
        """Coordinates of the next designs, shape (designs, dimensions)."""

    def take(self, outputs: Floats) -> None:
        """Go on by the outputs of the designs proposed last."""


class GoalPlanner:
    """Searches for the best designs (`sprag_study.worker.planning.rounds.Planner`).

    One goal is searched for by CMA-ES, several or none by NSGA-II; then equalities are polished, and one goal finished.

    A round is a generation, without the designs that were evaluated before, a step of the polish or of the finish, or
    at the end the best designs with fresh drives.
    Columns of the points are the variables of the plan in their order, then the paths of its operating points, then the
    drive; the cases of a design, one for each operating point and drive, are stored next to each other.
    """

    def __init__(self, plan: GoalPlan) -> None:
        self.plan = plan
        self._space = Space(plan)
        self._search: Search
        if len(plan.best) == 1:
            least = LEAST_BEFORE_FINISH if finish_designs(plan) else LEAST
            self._search = Cma(self._space, plan.population, plan.seed, growing=plan.growing, least=least)
        else:
            self._search = Nsga2(self._space, plan.population, plan.seed)
        self._known: dict[bytes, Floats] = {}
        self._record = Record(plan)
        self._generation = self._idle = self._rounds = self._cases = self._spent = 0
        self._end: End | None = None
        #: Known designs that served derivatives only.
        self._aside: set[bytes] = set()
        self._proposed = np.empty((0, self._space.dimensions))
        self._keys: list[bytes] = []
        #: Of the proposed designs, those that are not known: their places, and they themselves.
        self._new = np.empty(0, dtype=np.int64)
        self._asked = np.empty((0, self._space.dimensions))
        #: The best designs, which are asked for with fresh drives, and the keys of those that have them.
        self._fresh = np.empty((0, self._space.dimensions))
        self._with_fresh: set[bytes] = set()
        self._next()

    @property
    def paths(self) -> tuple[tuple[str, ...], ...]:
        """The parameters of each column of the points."""
        return self.plan.paths

    @property
    def results(self) -> tuple[str, ...]:
        """The results of goals and limits."""
        return self.plan.results

    @property
    def most_cases(self) -> int:
        """Cases of a search in which no design comes twice, with the longest polish and finish, and fresh drives.

        A run again of failed cases can make another design the best, and have it run with fresh drives, too.
        """
        fresh = most_fresh(self.plan) * len(self.plan.at) * self.plan.fresh
        return self._most_cases_searched + fresh

    @property
    def _most_cases_searched(self) -> int:
        """As `most_cases`, without fresh drives."""
        ends = polish_designs(self.plan) + finish_designs(self.plan)
        return (self._most_searched + ends) * self.plan.cases_each

    @property
    def most_rounds(self) -> int:
        """Generations, each with a new design, the rounds of the polish and of the finish, and that of fresh drives."""
        return self._most_rounds_searched + (1 if self.plan.fresh else 0)

    @property
    def _most_rounds_searched(self) -> int:
        """As `most_rounds`, without fresh drives."""
        generations = min(self.plan.generations, self._most_searched)
        return generations + (1 + MOST_TRIALS if polish_designs(self.plan) else 0) + finish_rounds(self.plan)

    @property
    def _most_searched(self) -> int:
        """Designs of all generations at most: of a catalogue, each once."""
        designs = self.plan.population * self.plan.generations
        return designs if self._space.size is None else min(designs, self._space.size)

    def tell(self, rows: Rows) -> None:
        """Take the rows of the next round.

        Any designs of the plan will do: where failed cases were run again, another planner may have asked for others.

        Raises
        ------
        ValueError
            If there are rows of something else.
        """
        if (fresh := self._space.of_fresh_cases(rows.points)) is not None:
            self._with_fresh.update(keys(fresh))
            self._next()
            return
        designs, coordinates = self._space.coordinates(rows.points)
        outputs = outputs_of(self.plan, rows)
        self._known.update(zip(keys(designs), outputs, strict=True))
        self._rounds += 1
        self._cases += len(rows.points)
        if not np.array_equal(designs, self._asked):
            self._others(coordinates, judge(self.plan, outputs))
        else:
            self._settle()
        self._next()

    def ask(self) -> Step:
        """The next round; asking changes nothing."""
        derivatives = self._end is not None and self._end.differentiates and len(self._asked) > 0
        finishing = isinstance(self._end, Finish)
        summary = self._record.summary(self._phase(), derivatives=derivatives, finishing=finishing)
        return Step(
            self._space.fresh_cases(self._fresh) if len(self._fresh) else self._space.cases(self._asked), summary
        )

    def best(self) -> tuple[Floats, Scores]:
        """The best designs of the search so far, the survivors of its last generation: variables in SI and scores."""
        coordinates, scores = self._search.survivors()
        return self._space.designs(coordinates), scores

    def _phase(self) -> str:
        if len(self._fresh):
            return FRESH
        if not len(self._asked):
            return "ended"
        return "search" if self._end is None else "polish"

    def _settle(self) -> None:
        """Hand the outputs of what was proposed to the search, or to the polish or the finish."""
        if not self._keys:
            scores = self._search.survivors()[1][:0]
        else:
            scores = judge(self.plan, np.array([self._known[key] for key in self._keys]))
        if self._end is not None:
            finishing = isinstance(self._end, Finish)
            if self._end.differentiates:
                self._aside.update(self._keys[place] for place in self._new.tolist())
                self._record.differentiated(scores[self._new], finishing=finishing)
            else:
                self._record.polished(scores[self._new], finishing=finishing)
            self._end.take(scores.outputs)
            return
        if len(scores):
            self._search.take(self._proposed, scores)
        self._idle = 0 if len(self._asked) else self._idle + 1
        self._generated(scores[self._new])

    def _others(self, coordinates: Floats, scores: Scores) -> None:
        """Take designs that another planner asked for: as a generation, or beside the polish, which asks again."""
        if self._end is not None or not len(self._asked):
            self._record.polished(scores, finishing=isinstance(self._end, Finish))
            return
        self._search.take(coordinates, scores)
        self._generated(scores)

    def _generated(self, new: Scores) -> None:
        self._generation += 1
        self._spent += len(self._proposed) if self.plan.growing else self.plan.population
        self._record.generation(new, self._search.survivors()[1], -(-self._spent // self.plan.population))

    def _next(self) -> None:
        """Propose what is asked for next: designs, or once there is none, or fresh drives had their turn, these."""
        if self._with_fresh:
            self._propose(self._proposed[:0])
        else:
            self._search_on()
        self._fresh = self._unseen() if self.plan.fresh and not len(self._asked) else self._fresh[:0]

    def _search_on(self) -> None:
        """Propose until there is something new to ask for, or the end."""
        while True:
            left = self.plan.population * self.plan.generations - self._spent
            settled = self.plan.least_gain > 0.0 and self._search.settled(self.plan.least_gain)
            searching = left > 0 and self._idle < _IDLE and not settled
            if self._rounds >= self._most_rounds_searched:
                self._propose(self._proposed[:0])
                return
            if searching and len(self._known) != self._space.size:
                self._propose(self._begun_with(self._search.propose(self._generation, self._known))[:left])
            elif self._end_begun().done:
                self._propose(self._proposed[:0])
                return
            else:
                self._propose(self._end_begun().propose())
            if self._cases + len(self._asked) * self.plan.cases_each > self._most_cases_searched:
                self._propose(self._proposed[:0])
                return
            if len(self._asked):
                return
            self._settle()

    def _begun_with(self, coordinates: Floats) -> Floats:
        """A generation; the first one with the known designs in place of as many that were drawn."""
        if self._generation or not len(self._space.start):
            return coordinates
        return np.concatenate([self._space.start, coordinates[len(self._space.start) :]])

    def _propose(self, coordinates: Floats) -> None:
        designs = self._space.designs(coordinates)
        self._proposed, self._keys = coordinates, keys(designs)
        new = {key: i for i, key in reversed(list(enumerate(self._keys))) if key not in self._known}
        self._new = np.array(sorted(new.values()), dtype=np.int64)
        self._asked = designs[self._new]

    def _end_begun(self) -> End:
        """The polish, which starts with the best designs of the search, and where it is done the finish."""
        if self._end is None:
            places, scores = self._search.survivors()
            count = MOST_STARTS if polish_designs(self.plan) else 0
            self._end = Polish(self.plan, self._space, places[:count], scores.outputs[:count])
        if self._end.done and not isinstance(self._end, Finish) and finish_designs(self.plan):
            self._end = self._finish()
        return self._end

    def _designs(self) -> tuple[Floats, Floats]:
        """All designs but those that served derivatives only, in their order, and the outputs of each."""
        known = [(key, outputs) for key, outputs in self._known.items() if key not in self._aside]
        designs = np.frombuffer(b"".join(key for key, _ in known)).reshape(len(known), -1)
        return designs, np.array([own for _, own in known])

    def _unseen(self) -> Floats:
        """The best designs, as `best_places` names them, that were not run with fresh drives."""
        if not self._known:
            return self._proposed[:0]
        designs, outputs = self._designs()
        best = designs[best_places(self.plan, outputs)]
        return best[[key not in self._with_fresh for key in keys(best)]]

    def _finish(self) -> Finish:
        """The finish of the best design known: one whose equalities are met to 1e-6 where there is one."""
        designs, outputs = self._designs()
        scores = judge(self.plan, outputs, equality=MET)
        exact = bool(scores.feasible.any())
        best = int(ranks(scores if exact else judge(self.plan, outputs)).argmin())
        design = designs[best][None]
        place = self._space.coordinates(self._space.cases(design))[1][0]
        return Finish(self.plan, self._space, place, outputs[best], exact=exact)
