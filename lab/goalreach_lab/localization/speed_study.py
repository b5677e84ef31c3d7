"""Processor time and accuracy of the localizer against other methods on the same images."""

from collections.abc import Callable, Sequence
import functools
import math
import time
from typing import Any, Final, TypeVar

import cv2
import numpy as np

from goalreach_lab.localization.frame_log import percentiles
from goalreach_lab.localization.waypoint_robot import Step, WaypointRobot, inputs_of
from goalreach_lab.rigs.localization_peers import BlobsAndP3P, FilterpyEkf, SpotsAndLeastSquares
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, per_case
from goalreach_msgs_py.angles import INCH_M
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray, Pose2
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator_config import SimulatorConfig

_LONGEST, _SEARCH = 20, 500
_ROBOTS = 20
OURS: Final = 'ours, tracking'
P3P: Final = 'SimpleBlobDetector + solveP3P'
LEAST_SQUARES: Final = 'scipy least_squares on our spots'
EKF: Final = 'filterpy EKF on our windows'
_ACQUISITION: Final = 'ours, one image'
_HEAD: Final = 'ours, head command'
_PEERS: Final = (P3P, LEAST_SQUARES, EKF)
_Value = TypeVar('_Value')


class InterleavedTimings:
    """Processor times (ms) and position errors (in) by method, one of each for every image kept.

    The methods take turns on each image, so that a change of the machine's load meets all alike.
    """

    def __init__(self) -> None:
        self.ms: dict[str, list[float]] = {}
        self.errors_in: dict[str, list[float]] = {}
        self.discard()

    def time(self, method: str, function: Callable[[], _Value]) -> _Value:
        """Call a function and add its processor time to the method's for the current image."""
        began_s = time.process_time()
        value = function()
        elapsed_ms = 1e3 * (time.process_time() - began_s)
        self._image_ms[method] = self._image_ms.get(method, 0.0) + elapsed_ms
        return value

    def solve(self, method: str, pose: Pose2) -> None:
        """Set the pose that a method found in the current image."""
        self._poses[method] = pose

    def keep(self, truth: Pose2) -> None:
        """Keep the current image's times, and the errors of its poses."""
        for method, elapsed_ms in self._image_ms.items():
            self.ms.setdefault(method, []).append(elapsed_ms)
        for method, pose in self._poses.items():
            self.errors_in.setdefault(method, []).append(_distance_m(pose, truth) / INCH_M)
        self.discard()

    def discard(self) -> None:
        """Forget the current image."""
        self._image_ms: dict[str, float] = {}
        self._poses: dict[str, Pose2] = {}


def _distance_m(pose: Pose2, truth: Pose2) -> float:
    return math.hypot(pose.x_m - truth.x_m, pose.y_m - truth.y_m)


class _TimedRobot(WaypointRobot):
    """A robot whose localizer is timed."""

    def __init__(self, seed: Sequence[int], timings: InterleavedTimings) -> None:
        super().__init__(seed, noise=NoiseModel())
        self._timings = timings

    def localize(self, frame: SensorFrame) -> LocalizerOutput:
        """Return the localizer's output for a frame.

        The head command is timed apart: no peer computes one.
        """
        output = self._timings.time(OURS, lambda: super(_TimedRobot, self).localize(frame))
        self._timings.time(_HEAD, lambda: self.localizer.head_command)
        return output


def speed_study(*, frames: int, seed: int) -> Study:
    """Return the study of processor times and errors of all methods on the same images.

    Only images that hold all three LEDs count, because the other methods need three.

    Args:
        frames: Number of images, divided among up to twenty robots.
        seed: Seed of everything random.
    """
    each = -(-frames // _ROBOTS)
    return Study(
        name='speed',
        key=('robot', 'frames'),
        settings={'seed': seed},
        cases=[{'robot': robot, 'frames': each} for robot in range(-(-frames // each))],
        measure=per_case(functools.partial(_measure, seed=seed)),
        analyse=_analyse,
        rows=_rows,
    )


def _measure(case: Case, *, seed: int) -> Result:
    """Return times and errors on the images of one robot with its own drawn errors."""
    cv2.setNumThreads(1)
    timings = InterleavedTimings()
    robot = _TimedRobot((seed, case['robot'], 70), timings)
    noise = NoiseModel()
    config = LocalizerConfig.for_arena(Arena(), noise)
    peers = _Peers(config, noise, timings)
    taken = 0
    for step in robot.run(_SEARCH + _LONGEST * case['frames']):
        seen = all(landmark is not None for landmark in step.output.landmarks)
        if step.output.mode != 'tracking' or not seen or not peers.solve(step):
            timings.discard()
            continue
        timings.solve(OURS, step.output.estimate.pose)
        _acquire(step, config, timings)
        timings.keep(step.frame.truth.pose)
        taken += 1
        if taken == case['frames']:
            break
    return {'taken': taken, 'ms': timings.ms, 'in': timings.errors_in}


def _acquire(step: Step, config: LocalizerConfig, timings: InterleavedTimings) -> None:
    """Let a new localizer find the pose in one image."""
    localizer, inputs = LandmarkLocalizer(config), inputs_of(step.frame)
    output = timings.time(_ACQUISITION, lambda: localizer.process(**inputs))
    if output.counters.acquired:
        timings.solve(_ACQUISITION, localizer.filter.pose)


class _Peers:
    """The other methods.

    Args:
        config: Configuration of the localizer.
        noise: The errors to expect.
        timings: Where times and poses go.
    """

    def __init__(
        self, config: LocalizerConfig, noise: NoiseModel, timings: InterleavedTimings
    ) -> None:
        self._config, self._noise, self._timings = config, noise, timings
        self._camera = SimulatorConfig().calibrated_camera
        self._blobs = BlobsAndP3P(config, self._camera)
        self._squares = SpotsAndLeastSquares(config, self._camera, noise)
        self._ekf: FilterpyEkf | None = None

    def solve(self, step: Step) -> bool:
        """Solve an image by every method; return whether each found the LEDs it needs."""
        frame, timings = step.frame, self._timings
        leds_px = np.array([[led.u_px, led.v_px] for led in step.output.landmarks if led])
        blobs = timings.time(P3P, lambda: self._blobs.detect(frame.image))
        labelled = self._blobs.assign(blobs, leds_px)
        if labelled is None or not self._solve_squares(step, leds_px):
            return False
        self._solve_p3p(labelled, step)
        self._filter(step)
        return True

    def _solve_p3p(self, pixels_px: FloatArray, step: Step) -> None:
        solutions = self._timings.time(P3P, lambda: self._blobs.solve(pixels_px))
        poses = [self._blobs.pose(*one, step.frame.joints) for one in solutions]
        if poses:
            truth = step.frame.truth.pose
            self._timings.solve(P3P, min(poses, key=lambda pose: _distance_m(pose, truth)))

    def _solve_squares(self, step: Step, leds_px: FloatArray) -> bool:
        squares, timings, frame = self._squares, self._timings, step.frame
        spots = timings.time(LEAST_SQUARES, lambda: squares.detector.in_frame(frame.image))
        pixels_px = self._blobs.assign(spots.pixels_px, leds_px)
        if pixels_px is None:
            return False
        near = step.output.estimate.pose
        pose = timings.time(LEAST_SQUARES, lambda: squares.solve(pixels_px, frame.joints, near))
        timings.solve(LEAST_SQUARES, pose)
        return True

    def _filter(self, step: Step) -> None:
        frame, timings = step.frame, self._timings
        if self._ekf is None:
            self._ekf = FilterpyEkf(
                self._config, self._camera, self._noise, step.output.estimate.pose
            )
        ekf = self._ekf
        odometry = frame.odometry.pose
        pose = timings.time(EKF, lambda: ekf.see(frame.image, frame.joints, odometry))
        timings.solve(EKF, pose)


def _analyse(results: Sequence[Result]) -> dict[str, Any]:
    found: dict[str, Any] = {'frames': sum(result['taken'] for result in results)}
    for what in ('ms', 'in'):
        methods = dict.fromkeys(name for result in results for name in result[what])
        found[what] = {
            name: percentiles(np.concatenate([result[what].get(name, []) for result in results]))
            for name in methods
        }
    return found


def _rows(found: dict[str, Any]) -> list[BenchRow]:
    ms = found['ms']
    rows = [
        BenchRow(
            name=f'{name}, processor time, median',
            unit='ms',
            ours=ms[method]['median'],
            n=found['frames'],
            note=f'p95 {ms[method]["p95"]:.2f} ms',
        )
        for name, method in (
            ('tracking frame', OURS),
            ('head command', _HEAD),
            ('acquisition', _ACQUISITION),
        )
    ]
    for what, unit, figure in (
        ('tracking frame, median', 'ms', 'median'),
        ('position error, rms', 'in', 'rms'),
    ):
        rows += [
            _peer_row(f'{what}, against {peer}', unit, figure, (OURS, peer), found)
            for peer in _PEERS
            if peer in found[unit]
        ]
    if _ACQUISITION in found['in']:
        name = 'position error of a single image, rms'
        rows.append(_peer_row(name, 'in', 'rms', (_ACQUISITION, P3P), found))
    return rows


def _peer_row(
    name: str, unit: str, figure: str, methods: tuple[str, str], found: dict[str, Any]
) -> BenchRow:
    ours, peer = (found[unit][method] for method in methods)
    return BenchRow(
        name=name, unit=unit, ours=ours[figure], reference=peer[figure], reference_name=methods[1],
        goal=Goal(of='ratio', relation='<=', bound=1.0), n=found['frames'],
        note=f'p95 {ours["p95"]:.2f} against {peer["p95"]:.2f} {unit}',
    )  # fmt: skip
