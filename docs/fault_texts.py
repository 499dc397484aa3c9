"""What faults say, as far as it stands in words in the code: translated where a fault is shown."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator
from typing import Final

from sprag_study.service.spec.described import A_LIST, NO_LIST

#: Functions that take the message of a fault, and its place among their arguments.
_MESSAGE: Final = {
    **dict.fromkeys(("fault", "Fault", "ParameterFault", "refused", "parameter_error"), 2),
    **dict.fromkeys(("refuse", "refuse_each", "FormulaError", "QuantityError", "TimingError"), 1),
    "mistake": 0,
    "check_size": 0,  # what there is too much of
}
#: Those that take what is allowed without a keyword.
_ALLOWED: Final = dict.fromkeys(("Fault", "ParameterFault", "parameter_error"), 4)
#: Where every message is translated as it is.
_WHOLE: Final = ("service/reading/", "service/results/", "service/schedules/", "service/spec/")
#: What is the same in all languages: code, names of fields, formats.
_CODE: Final = re.compile(r"`[^`]*`|'[^']*'|\"[^\"]*\"|\[[^\]]*\]|--\S+|\b(?:csv|json|pdf|html|null|true|PATH|VALUE)\b")
_WORDS: Final = re.compile(r"[a-z]{3}|\b(?:as|in|no|or)\b")


def fault_texts(calls: Iterable[ast.Call], where: str) -> Iterator[str]:
    """Messages of faults and what they say is allowed; some more than once. Those with values are sentences.

    ``calls`` are those of a module of the service, ``where`` is its path from the root. Raises ValueError for an
    f-string, which cannot be translated.
    """
    for call in calls:
        yield from _texts(call, where)


def _texts(call: ast.Call, where: str) -> Iterator[str]:
    name = getattr(call.func, "id", getattr(call.func, "attr", ""))
    message = call.args[_MESSAGE[name] : _MESSAGE[name] + 1] if name in _MESSAGE else []
    allowed = call.args[_ALLOWED[name] : _ALLOWED[name] + 1] if name in _ALLOWED else []
    allowed += [given.value for given in call.keywords if given.arg == "allowed"]
    if name == "Listed":
        yield from (text.format(items=items) for text in (NO_LIST, A_LIST) for items in _constants(call.args[0]))
        for note in (*call.args[4:5], *(given.value for given in call.keywords if given.arg == "note")):
            yield from _constants(note)
    for value in message:
        if isinstance(value, ast.JoinedStr) and where.startswith(_WHOLE):
            raise ValueError(f"{where}:{value.lineno}: an f-string cannot be translated; a Sentence can")
        yield from _constants(value)
    for value in allowed:
        yield from (text for text in _constants(value) if _WORDS.search(_CODE.sub("", text)))


def _constants(value: ast.expr) -> Iterator[str]:
    if isinstance(value, ast.Constant) and isinstance(value.value, str):
        yield value.value
    elif isinstance(value, ast.IfExp):
        yield from (*_constants(value.body), *_constants(value.orelse))
