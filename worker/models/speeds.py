"""The steady cycles of a case; `sprag_study.worker.models.abilities` computes them."""

from sprag_study.engine.machine_shaft.steady_cycles import SteadyCycle, SteadyCycles

__all__ = ["SteadyCycle", "SteadyCycles"]
