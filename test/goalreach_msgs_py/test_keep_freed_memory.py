"""Images in turn: their memory is kept, not handed back and faulted in again."""

import subprocess
import sys

import pytest

PROGRAM = """
import resource
from array import array
from goalreach_msgs_py.ros.node import keep_freed_memory

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
