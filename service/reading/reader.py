"""How somebody reads quantities: in which units, and by captions or by code names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final

from markupsafe import Markup

from sprag.sentences import Sentence, WarningText
from sprag.service.faults import refused
from sprag.service.languages import gettext
from sprag.service.reading.earlier import earlier_warning
from sprag.service.reading.numbers import in_language
from sprag.service.reading.part_names import lower_first, part_name, run_name
from sprag.service.reading.phrases import Name, Phrase, said
from sprag.service.reading.quantities import SI, Units, units_for
from sprag.service.reading.units import has_unit
from sprag.service.reading.wording import number, unit_text
from sprag.worker.models.vocabulary import caption, has_caption, letter

if TYPE_CHECKING:
    from sprag.sentences import Place
    from sprag.worker.study import Study

#: What quantities are called: for people, or as in specs and files.
CAPTIONS: Final = "captions"
CODES: Final = "codes"


@dataclass(frozen=True, slots=True)
class Choice:
    """A reader's choice, the same for all studies: the text of `quantities.read_units`, and captions or code names."""

    units: str = SI
    names: str = CAPTIONS

    def __post_init__(self) -> None:
        """Raise SelectionError for other ``names``; units are checked where a study is known."""
        if self.names not in (CAPTIONS, CODES):
            raise refused("names", "invalid-choice", "is not a way to name", self.names, allowed=f"{CAPTIONS}, {CODES}")


@dataclass(frozen=True, slots=True)
class Reading:
    """The choice for one study. Every number that somebody is shown with a unit, and every name, goes through it."""

    model: str
    units: Units = field(default_factory=Units)
    names: str = CAPTIONS

    def caption(self, name: str) -> str:
        """What a path, a result or a variable is called; of tied paths ("a = b") each."""
        if self.names == CODES:
            return name
        first, *tied = (caption(self.model, part, gettext) for part in name.split(" = "))
        return " = ".join([first, *map(lower_first, tied)])

    def within(self, name: str) -> str:
        """What it is called within a sentence."""
        return self.say(Phrase("{name}", name=Name(name, within=True)))

    def say(self, text: str) -> str:
        """A text; a phrase in the reader's language, units and words."""
        return said(text, self)

    def warning(self, text: str) -> str:
        """A warning: a sentence in the reader's language, units and words; see `earlier_warning` for one without."""
        known = isinstance(text, Sentence) or (isinstance(text, WarningText) and text.sentence is not None)
        return self.say(text) if known else earlier_warning(text, getattr(text, "code", ""), self)

    def place(self, place: Place) -> str:
        """What a place of a spec is called: ``Spring rate, pendulum 0``; ``Run, at most``.

        Where it is about a path or a result, that is what it is called by.
        """
        path = place.about or place.pointer.removeprefix("/base").strip("/").replace("/", ".")
        if place.about or (self.names == CODES and path):
            return self.caption(path)
        section, _dot, name = path.partition(".")
        if not section:
            return gettext("Machine") if place.pointer else gettext("Spec")
        if section == "run" and place.pointer.startswith("/run/"):
            return f"{gettext('Run')}, {lower_first(run_name(name.partition('.')[0]))}"
        return self.caption(path) if has_caption(self.model, path) else part_name(path)

    def say_name(self, name: str) -> str:
        """The title of an axis: a phrase, or the name of a quantity."""
        if not isinstance(name, Phrase):
            return self.caption(name)
        text = name.said(self)
        return f"{text[:1].upper()}{text[1:]}"

    def unit(self, si: str) -> str:
        """The unit in which quantities of that SI unit are shown."""
        return self.units.unit(si)

    def value(self, value: Any, si: str) -> Any:
        """A number in its unit; texts and missing numbers as they are."""
        return self.units.cell(value, si)

    def quantity(self, value: Any, si: str, digits: int = 5) -> str:
        """A number in SI as people read it, with its unit."""
        return f"{number(self.value(value, si), digits)} {unit_text(self.unit(si))}".strip()

    def typed(self, text: str, si: str) -> str:
        """What somebody typed beside a label with the shown unit: a bare number gets this unit."""
        shown, text = self.unit(si), in_language(text)
        return text if shown == si or not text.strip() or has_unit(text) else f"{text.strip()} {shown}"

    def with_unit(self, text: str, si: str) -> str:
        """As `typed`, with the SI unit too: beside other quantities the number is then in that unit."""
        text = self.typed(text, si)
        return text if si == "1" or not text.strip() or has_unit(text) else f"{text.strip()} {si}"

    def letter(self, name: str) -> Markup | None:
        """The letter of a result, as in print; None where it has none."""
        found = letter(self.model, name)
        if found is None:
            return None
        base, index = found
        return Markup("<i>{}</i>{}").format(base, Markup("<sub>{}</sub>").format(index) if index else "")

    def title(self, name: str, si: str) -> str:
        """What it is called, with its unit: ``Load torque (N·m)``."""
        shown = unit_text(self.unit(si))
        return f"{self.caption(name)} ({shown})" if shown else self.caption(name)


#: How measured clutches are read, which no study has yet: in the units of the fit.
CLUTCH: Final = Reading("vibration-drive")


def reading_for(study: Study, spec: Mapping[str, Any], choice: Choice) -> Reading:
    """The reading of a choice; raises SelectionError for units that cannot be shown."""
    return Reading(study.model, units_for(study, spec, choice.units), choice.names)
