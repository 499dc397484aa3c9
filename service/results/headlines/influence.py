"""What matters most for a result: the parameter it depends on most, and what 10 % more of it changes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from sprag_study.sentences import Amount, Name, Part
from sprag_study.service.languages import N_
from sprag_study.service.reading.reader import Phrase, joined
from sprag_study.service.results.headlines.headline import MOST, NOTHING, Headline, KeyNumber, digits
from sprag_study.service.results.sensitivity import in_order, per_tenth, weight

if TYPE_CHECKING:
    from sprag_study.service.results.sensitivity import Effect, Sensitivity
    from sprag_study.worker.study import Study


def influence_headline(study: Study, item: Sensitivity) -> Headline:
    """The answer about one result; nothing where no case has it, or it is the same in all."""
    order = [effect for effect in in_order(item) if weight(effect) > 0.0]
    if not order:
        return Headline((Phrase("Nothing that varies here changes {name}.", name=Name(item.info.name, within=True)),))
    first, name = order[0], Name(item.info.name, within=True)
    tenths = [(change, effect) for effect in order if (change := _tenth(study, effect)) is not None]
    change, steepest = max(tenths, key=lambda one: abs(one[0]), default=(0.0, first))
    says = []
    if steepest is not first or not change:
        says.append(
            Phrase("Over these ranges {parameter} matters most for {name}.", parameter=_within(first), name=name)
        )
    if change:
        parts: dict[str, Part] = {"name": name, "amount": _amount(item, abs(change))}
        text = (
            N_("10 % more {parameter} lowers {name} by about {amount}.")
            if change < 0.0
            else N_("10 % more {parameter} raises {name} by about {amount}.")
        )
        if steepest is first:
            text = (
                N_("{parameter} matters most: 10 % more of it lowers {name} by about {amount}.")
                if change < 0.0
                else N_("{parameter} matters most: 10 % more of it raises {name} by about {amount}.")
            )
        says.append(Phrase(text, parameter=_name(steepest) if steepest is first else _within(steepest), **parts))
    share = _share(first)
    if share is not None:
        says.append(
            Phrase(
                "{share} of what {name} varies by is owed to {parameter}.",
                share=Amount(share, "%", 2),
                name=name,
                parameter=_within(first),
            )
        )
    return Headline(tuple(says), tuple(_number(study, item, effect) for effect in order[:MOST]))


def _name(effect: Effect) -> Phrase:
    return joined(" = ", [Name(path, within=place > 0) for place, path in enumerate(effect.paths)])


def _within(effect: Effect) -> Phrase:
    return joined(" = ", [Name(path, within=True) for path in effect.paths])


def _share(effect: Effect) -> float | None:
    """The share of the variance that is owed to an axis, in per cent; None where no method gives it."""
    own = effect.indices
    share = own.total if own.total is not None else own.first_order
    return None if share is None else 100.0 * share


def _tenth(study: Study, effect: Effect) -> float | None:
    """The change by 10 % more than in the base; None for what is not numbers, or too little to be told."""
    base = study.base.get(effect.paths[0])
    change = None if base is None else per_tenth(effect, base)
    return None if change is None or change == 0.0 else change


def _amount(item: Sensitivity, value: float) -> Amount:
    return Amount(value, item.info.unit, 2)


def _number(study: Study, item: Sensitivity, effect: Effect) -> KeyNumber:
    change, share = _tenth(study, effect), _share(effect)
    more = NOTHING if change is None else Phrase("10 % more: {change}", change=_amount(item, change))
    if share is not None:
        return KeyNumber(_name(effect), share, "%", 2, where=Phrase("of the variation"), note=more)
    value = weight(effect)
    return KeyNumber(_name(effect), value, item.info.unit, digits(value), where=Phrase("over its range"), note=more)
