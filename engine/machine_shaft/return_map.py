"""The return map of a machine: the kinetic energy at the angle 0 after a cycle, by that before it.

T' = M(phi, T) has one variable, so that its motions cannot cross: the map rises, and its fixed points are the steady
cycles (J. Guckenheimer, P. Holmes, *Nonlinear Oscillations, Dynamical Systems, and Bifurcations of Vector Fields*,
section 1.5). Many starts are followed at once by Gauss's collocation, from panel to panel of the cycle. A panel that
does not resolve a motion is halved for this motion, as often as needed.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from sprag_study.engine import elementary
from sprag_study.engine.machine_shaft import kernels
from sprag_study.engine.machine_shaft.motor import characteristic, motor_torque
from sprag_study.engine.machine_shaft.operations import SpeedLaw
from sprag_study.engine.machine_shaft.panels import POSITIONS, RUNNING, TAIL, WEIGHTS, apply
from sprag_study.engine.machine_shaft.transient_bench import Bench

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]
#: Pieces of a motion: the end of each in rad, and the energies at its nodes.
Trace = list[tuple[float, Floats]]

_ITERATIONS = 25
#: Last two Legendre coefficients of a torque, over the largest energy of a panel.
_ROUGH = 1e-11
#: Pieces for each panel on average, in one call of the map; backwards a third of them.
_PIECES = 40
#: Halvings of a panel after which a motion counts although it has a kink there, and the most.
_KINKED, _MOST = 14, 45
#: Energy at which a shaft that could not be followed has stopped, as a share of the one at its pace.
_REST = 1e-10
#: Energies, as shares of the one at the start of a panel, at which the torque is asked whether it stops the shaft.
_SHARES = np.array([1.0, 0.7, 0.4, 0.1, 0.01, 1e-4])


@dataclass(frozen=True, slots=True)
class _Piece:
    """A part of a panel: its half length, and inertia, fixed torque and following torques at its nodes."""

    half: float
    inertia: Floats
    fixed: Floats
    law: SpeedLaw | None


@dataclass(frozen=True, slots=True)
class Returns:
    """Motions over one cycle.

    Attributes
    ----------
    energy : array, shape (n,)
        Kinetic energy in J at the end; 0 where the shaft stops on the way.
    growth : array, shape (n,)
        The derivative of that energy by the one at the beginning.
    stopped, lost : arrays of bool, shape (n,)
        Where the shaft stops; where a torque is not known, or the motion was not resolved.
    """

    energy: Floats
    growth: Floats
    stopped: Bools
    lost: Bools


class ReturnMap:
    """The map of a machine on its bench, with a factor on the torque of its operations."""

    def __init__(self, bench: Bench, load: float = 1.0) -> None:
        self._bench, self._load = bench, load
        self._fixed = bench.fixed(load)
        self._motor = characteristic(bench.model.drive) if bench.motor else None
        self._values = {name: value[0, 0] for name, value in bench.motor.items()}
        self._scale = float(0.5 * bench.fields.inertia.max() * np.square(bench.machine.pace).max())
        self._left = 0
        self._pieces: dict[tuple[float, float], _Piece] = {}

    def _piece(self, low: float, high: float) -> _Piece:
        """The part of the cycle between two angles of one panel."""
        kept = self._pieces.get((low, high))
        if kept is None:
            half = 0.5 * (high - low)
            angles = np.clip(low + half * (1.0 + POSITIONS), low, np.nextafter(high, 0.0))
            inertia, fixed = (self._bench.at(part, angles) for part in (self._bench.fields.inertia, self._fixed))
            kept = _Piece(half, inertia, fixed, self._bench.law_at(angles[None, None, :], self._load))
            self._pieces[low, high] = kept
        return kept

    def torque(self, piece: _Piece, energy: Floats) -> tuple[Floats, Floats]:
        """Torque in N*m on the shaft at energies (n, nodes), and its derivative by them."""
        omega = np.sqrt(2.0 * energy / piece.inertia)
        total, by_speed = np.broadcast_to(piece.fixed, omega.shape), np.zeros(omega.shape)
        if self._motor is not None:
            torque, slope = motor_torque(self._motor, self._values, omega)
            total, by_speed = total + torque, by_speed + slope
        if piece.law is not None:
            torque, slope = (part[:, 0, :] for part in piece.law(omega[:, None, :]))
            total, by_speed = total + torque, by_speed + slope
        return total, by_speed / (piece.inertia * omega)

    def mean_torque(self, omega: Floats) -> Floats:
        """Mean torque in N*m over the cycle of a shaft that turns evenly at ``omega`` (n,), in rad/s."""
        total = np.zeros(len(omega))
        cuts = np.unique(self._bench.panels.cuts[0])
        for low, high in pairwise(cuts.tolist()):
            piece = self._piece(low, high)
            torque = self.torque(piece, 0.5 * piece.inertia * np.square(omega)[:, None])[0]
            total += piece.half * apply(WEIGHTS[None, :], torque)[:, 0]
        return np.asarray(total / cuts[-1])

    def _collocated(self, piece: _Piece, begin: Floats, backward: bool) -> tuple[Floats, Floats, Floats, Floats]:
        """Energies at the nodes, that at the other end, its derivative by ``begin``, and the error; inf if none."""
        matrix = piece.half * (RUNNING - WEIGHTS if backward else RUNNING)
        weights = (-piece.half if backward else piece.half) * WEIGHTS[None, :]
        count = len(begin)
        energy = np.repeat(begin[:, None], len(WEIGHTS), axis=1)
        done, active = np.zeros(count, dtype=np.bool_), np.arange(count)
        for _ in range(_ITERATIONS):
            tried = energy[active]
            torque, slope = self.torque(piece, tried)
            left = begin[active, None] + apply(matrix, torque) - tried
            known = np.isfinite(left).all(axis=1) & np.isfinite(slope).all(axis=1)
            active, tried, left, slope = active[known], tried[known], left[known], slope[known]
            if not active.size:
                break
            step = np.empty(tried.shape)
            kernels.newton_steps(matrix, np.ascontiguousarray(slope), np.ascontiguousarray(left), step)
            following = tried + step
            # The torques of energies below 0 are not known.
            following = np.maximum(following, 1e-3 * tried)
            moved = np.abs(following - tried).max(axis=1) / np.abs(following).max(axis=1)
            energy[active] = following
            done[active[moved < 1e-13]] = True
            active = active[moved >= 1e-13]
            if not active.size:
                break
        torque, slope = self.torque(piece, energy)
        error = np.abs(apply(piece.half * TAIL, torque)).sum(axis=1) / energy.max(axis=1)
        residue = np.abs(begin[:, None] + apply(matrix, torque) - energy).max(axis=1) / energy.max(axis=1)
        end = begin + apply(weights, torque)[:, 0]
        sound = (done | (residue < 1e-12)) & (end > 0.0) & np.isfinite(end)
        error = np.where(sound, np.maximum(error, np.where(residue < 1e-11, 0.0, residue)), np.inf)
        growth = elementary.exp(apply(weights, slope)[:, 0])
        return energy, end, growth, error

    def _stops(self, piece: _Piece, begin: Floats, backward: bool) -> Bools:
        """Whether the torque at every energy up to that of the beginning takes all of it within the piece."""
        sign = -1.0 if backward else 1.0
        most = np.full(len(begin), -np.inf)
        for share in _SHARES:
            energy = np.repeat(share * begin[:, None], len(WEIGHTS), axis=1)
            most = np.maximum(most, (sign * self.torque(piece, energy)[0]).max(axis=1))
        return np.asarray(2.0 * piece.half * most < -1.05 * begin)

    def _over(self, low: float, high: float, begin: Floats, backward: bool, depth: int, trace: Trace | None) -> Returns:
        """Follow motions over a part of a panel."""
        piece, count = self._piece(low, high), len(begin)
        nodes, energy, growth, error = self._collocated(piece, begin, backward)
        out = Returns(energy, growth, np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_))
        again = ~(error <= (_ROUGH if depth < _KINKED else 1e-7))
        if not again.any():
            if trace is not None:
                trace.append((low if backward else high, nodes))
            return out
        rows = np.nonzero(again)[0]
        ends = self._stops(piece, begin[rows], backward)
        self._left -= 1
        last = depth >= _MOST or self._left < 0
        if last:
            ends |= begin[rows] < _REST * self._scale
        out.stopped[rows[ends]] = True
        rows = rows[~ends]
        if last:
            out.lost[rows] = True
        elif rows.size:
            middle = 0.5 * (low + high)
            halves = ((middle, high), (low, middle)) if backward else ((low, middle), (middle, high))
            self._chain(out, rows, begin[rows], halves, backward, depth + 1, trace)
        out.energy[out.stopped | out.lost] = 0.0
        return out

    def _chain(
        self, out: Returns, rows: NDArray[np.int64], begin: Floats, parts: tuple[tuple[float, float], ...],
        backward: bool, depth: int, trace: Trace | None,
    ) -> None:  # fmt: skip
        """Follow the motions ``rows`` of ``out`` over parts of the cycle, one after the other."""
        energy, growth = begin.copy(), np.ones(len(begin))
        turning = np.arange(len(begin))
        for low, high in parts:
            after = self._over(low, high, energy[turning], backward, depth, trace)
            energy[turning], growth[turning] = after.energy, growth[turning] * after.growth
            out.stopped[rows[turning]], out.lost[rows[turning]] = after.stopped, after.lost
            turning = turning[~(after.stopped | after.lost)]
            if not turning.size:
                break
        out.energy[rows], out.growth[rows] = energy, growth

    def follow(self, begin: Floats, *, backward: bool = False, trace: Trace | None = None) -> Returns:
        """Follow motions over one cycle, from their energies (n,) in J at the angle 0, or back in the angle.

        ``trace`` gets the pieces of the motion, of one start only: the end of each, and the energies at its nodes.
        """
        count = len(begin)
        out = Returns(np.zeros(count), np.ones(count), np.zeros(count, dtype=np.bool_), np.zeros(count, dtype=np.bool_))
        parts = list(pairwise(np.unique(self._bench.panels.cuts[0]).tolist()))
        self._left = (_PIECES // 3 if backward else _PIECES) * len(parts)
        with np.errstate(all="ignore"):
            self._chain(out, np.arange(count), begin, tuple(parts[::-1] if backward else parts), backward, 0, trace)
        return out
