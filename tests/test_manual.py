"""The manual pages of the commands: every command has one, and its text is well-formed."""

from __future__ import annotations

import os
import re
import shutil
import subprocess

import pytest

from docs import manual
from tests.test_docs import commands

FILES = sorted(manual.FOLDER.glob("*.1"))


def test_every_command_has_a_page_with_its_options() -> None:
    assert {file.name: file.read_text() for file in FILES} == manual.pages()
    names = commands()
    for name, options in names.items():
        if not name or any(other.startswith(f"{name} ") for other in names):
            continue  # a group: its commands have their own pages
        # What a group of commands has in common stands on its page.
        words = ["sprag", *name.split()]
        above = ["-".join(words[:count]) for count in range(1, len(words) + 1)]
        text = "".join((manual.FOLDER / f"{page}.1").read_text() for page in above).replace(r"\-", "-")
        assert [option for option in options if option.startswith("-") and option not in text] == [], name


def test_values_have_names() -> None:
    for file in FILES:
        assert re.findall(r"<(?:str|int|float)>", file.read_text()) == [], f"{file.name}: an option needs a metavar"


def test_pages_refer_to_pages() -> None:
    names = {file.stem for file in FILES}
    for file in FILES:
        (related,) = re.findall(r"(?s)\.SH SEE ALSO\n(.*)", file.read_text().replace(r"\-", "-"))
        found = re.findall(r"\\fB(.+?)\\fR\(1\)", related)
        assert found, file.name
        assert set(found) <= names


def test_mandoc_finds_no_fault() -> None:
    if shutil.which("mandoc") is None:
        if "CI" in os.environ:
            pytest.fail("mandoc is not installed")
        pytest.skip("mandoc is not installed")
    done = subprocess.run(
        ["mandoc", "-T", "lint", "-W", "warning", *FILES], capture_output=True, text=True, check=False
    )
    # The pages have no date: they would differ each day.
    assert [line for line in done.stdout.splitlines() if "missing date" not in line] == []


def test_text_is_escaped() -> None:
    assert manual.roff("a-b\\c") == r"a\-b\ec"
    assert [manual.roff(text) for text in (".x", "'x")] == [r"\&.x", r"\&'x"]
