"""The groups of rows, and the words that explain them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import importlib
from typing import Final

from goalreach_lab.row import BenchRow
from goalreach_lab.speed.measurement import Budget


@dataclass(frozen=True, kw_only=True)
class Group:
    """Rows that are measured together.

    Attributes:
        source: Module and function that measure them.
        title: Heading in the document.
        text: What each row is and how it is measured.
        profile: Where the time goes, told where a row misses its goal.
    """

    source: str
    title: str
    text: str
    profile: str = ''


GROUPS: Final = {
    'lockstep': Group(
        source='graph_rows.lockstep_rows',
        title='A tick in lockstep',
        text="""\
The wall time from one image to the next, which comes when the command for the last is there. The
floor is the same messages between the same nodes with callbacks that only set a stamp and send
what was made once, on the same executor and the same DDS profile: `EventsExecutor`, the
cheapest that serves timers, services and topics soundly. The floor sends and takes message
objects of rclpy, as anyone would write it; ours packs bytes (ARCHITECTURE.md). A probe in a
process of its own looks at `/clock` twice, with a depth of 1, and sleeps in between, so that it
costs next to nothing.""",
        profile="""\
the relay computes nothing. The computing of a frame in one process without ROS is the last row of
the table; what a composed tick takes beyond that and the relay's tick is reading and packing
messages by Python. The last section tells where the computing goes. Between processes each hop
adds the wake-up of a thread, four of them in a row in a tick, and whatever else runs on the
machine comes in between.""",
    ),
    'real-time': Group(
        source='graph_rows.real_time_rows',
        title='In real time at 25 Hz',
        text="""\
From the arrival of `/camera/camera_info`, which is sent just before its image, to the arrival of
the `/cmd_vel` with that stamp, both at the same probe; the relay likewise. What is shown is what
ours takes beyond the relay, at the median and at 99 of 100. Processor time is that of the four
nodes and the launcher, from the kernel. Memory is what a process holds of its own (anonymous
pages), beyond a node that only imports rclpy.""",
        profile="""\
between image and command there is the computing of a frame, the last section. At 25 Hz
caches are cold and the processor has to wake up for every hop, so that it takes longer than in
lockstep; p99 is that of the machine, where other programs run.""",
    ),
    'start': Group(
        source='graph_rows.start_rows',
        title='Start',
        text="""\
From starting `goalreach run` without a policy, so that it learns one, to the first command that is
not to stand. The floor starts four processes that import rclpy and make a node, until
a probe knows all four.""",
        profile="""\
the launcher imports rclpy, learns a policy and starts four processes, which import rclpy, OpenCV
and the messages and declare their parameters on what cores there are; the rest is discovery.""",
    ),
    'learning': Group(
        source='core_rows.learning_rows',
        title='Learning',
        text="""\
A learning phase of 440 paths beside IR-SIM, which only moves its robot for as many
robot-seconds at 10 Hz and learns nothing, and beside stable-baselines3's DQN on the same
environment until it reaches the goal from all 22 starts. What is not installed is left out, and
the command says so.""",
    ),
    'driving': Group(
        source='driving.driving_rows',
        title='Driving with rendered images in one process',
        text="""\
Everything included: motion, rendering, noise, spots, filter, memberships, policy, command. The
growth of the time of a frame with the size of the image and with the number of LEDs is fitted with
straight lines; the points are beside them.""",
        profile="""\
the last section.""",
    ),
    'localization': Group(
        source='core_rows.localization_rows',
        title='Localisation of an image',
        text="""\
Turn about on the same images, those that hold all three LEDs: ours, OpenCV's SimpleBlobDetector
with solveP3P, scipy's least squares on our spots, filterpy's extended Kalman filter on our
windows. The last has three states and takes the brightest light of a window for its LED; ours has
18, tells LEDs from other lights, checks its input and itself, and aims the head, all of which is
in its time. [LOCALIZATION.md](LOCALIZATION.md) holds the errors of each against one another, and
the time of an acquisition.""",
        profile="""\
products of small matrices of 18 states, and what numpy and Python need around each.""",
    ),
    'recording': Group(
        source='core_rows.recording_rows',
        title='Recording',
        text="""\
Processor time of the writer, on the same images as the writer of the package rosbags, in a process
that does nothing else.""",
    ),
    'evaluation': Group(
        source='core_rows.evaluation_rows',
        title='Many drives',
        text="""\
The same evaluation in one process and over two, and one of half as many drives. What two cores of
this machine are worth is told by two loops of plain Python at once.""",
        profile="""\
two processes have to be started, and each imports numpy and OpenCV; beside that the drives
share nothing. The rest is the machine: two cores that are hardware threads of one, or that
other programs use, are not two.""",
    ),
}


def rows_of(name: str, budget: Budget) -> list[BenchRow]:
    """Measure one group."""
    module, _, function = GROUPS[name].source.partition('.')
    found = importlib.import_module(f'goalreach_lab.speed.{module}')
    measure: Callable[[Budget], list[BenchRow]] = getattr(found, function)
    return measure(budget)
