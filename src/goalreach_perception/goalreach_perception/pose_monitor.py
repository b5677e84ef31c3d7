"""Integrity monitor: decides from the match of images and predictions whether a pose is valid."""

from collections.abc import Sequence
from dataclasses import dataclass
import enum
import math

import numpy as np

from goalreach_msgs_py.parameters import Configuration, parameter
from goalreach_msgs_py.values import FloatArray, Pose2

_PAIR = 2
_USELESS_M = 0.05
"""Uncertainty of a position, along its worst axis, at which a robot stands. Chosen: just what a
state accepts."""
_STAYS_M = 0.02
"""Farther by the odometry, a robot has moved. Chosen."""
_PATIENCE_CHECKS = 3
"""Intervals of checks in which a useless pose may become better. Chosen: 3 s."""
_LONGEST_CHECKS = 12
"""The same where many poses were useless before. Chosen: 12 s."""
_AGAIN = 6
"""Images that confirm a pose after a useless one: of three LEDs, so many tell of a misfit."""


class Mode(enum.Enum):
    """State of the localization."""

    SEARCHING = 'searching'
    CONFIRMING = 'confirming'
    TRACKING = 'tracking'
    DOUBTFUL = 'doubtful'
    REFUSED = 'refused'


@dataclass(frozen=True, kw_only=True)
class PoseMonitorConfig(Configuration):
    """Thresholds of the integrity monitor."""

    lost_after_frames: int = parameter(
        5,
        'Consecutive images contradicting a pose until it is lost (chosen: 0.2 s)',
        within=(1, 1000),
    )
    unseen_after_frames: int = parameter(
        200,
        'Consecutive images without any LED until a pose is lost (chosen: 8 s, in which a turret '
        'that turned away at full speed gets back to the LEDs)',
        within=(1, 100000),
    )
    blind_after_frames: int = parameter(
        50,
        'Images without an LED, none being predicted, until the pose is doubtful (chosen: 2 s, in '
        'which odometry drifts by less than an inch)',
        within=(1, 100000),
    )
    triple_confirmations: int = parameter(
        1,
        'Images that must confirm a pose from three LEDs: one may have been a spurious spot '
        '(chosen)',
        within=(0, 1000),
    )
    confirm_within_frames: int = parameter(
        8, 'Images within which a pose must be confirmed (chosen: 0.3 s)', within=(1, 1000)
    )
    check_every_frames: int = parameter(
        25,
        'Images from one check of the filter against one image alone to the next (chosen: 1 s)',
        within=(1, 100000),
    )
    check_gate: float = parameter(
        40.0,
        'Largest squared distance of the filter from the pose of one image, 3 dof (p = 1e-8)',
        within=(1.0, None),
    )
    contradictions: int = parameter(
        2,
        'Consecutive failed checks until the filter restarts from the image (chosen)',
        within=(1, None),
    )


class PoseMonitor:
    """The state machine of the modes.

    Attributes:
        mode: The current mode; never REFUSED.
        reason: Why it is not TRACKING; empty while it is.
    """

    def __init__(self, config: PoseMonitorConfig) -> None:
        self._config = config
        self.mode = Mode.SEARCHING
        self.reason = 'no fix yet'
        self._to_confirm = self._frames_left = 0
        self._leds: tuple[int, ...] = ()
        self._stays_at: tuple[float, float] | None = None
        self._stays, self._patience = 0, _PATIENCE_CHECKS * config.check_every_frames
        self._reset_counts()

    def _reset_counts(self) -> None:
        self._misses = self._unseen = self._confirmations = 0
        self._contradictions = self._checked = 0
        self._needs_pair = False

    @property
    def unconfirmed_leds(self) -> tuple[int, ...]:
        """The LEDs that must be detected again to confirm a new pose; else empty."""
        return self._leds if self.mode is Mode.CONFIRMING else ()

    @property
    def may_reacquire(self) -> bool:
        """Whether a pose from one image may replace the current one.

        One contradicting image is not enough: a single encoder reading may be an outlier.
        """
        doubtful = self.mode is Mode.DOUBTFUL and self._misses != 1
        return doubtful or self.mode is Mode.SEARCHING

    def start(self, leds: Sequence[int] | None, *, again: bool = False) -> None:
        """Register a new pose.

        Args:
            again: Whether images have contradicted one before: they may do so again.
            leds: LEDs of the image it was solved from; as many must be detected again to confirm
                it. None for a pose that needs no confirmation.
        """
        self._reset_counts()
        self._leds = tuple(leds or ())
        self._to_confirm = 0 if leds is None else self._config.triple_confirmations
        self._frames_left = self._config.confirm_within_frames
        if again:
            self._to_confirm, self._frames_left = _AGAIN, 2 * _AGAIN
        self.mode, self.reason = Mode.TRACKING, ''
        if self._to_confirm:
            self.mode = Mode.CONFIRMING
            self.reason = f'a pose from {len(self._leds)} lights waits for confirmation'

    def lose(self, reason: str) -> None:
        """Register the loss of the pose."""
        self.mode, self.reason = Mode.SEARCHING, reason

    def update(self, used: int, expected: int) -> None:
        """Register the match of one image with the prediction.

        An image contradicts the pose if no LED is matched, or two fewer than predicted; the pose
        is then doubtful. If two or more LEDs are missing at once, or a single one repeatedly, two
        LEDs must match before the pose is valid again, since a single spurious spot may match by
        chance. Otherwise one matched LED is enough.
        """
        bad = expected > 0 and used < max(1, expected - 1)
        doubtful = self._needs_pair and used < _PAIR
        self._misses = self._misses + 1 if bad or (doubtful and expected) else 0
        self._unseen = 0 if used else self._unseen + 1
        if self.mode is Mode.CONFIRMING:
            self._confirm(used, bad=bad or not used)
        elif self._misses >= self._config.lost_after_frames:
            self.lose('the LEDs are not where they should be')
        elif self._unseen >= self._config.unseen_after_frames:
            self.lose('no LED was seen for too long')
        elif bad or doubtful:
            self._needs_pair |= not used and (expected >= _PAIR or self._misses > _PAIR)
            self.mode, self.reason = Mode.DOUBTFUL, 'expected LEDs are not seen'
        elif self._unseen > self._config.blind_after_frames:
            self.mode, self.reason = Mode.DOUBTFUL, 'no LED is in view'
        elif used:
            self._needs_pair = False
            self.mode, self.reason = Mode.TRACKING, ''

    def _confirm(self, used: int, *, bad: bool) -> None:
        """Count an image for a new pose."""
        self._confirmations += used >= len(self._leds)
        self._frames_left -= 1
        if self._confirmations >= self._to_confirm:
            self.mode, self.reason = Mode.TRACKING, ''
        elif bad or self._frames_left <= 0:
            self.lose('a new pose was not confirmed')

    def check_due(self) -> bool:
        """Count an image of three LEDs; return whether to check the filter against it alone."""
        self._checked += 1
        return self._checked % self._config.check_every_frames == 0 or self._contradictions > 0

    def add_check(self, distance2: float) -> bool:
        """Register a check; return whether to restart the filter from the image.

        It is the squared distance of the filter from the pose of one image, 3 degrees of freedom.
        """
        agrees = distance2 <= self._config.check_gate
        self._contradictions = 0 if agrees else self._contradictions + 1
        return self._contradictions >= self._config.contradictions

    def is_useless(self, odometry: Pose2, doubt: FloatArray | None) -> bool:
        """Register a pose; return whether to forget it and what images told of constants.

        A clock that was wrong for a second, or a light taken for another, leaves a covariance that
        only motion makes small again, and a robot that stays where it is for it. Where a model
        never fits, the covariance grows again: each time the robot stays twice as long, to 12 s.

        Args:
            odometry: Pose in `odom`.
            doubt: Covariance of a pose that images have contradicted, (3, 3); else None.
        """
        since, place = self._stays_at, (odometry.x_m, odometry.y_m)
        if doubt is None or np.linalg.eigvalsh(doubt[:2, :2])[-1] <= _USELESS_M**2:
            self._stays_at = None
        elif since is None or math.dist(since, place) > _STAYS_M:
            self._stays_at, self._stays = place, 0
        self._stays += self._stays_at is not None
        if self._stays_at is None or self._stays < self._patience:
            return False
        longest = _LONGEST_CHECKS * self._config.check_every_frames
        self._stays_at, self._patience = None, min(2 * self._patience, longest)
        return True
