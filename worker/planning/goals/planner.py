"""The planner of a search for designs: generations, then the polish of equalities."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.cma import Cma
from sprag_study.worker.planning.goals.nsga2 import Nsga2
from sprag_study.worker.planning.goals.polish import MOST_STARTS, MOST_TRIALS, Polish, polish_designs
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


class GoalPlanner:
    """Searches for the best designs (`sprag_study.worker.planning.rounds.Planner`).

    One goal is searched for by CMA-ES, several or none by NSGA-II; then equalities are polished.

    A round is a generation, without the designs that were evaluated before, or a step of the polish. Columns of the
    points are the variables of the plan in their order, then the paths of its operating points, then the drive; the
    cases of a design, one for each operating point and drive, are stored next to each other.
    """

    def __init__(self, plan: GoalPlan) -> None:
        self.plan = plan
        self._space = Space(plan)
        self._search: Search
        if len(plan.best) == 1:
            self._search = Cma(self._space, plan.population, plan.seed)
        else:
            self._search = Nsga2(self._space, plan.population, plan.seed)
        self._known: dict[bytes, Floats] = {}
        self._record = Record(plan)
        self._generation = self._idle = self._rounds = self._cases = 0
        self._polish: Polish | None = None
        self._proposed = np.empty((0, self._space.dimensions))
        self._keys: list[bytes] = []
        #: Of the proposed designs, those that are not known: their places, and they themselves.
        self._new = np.empty(0, dtype=np.int64)
        self._asked = np.empty((0, self._space.dimensions))
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
        """Cases of a search in which no design comes twice, with the longest polish."""
        return (self._most_searched + polish_designs(self.plan)) * self.plan.cases_each

    @property
    def most_rounds(self) -> int:
        """Generations, each with a new design, and the rounds of the polish."""
        generations = min(self.plan.generations, self._most_searched)
        return generations + (1 + MOST_TRIALS if polish_designs(self.plan) else 0)

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
        return Step(self._space.cases(self._asked), self._record.summary(self._phase()))

    def best(self) -> tuple[Floats, Scores]:
        """The best designs of the search so far, the survivors of its last generation: variables in SI and scores."""
        coordinates, scores = self._search.survivors()
        return self._space.designs(coordinates), scores

    def _phase(self) -> str:
        if not len(self._asked):
            return "ended"
        return "search" if self._polish is None else "polish"

    def _settle(self) -> None:
        """Hand the outputs of what was proposed to the search or to the polish."""
        if not self._keys:
            scores = self._search.survivors()[1][:0]
        else:
            scores = judge(self.plan, np.array([self._known[key] for key in self._keys]))
        if self._polish is not None:
            if self._polish.differentiates:
                self._record.differentiated(scores[self._new])
            else:
                self._record.polished(scores[self._new])
            self._polish.take(scores.outputs)
            return
        if len(scores):
            self._search.take(self._proposed, scores)
        self._idle = 0 if len(self._asked) else self._idle + 1
        self._generated(scores[self._new])

    def _others(self, coordinates: Floats, scores: Scores) -> None:
        """Take designs that another planner asked for: as a generation, or beside the polish, which asks again."""
        if self._polish is not None or not len(self._asked):
            self._record.polished(scores)
            return
        self._search.take(coordinates, scores)
        self._generated(scores)

    def _generated(self, new: Scores) -> None:
        self._generation += 1
        self._record.generation(new, self._search.survivors()[1])

    def _next(self) -> None:
        """Propose until there is something new to ask for, or the end."""
        while True:
            searching = self._generation < self.plan.generations and self._idle < _IDLE
            if self._rounds >= self.most_rounds:
                self._propose(self._proposed[:0])
                return
            if searching and len(self._known) != self._space.size:
                self._propose(self._begun_with(self._search.propose(self._generation, self._known)))
            elif self._polish_begun().done:
                self._propose(self._proposed[:0])
                return
            else:
                self._propose(self._polish_begun().propose())
            if self._cases + len(self._asked) * self.plan.cases_each > self.most_cases:
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

    def _polish_begun(self) -> Polish:
        """The polish; it starts with the best designs of the search."""
        if self._polish is None:
            places, scores = self._search.survivors()
            count = MOST_STARTS if polish_designs(self.plan) else 0
            self._polish = Polish(self.plan, self._space, places[:count], scores.outputs[:count])
        return self._polish
