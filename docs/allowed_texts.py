"""What faults say is allowed, as far as it stands in words in the code: translated where a fault is shown."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

_SERVICE: Final = Path(__file__).resolve().parents[1] / "service"
#: What is the same in all languages: code, names of fields, formats.
_CODE: Final = re.compile(r"`[^`]*`|'[^']*'|\"[^\"]*\"|\[[^\]]*\]|--\S+|\b(?:csv|json|pdf|html|null|true|PATH|VALUE)\b")


def allowed_texts() -> Iterator[str]:
    """Every such text; some more than once. Texts with numbers in them are `sprag.service.languages.ranges`."""
    for file in sorted(_SERVICE.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            if isinstance(node, ast.keyword) and node.arg == "allowed":
                yield from (text for text in _constants(node.value) if re.search(r"[a-z]{3}", _CODE.sub("", text)))


def _constants(value: ast.expr) -> Iterator[str]:
    if isinstance(value, ast.Constant) and isinstance(value.value, str) and not value.value.endswith((" ", "of ")):
        yield value.value
    elif isinstance(value, ast.IfExp):
        yield from (*_constants(value.body), *_constants(value.orelse))
