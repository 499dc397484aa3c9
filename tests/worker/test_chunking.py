"""Cutting studies into chunks."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sprag_study.sentences import WarningText
from sprag_study.worker.chunking import CHUNK_SECONDS, MAX_CHUNKS, MIN_CASES, Chunking, chunk_cases, spans, work_of
from tests.worker import fakes


@given(cases=st.integers(1, 10_000), size=st.integers(1, 600))
def test_spans_cover_every_case_once(cases: int, size: int) -> None:
    covered = [case for first, count in spans(cases, size) for case in range(first, first + count)]
    assert covered == list(range(cases))


@given(
    cases=st.integers(1, 10_000_000),
    seconds=st.floats(0.0, 1e3),
    processes=st.integers(1, 128),
    fixed=st.integers(0, 1_000_000),
)
def test_sizes_are_possible_and_their_number_bounded(cases: int, seconds: float, processes: int, fixed: int) -> None:
    size = chunk_cases(cases, seconds, processes, fixed)
    assert 1 <= size <= cases
    assert len(range(0, cases, size)) <= MAX_CHUNKS


@pytest.mark.parametrize(
    ("cases", "seconds", "processes", "size"),
    [
        (1_000_000, 3e-4, 2, 3333),  # a second of work
        (512, 3e-4, 2, 64),  # four chunks for each process
        (20, 3e-4, 2, MIN_CASES),
        (5, 3e-4, 2, 5),
        (1000, 10.0, 2, MIN_CASES),
        (1000, 0.0, 1, 250),
    ],
)
def test_size_by_the_time_of_a_case(cases: int, seconds: float, processes: int, size: int) -> None:
    assert chunk_cases(cases, seconds, processes) == size


@pytest.mark.parametrize(
    ("seconds", "timeout", "size"),
    [(85.0, 600.0, 1), (25.0, 600.0, 8), (10.0, 600.0, 16), (700.0, 600.0, 1), (1e-3, 600.0, 128)],
)
def test_a_chunk_stays_far_from_its_time_limit(seconds: float, timeout: float, size: int) -> None:
    assert chunk_cases(1024, seconds, 2, timeout=timeout) == size
    # Half of the limit, if a case alone does not take more.
    assert seconds * work_of(size) <= max(0.5 * timeout, seconds * work_of(1))


def test_a_case_that_does_not_fit_the_time_limit_is_warned_of() -> None:
    study = fakes.study(64)
    (warning,) = Chunking(0, 2, timeout=1e-9).warnings(study)
    assert isinstance(warning, WarningText)
    assert warning.code == "exceeds-chunk-timeout"
    assert "1e-09 s" in warning
    assert Chunking(0, 2, timeout=600.0).warnings(study) == ()
    assert Chunking(0, 2, timeout=1e-9).cases_of(study) == 1


def test_a_million_cases_are_a_few_hundred_chunks() -> None:
    assert len(range(0, 10**6, chunk_cases(10**6, 3e-4, 16))) == pytest.approx(300, rel=0.01)


def test_the_setting_is_taken_as_it_is() -> None:
    assert Chunking(7, 4).cases_of(fakes.study(512)) == 7
    assert Chunking(1000, 4).cases_of(fakes.study(512)) == 512


def test_automatic_size_comes_from_the_engine() -> None:
    assert 1 <= Chunking(0, 2).cases_of(fakes.study(512)) <= 64
    assert CHUNK_SECONDS == 1.0
