"""Memory of a node: full collections in its loop, freed blocks that are kept."""

from collections.abc import Iterator
import gc
import subprocess
import sys

import pytest

from goalreach_msgs_py.ros.process import PeriodicGc


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
    periodic = PeriodicGc(100.0)
    periodic.collect_if_due(109.9)
    assert not full_collections
    for now_s in (110.0, 110.1, 119.9):
        periodic.collect_if_due(now_s)
    assert len(full_collections) == 1
    periodic.collect_if_due(120.0)
    assert len(full_collections) == 2


def test_what_exists_at_the_beginning_is_not_looked_through_again() -> None:
    before = gc.get_freeze_count()
    PeriodicGc(0.0)
    assert gc.get_freeze_count() > before
    gc.unfreeze()


PROGRAM = """
import resource
from array import array
from goalreach_msgs_py.ros.process import keep_freed_memory

if KEEP:
    keep_freed_memory()
image = bytes(640 * 480)


def faults():
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt


def make_two():
    first, second = array('B'), array('B')
    first.frombytes(image)
    second.frombytes(image)
    return first.tobytes()


for _ in range(20):
    make_two()
before = faults()
for _ in range(100):
    make_two()
print(faults() - before)
"""


def faults_of_100_images(*, keep: bool) -> int:
    program = PROGRAM.replace('KEEP', str(keep))
    run = subprocess.run([sys.executable, '-c', program], capture_output=True, check=True)
    return int(run.stdout)


@pytest.mark.skipif(not sys.platform.startswith('linux'), reason='glibc alone has mallopt')
def test_pages_of_images_stay() -> None:
    # Two images and a copy of one are 225 pages of 4096 bytes.
    assert faults_of_100_images(keep=True) < 225
