"""The text of a spec: strict JSON and TOML, bounded work, faults with their places."""

from __future__ import annotations

import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.service.spec.document import SpecError, format_of, load_spec
from sprag_study.worker.limits import MAX_BODY_BYTES, MAX_DEPTH

plain = st.recursive(
    st.none() | st.booleans() | st.integers(-(10**20), 10**20) | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"]), max_size=5),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(st.text(st.characters(exclude_categories=["Cs"]), max_size=3), inner, max_size=3),
    max_leaves=8,
)  # fmt: skip


def pointers(text: str | bytes, kind: str) -> list[str]:
    with pytest.raises(SpecError) as caught:
        load_spec(text, kind)  # type: ignore[arg-type]
    json.dumps([(problem.message, problem.value) for problem in caught.value.faults], allow_nan=False)
    return [problem.where for problem in caught.value.faults]


@given(plain)
def test_json_comes_out_as_it_is(data: object) -> None:
    assert load_spec(json.dumps(data), "json") == data
    assert load_spec(json.dumps(data, ensure_ascii=False).encode(), "json") == data


def test_a_byte_order_mark_is_tolerated() -> None:
    assert load_spec(b'\xef\xbb\xbf{"a": 1}', "json") == {"a": 1}
    assert load_spec("\ufeffa = 1", "toml") == {"a": 1}


@pytest.mark.parametrize(
    ("text", "kind", "at"),
    [
        ('{"a": 1, "b": {"c": 1, "c": 2}, "a": 3}', "json", ["/a", "/b/c"]),
        ('{"a": NaN, "b": [1, Infinity, -Infinity], "c": 1e999}', "json", ["/a", "/b/1", "/b/2", "/c"]),
        ('{"a/b": {"~": NaN}}', "json", ["/a~1b/~0"]),
        ("a = nan\nb = [inf, -inf]\nc = 1e999", "toml", ["/a", "/b/0", "/b/1", "/c"]),
        ("a = 2026-01-01\nb = 12:00:00\nc = 2026-01-01T00:00:00Z", "toml", ["/a", "/b", "/c"]),
        (r'{"a": "\ud800", "\udfff": 1}', "json", ["/?", "/a"]),
        ('"\ud800"', "json", [""]),
        (b'{"a": "\xff"}', "json", [""]),
        (b"\xff\xfe{\x00}\x00", "json", [""]),
        ("", "json", [""]),
        ("{", "json", [""]),
        ('{"a": 1,}', "json", [""]),
        ("{'a': 1}", "json", [""]),
        ('{"a": 1} {}', "json", [""]),
        ('{"a": 0x10}', "json", [""]),
        ('{"a": "\n"}', "json", [""]),
        ("a = 1\na = 2", "toml", [""]),
        ("a = ", "toml", [""]),
        ('{"a": ' + "9" * 500 + "}", "json", ["/a"]),
        ('{"a": -' + "9" * (MAX_BODY_BYTES - 10) + "}", "json", ["/a"]),
        ("a = " + "9" * 5000, "toml", [""]),
        ("a = 0x" + "f" * 5000, "toml", ["/a"]),
        (" " * MAX_BODY_BYTES + "{}", "json", [""]),
    ],
    ids=lambda value: repr(value)[:25],
)
def test_what_is_refused(text: str | bytes, kind: str, at: list[str]) -> None:
    assert pointers(text, kind) == at


@pytest.mark.parametrize(
    ("text", "kind"),
    [
        ("[" * (MAX_DEPTH + 1) + "]" * (MAX_DEPTH + 1), "json"),
        ('{"a":' * 40 + "1" + "}" * 40, "json"),
        ("[" * 500_000, "json"),
        ('["' + '\\"' * 400_000 + "[" * 40, "json"),
        ("a = " + "[" * 40 + "]" * 40, "toml"),
        ("a = " + "[" * 500_000, "toml"),
        (".".join("a" * 40) + " = 1", "toml"),
        (".".join("a" * 300_000) + " = 1", "toml"),
        ("[" + ' . "a b"' * 100_000 + "]", "toml"),
        ("a = {b" + " = {b" * 40, "toml"),
    ],
    ids=lambda value: repr(value)[:15],
)
def test_depth_is_refused_at_once(text: str, kind: str) -> None:
    begin = time.thread_time()
    assert pointers(text, kind) == [""]
    assert time.thread_time() - begin < 2.0


def test_the_deepest_that_is_taken() -> None:
    assert json.dumps(load_spec("[" * MAX_DEPTH + "]" * MAX_DEPTH, "json")) == "[" * MAX_DEPTH + "]" * MAX_DEPTH
    assert load_spec('{"a": "' + "[" * 100 + '"}', "json") == {"a": "[" * 100}
    assert load_spec('a = "' + "[." * 100 + '" # ' + "[." * 100, "toml") == {"a": "[." * 100}
    assert load_spec("a = [" + "0.5, " * 1000 + "]", "toml") == {"a": [0.5] * 1000}
    assert load_spec("a = '''" + "'[.\n" * 100 + "'''", "toml") == {"a": "'[.\n" * 100}
    assert load_spec('a = """' + '"[.\n' * 100 + '"""', "toml") == {"a": '"[.\n' * 100}


@given(st.one_of(st.text(max_size=60), st.text("[]{}\"\\.=\n'#a1 ", max_size=60)), st.sampled_from(["json", "toml"]))
def test_any_text_is_data_or_refused(text: str, kind: str) -> None:
    try:
        data = load_spec(text, kind)  # type: ignore[arg-type]
    except SpecError as error:
        assert error.faults  # noqa: PT017
    else:
        json.dumps(data, allow_nan=False)


def test_the_format_goes_by_the_name() -> None:
    assert format_of("folder.json/study.TOML") == "toml"
    assert format_of("study.json") == format_of("study") == "json"
