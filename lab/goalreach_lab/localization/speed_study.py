"""What an image costs, and how well it is solved, beside other ways on the same images."""

from __future__ import annotations

from typing import Any, Final

import cv2
import numpy as np

from goalreach_lab.localization.frame_log import percentiles
from goalreach_lab.localization.turn_about import TurnAbout, away_m
from goalreach_lab.localization.wanderer import Step, Wanderer
from goalreach_lab.rigs.localization_peers import BlobsAndP3P, FilterpyEkf, SpotsAndLeastSquares
from goalreach_lab.row import BenchRow, Goal
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import FloatArray
from goalreach_perception.localizer import LandmarkLocalizer
from goalreach_perception.localizer_config import LocalizerConfig
from goalreach_perception.localizer_output import LocalizerOutput
from goalreach_sim.sensors import SensorFrame
from goalreach_sim.simulator_config import SimulatorConfig

_LONGEST, _SEARCH = 20, 500
_ROBOTS = 20
_TRACKING_MS, _ACQUISITION_MS = 0.25, 1.2
OURS: Final = 'ours, tracking'
P3P: Final = 'SimpleBlobDetector + solveP3P'
LEAST_SQUARES: Final = 'scipy least_squares on our spots'
_ACQUIRED: Final = 'ours, one image'
EKF: Final = 'filterpy EKF on our windows'


class _TimedWanderer(Wanderer):
    """A robot whose localizer's time is taken."""

    bench: TurnAbout

    def see(self, frame: SensorFrame) -> LocalizerOutput:
        """Return what the localizer makes of a frame."""
        self.bench.begin(OURS)
        return self.bench.timed(OURS, lambda: super(_TimedWanderer, self).see(frame))


def study_speed(*, frames: int, seed: int) -> dict[str, Any]:
    """Return processor times and errors of all ways, turn about on the same images.

    Only images that hold all three LEDs count: the others can make nothing of two.

    Args:
        frames: Images.
        seed: Of everything random.
    """
    cv2.setNumThreads(1)
    for name, peer in (('scipy', SpotsAndLeastSquares), ('filterpy', FilterpyEkf)):
        if not peer.is_installed():
            print(f'{name} is not installed: left out (pip install goalreach[bench])')
    bench = TurnAbout()
    each = -(-frames // _ROBOTS)
    taken = sum(_drive(number, each, bench, seed) for number in range(-(-frames // each)))
    return {
        'frames': taken,
        'ms': {name: percentiles(np.array(values)) for name, values in bench.ms.items()},
        'in': {name: percentiles(np.array(values)) for name, values in bench.errors_in.items()},
    }


def _drive(number: int, frames: int, bench: TurnAbout, seed: int) -> int:
    """Let one robot, with its own drawn errors, take images; return how many."""
    noise = NoiseModel()
    robot = _TimedWanderer((seed, number, 70), noise=noise)
    robot.bench = bench
    config = LocalizerConfig.for_arena(Arena(), noise)
    peers = _Peers(config, noise)
    taken = 0
    for step in robot.run(_SEARCH + _LONGEST * frames):
        seen = all(landmark is not None for landmark in step.output.landmarks)
        if step.output.mode != 'tracking' or not seen or not peers.take(step, bench):
            bench.drop(OURS)
            continue
        bench.judge(OURS, step.output.estimate.pose, step)
        _acquire(step, config, bench)
        taken += 1
        if taken == frames:
            break
    return taken


def _acquire(step: Step, config: LocalizerConfig, bench: TurnAbout) -> None:
    """Let a localizer that knows nothing of the past find the pose."""
    localizer, frame = LandmarkLocalizer(config), step.frame
    bench.begin(_ACQUIRED)
    output = bench.timed(
        _ACQUIRED,
        lambda: localizer.process(
            time_ns=frame.time_ns,
            image=frame.image,
            camera=frame.camera,
            joints=frame.joints,
            odometry=frame.odometry,
        ),
    )
    if output.counters.acquired:
        bench.judge(_ACQUIRED, localizer.filter.pose, step)


class _Peers:
    """All other ways, where they are installed.

    Args:
        config: What the localizer knows beforehand.
        noise: The errors to expect.
    """

    def __init__(self, config: LocalizerConfig, noise: NoiseModel) -> None:
        self._config, self._noise = config, noise
        camera = SimulatorConfig().calibrated_camera
        self._camera = camera
        self._blobs = BlobsAndP3P(config, camera)
        self._squares: SpotsAndLeastSquares | None = None
        if SpotsAndLeastSquares.is_installed():
            self._squares = SpotsAndLeastSquares(config, camera, noise)
        self._ekf: FilterpyEkf | None = None

    def take(self, step: Step, bench: TurnAbout) -> bool:
        """Solve an image in all ways; return whether each had what it needs."""
        frame = step.frame
        leds_px = np.array([[led.u_px, led.v_px] for led in step.output.landmarks if led])
        names = [P3P, *([LEAST_SQUARES] if self._squares else [])]
        bench.begin(*names)
        blobs = bench.timed(P3P, lambda: self._blobs.detect(frame.image))
        named = self._blobs.named(blobs, leds_px)
        found = None
        if self._squares is not None:
            detector = self._squares.detector
            spots = bench.timed(LEAST_SQUARES, lambda: detector.in_frame(frame.image))
            found = self._blobs.named(spots.pixels_px, leds_px)
        if named is None or (self._squares is not None and found is None):
            bench.drop(*names)
            return False
        self._solve_p3p(named, step, bench)
        if self._squares is not None and found is not None:
            self._solve_squares(self._squares, found, step, bench)
        if FilterpyEkf.is_installed():
            self._filter(step, bench)
        return True

    def _solve_p3p(self, pixels_px: FloatArray, step: Step, bench: TurnAbout) -> None:
        solutions = bench.timed(P3P, lambda: self._blobs.solve(pixels_px))
        poses = [self._blobs.pose(*one, step.frame.joints) for one in solutions]
        if poses:
            bench.judge(P3P, min(poses, key=lambda pose: away_m(pose, step)), step)

    def _solve_squares(
        self, squares: SpotsAndLeastSquares, pixels_px: FloatArray, step: Step, bench: TurnAbout
    ) -> None:
        near = step.output.estimate.pose
        pose = bench.timed(
            LEAST_SQUARES, lambda: squares.solve(pixels_px, step.frame.joints, near)
        )
        bench.judge(LEAST_SQUARES, pose, step)

    def _filter(self, step: Step, bench: TurnAbout) -> None:
        frame = step.frame
        if self._ekf is None:
            self._ekf = FilterpyEkf(
                self._config, self._camera, self._noise, step.output.estimate.pose
            )
        ekf = self._ekf
        bench.begin(EKF)
        pose = bench.timed(EKF, lambda: ekf.see(frame.image, frame.joints, frame.odometry.pose))
        bench.judge(EKF, pose, step)


def speed_rows(result: dict[str, Any]) -> list[BenchRow]:
    """Return the rows of speed and of the errors beside."""
    times, errors, n = result['ms'], result['in'], result['frames']
    rows = [
        BenchRow(
            name=f'{name}, all of it, median',
            unit='ms',
            ours=times[key]['median'],
            goal=Goal(of='ours', relation='<=', bound=bound),
            n=n,
            note=f'p95 {times[key]["p95"]:.2f} ms of processor time',
        )
        for name, key, bound in (
            ('tracking frame', OURS, _TRACKING_MS),
            ('acquisition', _ACQUIRED, _ACQUISITION_MS),
        )
    ]
    least = Goal(of='ratio', relation='<=', bound=1.0)
    for what, unit, found, figure in (
        ('tracking frame, median', 'ms', times, 'median'),
        ('position error, rms', 'in', errors, 'rms'),
    ):
        rows += [
            BenchRow(
                name=f'{what}, beside {peer}',
                unit=unit,
                ours=found[OURS][figure],
                reference=found[peer][figure],
                reference_name=peer,
                goal=least,
                n=n,
                note=f'p95 {found[OURS]["p95"]:.2f} beside {found[peer]["p95"]:.2f} {unit}',
            )
            for peer in (P3P, LEAST_SQUARES, EKF)
            if peer in found
        ]
    one, peer = errors.get(_ACQUIRED), errors[P3P]
    if one is not None:
        rows.append(
            BenchRow(
                name='position error of a single image, rms',
                unit='in',
                ours=one['rms'],
                reference=peer['rms'],
                reference_name=P3P,
                goal=least,
                n=n,
                note='no memory, LEDs named by ourselves; P3P is told the names',
            )
        )
    return rows
