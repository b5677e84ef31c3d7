"""The recorder: its share of the processor, its memory, losses, deaths, and its writer's speed."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
import shutil
import signal
import statistics
import tempfile
import time

import numpy as np

from goalreach_bags.reader import BagReader
from goalreach_bags.recording import TICK_TOPICS
from goalreach_bags.repair import repair_bag
from goalreach_bags.topic import STORAGES, BagTopic, QosOffer, StorageOptions, message_definition
from goalreach_bags.writer import BagWriter
from goalreach_lab.rigs.recorded_run import (
    find_recorder,
    lost_messages,
    running_stack,
    unanswered_ticks,
    watch_run,
)
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.errors import ConfigurationError

SUMMARY = 'Recorder: processor, memory, losses, sudden deaths; its writer beside that of rosbags'

_ROUNDS = 5
_IMAGE = 'sensor_msgs/msg/Image'
_IMAGE_BYTES = 640 * 480 + 60
_NS_PER_IMAGE = 40_000_000
_LATEST_DEATH_S = 3.0


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the suite's options."""
    add = parser.add_argument
    add('--seconds', type=float, default=20.0, help='length of the real-time run; 0: none')
    add('--kills', type=int, default=3, help='recorders to kill at a random moment')
    add('--images', type=int, default=300, help='images to write in each round')


def execute(options: argparse.Namespace) -> list[BenchRow]:
    """Measure.

    Raises:
        GoalreachError: An option is refused, or the graph does not come up.
    """
    for name, least in (('seconds', 0.0), ('kills', 0), ('images', 1)):
        if getattr(options, name) < least:
            raise ConfigurationError(f'--{name}', getattr(options, name), f'at least {least:g}')
    rows = []
    with tempfile.TemporaryDirectory(prefix='goalreach-') as folder:
        if options.seconds:
            rows += _real_time_run(Path(folder), options.seed, options.seconds)
        if options.kills:
            rows.append(_sudden_deaths(Path(folder), options.seed, options.kills))
        rows += _writers(Path(folder), options.images)
    return rows


def _real_time_run(folder: Path, seed: int, seconds: float) -> list[BenchRow]:
    path = folder / 'run'
    with running_stack(path, seed=seed, clock='realtime') as stack:
        seen = watch_run(find_recorder(stack, path), seconds)
    with BagReader(path) as bag:
        count, lost, skipped = sum(bag.counts.values()), lost_messages(bag), unanswered_ticks(bag)
    note = f'{seen.watched_s:.0f} s at 25 Hz, 640 x 480, {count} messages'
    goal = Goal(of='ours', relation='<=', bound=1 / 3)
    none = Goal(of='ours', relation='<=', bound=0.0)
    flat = Goal(of='ours', relation='<=', bound=10.0)
    return [
        BenchRow(name='recorder, processor', unit='cores', ours=seen.cores, goal=goal, note=note),
        BenchRow(
            name='recorder, messages lost',
            unit='',
            ours=sum(lost.values()),
            goal=none,
            n=count,
            note=f'topics: {lost or "none"}; by the numbers that publishers give their messages',
        ),
        BenchRow(
            name='ticks that a node of the run left out',
            unit='',
            ours=max(skipped.values(), default=0),
            n=len(TICK_TOPICS),
            note=f'topics: {skipped or "none"}; never sent, or lost (above)',
        ),
        BenchRow(
            name='recorder, memory gained',
            unit='MB',
            ours=seen.growth_mb,
            goal=flat,
            note=f'{seen.peak_mb:.0f} MB at most',
        ),
    ]


def _sudden_deaths(folder: Path, seed: int, kills: int) -> BenchRow:
    """Kill recorders of running graphs at random moments; count bags that are whole after."""
    rng = np.random.default_rng(seed)
    readable = 0
    for number in range(kills):
        path = folder / f'killed-{number}'
        with running_stack(path, seed=seed, clock='realtime') as stack:
            recorder = find_recorder(stack, path)
            time.sleep(_LATEST_DEATH_S * rng.random())
            os.kill(recorder, signal.SIGKILL)
        result = repair_bag(path)
        with BagReader(path) as bag:
            readable += sum(1 for _ in bag.messages()) == result.messages > 0
    return BenchRow(
        name='killed recorders whose bag is readable after repair',
        unit='',
        ours=readable,
        reference=kills,
        reference_name='killed',
        goal=Goal(of='ratio', relation='>=', bound=1.0),
        n=kills,
    )


def _writers(folder: Path, images: int) -> list[BenchRow]:
    """Write the same images with our writer and with that of rosbags, in turns."""
    data = np.random.default_rng(0).integers(0, 256, _IMAGE_BYTES, dtype=np.uint8).tobytes()
    rows = []
    for storage in STORAGES:
        ours, theirs = [], []
        for number in range(_ROUNDS):
            ours.append(_write_ours(folder / f'{storage}-{number}', storage, data, images))
            theirs.append(_write_rosbags(folder / f'{storage}-r{number}', storage, data, images))
        rows.append(
            BenchRow(
                name=f'writing images, {storage}',
                unit='MB/s',
                ours=images * _IMAGE_BYTES / statistics.median(ours) / 1e6,
                reference=images * _IMAGE_BYTES / statistics.median(theirs) / 1e6,
                reference_name='rosbags',
                n=_ROUNDS,
                note='ours flushes every chunk and keeps check sums; that of rosbags does not',
            )
        )
    return rows


def processor_row(folder: Path, images: int, rounds: int) -> BenchRow:
    """Return the processor time of our writer beside that of rosbags, MCAP, turn about.

    Args:
        folder: Where the bags go.
        images: Images in each bag.
        rounds: Bags of each.
    """
    data = np.random.default_rng(0).integers(0, 256, _IMAGE_BYTES, dtype=np.uint8).tobytes()
    took: dict[str, list[float]] = {'ours': [], 'rosbags': []}
    for number in range(rounds):
        for name, write in (('ours', _write_ours), ('rosbags', _write_rosbags)):
            bag = folder / f'{name}-{number}'
            began_s = time.process_time()
            write(bag, 'mcap', data, images)
            took[name].append((time.process_time() - began_s) / images * 1e6)
            shutil.rmtree(bag)
    return BenchRow(
        name='recording an image of 640 x 480, MCAP, processor time',
        unit='us',
        ours=statistics.median(took['ours']),
        reference=statistics.median(took['rosbags']),
        reference_name='raw writer of rosbags',
        goal=Goal(of='ratio', relation='<=', bound=1.3),
        n=rounds,
        note=f'from {min(took["ours"]):.0f} to {max(took["ours"]):.0f}; ours flushes every '
        'chunk and keeps check sums',
    )


def _write_ours(path: Path, storage: str, data: bytes, images: int) -> float:
    began_s = time.perf_counter()
    writer = BagWriter(path, StorageOptions(storage=storage))
    writer.add_topic(
        BagTopic(
            name='/image',
            type_name=_IMAGE,
            type_hash='',
            offers=(QosOffer(),),
            definition=message_definition(_IMAGE),
        )
    )
    for number in range(images):
        writer.write('/image', number * _NS_PER_IMAGE, data)
    writer.close()
    return time.perf_counter() - began_s


def _write_rosbags(path: Path, storage: str, data: bytes, images: int) -> float:
    from rosbags.rosbag2 import StoragePlugin, Writer

    plugin = StoragePlugin.MCAP if storage == 'mcap' else StoragePlugin.SQLITE3
    definition = message_definition(_IMAGE)
    began_s = time.perf_counter()
    with Writer(path, version=9, storage_plugin=plugin) as writer:
        connection = writer.add_connection(
            '/image', _IMAGE, msgdef=definition, rihs01='RIHS01_' + 64 * '0'
        )
        for number in range(images):
            writer.write(connection, number * _NS_PER_IMAGE, data)
    return time.perf_counter() - began_s
