"""Which files of Fast DDS are removed, and which are not."""

import fcntl
import mmap
import os
from pathlib import Path
import time

from goalreach_bringup.launch.environment import abandoned_files, remove_abandoned


def make(folder: Path, *names: str, age_s: float = 60.0) -> None:
    for name in names:
        path = folder / name
        path.touch()
        then = time.time() - age_s
        os.utime(path, (then, then))


def test_files_of_dead_processes_go_and_those_in_use_stay(tmp_path: Path) -> None:
    dead = {'fastrtps_aa', 'fastrtps_aa_el', 'fastrtps_port7411', 'fastrtps_port7411_el'}
    dead |= {'sem.fastrtps_port7411_mutex', 'fastrtps_port7413', 'sem.fastrtps_port7413_mutex'}
    used = {'fastrtps_bb', 'fastrtps_bb_el', 'other', 'other_el'}
    make(tmp_path, *dead, *used)
    with (tmp_path / 'fastrtps_bb_el').open() as user:
        fcntl.flock(user, fcntl.LOCK_SH)
        assert {path.name for path in abandoned_files(tmp_path)} == dead
        assert remove_abandoned(tmp_path) == len(dead)
    assert {path.name for path in tmp_path.iterdir()} == used


def test_files_that_were_just_made_are_left_alone(tmp_path: Path) -> None:
    make(tmp_path, 'fastrtps_aa', 'fastrtps_aa_el', age_s=0.0)
    assert remove_abandoned(tmp_path) == 0


def test_what_a_living_process_has_mapped_stays() -> None:
    folder = Path('/dev/shm')  # noqa: S108 - mappings are told by where they are
    name = f'fastrtps_test{os.getpid()}'
    path = folder / name
    path.write_bytes(b'\0' * 4096)
    try:
        with path.open('r+b') as stream, mmap.mmap(stream.fileno(), 4096):
            os.utime(path, (0.0, 0.0))
            assert path not in abandoned_files()
        # A graph that starts at this moment, in another test, removes it.
        assert path in abandoned_files() or not path.exists()
    finally:
        path.unlink(missing_ok=True)
