"""Time series of a run, read from its bag."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
import math
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
import yaml

from goalreach_bags.reader import BagReader
from goalreach_bags.recording import PARAMETERS_KEY
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.cdr import MessageError, stamp_of
from goalreach_msgs_py.diagnostic_messages import q_table_from_raw, state_from_raw
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.pose_messages import estimate_from_raw, odometry_from_raw, twist_from_raw
from goalreach_msgs_py.values import Confidence, Pose2, Twist2

Floats = NDArray[np.float64]

_READERS: Final[Mapping[str, Callable[[bytes], Any]]] = {
    topics.GROUND_TRUTH: odometry_from_raw,
    topics.POSE: estimate_from_raw,
    topics.STATE: state_from_raw,
    topics.CMD_VEL: twist_from_raw,
    topics.Q_TABLE: q_table_from_raw,
}
_NO_COMMAND: Final = Twist2(linear_m_per_s=math.nan, steering_rad_per_s=math.nan)
_ROBOT: Final = 'nomad200'
_KEY: Final = 'ros__parameters'
_NS: Final = 1e-9


@dataclass(frozen=True, kw_only=True)
class RunSeries:
    """Time series of a run; one row per stamp with pose, state and, if recorded, truth.

    Attributes:
        arena: The arena.
        time_s: The stamps, (n).
        truth: True x, y, heading, m and rad, (n, 3); NaN where the bag has none.
        estimate: Estimated x, y, heading, (n, 3); NaN where the state was uncertain.
        sigma: Standard deviations of the estimate, (n, 3); NaN likewise.
        memberships: Of LEFT-SIDE, FRONT, RIGHT-SIDE, NEAR, MEDIUM, FAR, (n, 6).
        region: Index of the region in a table of 3 x 3, (n).
        q: Q-values of the region's actions, (n, 8); NaN where the bag has no Q-table.
        command: Speed and steering rate commanded, (n, 2); NaN where there is none.
    """

    arena: Arena
    time_s: Floats
    truth: Floats
    estimate: Floats
    sigma: Floats
    memberships: Floats
    region: NDArray[np.int64]
    q: Floats
    command: Floats


def recorded_arena(bag: BagReader) -> Arena:
    """Return the arena of the run's parameters, the paper's where the bag has none."""
    try:
        parameters = load_yaml(bag.metadata.custom[PARAMETERS_KEY])
        return Arena.from_parameters(parameters[_ROBOT][_KEY])
    except (KeyError, TypeError, yaml.YAMLError, GoalreachError):
        return Arena()


def read_run_series(bag: BagReader) -> RunSeries:
    """Return the time series of a run.

    Raises:
        GoalreachError: The bag lacks pose or state, or a message is of another type.
    """
    needed = [topics.POSE, topics.STATE]
    bag.require(needed)
    needed += [topics.GROUND_TRUTH] * bool(bag.counts.get(topics.GROUND_TRUTH))
    by_topic: dict[str, dict[int, Any]] = {name: {} for name in _READERS}
    for message in bag.messages(_READERS):
        latched = message.topic == topics.Q_TABLE
        try:
            stamp_ns = message.time_ns if latched else stamp_of(message.data)
            by_topic[message.topic][stamp_ns] = _READERS[message.topic](message.data)
        except MessageError as error:
            raise GoalreachError(f'{bag.path}: {message.topic}: {error}') from None
    stamps = sorted(set.intersection(*(set(by_topic[name]) for name in needed)))
    if not stamps:
        raise GoalreachError(f'{bag.path}: truth, pose and state have no stamp in common')
    estimates = [by_topic[topics.POSE][s] for s in stamps]
    variances = [estimate.covariance.diagonal() for estimate in estimates]
    states = [by_topic[topics.STATE][s] for s in stamps]
    doubt = np.array([[state.confidence is not Confidence.OK] for state in states])
    region = np.array([s.region[0] * len(s.mu_y) + s.region[1] for s in states])
    truths = by_topic[topics.GROUND_TRUTH]
    twists = [by_topic[topics.CMD_VEL].get(s, _NO_COMMAND) for s in stamps]
    return RunSeries(
        arena=recorded_arena(bag),
        time_s=np.array(stamps) * _NS,
        truth=np.array([_pose(truths[s].pose) if truths else [np.nan] * 3 for s in stamps]),
        estimate=np.where(doubt, np.nan, [_pose(estimate.pose) for estimate in estimates]),
        sigma=np.where(doubt, np.nan, np.sqrt(variances)),
        memberships=np.array([(*state.mu_x, *state.mu_y) for state in states]),
        region=region,
        q=_q_over_time(by_topic[topics.Q_TABLE], stamps, region),
        command=np.array([(t.linear_m_per_s, t.steering_rad_per_s) for t in twists]),
    )


def _pose(pose: Pose2) -> tuple[float, float, float]:
    return pose.x_m, pose.y_m, pose.heading_rad


def _q_over_time(
    tables: Mapping[int, Floats], stamps: list[int], region: NDArray[np.int64]
) -> Floats:
    """Return the Q-values of the region, from the table valid at each stamp."""
    if not tables:
        return np.full((len(stamps), 8), np.nan)
    times = sorted(tables)
    q = np.array([tables[t].reshape(-1, tables[t].shape[-1]) for t in times])
    valid = np.maximum(np.searchsorted(times, stamps, side='right') - 1, 0)
    return np.asarray(q[valid, region], dtype=np.float64)
