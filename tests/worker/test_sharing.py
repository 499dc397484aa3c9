"""How dispatchers share studies: who takes a free one, who gives one away; and that this comes to rest."""

from __future__ import annotations

from random import Random

import pytest

from sprag_study.worker.ports import ActiveStudy, Peer
from sprag_study.worker.sharing import gives, takes
from sprag_study.worker.states import StudyState


def study(number: int, *, priority: int = 0, fingerprint: str = "") -> ActiveStudy:
    return ActiveStudy(number, str(number), StudyState.RUNNING, priority, fingerprint=fingerprint)


def test_a_free_study_goes_to_a_dispatcher_with_the_fewest() -> None:
    assert takes(study(1), "a", 9, [])
    assert takes(study(1), "a", 2, [Peer("a", 2), Peer("b", 3)])
    assert not takes(study(1), "a", 2, [Peer("a", 5), Peer("b", 1)])


def test_a_study_with_rows_goes_to_a_dispatcher_of_their_fingerprint_while_there_is_one() -> None:
    begun = study(1, fingerprint="b")
    assert not takes(begun, "a", 0, [Peer("b", 7)])
    assert takes(begun, "b", 7, [Peer("a", 0)])
    assert not takes(begun, "b", 7, [Peer("a", 9), Peer("b", 0)])
    assert takes(begun, "a", 0, [Peer("c", 0)]), "nobody else can go on with it"


def test_the_latest_study_of_the_lowest_priority_is_given_away() -> None:
    own = [study(1), study(2, priority=5), study(3), study(4, priority=1)]
    assert gives(own, [Peer("a", 2)]) == 3
    assert gives(own, [Peer("a", 3)]) is None
    assert gives(own, []) is None
    assert gives([study(1, fingerprint="b"), study(2, fingerprint="b")], [Peer("a", 0)]) is None
    assert gives([study(1), study(2, fingerprint="b")], [Peer("a", 0)]) == 1


def test_one_that_can_run_nothing_leaves_studies_to_those_that_can() -> None:
    assert takes(study(1), "a", 0, [], stuck=True), "it waits where nobody else could run it"
    assert not takes(study(1), "a", 0, [Peer("b", 7)], stuck=True)
    assert gives([study(1)], [Peer("b", 7)], stuck=True) == 1
    assert gives([study(1)], [], stuck=True) is None
    begun = study(1, fingerprint="a")
    assert takes(begun, "a", 0, [Peer("b", 0)], stuck=True), "only one of its fingerprint goes on with it"
    assert not takes(begun, "a", 0, [Peer("a", 3)], stuck=True)
    assert gives([begun], [Peer("b", 0)], stuck=True) is None
    assert gives([begun], [Peer("a", 3)], stuck=True) == 1


@pytest.mark.parametrize("seed", range(20))
def test_sharing_comes_to_rest_with_equal_shares(seed: int) -> None:
    draw = Random(seed)
    count = draw.randint(2, 5)
    own = {name: {number for number in range(100) if number % 7 == name} for name in range(count)}
    free = {number for number in range(100) if number % 7 >= count}
    for _ in range(1000):
        name = draw.randrange(count)
        peers = [Peer("f", len(own[other])) for other in own if other != name]
        given = gives([study(number) for number in own[name]], peers)
        if given is not None:
            own[name].remove(given)
            free.add(given)
        for number in sorted(free):
            if takes(study(number), "f", len(own[name]), peers):
                free.remove(number)
                own[name].add(number)
                break
    assert not free
    assert sorted(number for share in own.values() for number in share) == list(range(100))
    sizes = [len(share) for share in own.values()]
    assert max(sizes) - min(sizes) <= 1
