"""What a fault says is allowed, in the reader's language."""

from __future__ import annotations

import re
from typing import Final

from sprag.service.languages import ENGLISH, N_, current, decimal, gettext, ngettext

#: A number in a sentence.
NUMBER: Final = r"[-−+]?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?"
#: Parts of a description of what is allowed, and the texts in which their numbers stand.
_RANGES: Final = (
    (re.compile(rf"({NUMBER})(?: to | \.\. )({NUMBER})"), N_("{low} to {high}")),
    (re.compile(rf"at most ({NUMBER})"), N_("at most {high}")),
    (re.compile(rf"at least ({NUMBER})"), N_("at least {low}")),
)


def with_range(text: str) -> str:
    """What is allowed, in a text without a translation, with its range in the reader's language."""
    if current() == ENGLISH:
        return text
    for pattern, template in _RANGES:
        found = pattern.search(text)
        if found is None:
            continue
        ends = (_number(end) for end in found.groups())
        names = re.findall(r"{(\w+)}", template)
        said = gettext(template).format(**dict(zip(names, ends, strict=True)))
        text = text[: found.start()] + said + text[found.end() :]
        break
    text = re.sub(r"\band\b", gettext("and"), text)
    text = re.sub(r"… (\d+) more", lambda found: gettext("… {count} more", count=found[1]), text)
    return re.sub(r"([\d,\N{NARROW NO-BREAK SPACE}]+) characters", lambda found: _characters(found[1]), text)


def _characters(count: str) -> str:
    number = int(re.sub(r"\D", "", count))
    return ngettext("{count} character", "{count} characters", number).format(count=_number(count))


def _number(text: str) -> str:
    """A number of an English text with the separators of the reader's language."""
    return decimal(text.replace(",", "\N{NARROW NO-BREAK SPACE}"))
