"""The search for several goals: NSGA-II, whose survivors are the designs that others do not dominate, evenly spread.

Source: Deb et al. 2002, as of ``ranking``; simulated binary crossover and polynomial mutation with bounds as in its
authors' program. Catalogue values are exchanged between parents and mutated to a neighbour or to any other value.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sprag_study.worker.planning.goals.draws import Draws, power
from sprag_study.worker.planning.goals.ranking import ranks, spread
from sprag_study.worker.planning.goals.scores import joined
from sprag_study.worker.planning.goals.space import keys
from sprag_study.worker.planning.goals.tolerance import Tolerance, tolerant

if TYPE_CHECKING:
    from collections.abc import Container

    from sprag_study.worker.planning.goals.scores import Scores
    from sprag_study.worker.planning.goals.space import Space

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

#: Distribution indices of crossover and of mutation, and the probability of a crossover.
_CROSSOVER, _MUTATION = 15.0, 20.0
_CROSSED = 0.9
#: Times that designs which are known are drawn again.
_ATTEMPTS = 20


@dataclass(frozen=True)
class _Survivors:
    """Designs in the order of their ranks, then of their crowding distances; shapes (designs, ...)."""

    coordinates: Floats
    scores: Scores
    rank: Ints
    crowding: Floats


class Nsga2:
    """The survivors so far, and how the next generation follows from them."""

    def __init__(self, space: Space, population: int, seed: int) -> None:
        self._space, self._population, self._seed = space, population, seed
        self._tolerance = Tolerance()
        #: The best by the limits as they are, and the parents of the next generation, by violations tolerated now.
        self._best: _Survivors | None = None
        self._parents: _Survivors | None = None

    def propose(self, generation: int, known: Container[bytes]) -> Floats:
        """Coordinates of new designs, shape (at most ``population``, dimensions)."""
        draws = Draws(self._seed, generation)
        found = np.empty((0, self._space.dimensions))
        seen: set[bytes] = set()
        for _ in range(_ATTEMPTS):
            missing = self._population - len(found)
            if missing == 0:
                break
            drawn = self._space.centred(self._drawn(draws, missing))
            new = np.zeros(len(drawn), dtype=np.bool_)
            for i, key in enumerate(keys(self._space.designs(drawn))):
                new[i] = key not in known and key not in seen
                seen.add(key)
            found = np.concatenate([found, drawn[new]])
        return found

    def take(self, coordinates: Floats, scores: Scores) -> None:
        """Choose survivors among the old ones and these designs."""
        epsilon = self._tolerance.next(scores)
        best = self._chosen(self._best, coordinates, scores, 0.0)
        self._parents = self._chosen(self._parents, coordinates, scores, epsilon) if epsilon > 0.0 else best
        self._best = best

    def settled(self, _least: float, /) -> bool:
        """Never: how far a front can still move is not known."""
        return False

    def survivors(self) -> tuple[Floats, Scores]:
        """The best designs so far, the first fronts first, those with far neighbours first within a front."""
        assert self._best is not None
        return self._best.coordinates, self._best.scores

    def _chosen(self, old: _Survivors | None, coordinates: Floats, scores: Scores, epsilon: float) -> _Survivors:
        if old is not None:
            coordinates, scores = np.concatenate([old.coordinates, coordinates]), joined(old.scores, scores)
        # Without goals, designs are spread over the space of the variables.
        apart = scores.goals if scores.goals.shape[1] else coordinates
        rank = ranks(tolerant(scores, epsilon))
        chosen: list[Ints] = []
        distances: list[Floats] = []
        room = min(self._population, len(rank))
        for front in range(int(rank.max()) + 1):
            members = np.flatnonzero(rank == front)
            kept, distance = spread(apart[members], min(room, len(members)))
            chosen.append(members[kept])
            distances.append(distance)
            room -= len(kept)
            if room == 0:
                break
        places, distance = np.concatenate(chosen), np.concatenate(distances)
        order = np.lexsort((-distance, rank[places]))
        places = places[order]
        return _Survivors(coordinates[places], scores[places], rank[places], distance[order])

    def _drawn(self, draws: Draws, count: int) -> Floats:
        if self._parents is None:
            return _latin(draws, count, self._space.dimensions)
        pairs = (count + 1) // 2
        mothers, fathers = _winners(draws, self._parents, pairs), _winners(draws, self._parents, pairs)
        children = _crossed(draws, mothers, fathers, self._space.counts)
        return _mutated(draws, children, self._space.counts)[:count]


def _winners(draws: Draws, parents: _Survivors, count: int) -> Floats:
    """Winners of tournaments of two, which are drawn so that each parent takes part in as many as any other."""
    size = len(parents.rank)
    rounds = -(-2 * count // size)
    drawn = np.concatenate([draws.permutation(size) for _ in range(rounds)])[: 2 * count].reshape(count, 2)
    one, other = drawn.T
    better = parents.rank[one] < parents.rank[other]
    better |= (parents.rank[one] == parents.rank[other]) & (parents.crowding[one] >= parents.crowding[other])
    return parents.coordinates[np.where(better, one, other)]


def _latin(draws: Draws, count: int, dimensions: int) -> Floats:
    """A Latin hypercube: each of ``count`` equal intervals of each coordinate has one design."""
    places = np.stack([draws.permutation(count) for _ in range(dimensions)], axis=1)
    return (places + draws.uniforms(count, dimensions)) / count


def _crossed(draws: Draws, mothers: Floats, fathers: Floats, counts: Ints) -> Floats:
    """Two children of each pair, by simulated binary crossover; shape (2 x pairs, dimensions)."""
    shape = mothers.shape
    crossing = draws.uniforms(shape[0], 1) < _CROSSED
    crossing = crossing & (draws.uniforms(*shape) < 0.5)
    place, exchange = draws.uniforms(*shape), draws.uniforms(*shape) < 0.5
    low, high = np.minimum(mothers, fathers), np.maximum(mothers, fathers)
    first, second = np.where(crossing & exchange, fathers, mothers), np.where(crossing & exchange, mothers, fathers)
    blend = crossing & (high - low > 1e-14) & (counts == 0)
    low, high, place, exchange = low[blend], high[blend], place[blend], exchange[blend]
    apart, middle = high - low, 0.5 * (low + high)
    below = middle - 0.5 * apart * _spread(place, 1.0 + 2.0 * low / apart)
    above = middle + 0.5 * apart * _spread(place, 1.0 + 2.0 * (1.0 - high) / apart)
    first[blend] = np.where(exchange, above, below)
    second[blend] = np.where(exchange, below, above)
    children: Floats = np.minimum(np.maximum(np.concatenate([first, second]), 0.0), 1.0)
    return children


def _spread(place: Floats, room: Floats) -> Floats:
    """The factor of the distance of the parents at a uniform ``place``; ``room`` keeps children within the bounds."""
    scaled = place * (2.0 - power(room, -(_CROSSOVER + 1.0)))
    return power(np.where(scaled <= 1.0, scaled, 1.0 / (2.0 - scaled)), 1.0 / (_CROSSOVER + 1.0))


def _mutated(draws: Draws, designs: Floats, counts: Ints) -> Floats:
    """The designs, each coordinate mutated with a probability of one over their number."""
    shape = designs.shape
    mutating = draws.uniforms(*shape) < 1.0 / shape[1]
    place, far = draws.uniforms(*shape), draws.uniforms(*shape)
    moved = designs.copy()
    here = mutating & (counts == 0)
    moved[here] = _moved(designs[here], place[here])
    for i in np.flatnonzero(counts).tolist():
        here = mutating[:, i]
        moved[here, i] = _other_value(designs[here, i], int(counts[i]), place[here, i], far[here, i])
    return moved


def _moved(values: Floats, place: Floats) -> Floats:
    """Polynomial mutation of values in [0, 1] by uniform numbers."""
    up = place >= 0.5
    room = power(np.where(up, values, 1.0 - values), _MUTATION + 1.0)
    twice = np.where(up, 2.0 * (1.0 - place), 2.0 * place)
    step = 1.0 - power(twice + (1.0 - twice) * room, 1.0 / (_MUTATION + 1.0))
    moved: Floats = np.minimum(np.maximum(values + np.where(up, step, -step), 0.0), 1.0)
    return moved


def _other_value(values: Floats, count: int, place: Floats, far: Floats) -> Floats:
    """Coordinates of other values of a catalogue: a neighbour, or in half of the cases any other."""
    now = np.minimum(np.floor(values * count), count - 1.0)
    neighbour = np.where(place < 0.5, now - 1.0, now + 1.0)
    neighbour = np.where((neighbour < 0.0) | (neighbour >= count), 2.0 * now - neighbour, neighbour)
    step = 1.0 + np.floor(place * (count - 1))
    anywhere = now + step - np.where(now + step >= count, float(count), 0.0)
    new = np.minimum(np.maximum(np.where(far < 0.5, neighbour, anywhere), 0.0), count - 1.0)
    return np.asarray((new + 0.5) / count)
