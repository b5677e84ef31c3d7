"""Full collections in a loop."""

from collections.abc import Iterator
import gc

import pytest

from goalreach_msgs_py.ros.node import GarbageRounds


@pytest.fixture
def full_collections() -> Iterator[list[int]]:
    """Yield one entry for each full collection of this process."""
    seen: list[int] = []

    def note(phase: str, info: dict[str, int]) -> None:
        if phase == 'stop' and info['generation'] == 2:
            seen.append(info['generation'])

    gc.callbacks.append(note)
    yield seen
    gc.callbacks.remove(note)
    gc.unfreeze()


def test_a_collection_comes_once_a_period(full_collections: list[int]) -> None:
    rounds = GarbageRounds(100.0)
    rounds.look(109.9)
    assert not full_collections
    for now_s in (110.0, 110.1, 119.9):
        rounds.look(now_s)
    assert len(full_collections) == 1
    rounds.look(120.0)
    assert len(full_collections) == 2


def test_what_exists_at_the_beginning_is_not_looked_through_again() -> None:
    before = gc.get_freeze_count()
    GarbageRounds(0.0)
    assert gc.get_freeze_count() > before
    gc.unfreeze()
