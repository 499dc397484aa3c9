"""The methods of views of the asynchronous client, as the text of a module: typed, with docstrings."""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import UnionType
from typing import Any, Final, Literal, get_args, get_origin

from sprag_study.service.views import case_questions, study_questions
from sprag_study.service.views.cases import CASE_VIEWS
from sprag_study.service.views.setting import NamedSetting, ViewInfo, settings_of
from sprag_study.service.views.studies import STUDY_VIEWS

CLIENT: Final = Path(__file__).resolve().parents[3] / "service" / "client"
#: What stands for a number or a text with a unit in the help of commands.
QUANTITIES: Final = frozenset({"VALUE", "TIME", "ANGLE", "TORQUE", "FACTOR", "SHARE", "NUMBER", "MASS", "FORCE", "N"})
#: Two settings that the client takes as one pair.
ENDS: Final = ("_from", "_to")

HEAD: Final = '''"""What a study and its cases show: a method for each view.

Made of the descriptions of the views by ``python -m tests.service.client.generate``; do not edit.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal, cast

from sprag_study.service.client.asynchronous.part import AsyncStudyPart
{tables}
from sprag_study.service.client.queries import query_of

if TYPE_CHECKING:
{shapes}
    from sprag_study.service.client.queries import Ends, Held, Value


class AsyncStudyViews(AsyncStudyPart):
    """Those methods of a study that show what it has found. Numbers are SI.

    ``start`` is the number of one of the starts of a case with many; by default 0, its own.
    """
'''


def module() -> str:
    """The text of the module, which ruff lays out."""
    views = [(about, STUDY_VIEWS[about.name].shape, False) for about in study_questions.STUDY_VIEWS]
    views += [(about, CASE_VIEWS[about.name].shape, True) for about in case_questions.CASE_VIEWS]
    methods = "\n".join(_method(about, shape, of_case) for about, shape, of_case in views)
    shapes = {shape for _, shape, _ in views if _table(shape) is None}
    imports = sorted(f"    from {shape.__module__} import {shape.__name__}" for shape in shapes)
    tables = sorted({f"from {place[0]} import {place[1]}" for _, shape, _ in views if (place := _table(shape))})
    return HEAD.format(tables="\n".join(tables), shapes="\n".join(imports)) + methods


def _tables() -> dict[str, str]:
    """Modules of the classes that have tables, by what they have as ``data``; read, as the client may not be whole."""
    found = {}
    for path in sorted(CLIENT.glob("*.py")):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            for field in node.body if isinstance(node, ast.ClassDef) else ():
                if isinstance(field, ast.AnnAssign) and ast.unparse(field.target) == "data":
                    module = f"sprag_study.service.client.{path.stem}"
                    found |= dict.fromkeys(ast.unparse(field.annotation).split(" | "), f"{module} {node.name}")
    return found


TABLES: Final = _tables()


def _table(shape: Any) -> tuple[str, str] | None:
    """Module and name of the class with the tables of an answer."""
    kinds = get_args(shape) if isinstance(shape, UnionType) else (shape,)
    # The shape of a route has the study beside the data.
    names = [base.__name__ for kind in kinds for base in (kind, *getattr(kind, "__orig_bases__", ()))]
    place = next((TABLES[name] for name in names if name in TABLES), None)
    return None if place is None else (place.split()[0], place.split()[1])


def _method(about: ViewInfo, shape: Any, of_case: bool) -> str:
    asked = [setting for setting in settings_of(about.question) if not setting.setting.of_files]
    parameters = list(_parameters(asked, about.leading))
    if of_case:
        parameters.insert(0, "case: int")
        if about.starts:
            parameters += ["start: int | None = None"] if "*" in parameters else ["*", "start: int | None = None"]
    answer = _table(shape)
    query = ", ".join(_sent(asked))
    if of_case and about.starts:
        query = f'{query}, "start": start'.removeprefix(", ")
    address = f'self._of_case(case, "/{about.name}"' if of_case else f'self._get("/{about.name}"'
    call = f"await {address}, query)" if query else f"await {address})"
    made = f'cast("{shape.__name__}", {call})' if answer is None else f'{answer[1]}(cast("Any", {call}))'
    asking = f"        query = query_of({{{query}}})\n" if query else ""
    name = shape.__name__ if answer is None else answer[1]
    return (
        f"    async def {about.method}({', '.join(['self', *parameters])}) -> {name}:\n"
        f"{_docstring(about, asked)}{asking}        return {made}\n"
    )


def _parameters(asked: list[NamedSetting], leading: int) -> Iterator[str]:
    """The parameters: those that stand without a name, which are no pairs, and the others by name."""
    first = [setting for setting in asked if not setting.name.endswith(ENDS)][:leading]
    yield from map(_parameter, first)
    others = [setting for setting in asked if setting not in first and not setting.name.endswith(ENDS[1])]
    if others:
        yield "*"
    yield from map(_parameter, others)


def _parameter(setting: NamedSetting) -> str:
    if setting.name.endswith(ENDS[0]):
        return f"{setting.name.removesuffix(ENDS[0])}_range: Ends | None = None"
    kind, default = _kind(setting)
    return f"{setting.name}: {kind}" if setting.default is ... else f"{setting.name}: {kind}{default}"


def _kind(setting: NamedSetting) -> tuple[str, str]:
    """The type of a parameter, and what follows where it is optional."""
    kinds = [kind for kind in get_args(setting.type) if kind is not type(None)] if not _plain(setting.type) else []
    kind = kinds[0] if kinds else setting.type
    if setting.setting.metavar == "PATH=VALUE":
        return "Held", " | None = None"
    if get_origin(kind) is list:
        return ("str | Sequence[str]" if get_args(kind)[0] is str else "Sequence[float]"), " = ()"
    if kind is bool:
        return "bool", " = False"
    if get_origin(kind) is Literal:
        return str(kind).removeprefix("typing."), " | None = None"
    if kind is str and setting.setting.metavar in QUANTITIES:
        return "Value", " | None = None"
    return kind.__name__, " | None = None"


def _plain(kind: Any) -> bool:
    return get_origin(kind) in (list, Literal) or isinstance(kind, type)


def _sent(asked: list[NamedSetting]) -> Iterator[str]:
    for setting in asked:
        pair = next((place for place, end in enumerate(ENDS) if setting.name.endswith(end)), None)
        value = setting.name
        if pair is not None:
            ends = f"{setting.name.removesuffix(ENDS[pair])}_range"
            value = f"None if {ends} is None else {ends}[{pair}]"
        yield f'"{setting.alias}": {value}'


def _docstring(about: ViewInfo, asked: list[NamedSetting]) -> str:
    head, _, more = about.summary.partition("\n\n")
    first, dot, rest = head.partition(". ")
    paragraphs = [f"{first}." if dot else first, *([rest] if rest else []), *([more] if more else [])]
    lines = ["\n".join(_wrapped(text, 8)) for text in paragraphs[1:]]
    text = " " * 8 + '"""' + "\n".join(_wrapped(paragraphs[0], 8, '"""')).strip().removeprefix('"""')
    text += "".join(f"\n\n{line}" for line in lines)
    if not asked:
        return f'{text}"""\n'
    text += "\n\n        Parameters\n        ----------"
    for setting in asked:
        if setting.name.endswith(ENDS[1]):
            continue
        optional = "" if setting.default is ... else ", optional"
        meaning = setting.setting.meaning.replace("; may be repeated", "")
        if setting.setting.metavar == "PATH=VALUE":
            meaning = meaning.partition(": ")[2]
        if setting.name.endswith(ENDS[0]):
            name, kind = f"{setting.name.removesuffix(ENDS[0])}_range", "two float or str"
            meaning = f"its ends, {meaning}"
        else:
            name, kind = setting.name, _told(setting)
        text += f"\n        {name} : {kind}{optional}\n" + "\n".join(
            _wrapped(f"{meaning[0].upper()}{meaning[1:]}.", 12)
        )
    return f'{text}\n        """\n'


def _told(setting: NamedSetting) -> str:
    kind, _ = _kind(setting)
    told = {
        "Value": "float or str",
        "Held": "mapping of str to float or str",
        "str | Sequence[str]": "str or sequence of str",
        "Sequence[float]": "sequence of float",
    }
    return told.get(kind, kind.replace("Literal[", "{").replace("]", "}"))


def _wrapped(text: str, indent: int, first: str = "") -> list[str]:
    return textwrap.wrap(text, 120, initial_indent=" " * indent + first, subsequent_indent=" " * indent)
