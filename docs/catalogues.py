"""The catalogues of languages (service/languages/*.po), from the texts that the program has.

python -m docs.catalogues           sort them, add missing texts with an empty translation, remove those without a use
python -m docs.catalogues --check   exit code 1 where a text is missing, has no use or other places than its English
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Final

from docs.fault_texts import fault_texts
from docs.form_texts import form_values
from docs.vocabulary import units, vocabulary
from sprag_study.service import languages
from sprag_study.service.cli.app import command_line
from sprag_study.service.cli.language import texts as help_texts
from sprag_study.service.http.web.script_texts import script_texts
from sprag_study.service.http.web.templates import _templates
from sprag_study.service.languages.catalogue import Catalogue, Entry, Key, read, written
from sprag_study.service.presets import ABOUT
from sprag_study.service.reading.wording import NOUNS

ROOT: Final = Path(__file__).parent.parent
#: Where texts stand. What else the worker and the engine say, which know no languages, is in `vocabularies`.
CODE: Final = ("service", "worker", "engine", "sprag_study")
#: Functions that take a text, and the names of their constant arguments.
_FUNCTIONS: Final = {
    **dict.fromkeys(("_", "gettext", "N_", "Phrase", "Sentence"), ("text",)),
    **dict.fromkeys(("ngettext", "plural"), ("text", "many")),
    "pgettext": ("context", "text"),
}
_PLACE: Final = re.compile(r"%\((\w+)\)s|\{(\w+)[^{}]*\}|(</?[a-z][^>]*>)")
Found = dict[Key, str]


def calls(text: str) -> list[ast.Call]:
    """The calls of functions in a Python module."""
    return [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Call)]


def of_code(nodes: Iterable[ast.Call], where: str) -> Iterator[tuple[Key, str]]:
    """The texts in calls and their plurals. Raises ValueError for one that is not a constant."""
    for node in nodes:
        name = getattr(node.func, "id", getattr(node.func, "attr", ""))
        names = _FUNCTIONS.get(name, ())
        given = node.args[: len(names)]
        if not names or len(given) < len(names):
            continue
        values = [item.value if isinstance(item, ast.Constant) else None for item in given]
        if all(isinstance(value, str) and value for value in values):
            parts = dict(zip(names, map(str, values), strict=True))
            yield Key(parts["text"], parts.get("context", "")), parts.get("many", "")
        elif any(isinstance(item, ast.JoinedStr) for item in given):
            raise ValueError(f"{where}:{node.lineno}: an f-string cannot be translated; give its values by name")


def of_template(source: str) -> Iterator[tuple[Key, str]]:
    """The texts of a template of the pages and their plurals."""
    for _line, function, message in _templates().extract_translations(source):  # type: ignore[attr-defined]
        given = (message,) if isinstance(message, str) else message or ()  # None for a value
        parts = [part for part in given if isinstance(part, str)]
        names = _FUNCTIONS.get(function, ())
        if len(parts) >= len(names) > 0:
            known = dict(zip(names, parts, strict=False))
            yield Key(known["text"], known.get("context", "")), known.get("many", "")


def vocabularies() -> Iterator[tuple[Key, str]]:
    """Texts that are values of the program and translated where they are shown, with their plurals."""
    for noun in NOUNS:
        yield Key(f"{{n}} {noun}"), f"{{n}} {noun}s"
    yield from ((Key(text), "") for text in (*vocabulary(), *form_values()))
    yield from ((Key(unit, "unit"), "") for unit in units())
    yield from ((Key(text), "") for text in help_texts(command_line(languages.ENGLISH)))
    yield from ((Key(preset.shows), "") for preset in ABOUT.values())


def texts() -> Found:
    """Every text of the program, with its plural where it has one."""
    found: Found = {}
    pairs: list[tuple[Key, str]] = [*vocabularies(), *((Key(text), "") for text in script_texts())]
    for folder in CODE:
        for file in sorted((ROOT / folder).rglob("*.py"), key=str):
            where, nodes = str(file.relative_to(ROOT)), calls(file.read_text(encoding="utf-8"))
            pairs += of_code(nodes, where)
            if folder == "service":
                pairs += ((Key(text), "") for text in fault_texts(nodes, where))
    environment = _templates()
    assert environment.loader is not None
    for name in environment.list_templates(extensions=["html"]):
        pairs += of_template(environment.loader.get_source(environment, name)[0])
    for key, many in pairs:
        found[key] = many or found.get(key, "")
    return found


def places(text: str) -> list[str]:
    """The places of values and the tags of a text, in the order of their names."""
    return sorted("".join(match) for match in _PLACE.findall(text))


def faults(catalogue: Catalogue, found: Found) -> Iterator[str]:
    """What is wrong with a catalogue."""
    for key in sorted(found.keys() | catalogue.entries.keys()):
        entry = catalogue.entries.get(key)
        if key not in found:
            yield f"is not used: {key.text!r}"
        elif entry is None or not all(entry.forms):
            yield f"is missing: {key.text!r}"
        elif entry.many != found[key]:
            yield f"has another plural: {key.text!r}"
        elif len(entry.forms) != (catalogue.plural_forms if entry.many else 1):
            yield f"has {len(entry.forms)} forms of {key.text!r}"
        elif not all(_fits(form, key.text, entry.many or key.text) for form in entry.forms):
            yield f"has other places or tags: {key.text!r}"


def _fits(form: str, one: str, many: str) -> bool:
    """Whether a form has the places that both English forms have, and no others than they."""
    return set(places(one)) & set(places(many)) <= set(places(form)) <= set(places(one)) | set(places(many))


def updated(catalogue: Catalogue, found: Found) -> dict[Key, Entry]:
    """The entries of a catalogue for the texts that the program has; new ones are empty."""
    entries = {}
    for key, many in found.items():
        forms = catalogue.entries[key].forms if key in catalogue.entries else ()
        count = catalogue.plural_forms if many else 1
        entries[key] = Entry((forms + ("",) * count)[:count], many)
    return entries


def main(arguments: Iterable[str]) -> int:
    """Check the catalogues, or bring them up to date."""
    found, wrong = texts(), 0
    for file in sorted(languages.FOLDER.glob("*.po")):
        text = file.read_text(encoding="utf-8")
        catalogue = read(file)
        remarks = [line for line in text.splitlines() if line.startswith("#")]
        if "--check" not in arguments:
            file.write_text(written(catalogue.header, updated(catalogue, found), remarks), encoding="utf-8")
            catalogue = read(file)
        elif text != written(catalogue.header, catalogue.entries, remarks):
            wrong += 1
            print(f"{file.name} is not in order: python -m docs.catalogues sorts it.")
        for fault in faults(catalogue, found):
            wrong += 1
            print(f"{file.name}: {fault}")
    return int(wrong > 0)


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
