"""Whether a pose may be believed, from what the images keep saying."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import enum

from goalreach_msgs_py.parameters import check_fields, parameter

_PAIR = 2
_BLIND_FRAMES = 50
"""Images without any LED, none being expected, that a pose is believed on; chosen: 2 s, in which
odometry is off by less than an inch."""


class Mode(enum.Enum):
    """How far the pose is known."""

    SEARCHING = 'searching'
    CONFIRMING = 'confirming'
    TRACKING = 'tracking'
    DOUBTFUL = 'doubtful'
    REFUSED = 'refused'


@dataclass(frozen=True, kw_only=True)
class PoseMonitorConfig:
    """How much contradiction a pose survives."""

    lost_after_frames: int = parameter(
        5,
        'Images in a row that must speak against a pose to give it up (chosen: 0.2 s)',
        minimum=1,
        maximum=1000,
    )
    unseen_after_frames: int = parameter(
        200,
        'Images in a row without any LED after which a pose is given up (chosen: 8 s, in which a '
        'turret that turned away at full speed comes to the LEDs)',
        minimum=1,
        maximum=100000,
    )
    pair_confirmations: int = parameter(
        3, 'Images that must bear out a pose from two LEDs (chosen)', minimum=0, maximum=1000
    )
    triple_confirmations: int = parameter(
        1,
        'Images that must bear out a pose from three LEDs: one may have been a spurious light '
        '(chosen)',
        minimum=0,
        maximum=1000,
    )
    confirm_within_frames: int = parameter(
        8, 'Images within which a pose must be borne out (chosen: 0.3 s)', minimum=1, maximum=1000
    )
    check_every_frames: int = parameter(
        25,
        'Every how many images the filter is checked against one image alone (chosen: 1 s)',
        minimum=1,
        maximum=100000,
    )
    check_gate: float = parameter(
        40.0,
        'Largest squared distance of the filter from the pose of one image, 3 dof (p = 1e-8)',
        minimum=1.0,
    )
    contradictions: int = parameter(
        2, 'Failed checks in a row after which the image is believed (chosen)', minimum=1
    )

    def __post_init__(self) -> None:
        """Check every field."""
        check_fields(self)


class PoseMonitor:
    """Keeps the mode: a state machine without any geometry.

    Args:
        config: How much contradiction a pose survives.

    Attributes:
        mode: The present mode; never REFUSED.
        reason: Why it is not TRACKING, or an empty text.
    """

    def __init__(self, config: PoseMonitorConfig) -> None:
        self._config = config
        self.mode = Mode.SEARCHING
        self.reason = 'no fix yet'
        self._misses = 0
        self._unseen = 0
        self._confirmations = self._to_confirm = self._patience = 0
        self._leds: tuple[int, ...] = ()
        self._contradictions = self._checked = 0
        self._firm = False

    @property
    def unconfirmed_leds(self) -> tuple[int, ...]:
        """The LEDs that must be seen again for a new pose to be believed; else empty."""
        return self._leds if self.mode is Mode.CONFIRMING else ()

    @property
    def may_reacquire(self) -> bool:
        """Whether a pose that fits the image may take the place of this one, if there is one.

        One image against a pose is not enough: an encoder's reading may be far off for once.
        """
        doubted = self.mode is Mode.DOUBTFUL and self._misses != 1
        return doubted or self.mode is Mode.SEARCHING

    def start(self, leds: Sequence[int] | None) -> None:
        """Take note of a new pose.

        Args:
            leds: Which LEDs of one image it came from; as many must be seen again for it to be
                believed. None for a pose that is sure.
        """
        self._misses = self._unseen = self._confirmations = 0
        self._contradictions = self._checked = 0
        self._firm = False
        pair, triple = self._config.pair_confirmations, self._config.triple_confirmations
        self._leds = tuple(leds or ())
        self._to_confirm = 0 if leds is None else (pair if len(leds) <= _PAIR else triple)
        self._patience = self._config.confirm_within_frames
        if self._to_confirm == 0:
            self.mode, self.reason = Mode.TRACKING, ''
        else:
            self.mode = Mode.CONFIRMING
            self.reason = f'a pose from {len(self._leds)} lights waits for confirmation'

    def lose(self, reason: str) -> None:
        """Give the pose up."""
        self.mode, self.reason = Mode.SEARCHING, reason

    def update(self, used: int, expected: int) -> None:
        """Take note of one image that was compared with the pose.

        An image speaks against the pose where none, or two fewer than expected, of the LEDs are
        where they should be: it is not published as good. Doubt is firm where two or more are
        missing at once, or a single one time and again; then two LEDs must be seen to make the
        pose good again, since a single light may be in the place of an LED by chance. Else the
        next LED that is where it should be ends it.

        Args:
            used: LEDs that were where they should be.
            expected: LEDs that should have been in the image.
        """
        bad = expected > 0 and used < max(1, expected - 1)
        doubted = self._firm and used < _PAIR
        self._misses = self._misses + 1 if bad or (doubted and expected) else 0
        self._unseen = 0 if used else self._unseen + 1
        if self.mode is Mode.CONFIRMING:
            self._confirm(used, bad=bad or not used, expected=expected)
        elif self._misses >= self._config.lost_after_frames:
            self.lose('the LEDs are not where they should be')
        elif self._unseen >= self._config.unseen_after_frames:
            self.lose('no LED was seen for too long')
        elif bad or doubted:
            self._firm |= not used and (expected >= _PAIR or self._misses > _PAIR)
            self.mode, self.reason = Mode.DOUBTFUL, 'expected LEDs are not seen'
        elif self._unseen > _BLIND_FRAMES:
            self.mode, self.reason = Mode.DOUBTFUL, 'no LED is in view'
        elif used:
            self._firm = False
            self.mode, self.reason = Mode.TRACKING, ''

    def _confirm(self, used: int, *, bad: bool, expected: int) -> None:
        """Count an image for a new pose; one that lacks an LED bears no pose from a pair out."""
        complete = len(self._leds) > _PAIR or used >= expected
        self._confirmations += used >= len(self._leds) and complete
        self._patience -= 1
        if self._confirmations >= self._to_confirm:
            self.mode, self.reason = Mode.TRACKING, ''
        elif bad or self._patience <= 0:
            self.lose('a new pose was not confirmed')

    def check_due(self) -> bool:
        """Count an image with three LEDs; return whether to check the pose against it alone."""
        self._checked += 1
        return self._checked % self._config.check_every_frames == 0 or self._contradictions > 0

    def add_check(self, distance2: float) -> bool:
        """Take note of a check; return whether the pose of the image is the one to believe.

        Args:
            distance2: Squared distance of the filter from the pose of one image, 3 dof.
        """
        agrees = distance2 <= self._config.check_gate
        self._contradictions = 0 if agrees else self._contradictions + 1
        return self._contradictions >= self._config.contradictions
