"""Recomputation: recorded sensors through live perception and state estimation."""

from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
import os
from pathlib import Path
import tempfile
import time
from typing import Any, Final

from rclpy.experimental import EventsExecutor
from rclpy.node import Node

from goalreach_bags.compare import OUTPUTS, TopicResult
from goalreach_bags.decode import Decoder
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import PARAMETERS_KEY
from goalreach_bags.ros.qos_profiles import publisher_profile
from goalreach_bags.storage import BagError
from goalreach_evaluation.terminal import progress_bar
from goalreach_msgs_py import topics
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.parameter_file import merge_parameters, read_parameters, write_parameters
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.ros.messaging import DEEP_QOS
from goalreach_msgs_py.ros.node import ros_session
from goalreach_perception.landmark_localizer_node import LandmarkLocalizerNode
from goalreach_perception.state_estimator_node import StateEstimatorNode

_CONNECT_S: Final = 10.0
_REPEAT_S: Final = 1.0
_ATTEMPTS: Final = 20
"""Chosen: after the first a lost message is sent again, after so many nodes have failed."""

_INCOMPLETE_STAMPS: Final = 64
"""Stamps whose sensors may be incomplete at a time. Chosen."""

_OTHERS: Final = (topics.CLOCK, topics.LANDMARK_MARKERS, topics.DIAGNOSTICS, '/tf')
"""Topics of perception that are not compared: not those of a running graph either."""


class SensorFeeder(Node):
    """Publishes the sensors of a stamp and waits for all outputs of perception."""

    def __init__(self, bag: BagReader, executor: EventsExecutor) -> None:
        super().__init__('feeder', start_parameter_services=False, enable_rosout=False)
        self._executor = executor
        self._answers: dict[str, bytes] = {}
        self._stamp_ns = -1
        self._sensors: dict[str, Any] = {}
        for name in _sensors(bag):
            topic = bag.topics[name]
            kind, profile = message_class(topic.type_name), publisher_profile(topic.offers)
            self._sensors[name] = self.create_publisher(kind, name, profile)
        self._outputs = _recorded(bag, OUTPUTS)
        for name in self._outputs:
            kind, collect = message_class(bag.topics[name].type_name), partial(self._collect, name)
            self.create_subscription(kind, name, collect, DEEP_QOS, raw=True)

    def connect(self) -> None:
        """Wait until perception is connected; it makes no use of bumpers, or of joints it lacks.

        Raises:
            GoalreachError: It did not connect in time.
        """
        spared = topics.BUMPERS, topics.JOINT_STATES
        needed = [publisher for name, publisher in self._sensors.items() if name not in spared]

        def connected() -> bool:
            return all(publisher.get_subscription_count() for publisher in needed) and all(
                subscription.get_publisher_count() for subscription in self.subscriptions
            )

        if not self._spin_until(connected, _CONNECT_S):
            raise GoalreachError(f'perception did not connect within {_CONNECT_S:g} s')

    def process(self, stamp_ns: int, sensors: Mapping[str, bytes]) -> dict[str, bytes]:
        """Return the outputs of perception for the sensors of a stamp.

        Raises:
            GoalreachError: A topic was not answered in time.
        """
        self._stamp_ns = stamp_ns
        self._answers.clear()
        for _ in range(_ATTEMPTS):
            for name, publisher in self._sensors.items():
                publisher.publish(sensors[name])
            if self._spin_until(lambda: len(self._answers) == len(self._outputs), _REPEAT_S):
                return dict(self._answers)
        silent = ', '.join(name for name in self._outputs if name not in self._answers)
        raise GoalreachError(f'no answer on {silent} to the sensors of {stamp_ns * 1e-9:.3f} s')

    def _collect(self, name: str, data: bytes) -> None:
        if stamp_of(data) == self._stamp_ns:
            self._answers[name] = data

    def _spin_until(self, condition: Callable[[], bool], limit_s: float) -> bool:
        deadline_s = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > deadline_s:
                return False
            self._executor.spin_once(timeout_sec=0.05)
        return True


def recompute(
    path: Path, *, tolerance: float, params_file: Path | None = None, quiet: bool = False
) -> list[TopicResult]:
    """Feed the recorded sensors to live perception and compare its outputs with the recorded ones.

    Only stamps with a recorded pose are fed, so that perception receives what it received then.
    The bag was recorded from the beginning of a run; a file of parameters replaces its own.

    Returns:
        One result per output, the earliest difference first.

    Raises:
        GoalreachError: The bag lacks what is needed, or perception does not answer.
    """
    with BagReader(path) as bag:
        sensors, outputs = _sensors(bag), _recorded(bag, OUTPUTS)
        bag.require((sensors[-1], topics.CAMERA_INFO, topics.ODOM, topics.POSE, topics.STATE))
        decoder = Decoder(bag.topics[name] for name in (*sensors, *outputs))
        recorded: dict[str, dict[int, bytes]] = {name: {} for name in outputs}
        for message in bag.messages(outputs):
            recorded[message.topic][stamp_of(message.data)] = message.data
        results = {name: TopicResult(topic=name) for name in outputs}
        with (
            _perception(bag, params_file) as feeder,
            progress_bar('recompute', total=len(recorded[topics.POSE]), quiet=quiet) as advance,
        ):
            for stamp_ns, measured in _sensor_sets(bag, recorded[topics.POSE]):
                answers = feeder.process(stamp_ns, measured)
                for name in outputs:
                    if stamp_ns in recorded[name]:
                        pair = (recorded[name][stamp_ns], answers[name])
                        results[name].add(decoder, stamp_ns, pair, tolerance)
                advance(1)
        if not all(result.compared for result in results.values()):
            raise BagError(path, 'holds no stamp with all sensors and outputs')
        return sorted(results.values(), key=lambda result: result.first_ns)


def _recorded(bag: BagReader, names: Sequence[str]) -> list[str]:
    return [name for name in names if bag.counts.get(name)]


def _sensors(bag: BagReader) -> list[str]:
    """Return the recorded sensors, the image last: compressed where most images are."""
    image = max((topics.IMAGE, topics.COMPRESSED_IMAGE), key=lambda name: bag.counts.get(name, 0))
    return [*_recorded(bag, topics.SENSORS[:-1]), image]


def _sensor_sets(
    bag: BagReader, stamps: Container[int]
) -> Iterator[tuple[int, Mapping[str, bytes]]]:
    """Yield the complete sensors of each stamp, in order."""
    incomplete: dict[int, dict[str, bytes]] = {}
    sensors = _sensors(bag)
    for message in bag.messages(sensors):
        stamp_ns = stamp_of(message.data)
        if stamp_ns in stamps:
            incomplete.setdefault(stamp_ns, {})[message.topic] = message.data
            if len(incomplete[stamp_ns]) == len(sensors):
                yield stamp_ns, incomplete.pop(stamp_ns)
            elif len(incomplete) > _INCOMPLETE_STAMPS:
                del incomplete[next(iter(incomplete))]


@contextmanager
def _perception(bag: BagReader, params_file: Path | None) -> Iterator[SensorFeeder]:
    """Run localizer and estimator in this process, with all topics and both nodes renamed."""
    renamed = f'_recompute_{os.getpid()}'
    with tempfile.TemporaryDirectory(prefix='goalreach-') as directory:
        parameters_path = _write_parameters(bag, params_file, Path(directory), renamed)
        arguments = ['--ros-args', '--params-file', str(parameters_path)]
        arguments += ['--log-level', 'error']
        for name in (*topics.SENSORS, topics.COMPRESSED_IMAGE, *OUTPUTS, *_OTHERS):
            arguments += ['-r', f'{name}:=/{renamed}{name}']
        for name in (topics.LOCALIZER, topics.ESTIMATOR):
            arguments += ['-r', f'{name}:__node:={renamed}_{name}']
        with ros_session(arguments) as closing:
            executor = EventsExecutor()
            feeder = SensorFeeder(bag, executor)
            for node in (feeder, LandmarkLocalizerNode(), StateEstimatorNode()):
                closing.callback(node.destroy_node)
                executor.add_node(node)
            closing.callback(executor.shutdown)
            feeder.connect()
            yield feeder


def _write_parameters(bag: BagReader, params_file: Path | None, folder: Path, prefix: str) -> Path:
    """Write the recorded parameters, with those of a file over them, for the renamed nodes."""
    recorded_path, path = folder / 'recorded.yaml', folder / 'parameters.yaml'
    text = bag.metadata.custom.get(PARAMETERS_KEY)
    files = [] if params_file is None else [params_file]
    if text is not None:
        recorded_path.write_text(text, encoding='utf-8')
        files.insert(0, recorded_path)
    if not files:
        raise BagError(
            bag.path,
            'holds no parameters of its run (made without run --record?): '
            'pass them with --params-file',
        )
    merged = merge_parameters(*map(read_parameters, files))
    nodes = topics.LOCALIZER, topics.ESTIMATOR
    write_parameters(path, {f'{prefix}_{node}': merged[node] for node in nodes})
    return path
