"""Recorded sensors through live perception and state estimation, in lockstep."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
import os
from pathlib import Path
import tempfile
from typing import Any, Final

import rclpy
from rclpy.experimental import EventsExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions

from goalreach_bringup.bags.bag_reader_file import BagReader
from goalreach_bringup.bags.decoder import Decoder
from goalreach_bringup.bags.errors import BagError
from goalreach_bringup.bags.raw_message import stamp_of
from goalreach_bringup.bags.recomputation import OUTPUTS, SENSORS, Recomputation, TopicResult
from goalreach_bringup.bags.recording import PARAMETERS_KEY
from goalreach_bringup.bags.ros_feeder import Feeder
from goalreach_bringup.parameter_file import merge_parameters, read_parameters, write_parameters
from goalreach_bringup.run.environment import fast_dds_profile
from goalreach_bringup.run.plan import ESTIMATOR, LOCALIZER, NODES
from goalreach_bringup.terminal import progress_bar
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.topics import BUMPERS, POSE
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode

__all__ = ['recompute']

_PROFILES: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_DEPTH: Final = 64
"""Stamps whose sensors may be incomplete at a time. Chosen."""


def recompute(
    path: Path, *, tolerance: float, params_file: Path | None = None
) -> list[TopicResult]:
    """Feed the recorded sensors and compare the answers with the recorded ones.

    Only stamps that perception had answered are fed: it then sees what it saw.

    Args:
        path: The bag, recorded from the beginning of a run.
        tolerance: Largest difference of a field that counts as none.
        params_file: Parameters that replace those recorded in the bag.

    Returns:
        One result per output, the earliest difference first.

    Raises:
        GoalreachError: The bag lacks what is needed, or perception does not answer.
    """
    with BagReader(path) as bag:
        bag.require((*SENSORS, *OUTPUTS))
        decoder = Decoder(bag.topics[name] for name in (*SENSORS, *OUTPUTS))
        recorded = _answers(bag)
        stamps = recorded[POSE].keys()
        comparison = Recomputation(decoder, tolerance)
        with (
            _perception(bag, params_file) as feeder,
            progress_bar('recompute', total=len(stamps)) as advance,
        ):
            for stamp_ns, sensors in _sensor_sets(bag, stamps):
                answers = feeder.ask(stamp_ns, sensors)
                for name in OUTPUTS:
                    if stamp_ns in recorded[name]:
                        before = recorded[name][stamp_ns]
                        comparison.compare(name, stamp_ns, before, answers[name])
                advance(1)
        if not all(result.compared for result in comparison.results.values()):
            raise BagError(path, 'holds no stamp with all sensors and answers')
        return comparison.ordered()


def _answers(bag: BagReader) -> dict[str, dict[int, bytes]]:
    answers: dict[str, dict[int, bytes]] = {name: {} for name in OUTPUTS}
    for message in bag.messages(OUTPUTS):
        answers[message.topic][stamp_of(message.data)] = message.data
    return answers


def _sensor_sets(
    bag: BagReader, stamps: Mapping[int, Any] | Any
) -> Iterator[tuple[int, dict[str, bytes]]]:
    """Yield the sensors of each stamp, when all of it are there, in order."""
    collected: dict[int, dict[str, bytes]] = {}
    last_ns = -1
    for message in bag.messages(SENSORS):
        stamp_ns = stamp_of(message.data)
        if stamp_ns not in stamps or stamp_ns <= last_ns:
            continue
        collected.setdefault(stamp_ns, {})[message.topic] = message.data
        if len(collected[stamp_ns]) == len(SENSORS):
            last_ns = stamp_ns
            yield stamp_ns, collected.pop(stamp_ns)
            collected = {s: values for s, values in collected.items() if s > stamp_ns}
        elif len(collected) > _DEPTH:
            del collected[min(collected)]


@contextmanager
def _perception(bag: BagReader, params_file: Path | None) -> Iterator[Feeder]:
    """Bring localizer and estimator up in this process, on topics of their own."""
    os.environ.setdefault(_PROFILES, fast_dds_profile())
    executor: EventsExecutor | None = None
    nodes: list[Node] = []
    with tempfile.TemporaryDirectory(prefix='goalreach-') as directory:
        parameters_path = _write_parameters(bag, params_file, Path(directory))
        arguments = ['--ros-args', '--params-file', str(parameters_path)]
        arguments += ['--log-level', 'error', '--disable-external-lib-logs']
        for name in (*SENSORS, *OUTPUTS, '/diagnostics'):
            arguments += ['-r', f'{name}:=/_recompute_{os.getpid()}{name}']
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
        try:
            executor = EventsExecutor()
            feeder = Feeder(bag, executor)
            nodes += [feeder, LandmarkLocalizerNode(), StateEstimatorNode()]
            for node in nodes:
                executor.add_node(node)
            feeder.connect(deaf=(BUMPERS,))
            yield feeder
        finally:
            if executor is not None:
                executor.shutdown()
            for node in nodes:
                node.destroy_node()
            rclpy.try_shutdown()


def _write_parameters(bag: BagReader, params_file: Path | None, directory: Path) -> Path:
    """Write the recorded parameters, with those of a file over them."""
    recorded_path, path = directory / 'recorded.yaml', directory / 'parameters.yaml'
    text = bag.custom.get(PARAMETERS_KEY)
    if text is None and params_file is None:
        raise BagError(
            bag.path,
            'does not tell the parameters of its run (made without run --record?): '
            'give them with --params-file',
        )
    layers = []
    if text is not None:
        recorded_path.write_text(text, encoding='utf-8')
        layers.append(read_parameters(recorded_path, NODES))
    if params_file is not None:
        layers.append(read_parameters(params_file, NODES))
    merged = merge_parameters(*layers)
    for node in (LOCALIZER, ESTIMATOR):
        merged.setdefault(node, {})
    try:
        write_parameters(path, {node: merged[node] for node in (LOCALIZER, ESTIMATOR)})
    except OSError as error:
        raise GoalreachError(f'{path}: cannot be written: {error.strerror}') from None
    return path
