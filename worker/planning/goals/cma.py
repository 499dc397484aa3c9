"""The search for one goal: CMA-ES, which adapts the covariance of a normal distribution to the best of its draws.

Source: N. Hansen, "The CMA Evolution Strategy: A Tutorial", arXiv:1604.00772, with negative weights. Draws use the
Cholesky factor of the covariance (O. Krause, D. R. Arbones, C. Igel, "CMA-ES with optimal covariance update and storage
complexity", NIPS 2016). What this search adds:

- **bounds**: what is drawn beyond them is reflected, and the distribution is updated by what was drawn;
- **limits**: designs whose violation is tolerated (``tolerance``) compete by their goal, the others by violation, as by
  M. Hellwig and H.-G. Beyer, CEC 2018;
- **catalogues**: a coordinate's deviation is kept so large that its next value is drawn with a probability of at least
  1 / (variables x population) (the margin of R. Hamano et al., GECCO 2022);
- **restarts**: where the draws no longer differ, from a random place, with as many draws or with twice as many (IPOP:
  A. Auger, N. Hansen, "A restart CMA evolution strategy with increasing population size", CEC 2005).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.draws import Draws, exponential, logarithm, normal_quantile
from sprag_study.worker.planning.goals.linear import cholesky, lower_solved, norm, weighted_sum
from sprag_study.worker.planning.goals.plan import POPULATION
from sprag_study.worker.planning.goals.ranking import ranks
from sprag_study.worker.planning.goals.scores import Scores, joined
from sprag_study.worker.planning.goals.space import keys
from sprag_study.worker.planning.goals.tolerance import Tolerance, tolerant

if TYPE_CHECKING:
    from collections.abc import Container

    from sprag_study.worker.planning.goals.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: First deviation, in widths of the ranges; the least one before a restart, and where a finish does the rest.
_DEVIATION, LEAST, LEAST_BEFORE_FINISH = 0.3, 1e-12, 1e-3
#: Designs kept as the best.
_KEPT = 20
#: Random numbers of restarts are apart from those of generations.
_RESTARTS = 1 << 32


class _Rates:
    """Weights and learning rates, the tutorial's defaults for n variables and a population."""

    def __init__(self, n: int, population: int) -> None:
        ranks_from_one = np.arange(1, population + 1, dtype=np.float64)
        raw = float(logarithm(np.array([(population + 1) / 2.0]))[0]) - logarithm(ranks_from_one)
        positive, negative = np.where(raw > 0.0, raw, 0.0), np.where(raw < 0.0, raw, 0.0)
        total, total_squares = math.fsum(positive.tolist()), math.fsum((positive * positive).tolist())
        lost, lost_squares = math.fsum(negative.tolist()), math.fsum((negative * negative).tolist())
        self.effective = total * total / total_squares
        effective_lost = lost * lost / lost_squares
        mu = self.effective
        self.path_c = (4.0 + mu / n) / (n + 4.0 + 2.0 * mu / n)
        self.path_s = (mu + 2.0) / (n + mu + 5.0)
        self.damping = 1.0 + self.path_s + 2.0 * max(0.0, math.sqrt((mu - 1.0) / (n + 1.0)) - 1.0)
        self.one = 2.0 / ((n + 1.3) * (n + 1.3) + mu)
        self.many = min(1.0 - self.one, 2.0 * (0.25 + mu + 1.0 / mu - 2.0) / ((n + 2.0) * (n + 2.0) + mu))
        least = min(
            1.0 + self.one / self.many,
            1.0 + 2.0 * effective_lost / (mu + 2.0),
            (1.0 - self.one - self.many) / (n * self.many),
        )
        self.positive = positive / total
        self.weights = self.positive - negative / lost * least
        self.length = math.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))


class Cma:
    """The distribution so far, and how the next generation follows from it."""

    def __init__(
        self, space: Space, population: int, seed: int, *, growing: bool = False, least: float = LEAST
    ) -> None:
        self._space, self._seed, self._growing, self._least = space, seed, growing, least
        self._populate(population)
        self._tolerance = Tolerance()
        self._generation = 0
        self._best: tuple[Floats, Scores] | None = None
        #: Violation and goal of the best design when the run began, and what the last run gained, relative.
        self._begun: tuple[float, float] | None = None
        self._gained = math.inf
        self._start(np.full(space.dimensions, 0.5))

    def _populate(self, population: int) -> None:
        """Begin with generations of that many designs."""
        n = self._space.dimensions
        self._population, self._rates = population, _Rates(n, population)
        self._quantile = normal_quantile(min(0.25, 1.0 / (n * population)))

    def _start(self, mean: Floats) -> None:
        n = self._space.dimensions
        self._mean, self._deviation = mean, _DEVIATION
        self._covariance, self._factor = np.eye(n), np.eye(n)
        self._path_s, self._path_c = np.zeros(n), np.zeros(n)
        self._since = 0
        self._lasts: list[tuple[float, float]] = []
        self._stretch = self._margins()

    def propose(self, generation: int, known: Container[bytes]) -> Floats:
        """Coordinates of the designs of a generation, shape (population, dimensions); some may be known."""
        self._draw(generation)
        designs = self._space.designs(self._space.centred(self._coordinates))
        if all(key in known for key in keys(designs)):
            self._restart(generation)
            self._draw(generation)
        return self._space.centred(self._coordinates)

    def _restart(self, generation: int) -> None:
        """End the run, and begin another one."""
        best = None if self._best is None else (float(self._best[1].violation[0]), float(self._best[1].goals[0, 0]))
        self._gained = math.inf
        if self._begun is not None and best is not None and self._begun[0] == best[0] == 0.0:
            self._gained = (self._begun[1] - best[1]) / max(abs(self._begun[1]), 1e-300)
        self._begun = best
        if self._growing:
            self._populate(min(2 * self._population, POPULATION[1]))
        self._start(Draws(self._seed, _RESTARTS + generation).uniforms(self._space.dimensions))

    def settled(self, least: float, /) -> bool:
        """Whether a run that began anew has ended, and its best design is better by at most that share of the goal."""
        return self._gained <= least

    def _draw(self, generation: int) -> None:
        self._normals = Draws(self._seed, generation).normals(self._population, self._space.dimensions)
        steps = np.zeros_like(self._normals)
        for j in range(self._space.dimensions):
            steps += self._normals[:, j, None] * self._factor[:, j]
        self._steps = steps
        drawn = self._mean + self._deviation * self._stretch * steps
        folded = drawn - 2.0 * np.floor(0.5 * drawn)
        self._coordinates = np.minimum(folded, 2.0 - folded)

    def take(self, coordinates: Floats, scores: Scores) -> None:
        """Adapt the distribution to the scores of the designs proposed last."""
        self._generation += 1
        self._keep(coordinates, scores)
        order = _order(tolerant(scores, self._tolerance.next(scores)))
        first = order[0]
        if not np.array_equal(coordinates, self._space.centred(self._coordinates)):
            self._reconstruct(coordinates)
        if len(order) < POPULATION[0]:
            return
        self._update(order)
        self._lasts.append((float(scores.violation[first]), float(scores.goals[first, 0])))
        if self._converged(scores[order]):
            self._restart(self._generation)

    def _reconstruct(self, coordinates: Floats) -> None:
        """Take designs that were not drawn here as draws, shortened where they are far for the distribution."""
        turns = np.round(0.5 * (self._mean - coordinates)), np.round(0.5 * (self._mean + coordinates))
        near, mirrored = coordinates + 2.0 * turns[0], 2.0 * turns[1] - coordinates
        closer = np.abs(near - self._mean) <= np.abs(mirrored - self._mean)
        steps = (np.where(closer, near, mirrored) - self._mean) / (self._deviation * self._stretch)
        normals = np.array([lower_solved(self._factor, step) for step in steps])
        n = self._space.dimensions
        lengths = np.array([norm(row) for row in normals])
        shorter = np.minimum(1.0, (math.sqrt(n) + 2.0 * n / (n + 2.0)) / np.maximum(lengths, 1e-300))[:, None]
        self._steps, self._normals = steps * shorter, normals * shorter

    def survivors(self) -> tuple[Floats, Scores]:
        """The best designs so far, the best first."""
        assert self._best is not None
        return self._best

    def _keep(self, coordinates: Floats, scores: Scores) -> None:
        if self._best is not None:
            coordinates = np.concatenate([self._best[0], coordinates])
            scores = joined(self._best[1], scores)
        first = np.sort(np.unique(coordinates, axis=0, return_index=True)[1])
        chosen = first[np.argsort(ranks(scores[first]), kind="stable")][:_KEPT]
        self._best = coordinates[chosen], scores[chosen]

    def _update(self, order: Ints) -> None:
        n = self._space.dimensions
        rates = self._rates if len(order) == self._population else _Rates(n, len(order))
        steps, normals = self._steps[order], self._normals[order]
        step, normal = weighted_sum(rates.positive, steps), weighted_sum(rates.positive, normals)
        self._mean = self._mean + self._deviation * self._stretch * step
        self._since += 1
        self._path_s = (1.0 - rates.path_s) * self._path_s + math.sqrt(
            rates.path_s * (2.0 - rates.path_s) * rates.effective
        ) * normal
        length = norm(self._path_s)
        decay = 1.0 - math.prod([1.0 - rates.path_s] * (2 * min(self._since, 10_000)))
        moving = length / math.sqrt(decay) < (1.4 + 2.0 / (n + 1.0)) * rates.length
        self._path_c = (1.0 - rates.path_c) * self._path_c
        if moving:
            self._path_c = self._path_c + math.sqrt(rates.path_c * (2.0 - rates.path_c) * rates.effective) * step
        squares = np.array([math.fsum(row) for row in (normals * normals).tolist()])
        weights = np.where(rates.weights >= 0.0, rates.weights, rates.weights * n / np.maximum(squares, 1e-300))
        lost = 0.0 if moving else rates.one * rates.path_c * (2.0 - rates.path_c)
        keep = 1.0 + lost - rates.one - rates.many * math.fsum(rates.weights.tolist())
        self._covariance = (
            keep * self._covariance
            + rates.one * self._path_c[:, None] * self._path_c
            + rates.many * weighted_sum(weights, steps[:, :, None] * steps[:, None, :])
        )
        growth = rates.path_s / rates.damping * (length / rates.length - 1.0)
        self._deviation *= float(exponential(np.array([min(1.0, growth)]))[0])
        self._stretch = self._margins()

    def _margins(self) -> Floats:
        """Factors of the deviations of catalogue coordinates that keep their next values within reach."""
        stretch = np.ones(self._space.dimensions)
        for i in np.flatnonzero(self._space.counts):
            count = int(self._space.counts[i])
            folded = self._mean[i] - 2.0 * math.floor(0.5 * self._mean[i])
            place = min(folded, 2.0 - folded) * count
            cell = min(math.floor(place), count - 1)
            away = [place - cell] * (cell > 0) + [cell + 1 - place] * (cell < count - 1)
            if away:
                own = self._deviation * math.sqrt(self._covariance[i, i])
                stretch[i] = max(1.0, min(away) / count / (self._quantile * own))
        return stretch

    def _converged(self, ordered: Scores) -> bool:
        """Whether a restart is due; otherwise the factor of the covariance is current."""
        try:
            self._factor = cholesky(self._covariance)
        except ValueError:
            return True
        widest = self._deviation * math.sqrt(float(np.diag(self._covariance).max()))
        if not self._least < widest < 1e3:
            return True
        window = 10 + math.ceil(30 * self._space.dimensions / self._population)
        self._lasts = self._lasts[-window:]
        if len(self._lasts) < window:
            return False
        goals = [goal for _, goal in self._lasts] + [float(ordered.goals[len(ordered) // 2, 0])]
        flat = max(goals) - min(goals) <= 1e-14 * max(map(abs, goals))
        return flat and len({violation for violation, _ in self._lasts}) == 1


def _order(scores: Scores) -> Ints:
    """From the best to the worst: by violation, and where that is the same by the goal."""
    return np.lexsort((scores.goals[:, 0], scores.violation)).astype(np.int64)
