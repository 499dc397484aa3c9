"""Check of a filled form: its spec, the faults by field, the estimated cost, the clutch fits."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final
from urllib.parse import urlencode

from sprag_study.sentences import Place, WarningText
from sprag_study.service.faults import Fault
from sprag_study.service.figures.drawing import Drawing
from sprag_study.service.figures.drawings import BETWEEN_FIELDS, drawings
from sprag_study.service.http.web.figures.fits import FitChart, fit_at
from sprag_study.service.http.web.form.columns import COLUMNS
from sprag_study.service.http.web.form.element_lines import element_of
from sprag_study.service.http.web.form.entries import Faults
from sprag_study.service.http.web.form.machine import model_name, places
from sprag_study.service.http.web.form.machine_spec import step_of
from sprag_study.service.http.web.form.sent import with_first_values
from sprag_study.service.http.web.form.spec import form_with_spec
from sprag_study.service.http.web.form.walk import Filled
from sprag_study.service.jobs.preview import preview_json
from sprag_study.service.jobs.start_from import with_components
from sprag_study.service.jobs.submission import Order, Submission, submission
from sprag_study.service.languages import _, gettext, grouped, ngettext
from sprag_study.service.reading.faults import message
from sprag_study.service.reading.quantities import TYPED
from sprag_study.service.reading.reader import CLUTCH, Choice, Reading, reading_for
from sprag_study.service.reading.wording import duration
from sprag_study.service.results.draft_words import draft_words
from sprag_study.service.schedules.deadline import ALLOWED, finish_at
from sprag_study.service.schedules.times import TimingError
from sprag_study.service.spec.document import ParsedSpec, SpecError, load_spec, parse_spec
from sprag_study.service.spec.measured import MeasuredDataError, parse_measured
from sprag_study.service.views.library import Library

if TYPE_CHECKING:
    from datetime import datetime

    from sprag_study.service.answers.studies import ClutchFitReport, Preview
    from sprag_study.worker.chunking import Chunking
    from sprag_study.worker.study import Study

    Known = Callable[[Study], int]
    Complete = Callable[[Any], Any]


#: Faults that are told beside one field; of more of them their number.
_MOST_TEXTS: Final = 3


@dataclass(slots=True)
class Checked:
    """The result of checking a filled form.

    ``faults`` contains the messages by field ("" for general ones); ``preview`` is None while there are any. ``fits``
    contains the report and the picture of each clutch that could be fitted, regardless of other faults; ``notes`` the
    assumptions about measured data. ``finish`` is the deadline, which is not part of the spec. ``sketch`` contains the
    drawings of the machine, ``words`` the study in a sentence, ``warnings`` those of the preview for people, and
    ``beside`` those of them that are about a field, by its name.
    """

    spec: dict[str, Any]
    parsed: ParsedSpec | None = None
    faults: Faults = field(default_factory=dict)
    preview: Preview | None = None
    fits: dict[str, tuple[ClutchFitReport, FitChart]] = field(default_factory=dict)
    finish: datetime | None = None
    finish_text: str = ""
    notes: list[str] = field(default_factory=list)
    empty: frozenset[str] = frozenset()
    sketch: tuple[Drawing, ...] = ()
    words: str = ""
    warnings: tuple[str, ...] = ()
    beside: dict[str, list[str]] = field(default_factory=dict)
    form: Filled | None = None

    @property
    def run(self) -> str:
        """What the button that submits the study says: how many cases, and how long they take."""
        if self.preview is None:
            return gettext("Run")
        count, time = self.preview["most_cases"], _time(self.preview)
        if self.preview["most_rounds"] > 1:
            return gettext("Run at most {n} cases, {time}", n=grouped(count), time=time)
        return ngettext("Run {n} case, {time}", "Run {n} cases, {time}", count, n=grouped(count), time=time)

    def say_beside(self, texts: Mapping[str, str]) -> None:
        """Add a hint beside each of some fields, by their names."""
        for name, text in texts.items():
            self.beside.setdefault(name, []).append(text)

    @property
    def query(self) -> str:
        """Parameters of the URL besides the spec."""
        return "" if self.finish is None else "?" + urlencode({"finish_by": self.finish_text})

    @property
    def missing(self) -> int:
        """Number of empty required fields; their messages appear once the user has left them."""
        return sum(name in self.empty for name in self.faults)

    @property
    def attention(self) -> int:
        """Number of messages beside fields that are filled in."""
        return sum(len(texts) for name, texts in self.faults.items() if name and name not in self.empty)


def _none_known(_study: Study) -> int:
    return 0


def _as_it_is(spec: Any) -> Any:
    return spec


def look_over(
    values: Mapping[str, str],
    chunking: Chunking,
    known: Known,
    now: datetime,
    choice: Choice | None = None,
    complete: Complete = _as_it_is,
) -> Checked:
    """Check a form, given by fields or as text, with its deadline; ``known`` as for `check_form`.

    ``choice`` has the units and names of the sentence about it; ``complete`` gives components their fields.
    """
    text, finish, fault = values.get("finish_by", "").strip(), None, ""
    try:
        finish = finish_at(text, now) if text else None
    except TimingError as error:
        fault = message(Fault("/finish_by", error.code, error.message, allowed=ALLOWED))
    left = None if finish is None else (finish - now).total_seconds()
    if "/text" in values:
        checked = check_text(values["/text"], values.get("format", "json"), chunking, known, left, complete)
    else:
        checked = check_form(values, chunking, known, left, complete)
    checked.finish, checked.finish_text = finish, text
    if fault:
        checked.faults["finish_by"], checked.parsed, checked.preview = [fault], None, None
    if checked.parsed is not None and checked.preview is not None:
        reading = reading_for(checked.parsed.study, checked.parsed.spec, choice or Choice(TYPED))
        checked.words = draft_words(checked.parsed.study, checked.parsed.spec, checked.preview, reading)
        for text in checked.preview["warnings"]:
            name, told = _placed(text, checked.form)
            if name and told is not None:
                checked.beside.setdefault(name, []).append(reading.warning(told))
            else:
                checked.warnings = (*checked.warnings, reading.warning(text))
    return checked


def checked_form(library: Library, values: Mapping[str, str], now: datetime, choice: Choice) -> Checked:
    """Check a form in a process; ``choice`` as of `look_over`."""
    store = library.store
    complete = partial(with_components, store)
    checked = look_over(values, store.dispatchers.chunking, store.reuse.count, now, choice, complete)
    # The study itself is not returned: it can be large, and no page shows it.
    return replace(checked, parsed=None, form=None)


def submitted_form(library: Library, values: Mapping[str, str], now: datetime) -> tuple[Checked, Submission | None]:
    """Check a form in a process; also its study, None where the form has faults."""
    store = library.store
    complete = partial(with_components, store)
    checked = look_over(values, store.dispatchers.chunking, store.reuse.count, now, complete=complete)
    parsed, finish = checked.parsed, checked.finish
    made = None if parsed is None else submission(parsed, store, Order(now, finish_by=finish))
    return replace(checked, parsed=None, form=None), made


def _placed(text: str, form: Filled | None) -> tuple[str, WarningText | None]:
    """The field that a warning is about, "" for none, and what it says there."""
    sentence = getattr(text, "sentence", None)
    place = None if sentence is None else sentence.parts.get("part0")
    told = None if sentence is None else sentence.parts.get("part1")
    if form is None or not isinstance(place, Place) or not isinstance(told, str):
        return "", None
    return form.field_of(place.pointer), WarningText(told)


def _time(preview: Preview) -> str:
    """How long the cases take, in words."""
    seconds = preview["estimated_seconds"]
    return gettext("about {time}", time=duration(seconds)) if seconds >= 1.0 else duration(seconds)


def check_form(
    values: Mapping[str, str],
    chunking: Chunking,
    known: Known = _none_known,
    left: float | None = None,
    complete: Complete = _as_it_is,
) -> Checked:
    """Check a filled form.

    ``known`` counts the cases of a study that need not be run; ``left`` are the seconds until its deadline.
    """
    values = with_first_values(values)
    spec, form = form_with_spec(values)
    faults = form.faults
    found = Checked(
        spec, faults=faults, form=form, empty=frozenset(name for name, text in values.items() if not text.strip())
    )
    try:
        found.parsed = parse_spec(complete(spec))
    except SpecError as error:
        place_faults(form, error.faults)
    if values.get(COLUMNS, "").strip() and "axes" in spec:
        found.faults[COLUMNS] = [_("has columns that are not used yet; make axes of them, or empty the field")]
    if found.faults:
        found.parsed = None
    if found.parsed is not None:
        found.preview = preview_json(found.parsed, chunking, known(found.parsed.study), left)
        found.sketch = drawings(found.parsed.study, width=BETWEEN_FIELDS)
    found.notes += map(Reading(model_name(values)).warning, form.doubts)
    for pointer in places(values, "measured"):
        found.notes += _assumed(values.get(f"{pointer}/data", ""))
        fit = fit_at(found.spec, None if found.parsed is None else found.parsed.study, pointer)
        found.fits |= {} if fit is None else {pointer: fit}
    return found


def place_faults(form: Filled, found: Iterable[Fault]) -> None:
    """Add the faults of a spec to those of the form that it was made of, each beside its field."""
    for item in found:
        name = _beside(form.field_of(item.where or ""), form.values.get("edited", ""))
        # Faults of unreadable data were reported already, line by line.
        if not (name in form.faults and name.endswith("/data")):
            texts = form.faults.setdefault(name, [])
            # One field can stand for several places of the spec, as the value of a parameter at all points does.
            text = (step_of(item.where or "") or element_of(item.where or "")) + message(item)
            texts += [text] if text not in texts else []
    for texts in form.faults.values():
        if (count := len(texts) - _MOST_TEXTS) > 1:
            texts[_MOST_TEXTS:] = [
                ngettext("and {count} further fault", "and {count} further faults", count, count=count)
            ]


def _beside(name: str, edited: str) -> str:
    """The field for a fault at ``name``: where it is about a part of the machine, that of it which was changed last."""
    return edited if name.startswith("/base/") and edited.startswith(f"{name}/") else name


def _assumed(text: str) -> list[str]:
    """Assumptions about pasted data; none for data that cannot be read, which is reported elsewhere."""
    try:
        notes = parse_measured(text).warnings
    except MeasuredDataError:
        return []
    return [_("Measured data: {text}.", text=CLUTCH.warning(note).removesuffix(".")) for note in notes]


def check_text(
    text: str,
    form: str,
    chunking: Chunking,
    known: Known = _none_known,
    left: float | None = None,
    complete: Complete = _as_it_is,
) -> Checked:
    """Check a spec given as text, JSON or TOML; ``known`` and ``left`` as for `check_form`."""
    found = Checked({})
    try:
        loaded = load_spec(text, "toml" if form == "toml" else "json")
        found.parsed = parse_spec(complete(loaded))
    except SpecError as error:
        found.faults["/text"] = [f"{item.where or _('the spec')}: {message(item)}" for item in error.faults]
        return found
    found.spec = found.parsed.spec
    found.preview = preview_json(found.parsed, chunking, known(found.parsed.study), left)
    return found
