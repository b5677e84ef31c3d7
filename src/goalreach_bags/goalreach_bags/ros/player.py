"""The player: the messages of a bag into the graph again, in their time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
import itertools
import os
import select
import sys
import termios
import time
import tty
from typing import Any, Final

import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rosbags.interfaces import QosDurability
from rosgraph_msgs.msg import Clock

from goalreach_bags.decode import Decoder
from goalreach_bags.options import ReplayOptions
from goalreach_bags.reader import BagMessage, BagReader
from goalreach_bags.ros.channels import publisher_profile
from goalreach_bags.storage import BagError
from goalreach_evaluation.terminal import progress_bar
from goalreach_msgs_py.ros.dds_profile import fast_dds_profile
from goalreach_msgs_py.ros.interfaces import message_class
from goalreach_msgs_py.ros.messaging import RELIABLE_QOS, stamp_to_msg
from goalreach_msgs_py.ros.node import StopRequest
from goalreach_msgs_py.topics import CLOCK

_NS_PER_S = 1_000_000_000


@dataclass
class ReplayTimer:
    """Maps the time of a bag to the wall clock, at a rate, with pauses.

    >>> timer = ReplayTimer(rate=2.0)
    >>> timer.begin(now_s=10.0, at_ns=0)
    >>> timer.due_s(1_000_000_000)
    10.5

    Attributes:
        rate: Seconds of the bag per second of the wall clock.
        paused: Whether time stands still.
    """

    rate: float = 1.0
    paused: bool = False
    _now_s: float = field(default=0.0, init=False)
    _at_ns: float = field(default=0.0, init=False)

    def begin(self, *, now_s: float, at_ns: int) -> None:
        """Let a time of the bag be now."""
        self._now_s, self._at_ns = now_s, float(at_ns)

    def time_ns(self, now_s: float) -> int:
        """Return the time of the bag."""
        passed_s = 0.0 if self.paused else now_s - self._now_s
        return round(self._at_ns + passed_s * self.rate * _NS_PER_S)

    def due_s(self, time_ns: int) -> float:
        """Return when a time of the bag comes, if there is no pause before it."""
        return self._now_s + (time_ns - self._at_ns) / (self.rate * _NS_PER_S)

    def toggle(self, now_s: float) -> None:
        """Pause, or go on."""
        self._at_ns = float(self.time_ns(now_s))
        self._now_s = now_s
        self.paused = not self.paused

    def step_to(self, now_s: float, time_ns: int) -> None:
        """Jump to a time of the bag."""
        self._now_s, self._at_ns = now_s, float(time_ns)

    def change_rate(self, now_s: float, factor: float) -> None:
        """Go on at another rate."""
        self._at_ns = float(self.time_ns(now_s))
        self._now_s = now_s
        self.rate *= factor


_NS_PER_S_player: Final = 1_000_000_000
_CLOCK_PERIOD_NS: Final = 25_000_000
"""Where the bag has no clock one is made, at 40 Hz as rosbag2 does."""

_KEY_S: Final = 0.05
_LINGER_S: Final = 0.3
"""Time for the last messages to be fetched before the publishers go. Chosen."""

_FASTER: Final = 1.25


class Player(Node):
    """Publishes the messages of a bag as they are, with the quality of service they had.

    Publishes: the selected topics; `/clock` only when asked: the recorded one, or one made of
    the receive times.

    Args:
        bag: The bag, open.
        options: What to play, and how.

    Raises:
        GoalreachError: There is nothing to play, or a type is of another definition here.
    """

    def __init__(self, bag: BagReader, options: ReplayOptions) -> None:
        """Make the publishers."""
        super().__init__('player', start_parameter_services=False, enable_rosout=False)
        self._bag = bag
        self._options = options
        names = [name for name in bag.topics if options.selection.includes(name)]
        self._makes_clock = options.clock and CLOCK not in names
        if not options.clock:
            names = [name for name in names if name != CLOCK]
        bag.require(options.selection.full_names)
        if not any(bag.counts[name] for name in names):
            raise BagError(bag.path, 'holds no message of what is to be replayed')
        Decoder(bag.topics[name] for name in names)
        self._names = names
        self._first_ns = bag.first_ns + round(options.start * _NS_PER_S_player)
        self._stop_ns = bag.last_ns + 1
        if options.duration is not None:
            lasts_ns = round(options.duration * _NS_PER_S_player)
            self._stop_ns = min(self._stop_ns, self._first_ns + lasts_ns)
        if self._first_ns >= self._stop_ns:
            lasts_s = (bag.last_ns - bag.first_ns) / _NS_PER_S_player
            raise BagError(bag.path, f'ends after {lasts_s:.3f} s, before the start asked for')
        self._outlets: dict[str, Any] = {name: self._publisher(name) for name in names}
        self._clock: Any = None
        if self._makes_clock:
            self._clock = self.create_publisher(Clock, CLOCK, RELIABLE_QOS)
        self._timer = ReplayTimer(rate=options.rate, paused=options.paused)
        self._clocked_ns = 0
        self._quit = False
        self._steps = 0

    @property
    def duration_ns(self) -> int:
        """Time of the bag that is played."""
        return self._stop_ns - self._first_ns

    def play(
        self,
        is_over: Callable[[], bool],
        key: Callable[[float], str],
        watch: Callable[[int], None],
    ) -> int:
        """Play to the end, or until told to stop; return the messages sent.

        Args:
            is_over: Looked at between messages.
            key: Waits for a key within a time; space pauses, s or right steps, up and down
                change the rate, q ends.
            watch: Called with the nanoseconds of the bag that were played since the last call.
        """
        time.sleep(self._options.delay)
        sent = 0
        while True:
            sent += self._play_once(is_over, key, watch)
            if not self._options.loop or self._quit or is_over():
                break
        self._linger()
        return sent

    def _publisher(self, name: str) -> Any:
        topic = self._bag.topics[name]
        profile = publisher_profile(topic.offers)
        return self.create_publisher(message_class(topic.type_name), name, profile)

    def _play_once(
        self,
        is_over: Callable[[], bool],
        key: Callable[[float], str],
        watch: Callable[[int], None],
    ) -> int:
        sent = self._catch_up()
        self._timer.begin(now_s=time.monotonic(), at_ns=self._first_ns)
        self._clocked_ns = 0
        at_ns = self._first_ns
        for time_ns, messages in self._instants():
            self._wait_for(time_ns, is_over, key)
            if self._quit or is_over():
                return sent
            watch(time_ns - at_ns)
            at_ns = time_ns
            for message in messages:
                self._outlets[message.topic].publish(message.data)
                sent += 1
        return sent

    def _instants(self) -> Iterator[tuple[int, Iterator[BagMessage]]]:
        """Yield the messages, those of one receive time together."""
        messages = self._bag.messages(self._names, start_ns=self._first_ns, stop_ns=self._stop_ns)
        yield from itertools.groupby(messages, key=lambda message: message.time_ns)

    def _catch_up(self) -> int:
        """Publish what latched topics held at the start."""
        latched = [
            name
            for name in self._names
            if any(
                o.durability is QosDurability.TRANSIENT_LOCAL
                for o in self._bag.topics[name].offers
            )
        ]
        sent = 0
        if latched and self._first_ns > self._bag.first_ns:
            for message in self._bag.messages(latched, stop_ns=self._first_ns):
                self._outlets[message.topic].publish(message.data)
                sent += 1
        return sent

    def _wait_for(
        self, time_ns: int, is_over: Callable[[], bool], key: Callable[[float], str]
    ) -> None:
        """Wait until a time of the bag has come, or a step leads there."""
        while not self._quit and not is_over():
            now_s = time.monotonic()
            self._tell_time(now_s, time_ns)
            if self._timer.paused:
                self._obey(key(_KEY_S))
                if self._steps:
                    self._steps -= 1
                    self._timer.step_to(time.monotonic(), time_ns)
                    self._tell_time(time.monotonic(), time_ns)
                    return
                continue
            wait_s = self._timer.due_s(time_ns) - now_s
            if wait_s <= 0.0:
                return
            if self._clock is not None:
                wait_s = min(wait_s, _CLOCK_PERIOD_NS / (_NS_PER_S_player * self._timer.rate))
            self._obey(key(min(wait_s, _KEY_S)))

    def _tell_time(self, now_s: float, limit_ns: int) -> None:
        if self._clock is None:
            return
        time_ns = min(self._timer.time_ns(now_s), limit_ns)
        if time_ns - self._clocked_ns >= _CLOCK_PERIOD_NS or time_ns == limit_ns:
            self._clocked_ns = time_ns
            self._clock.publish(Clock(clock=stamp_to_msg(time_ns)))

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

    def _linger(self) -> None:
        for outlet in self._outlets.values():
            outlet.wait_for_all_acked(Duration(seconds=_LINGER_S))
        time.sleep(_LINGER_S)


_READ_BYTES: Final = 1024
_ARROWS: Final = {'\x1b[A': 'up', '\x1b[B': 'down', '\x1b[C': 'right', '\x1b[D': 'left'}


class Keyboard:
    """Reads keys as they are pressed; knows none where stdin is no terminal."""

    def __init__(self) -> None:
        self.is_there = sys.stdin.isatty()
        self._typed = ''

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Take keys unechoed and at once while the context lasts."""
        if not self.is_there:
            yield
            return
        descriptor = sys.stdin.fileno()
        before = termios.tcgetattr(descriptor)
        try:
            tty.setcbreak(descriptor)
            yield
        finally:
            termios.tcsetattr(descriptor, termios.TCSADRAIN, before)

    def key(self, timeout_s: float) -> str:
        """Return a key that is pressed within a time, '' if none is; arrows as 'up', 'right'..."""
        if not self.is_there:
            select.select([], [], [], timeout_s)
            return ''
        if not self._typed:
            ready, _, _ = select.select([sys.stdin], [], [], timeout_s)
            if not ready:
                return ''
            self._typed = os.read(sys.stdin.fileno(), _READ_BYTES).decode(errors='replace')
        for sequence, name in _ARROWS.items():
            if self._typed.startswith(sequence):
                self._typed = self._typed[len(sequence) :]
                return name
        key, self._typed = self._typed[:1], self._typed[1:]
        return key


_PROFILES: Final = 'FASTRTPS_DEFAULT_PROFILES_FILE'
_MS: Final = 1_000_000


def replay(options: ReplayOptions) -> str:
    """Replay a bag; return a line that says what was done.

    Raises:
        GoalreachError: The bag cannot be read, or holds nothing to replay.
    """
    stop = StopRequest()
    with BagReader(options.bag) as bag:
        os.environ.setdefault(_PROFILES, fast_dds_profile())
        rclpy.init(args=[], signal_handler_options=SignalHandlerOptions.NO)
        player = None
        try:
            player = Player(bag, options)
            return _play(player, options, stop)
        finally:
            if player is not None:
                player.destroy_node()
            rclpy.try_shutdown()


def _play(player: Player, options: ReplayOptions, stop: StopRequest) -> str:
    keyboard = Keyboard()
    label = 'replay (space: pause, s: step, up/down: rate, q: end)'
    began_s = time.monotonic()
    total = player.duration_ns // _MS
    with (
        keyboard.listening(),
        progress_bar(label, total=total, quiet=options.quiet or options.loop) as advance,
    ):
        sent = player.play(
            lambda: stop.requested, keyboard.key, lambda passed_ns: advance(passed_ns // _MS)
        )
    return f'replayed {sent} messages in {time.monotonic() - began_s:.1f} s: {options.bag}'
