"""The recorder: processor time, memory, losses, sudden deaths, and the speed of its writer."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
import contextlib
from contextlib import contextmanager
from dataclasses import dataclass
import multiprocessing
import os
from pathlib import Path
import shutil
import signal
import statistics
import struct
import tempfile
import time
from typing import Final

from mcap.exceptions import McapError
from mcap.records import Message
from mcap.stream_reader import StreamReader
import numpy as np

from goalreach_bags.options import StorageOptions
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import TICK_TOPICS, lost_messages
from goalreach_bags.repair import repair_bag
from goalreach_bags.storage import STORAGES
from goalreach_bags.topic import BagTopic, message_definition
from goalreach_bags.writer import BagWriter
from goalreach_lab.options import BenchOptions
from goalreach_lab.rigs.processes import CpuMeter, find_descendant, holdings_of
from goalreach_lab.rigs.stack import Stack, free_domains
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.options import option

SUMMARY = 'Recorder: processor, memory, losses, sudden deaths; its writer against that of rosbags'

_ROUNDS = 5
_IMAGE = 'sensor_msgs/msg/Image'
_IMAGE_BYTES = 640 * 480 + 60
_NS_PER_IMAGE = 40_000_000
_LATEST_DEATH_S = 3.0
_START_S: Final = 30.0
_SAMPLE_S: Final = 0.5
_WRITES: Final = 1_000_000
"""A recorder is at work once its bag has so many bytes."""

_SETTLED: Final = 0.2
"""Memory is compared from this part of the run on: before, buffers are still being filled."""


@dataclass(frozen=True, kw_only=True)
class Options(BenchOptions):
    """Options of the suite."""

    seconds: float = option(20.0, 'length of the real-time run; 0: none', minimum=0.0)
    kills: int = option(3, 'recorders to kill at a random moment', minimum=0)
    images: int = option(300, 'images to write in each round', minimum=1)


def execute(options: Options) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option is refused, or the graph does not come up.
    """
    rows = []
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        if options.seconds:
            rows += _real_time_rows(Path(folder), options.seed, options.seconds)
        if options.kills:
            rows.append(_sudden_deaths(Path(folder), options.seed, options.kills))
        rows += processor_rows(options.images, _ROUNDS, STORAGES)
    return rows


@contextmanager
def _recorded_stack(bag: Path, seed: int) -> Iterator[int]:
    """Run `goalreach run --record`; yield the process id of the recorder, once it writes.

    Raises:
        GoalreachError: The recorder does not come up.
    """
    words = ['--quiet', '--no-dashboard', '--seed', str(seed), '--clock', 'realtime']
    words += ['--starts', 'random', '--record', str(bag)]
    stack = Stack(words, domain=free_domains(1)[0], log_directory=bag.parent)
    try:
        yield _wait_for_recorder(stack, bag)
    finally:
        stack.stop()


def _wait_for_recorder(stack: Stack, bag: Path) -> int:
    deadline_s = time.monotonic() + _START_S
    while time.monotonic() < deadline_s and stack.alive:
        if sum(path.stat().st_size for path in bag.glob('*')) > _WRITES:
            pid = find_descendant(stack.pid, 'record')
            if pid is not None:
                return pid
        time.sleep(0.05)
    raise GoalreachError('the recorder of the run did not come up')


def _measure_recorder(pid: int, seconds: float) -> list[BenchRow]:
    """Measure processor time and memory of a recorder for some time."""
    began_s, meter = time.monotonic(), CpuMeter([pid])
    memory_mb: list[float] = []
    while time.monotonic() - began_s < seconds:
        time.sleep(_SAMPLE_S)
        held = holdings_of(pid)
        if held is None:
            raise GoalreachError('the recorder has ended')
        memory_mb.append(held.memory_mb)
    settled = memory_mb[int(_SETTLED * len(memory_mb)) :]
    return [
        BenchRow(
            name='recorder, processor',
            unit='cores',
            ours=meter.cores,
            note=f'{seconds:.0f} s at 25 Hz, 640 x 480',
        ),
        BenchRow(
            name='recorder, memory gained',
            unit='MB',
            ours=settled[-1] - settled[0],
            goal=Goal(of='ours', relation='<=', bound=10.0),
            note=f'{max(memory_mb):.0f} MB at most',
        ),
    ]


def _incomplete_ticks(bag: BagReader) -> dict[str, int]:
    """Return by topic how many ticks of the clock have no message in the bag.

    A node that is behind in real time leaves out an image; the recorder has then lost nothing,
    since nothing was sent. The last ticks may be incomplete: the run was interrupted.
    """
    stamps: dict[str, set[int]] = {name: set() for name in TICK_TOPICS}
    for message in bag.messages(TICK_TOPICS):
        stamps[message.topic].add(stamp_of(message.data))
    ticks = set(sorted(stamps['/clock'])[:-3])
    absent = {name: len(ticks - found) for name, found in stamps.items()}
    return {name: count for name, count in absent.items() if count}


def _real_time_rows(folder: Path, seed: int, seconds: float) -> list[BenchRow]:
    path = folder / 'run'
    with _recorded_stack(path, seed) as recorder:
        rows = _measure_recorder(recorder, seconds)
    with BagReader(path) as bag:
        count, absent = sum(bag.counts.values()), _incomplete_ticks(bag)
        lost = lost_messages(bag.metadata.custom)
    return [
        *rows,
        BenchRow.none_allowed(
            'recorder, messages lost',
            sum(lost.values()),
            n=count,
            note=f'topics: {lost or "none"}; by the sequence numbers of the publishers',
        ),
        BenchRow(
            name='ticks that a node of the run left out',
            unit='',
            ours=max(absent.values(), default=0),
            n=len(TICK_TOPICS),
            note=f'topics: {absent or "none"}; never sent, or lost (above)',
        ),
    ]


def _sudden_deaths(folder: Path, seed: int, kills: int) -> BenchRow:
    """Kill recorders of running graphs at random moments; count the bags repaired without loss."""
    rng = np.random.default_rng(seed)
    repaired, messages = 0, 0
    for number in range(kills):
        path = folder / f'killed-{number}'
        with _recorded_stack(path, seed) as recorder:
            time.sleep(_LATEST_DEATH_S * rng.random())
            os.kill(recorder, signal.SIGKILL)
        (file,) = path.glob('*.mcap')
        before, whole = file.read_bytes(), _whole_messages(file)
        result = repair_bag(path)
        kept = file.with_name(f'{file.name}.damaged').read_bytes() == before
        with BagReader(path) as bag:
            found = sum(1 for _ in bag.messages())
        repaired += kept and found == result.messages >= whole > 0
        messages += found
        shutil.rmtree(path)
    return BenchRow(
        name='killed recorders whose bag is repaired, without loss of a whole chunk',
        unit='',
        ours=repaired,
        reference=kills,
        reference_name='killed',
        goal=Goal(of='ratio', relation='>=', bound=1.0),
        n=kills,
        note=f'{messages} messages',
    )


def _whole_messages(path: Path) -> int:
    """Return how many messages the reader of `mcap` finds before the end of a file is missed."""
    found = 0
    with path.open('rb') as stream, contextlib.suppress(McapError, ValueError, struct.error):
        for record in StreamReader(stream, validate_crcs=True).records:
            found += isinstance(record, Message)
    return found


def processor_rows(images: int, rounds: int, storages: Sequence[str]) -> list[BenchRow]:
    """Return the processor time of our writer against that of rosbags, measured in turns.

    Each storage is measured in a process of its own: the history of a process decides whether its
    allocator keeps blocks of this size or returns them to the kernel, so that the same writer
    takes 150 or 450 us for an image.

    Args:
        images: Images in each bag.
        rounds: Bags of each.
        storages: 'mcap', which has a goal, or 'sqlite3'.
    """
    context = multiprocessing.get_context('spawn')
    rows = []
    for storage in storages:
        with ProcessPoolExecutor(max_workers=1, mp_context=context) as alone:
            rows.append(alone.submit(_processor_row, images, rounds, storage).result())
    return rows


def _processor_row(images: int, rounds: int, storage: str) -> BenchRow:
    with tempfile.TemporaryDirectory(prefix='goalreach-') as name:
        took = _write_in_turns(Path(name), images, rounds, storage)
    return BenchRow(
        name=f'recording an image of 640 x 480, {storage}, processor time',
        unit='us',
        ours=statistics.median(took['ours']),
        reference=statistics.median(took['rosbags']),
        reference_name='raw writer of rosbags',
        goal=Goal(of='ratio', relation='<=', bound=0.5) if storage == 'mcap' else None,
        n=rounds,
        note=f'from {min(took["ours"]):.0f} to {max(took["ours"]):.0f}; ours flushes every '
        'chunk and adds check sums',
    )


def _write_in_turns(
    folder: Path, images: int, rounds: int, storage: str
) -> dict[str, list[float]]:
    """Return the processor time of each bag by either writer, us for an image."""
    data = np.random.default_rng(0).integers(0, 256, _IMAGE_BYTES, dtype=np.uint8).tobytes()
    took: dict[str, list[float]] = {'ours': [], 'rosbags': []}
    for number in range(rounds):
        for name, write in (('ours', _write_ours), ('rosbags', _write_rosbags)):
            bag = folder / f'{name}-{number}'
            began_s = time.process_time()
            write(bag, storage, data, images)
            took[name].append((time.process_time() - began_s) / images * 1e6)
            shutil.rmtree(bag)
    return took


def _write_ours(path: Path, storage: str, data: bytes, images: int) -> None:
    writer = BagWriter(path, StorageOptions(storage=storage))
    definition = message_definition(_IMAGE)
    writer.add_topic(BagTopic(name='/image', type_name=_IMAGE, definition=definition))
    for number in range(images):
        writer.write('/image', number * _NS_PER_IMAGE, data)
    writer.close()


def _write_rosbags(path: Path, storage: str, data: bytes, images: int) -> None:
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if storage == 'mcap' else StoragePlugin.SQLITE3
    definition = message_definition(_IMAGE)
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection(
            '/image', _IMAGE, msgdef=definition, rihs01='RIHS01_' + 64 * '0'
        )
        for number in range(images):
            writer.write(connection, number * _NS_PER_IMAGE, data)
