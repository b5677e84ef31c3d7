"""What grows is found, and what merely comes and goes is not."""

from dataclasses import replace

import pytest

from goalreach_lab.faults.soak import files_gained, growths
from goalreach_lab.rigs.processes import Holdings, Sample


def samples(
    pid: int,
    memory_mb: list[float],
    *,
    first_s: float = 0.0,
    handles: int = 10,
    name: str = 'nomad200',
) -> list[Sample]:
    return [
        Sample(
            pid=pid,
            clock_s=first_s + 10.0 * k,
            holdings=Holdings(
                name=name,
                memory_mb=mb,
                threads=12,
                handles=handles + k // 50,
                shared_files=3,
            ),
        )
        for k, mb in enumerate(memory_mb)
    ]


def test_growth_is_that_from_the_settled_beginning_to_the_end() -> None:
    (one,) = growths(samples(1, [50.0] * 20 + [100.0 + 0.1 * k for k in range(80)]), 200.0)
    assert one.memory_share == pytest.approx(0.072, abs=0.001)
    assert (one.handles, one.threads, one.shared_files) == (1.0, 0.0, 0.0)
    assert one.span_s == 790.0


def test_one_moment_of_much_work_is_no_growth() -> None:
    (one,) = growths(samples(1, [100.0] * 99 + [180.0]), 0.0)
    assert one.memory_share == 0.0


def test_of_each_process_the_longest_life_is_compared() -> None:
    killed = samples(1, [100.0 + k for k in range(40)])
    restarted = samples(2, [100.0] * 60, first_s=400.0)
    brief = samples(3, [100.0] * 15, name='forkserver')
    (one,) = growths([*killed, *restarted, *brief], 100.0)
    assert (one.name, one.memory_share, one.samples) == ('nomad200', 0.0, 50)


def test_files_are_counted_whosever_they_are() -> None:
    each = samples(1, [100.0] * 100)
    flat = [replace(one, present_files=12) for one in each]
    assert files_gained(flat, 100.0) == 0.0
    grown = [replace(one, present_files=12 + k // 30) for k, one in enumerate(each)]
    assert files_gained(grown, 100.0) == 3.0
    assert files_gained([], 100.0) == 0.0


def test_a_process_that_became_a_node_is_compared_from_then_on() -> None:
    waiting = samples(1, [40.0] * 5, name='forkserver')
    driving = samples(1, [100.0] * 95, first_s=50.0)
    (one,) = growths([*waiting, *driving], 100.0)
    assert (one.name, one.memory_share, one.samples) == ('nomad200', 0.0, 85)
