"""Specs written in Python.

Made of the descriptions of the spec by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Literal, Self

from sprag_study.service.client.case_tables import measured_of
from sprag_study.service.client.drafts import (
    Draft,
    Entries,
    Quantity,
    Results,
    known,
    refined_results,
    results_of,
    sensors_of,
)


class Studies(Draft):
    """A draft of any model, with a method for each kind of study."""

    def refine(
        self,
        *,
        results: Results,
        error: Quantity | None = None,
        start: int | None = None,
        finest: Any | None = None,
        most: int | None = None,
    ) -> Self:
        """Curves (one adaptive axis) or maps (two), refined until they are accurate to the given error.

        Parameters
        ----------
        results : values
            The results that must be accurate to within the error, or to within an error of their own.
        error : number or text with a unit, optional
            Largest error of straight lines between the points, relative to the range of the result: 0.01 % to 20 %.
        start : int, optional
            Values of an adaptive axis in the first round, a power of 2 and 1; by default 17, of a map 9.
        finest : values, optional
            Smallest interval, as a fraction of the axis, one over a power of 2: "1/16" to "1/4096".
        most : int, optional
            Bound of the cases of all rounds.
        """
        return self._with(
            refine=known(results=refined_results(results), error=error, start=start, finest=finest, most=most)
        )

    def goal(
        self,
        *,
        vary: Entries,
        best: Results | None = None,
        subject_to: Results | None = None,
        at: Sequence[Any] | None = None,
        start: Sequence[Any] | None = None,
        over: Literal["worst", "mean", "best"] | None = None,
        population: int | None = None,
        generations: int | None = None,
        seed: int | None = None,
        least_gain: Quantity | None = None,
        polish: bool | None = None,
        fresh_drives: int | None = None,
    ) -> Self:
        """What a design should reach, and what may vary for it.

        Parameters
        ----------
        vary : values
            What may vary: over a range, among listed values, or among components.
        best : values, optional
            Results that are to be as small, or with max as large, as possible.
        subject_to : values, optional
            What a feasible design must fulfil.
        at : values, optional
            Parameters of each operating point, and its `name` if it has one; by default one, that of the base; fields
            name.
        start : values, optional
            Known designs, which the first generation has: the values of what varies, by default those of `base`: {} is
            the design of `base`.
        over : values, optional
            What counts of several operating points: the worst one, the mean, or the best one.
        population : int, optional
            Designs of one generation.
        generations : int, optional
            Generations, each chosen from the ones before.
        seed : int, optional
            Seed of the random numbers.
        least_gain : number or text with a unit, optional
            A search for one goal ends where starting anew has bettered the goal by at most this share; 0: after all
            generations: 0 % to 100 %.
        polish : bool, optional
            Whether equalities are met exactly at the end, and one goal is brought to its optimum by derivatives.
        fresh_drives : int, optional
            With tolerances: drives that the search has not seen, with which its best designs are run at the end; 0:
            none.
        """
        return self._choosing(
            goal=known(
                vary=self._entries(vary, "values"),
                best=results_of(best),
                subject_to=results_of(subject_to),
                at=at,
                start=start,
                over=over,
                population=population,
                generations=generations,
                seed=seed,
                least_gain=least_gain,
                polish=polish,
                fresh_drives=fresh_drives,
            )
        )

    def calibrate(
        self,
        *,
        unknown: Entries,
        measured: Any,
        sensors: Results | None = None,
        loss: Literal["linear", "soft_l1", "huber", "cauchy"] | None = None,
        refits: int | None = None,
        seed: int | None = None,
    ) -> Self:
        """Measured points, and the parameters that they are to determine.

        Parameters
        ----------
        unknown : values
            What is unknown, each between two values; fields path, from, to, prior; needed: path, from, to.
        measured : table
            A frame, a mapping of columns or a sequence of mappings, as `cases` of `sprag.run`, or {"csv": text}; a cell
            without a value was not measured.
        sensors : values, optional
            Gain and offset of sensors, each of a measured result; others read it as it is; fields result, gain, offset;
            needed: result.
        loss : values, optional
            How much a large residual counts: linear (least squares), or less with the others.
        refits : int, optional
            Refits of the bootstrap, which gives the intervals; 0 for none.
        seed : int, optional
            Seed of the random numbers.
        """
        return self._choosing(
            calibrate=known(
                unknown=self._entries(unknown, "values"),
                measured=measured_of(measured),
                sensors=sensors_of(sensors),
                loss=loss,
                refits=refits,
                seed=seed,
            )
        )

    def starts(self, *, ranges: Mapping[str, Any], count: int | None = None, seed: int | None = None) -> Self:
        """Many starts of each case, to find its coexisting regimes.

        Parameters
        ----------
        ranges : values
            Ranges of initial values, as in {"shaft.initial_speed": ["0 rad/s", "30 rad/s"]}; `*` stands for every
            pendulum.
        count : int, optional
            Starts of each case, its own among them.
        seed : int, optional
            Seed of the initial values, which are those of a scrambled Sobol sequence.
        """
        return self._with(starts=known(ranges=ranges, count=count, seed=seed))

    def set(
        self,
        *,
        name: str | None = None,
        derive: Mapping[str, Any] | None = None,
        run: Mapping[str, Any] | None = None,
        quantities: Mapping[str, Any] | None = None,
        combine: Literal["grid", "zip", "union"] | None = None,
        exclude: Sequence[Any] | None = None,
        tolerances: Entries | None = None,
        drives: int | None = None,
        seed: int | None = None,
        draws: Literal["sobol", "latin_hypercube", "random"] | None = None,
        correlations: Sequence[Any] | None = None,
    ) -> Self:
        """Other fields of the spec.

        Parameters
        ----------
        name : str, optional
            Name of the study.
        derive : values, optional
            Parameters that follow from others in every case, by path: formulas of other parameters, of numbers with
            their units and of functions; `*` stands for every pendulum or step.
        run : values, optional
        quantities : values, optional
            What is asked about beside the results of the model, by name: formulas of parameters and results of a case,
            of numbers with their units, of functions and of other quantities; each is a result like any other.
        combine : values, optional
            Grid: every combination of the axes (the first varies slowest); zip: the axes side by side; union: one after
            the other, what does not vary being as in the base, each case once.
        exclude : values, optional
            Conditions by path; a case is left out when all parts of any one of them hold.
        tolerances : values, optional
            What differs from one built drive to the next, and by how much; fields path, plus_minus, distribution,
            values, shared; needed: path.
        drives : int, optional
            Drives that are drawn; the nominal one is added to them.
        seed : int, optional
            Seed of the random numbers of the drives.
        draws : values, optional
            How drives are drawn: sobol (scrambled) and latin_hypercube fill the distributions evenly, random draws are
            independent.
        correlations : values, optional
            Parameters whose draws depend on each other; fields between, coefficient.
        """
        return self._with(
            name=name,
            derive=derive,
            run=run,
            quantities=quantities,
            combine=combine,
            exclude=exclude,
            tolerances=self._entries(tolerances, "plus_minus"),
            drives=drives,
            seed=seed,
            draws=draws,
            correlations=correlations,
        )
