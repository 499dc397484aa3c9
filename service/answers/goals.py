"""Answers about studies with a goal: their designs, ranked, and how the search has come to them."""

from __future__ import annotations

from typing import Annotated, Literal, NotRequired

from typing_extensions import TypedDict

from sprag_study.service.answers import Doc, Number, Value


class DesignVariable(TypedDict):
    """What a search varies."""

    name: Annotated[str, Doc("the first of `paths`")]
    paths: Annotated[list[str], Doc("the parameters that take the value together")]
    unit: str
    low: Annotated[float, Doc("least value, SI")]
    high: Annotated[float, Doc("largest value, SI")]
    values: Annotated[list[float], Doc("the listed values, SI; empty for a range")]
    names: NotRequired[Annotated[list[str], Doc("names of the components, in the order of `values`; left out: none")]]


class Counted(TypedDict):
    """At which operating points a goal or a limit counts, and how, where that is not as usual."""

    points: NotRequired[Annotated[list[int], Doc("the operating points that count, from 0; left out: all")]]
    over: NotRequired[Annotated[str, Doc("what counts of several points: worst, mean or best; left out: as usual")]]


class DesignGoal(Counted):
    """What is to be as small or as large as possible."""

    result: Annotated[str, Doc("a result, its quantile over the drives, or a yield; the name in `goals` and `results`")]
    unit: str
    description: str
    max: Annotated[bool, Doc("whether the largest value is the best")]


#: A limit has one of is, at_least and at_most; "is" is no name for a field of a class.
DesignLimit = TypedDict(
    "DesignLimit",
    {
        "result": str,
        "unit": str,
        "is": NotRequired[Annotated[float | str, Doc("SI, or the name of a category")]],
        "at_least": NotRequired[Annotated[float, Doc("SI")]],
        "at_most": NotRequired[Annotated[float, Doc("SI")]],
        "within": Annotated[float, Doc("half the width of the band around `is`, SI; 0 where it must be equal")],
        "points": NotRequired[Annotated[list[int], Doc("the operating points that count, from 0; left out: all")]],
        "over": NotRequired[Annotated[str, Doc("mean or best: that of the points must keep it; left out: each")]],
    },
)
DesignLimit.__doc__ = "The limits that a design must keep at every operating point."


class Design(TypedDict):
    """One design: a value of every variable, run at every operating point."""

    design: Annotated[int, Doc("its number, from 0, in order of the cases")]
    cases: Annotated[list[int], Doc("its cases of the nominal drive, one for each operating point")]
    round: Annotated[int, Doc("number of the round that it belongs to, from 1")]
    phase: Annotated[Literal["search", "polish"], Doc("whether a generation or the polish of equalities asked for it")]
    variables: Annotated[dict[str, Value], Doc("value of each variable by its name, SI; a component by its own")]
    goals: Annotated[dict[str, Number], Doc("each goal over the operating points, SI; null where it is missing")]
    results: Annotated[
        dict[str, list[Number | str]],
        Doc("what goals and limits are about, at each operating point; null where missing"),
    ]
    feasible: Annotated[bool, Doc("whether it is within every limit")]
    failed: Annotated[bool, Doc("whether one of its cases has failed or had not settled, or a goal is missing")]
    regimes: Annotated[
        list[str | None] | None,
        Doc(
            "regime of the nominal drive at each operating point, null for a failed case; null for runs of a given time"
        ),
    ]
    flags: Annotated[list[str], Doc("flags of all its cases, each once")]
    violation: Annotated[Number, Doc("sum of the relative violations of limits; 0 if feasible, null if failed")]
    miss: Annotated[Number, Doc("largest relative distance from the value of an equality; null where missing")]
    exact: Annotated[bool, Doc("whether it is feasible with its equalities met to 1e-6; without equalities, feasible")]
    rank: Annotated[int, Doc("0: no other design is better (the front), and so on; infeasible ones come last")]


class Generation(TypedDict):
    """What was known after a generation, or after a later round."""

    round: Annotated[int, Doc("rounds before")]
    generation: Annotated[int, Doc("generations before")]
    phase: Annotated[str, Doc("what came next: search, polish, fresh or ended")]
    feasible: Annotated[int, Doc("designs within every limit")]
    infeasible: int
    failed: int
    best: Annotated[list[float | None], Doc("best value of each goal within the limits, SI; null: none yet")]
    hypervolume: Annotated[float | None, Doc("what the front dominates, up to a fixed point; null where not known")]


class FreshResult(TypedDict):
    """A quantile or a yield over fresh drives, at each operating point; null where it is not known."""

    values: list[Number]
    low: Annotated[list[Number], Doc("lower ends of the 95 % intervals")]
    high: Annotated[list[Number], Doc("upper ends")]


class FreshDesign(TypedDict):
    """One of the best designs with fresh drives, which the search has not seen."""

    design: Annotated[int, Doc("its number")]
    drives: Annotated[int, Doc("fresh drives at each operating point")]
    first_case: Annotated[int, Doc("the first of their cases")]
    goals: Annotated[dict[str, Number], Doc("each goal over the operating points, SI; null where it is missing")]
    results: Annotated[dict[str, FreshResult], Doc("those of goals and limits that are about the drives, by name")]
    feasible: Annotated[bool, Doc("whether it is within every limit with fresh drives")]
    failed: Annotated[bool, Doc("whether all of them fail at an operating point, or a goal is missing")]


class FrontReport(TypedDict):
    """The designs of a study with a goal, the best rank first, within a rank in order of the first goal."""

    study: str
    variables: list[DesignVariable]
    best: list[DesignGoal]
    subject_to: list[DesignLimit]
    at: Annotated[list[dict[str, float]], Doc("the operating points, SI; a single empty one for that of the base")]
    names: NotRequired[
        Annotated[list[str], Doc("names of the operating points, empty for one without; left out: none")]
    ]
    over: Annotated[str, Doc("what counts of several operating points: worst, mean or best")]
    generations: Annotated[int, Doc("generations at most")]
    counts: Annotated[
        dict[str, int],
        Doc(
            "number of designs: known, feasible, failed, exact and front leave out those for derivatives; "
            "pending includes them"
        ),
    ]
    designs: Annotated[list[Design], Doc("at most `limit` of the known ones")]
    history: list[Generation]
    fresh: NotRequired[
        Annotated[list[FreshDesign], Doc("the best designs with fresh drives; left out: none, or not run yet")]
    ]
