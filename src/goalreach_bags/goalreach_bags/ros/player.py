"""The player: publishes the messages of a bag at their time."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from functools import partial
import itertools
import math
import os
import select
import sys
import termios
import time
import tty
from typing import Any, Final

from rclpy.duration import Duration
from rclpy.exceptions import InvalidTopicNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rosgraph_msgs.msg import Clock
from std_srvs.srv import Trigger

from goalreach_bags.decode import Decoder
from goalreach_bags.options import ReplayOptions
from goalreach_bags.reader import BagReader
from goalreach_bags.ros.qos_profiles import publisher_profile, read_overrides
from goalreach_bags.storage import BagError, BagMessage
from goalreach_evaluation.terminal import progress_bar
from goalreach_msgs_py.errors import CommandError, GoalreachError
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_to_msg
from goalreach_msgs_py.ros.node import ros_session
from goalreach_msgs_py.ros.process import StopRequest
from goalreach_msgs_py.topics import CLOCK

_NS_PER_S: Final = 1_000_000_000
_CLOCK_PERIOD_NS: Final = 25_000_000
"""Where the bag has no clock one is made, at 40 Hz as rosbag2 does."""

_KEY_S: Final = 0.05
_LINGER_S: Final = 0.3
"""Time for subscribers to take the last messages before the publishers end. Chosen."""

_FASTER: Final = 1.25


@dataclass
class ReplayTimer:
    """Maps the time of a bag to the wall clock, at a rate, with pauses.

    >>> timer = ReplayTimer(rate=2.0)
    >>> timer.jump(10.0, 0)
    >>> timer.due_s(1_000_000_000)
    10.5

    Attributes:
        rate: Seconds of the bag per second of the wall clock.
        paused: Whether time stands still.
    """

    rate: float = 1.0
    paused: bool = False
    _now_s: float = field(default=0.0, init=False)
    _at_ns: int = field(default=0, init=False)

    def jump(self, now_s: float, at_ns: int) -> None:
        """Continue from a time of the bag."""
        self._now_s, self._at_ns = now_s, at_ns

    def time_ns(self, now_s: float) -> int:
        """Return the time of the bag."""
        passed_s = 0.0 if self.paused else now_s - self._now_s
        return round(self._at_ns + passed_s * self.rate * _NS_PER_S)

    def due_s(self, time_ns: int) -> float:
        """Return when a time of the bag comes, unless there is a pause before it."""
        return self._now_s + (time_ns - self._at_ns) / (self.rate * _NS_PER_S)

    def toggle(self, now_s: float) -> None:
        """Pause or continue."""
        self.jump(now_s, self.time_ns(now_s))
        self.paused = not self.paused

    def change_rate(self, now_s: float, factor: float) -> None:
        """Continue at another rate."""
        self.jump(now_s, self.time_ns(now_s))
        self.rate *= factor


class Player(Node):
    """Publishes the messages of a bag unchanged, with the quality of service they had.

    Publishes: the selected topics, but those of unknown types; `/clock` only on request: the
    recorded one, or one made of the receive times.

    Services (std_srvs/srv/Trigger): `~/pause`, `~/resume`, `~/toggle_paused`, `~/play_next`.

    Attributes:
        duration_ns: Time of the bag that is played.

    Args:
        is_over: Returns whether to stop; called between messages.
        key: Waits up to a time for a key and returns it: space pauses, s or right steps, up and
            down change the rate, q ends.

    Raises:
        GoalreachError: There is nothing to play.
    """

    def __init__(
        self,
        bag: BagReader,
        options: ReplayOptions,
        is_over: Callable[[], bool],
        key: Callable[[float], str],
    ) -> None:
        rules = [argument for rule in options.remap for argument in ('--remap', rule)]
        try:
            super().__init__(
                'player',
                cli_args=['--ros-args', *rules],
                start_parameter_services=False,
                enable_rosout=False,
            )
        except RuntimeError as error:  # of rcl, which ends with the places in its sources
            raise CommandError(f'--remap: {str(error).split(", at /")[0]}') from None
        self._bag = bag
        self._options = options
        self._is_over = is_over
        self._key = key
        self._outputs: dict[str, Any] = {}
        self._latched: dict[str, int] = {}
        self._add_publishers()
        self._first_ns, self._stop_ns = self._range()
        self.duration_ns = self._stop_ns - self._first_ns
        self._sent = 0
        self._clock_publisher: Any = None
        if options.clock and CLOCK not in self._outputs:
            self._clock_publisher = self.create_publisher(Clock, CLOCK, RELIABLE_QOS)
        self._timer = ReplayTimer(rate=options.rate, paused=options.paused)
        self._clocked_ns = 0
        self._served_s = -math.inf
        self._quit = False
        self._steps = 0
        for name in ('pause', 'resume', 'toggle_paused', 'play_next'):
            self.create_service(Trigger, f'~/{name}', partial(self._on_request, name))
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self)

    def _range(self) -> tuple[int, int]:
        """Return the first time of the bag to play, and the time before which to end."""
        bag, options = self._bag, self._options
        first_ns, stop_ns = bag.first_ns + round(options.start * _NS_PER_S), bag.last_ns + 1
        if options.duration is not None:
            stop_ns = min(stop_ns, first_ns + round(options.duration * _NS_PER_S))
        if first_ns >= stop_ns:
            lasts_s = (bag.last_ns - bag.first_ns) / _NS_PER_S
            raise BagError(bag.path, f'ends after {lasts_s:.3f} s, before the start asked for')
        return first_ns, stop_ns

    def _add_publishers(self) -> None:
        bag, options, path = self._bag, self._options, self._options.qos_profile_overrides_path
        overrides = {} if path is None else read_overrides(path)
        bag.require(options.selection.full_names)
        for name in sorted(overrides.keys() - bag.topics.keys()):
            self.get_logger().warning(f'{path}: {name}: the bag has no such topic')
        for name in bag.topics:
            if options.selection.includes(name) and (options.clock or name != CLOCK):
                self._add_publisher(name, overrides.get(name))
        if not any(bag.counts[name] for name in self._outputs):
            raise BagError(bag.path, 'holds no message of the topics to replay')

    def _add_publisher(self, name: str, override: QoSProfile | None) -> None:
        """Add the publisher of a topic, or warn if its type is unknown or of another version."""
        topic = self._bag.topics[name]
        try:
            Decoder([topic])
            kind = message_class(topic.type_name)
            profile = override or publisher_profile(topic.offers)
            self._outputs[name] = self.create_publisher(kind, name, profile)
        except (GoalreachError, InvalidTopicNameException) as error:
            reason = str(error).splitlines()[0].rstrip(':')
            self.get_logger().warning(f'{name} is not replayed: {reason}')
            return
        except RuntimeError as error:  # such as another type on the topic that it is mapped to
            raise CommandError(f'{name}: {str(error).split(", at /")[0]}') from None
        if profile.durability is DurabilityPolicy.TRANSIENT_LOCAL:
            self._latched[name] = max(1, profile.depth)

    def play(self, watch: Callable[[int], None]) -> int:
        """Play to the end, or until it is stopped; return the number of messages sent.

        `watch` gets the nanoseconds of the bag that were played since its last call.
        """
        end_s = time.monotonic() + self._options.delay
        while not self._ends and (left_s := end_s - time.monotonic()) > 0.0:
            self._listen(min(left_s, _KEY_S))
        self._play_once(watch)
        while self._options.loop and not self._ends:
            self._play_once(watch)
        self._wait_for_acknowledgements()
        time.sleep(_LINGER_S)
        return self._sent

    def _wait_for_acknowledgements(self) -> None:
        limit_ms = self._options.wait_for_all_acked
        limit_s = _LINGER_S if limit_ms is None else limit_ms * 1e-3 or math.inf
        end_s = time.monotonic() + limit_s
        step = Duration(seconds=_KEY_S)
        for name, publisher in self._outputs.items():
            acknowledged = publisher.wait_for_all_acked(step)
            while not acknowledged and time.monotonic() < end_s and not self._is_over():
                acknowledged = publisher.wait_for_all_acked(step)
            if not acknowledged and limit_ms is not None:
                self.get_logger().warning(f'{name}: not all messages were acknowledged')

    @property
    def _ends(self) -> bool:
        return self._quit or self._is_over()

    def _play_once(self, watch: Callable[[int], None]) -> None:
        if self._latched and self._first_ns > self._bag.first_ns:
            # What a subscriber of latched topics would have received at the start.
            kept = {name: deque[BagMessage](maxlen=n) for name, n in self._latched.items()}
            for message in self._bag.messages(kept, stop_ns=self._first_ns):
                kept[message.topic].append(message)
            self._publish(itertools.chain(*kept.values()))
        self._timer.jump(time.monotonic(), self._first_ns)
        self._clocked_ns = 0
        at_ns = self._first_ns
        limits = {}
        if self._options.start > 0.0 or self._options.duration is not None:
            limits = {'start_ns': self._first_ns, 'stop_ns': self._stop_ns}
        messages = self._bag.messages(self._outputs, **limits)
        for time_ns, together in itertools.groupby(messages, key=lambda m: m.time_ns):
            self._wait_for(time_ns)
            if self._ends:
                break
            whole_ns = (time_ns - at_ns) // _MS * _MS
            watch(whole_ns)
            at_ns += whole_ns
            self._publish(together)

    def _publish(self, messages: Iterable[BagMessage]) -> None:
        for message in messages:
            self._outputs[message.topic].publish(message.data)
            self._sent += 1

    def _wait_for(self, time_ns: int) -> None:
        """Wait until a time of the bag has come, or a step leads there."""
        while not self._ends:
            now_s = time.monotonic()
            if now_s - self._served_s >= _KEY_S:  # even if every message is late
                self._listen(0.0)
            self._publish_clock(now_s, time_ns)
            if self._timer.paused:
                self._listen(_KEY_S)
                if self._steps:
                    self._steps -= 1
                    self._timer.jump(time.monotonic(), time_ns)
                    self._publish_clock(time.monotonic(), time_ns)
                    return
                continue
            wait_s = self._timer.due_s(time_ns) - now_s
            if wait_s <= 0.0:
                return
            if self._clock_publisher is not None:
                wait_s = min(wait_s, _CLOCK_PERIOD_NS / (_NS_PER_S * self._timer.rate))
            self._listen(min(wait_s, _KEY_S))

    def _publish_clock(self, now_s: float, limit_ns: int) -> None:
        if self._clock_publisher is None:
            return
        time_ns = min(self._timer.time_ns(now_s), limit_ns)
        if time_ns - self._clocked_ns >= _CLOCK_PERIOD_NS or time_ns == limit_ns:
            self._clocked_ns = time_ns
            self._clock_publisher.publish(Clock(clock=stamp_to_msg(time_ns)))

    def _listen(self, timeout_s: float) -> None:
        """Serve a request that is there, and wait for a key."""
        self._served_s = time.monotonic()
        self._executor.spin_once(timeout_sec=0.0)
        self._obey(self._key(timeout_s))

    def _on_request(self, name: str, _: Any, response: Any) -> Any:
        if name == 'play_next':
            response.success = self._timer.paused
            self._obey('s')
        else:
            if name == 'toggle_paused' or self._timer.paused == (name == 'resume'):
                self._obey(' ')
            response.success = True
        response.message = 'paused' if self._timer.paused else 'playing'
        return response

    def _obey(self, key: str) -> None:
        now_s = time.monotonic()
        if key == ' ':
            self._timer.toggle(now_s)
        elif key in ('s', 'right'):
            self._steps += self._timer.paused
        elif key in ('up', 'down'):
            self._timer.change_rate(now_s, _FASTER if key == 'up' else 1.0 / _FASTER)
        elif key == 'q':
            self._quit = True


_READ_BYTES: Final = 1024
_ARROWS: Final = {'\x1b[A': 'up', '\x1b[B': 'down', '\x1b[C': 'right', '\x1b[D': 'left'}


@contextmanager
def keyboard() -> Iterator[Callable[[float], str]]:
    """Read keys at once and without echo inside the context; none where stdin is no terminal.

    Yields:
        A function that returns a key pressed within a time, '' if none is; arrows as 'up'...
    """
    terminals = [sys.stdin] if sys.stdin.isatty() else []
    typed = ''

    def key(timeout_s: float) -> str:
        nonlocal typed
        if not typed:
            ready, _, _ = select.select(terminals, [], [], timeout_s)
            if not ready:
                return ''
            typed = os.read(sys.stdin.fileno(), _READ_BYTES).decode(errors='replace')
        first = typed[:3] if typed[:3] in _ARROWS else typed[:1]
        typed = typed.removeprefix(first)
        return _ARROWS.get(first, first)

    with ExitStack() as restored:
        for terminal in terminals:
            before = termios.tcgetattr(terminal)
            restored.callback(termios.tcsetattr, terminal, termios.TCSADRAIN, before)
            tty.setcbreak(terminal)
        yield key


_MS: Final = 1_000_000


def replay(options: ReplayOptions) -> str:
    """Replay a bag; return a line about the result.

    Raises:
        GoalreachError: The bag cannot be read, or holds nothing to replay.
    """
    stop = StopRequest()
    label = 'replay (space: pause, s: step, up/down: rate, q: end)'
    with BagReader(options.bag) as bag, keyboard() as key, ros_session() as closing:
        player = Player(bag, options, lambda: stop.requested, key)
        closing.callback(player.destroy_node)
        began_s = time.monotonic()
        total = player.duration_ns // _MS
        quiet = options.quiet or options.loop
        with progress_bar(label, total=total, quiet=quiet) as advance:
            sent = player.play(lambda passed_ns: advance(passed_ns // _MS))
    return f'replayed {sent} messages in {time.monotonic() - began_s:.1f} s: {options.bag}'
