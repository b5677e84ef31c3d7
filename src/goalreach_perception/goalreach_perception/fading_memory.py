"""What was learnt about constants fades towards what was known at the start."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from goalreach_msgs_py.values import FloatArray

__all__ = ['FadingMemory']


class FadingMemory:
    """Takes constants as Ornstein-Uhlenbeck processes around their prior, with a long memory.

    With a = exp(-dt / memory), the mean m becomes m0 + a (m - m0) and the covariance P becomes
    a^2 P + (1 - a^2) P0. So small errors that repeat from image to image do not add up to false
    certainty, and nothing drifts away for ever.

    Args:
        mean: (n,) prior mean.
        sigmas: (n,) prior standard deviations.
        fading: (n,) which states fade.
        memory_s: Time constant.
    """

    def __init__(
        self, mean: FloatArray, sigmas: FloatArray, fading: NDArray[np.bool_], memory_s: float
    ) -> None:
        self._mean = mean.copy()
        self._variance = sigmas**2
        self._fading = fading
        self._memory_s = memory_s
        self._factors: tuple[float, FloatArray, FloatArray, FloatArray] | None = None

    def fade(
        self, mean: FloatArray, covariance: FloatArray, dt_s: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return mean and covariance after some time; infinite to forget all."""
        if self._factors is None or self._factors[0] != dt_s:
            keep = np.where(self._fading, math.exp(-dt_s / self._memory_s), 1.0)
            back = np.diag((1.0 - keep * keep) * self._variance)
            self._factors = (dt_s, keep, np.outer(keep, keep), back)
        _, keep, keep_both, back = self._factors
        return self._mean + keep * (mean - self._mean), keep_both * covariance + back
