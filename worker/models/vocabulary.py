"""What people read of a parameter, a result or a variable instead of its name: a caption, and a letter."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import lru_cache
from typing import Final

from sprag_study.worker.directions import SWEEP
from sprag_study.worker.models.parameters import general_path, model_parameter
from sprag_study.worker.models.registry import model_of
from sprag_study.worker.spread import DRIVE

_HALF_WIDTH: Final = ".half_width"
#: Path of the constants that users name, with a caption of their names.
_CONSTANT: Final = "constants.NAME"
#: Caption of the half width of a mean.
HALF_WIDTH: Final = "{caption}, half width"
#: What a numbered part is called, by the first words of its paths.
_PARTS: Final = (
    ("pendulums", "pendulum"), ("parts", "part"), ("drive.stages", "stage"), ("joints", "joint"),
    ("couplings", "coupling"),
)  # fmt: skip
#: What of the drives a goal can be about (`sprag_study.worker.planning.goals.plan`).
OF_DRIVES: Final = ("mean of the drives", "deviation of the drives", "{number} % quantile")
#: What designs of a search have beside their goals and limits.
_OF_DESIGNS: Final = ("rank", "violation", "miss")
#: Where the short form of a description ends.
_END: Final = re.compile(r"[;,:(]| / ")


def ordinal(index: str | int) -> str:
    """The number of one of several for people, who count from 1 where paths count from 0; other texts stay."""
    return str(int(index) + 1) if str(index).isdigit() else str(index)


def words(name: str) -> str:
    """A name without a caption as words: ``output.level`` as ``Output level``."""
    text = name.replace(".", " ").replace("_", " ").strip()
    text = re.sub(r"^pendulums (\d+)", lambda found: f"pendulum {ordinal(found[1])}", text)
    return text[:1].upper() + text[1:] if text[:1].isascii() else text


def caption(
    model: str, name: str, translate: Callable[[str], str] = str, single: Collection[str] = (),
    joints: Sequence[str] = (),
) -> str:  # fmt: skip
    """The caption of a path of a spec, a result or a variable of ``model``: ``Spring rate, pendulum 1``.

    Without one of its own, a parameter has the beginning of its description, anything else its name in words.
    ``translate`` gives each text of `caption_texts` in another language. ``single`` are the numbered parts of which
    the machine has only one (`single_parts`): they stand only where something of no part is called the same.
    ``joints`` are the names of its joints in the order of their numbers.
    """
    if name.endswith(_HALF_WIDTH):
        return translate(HALF_WIDTH).format(
            caption=caption(model, name.removesuffix(_HALF_WIDTH), translate, single, joints)
        )
    result, beginning, about = name.partition(" (")
    if beginning and about.endswith(")"):  # what a goal is about: ``shaft.speed.mean (5 % quantile)``
        return f"{caption(model, result, translate, single, joints)} ({_of_drives(about, translate)}"
    text, index, part = _caption(model, name)
    if part and part[1] == "0" and part[0] in single and text not in _without_part(model):
        part = None
    whose = f", {translate(part[0])} {_called(part, translate, joints)}" if part else ""
    return translate(text).format(index, number=ordinal(index)) + whose


def _called(part: tuple[str, str], translate: Callable[[str], str], joints: Sequence[str]) -> str:
    """The number of a part, or the name of a joint: ``B.inner``, of part 2 ``B.inner, part 2``."""
    if part[0] != "joint" or not part[1].isdigit() or int(part[1]) >= len(joints):
        return ordinal(part[1])
    name = joints[int(part[1])]
    own, owner = _within_part(name)
    return f"{own}, {translate(owner[0])} {ordinal(owner[1])}" if owner else name


def _of_drives(about: str, translate: Callable[[str], str]) -> str:
    """What of the drives a goal is about, ``mean of the drives - 3 sigma``; another text as it is."""
    for text in OF_DRIVES:
        before, _number, after = text.partition("{number}")
        if found := re.match(f"{re.escape(before)}(.*?){re.escape(after)}" if after else re.escape(before), about):
            number = found[1] if after else ""
            return translate(text).format(number=number) + about[found.end() :]
    return about


def bare_caption(model: str, name: str, translate: Callable[[str], str] = str) -> str:
    """The caption without its part of the machine, for places that stand within that part: ``Spring rate``."""
    text, index, _part = _caption(model, name)
    return translate(text).format(index, number=ordinal(index))


def given_caption(model: str, name: str, translate: Callable[[str], str] = str) -> str:
    """As `bare_caption`, where the model has a caption for it; "" where only a description stands for one."""
    own, _part = _within_part(name)
    known = {name, general_path(name), general_path(own)} & model_of(model).presentation.captions.keys()
    return bare_caption(model, name, translate) if known else ""


def single_parts(paths: Iterable[str]) -> frozenset[str]:
    """The kinds of numbered parts, pendulums and parts of a machine, of which these paths have just one."""
    numbers = {
        (word, name.removeprefix(f"{first}.").partition(".")[0])
        for name in paths for first, word in _PARTS[:2] if name.startswith(f"{first}.")
    }  # fmt: skip
    kinds = [word for word, _number in numbers]
    return frozenset(word for word in kinds if kinds.count(word) == 1)


def has_caption(model: str, name: str) -> bool:
    """Whether ``name`` is a parameter of ``model``, or has a caption of its own."""
    captions = model_of(model).presentation.captions
    return model_parameter(model, name) is not None or not captions.keys().isdisjoint((name, general_path(name)))


@lru_cache(maxsize=4096)
def _caption(model: str, name: str) -> tuple[str, str, tuple[str, str] | None]:
    """The text, its last index, and word and index of the part that it belongs to."""
    own, part = _within_part(name)
    captions = model_of(model).presentation.captions
    general = general_path(name)
    if (constant := name.removeprefix("constants.")) != name and _CONSTANT in captions:
        return captions[_CONSTANT], constant, None
    found = next((captions[key] for key in (name, general, general_path(own)) if key in captions), None)
    if found is not None:
        index = re.findall(r"\.(\d+)", name)
        return found, index[-1] if index else "", part
    entry = model_parameter(model, name)
    if entry is None:
        return _without_places(words(own if part else name)), "", part
    text = _END.split(entry.help, maxsplit=1)[0].strip()
    return _without_places(text[:1].upper() + text[1:]), "", part


@lru_cache(maxsize=16)
def _without_part(model: str) -> frozenset[str]:
    """The texts of captions of what belongs to no numbered part."""
    known = model_of(model)
    names = [*(entry.path for entry in known.parameters()), *(info.name for info in known.result_catalogue())]
    parts = tuple(f"{first}." for first, _word in _PARTS)
    return frozenset(_caption(model, name)[0] for name in names if not name.startswith(parts))


def _without_places(text: str) -> str:
    return text.replace("{", "{{").replace("}", "}}")


def caption_texts(model: str) -> list[str]:
    """Every text that captions of ``model`` are made of, once."""
    known = model_of(model)
    names = [entry.path for entry in known.parameters()] + [info.name for info in known.result_catalogue()]
    own = (name for name in names if not name.endswith(_HALF_WIDTH))
    found = [*known.presentation.captions.values(), *(_caption(model, name)[0] for name in own)]
    axes = map(words, (DRIVE, SWEEP, *_OF_DESIGNS))  # of no machine
    return list(dict.fromkeys([HALF_WIDTH, *OF_DRIVES, *(word for _, word in _PARTS), *axes, *found]))


def _within_part(name: str) -> tuple[str, tuple[str, str] | None]:
    """The name within its numbered part; word and number of this part."""
    for first, word in _PARTS:
        found = re.fullmatch(rf"{re.escape(first)}\.(\d+|\*)\.(.+)", name)
        if found:
            return found[2], (word, found[1])
    return name, None


def letter(model: str, name: str) -> tuple[str, str] | None:
    """Base and index of the letter of a result; None where it has none."""
    letters = model_of(model).presentation.letters
    return letters.get(name) or letters.get(general_path(name))
