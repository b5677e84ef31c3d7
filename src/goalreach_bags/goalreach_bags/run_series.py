"""Time series of a run, read from its bag."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
import yaml

from goalreach_bags.decode import Decoder
from goalreach_bags.reader import BagReader
from goalreach_bags.recording import PARAMETERS_KEY
from goalreach_msgs_py import topics
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.cdr import stamp_of
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.files import load_yaml
from goalreach_msgs_py.regions import X_LABELS, Y_LABELS, parse_region

Floats = NDArray[np.float64]

_PLANAR: Final = (0, 1, 5)
_ROBOT: Final = 'nomad200'
_KEY: Final = 'ros__parameters'
_NS: Final = 1e-9


@dataclass(frozen=True, kw_only=True)
class RunSeries:
    """Time series of a run; one row per stamp with truth, pose and state.

    Attributes:
        arena: The arena.
        time_s: The stamps, (n).
        truth: True x, y, heading, m and rad, (n, 3).
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
        GoalreachError: The bag lacks truth, pose or state, or a message is of another type.
    """
    needed = (topics.GROUND_TRUTH, topics.POSE, topics.STATE)
    bag.require(needed)
    names = [n for n in (*needed, topics.CMD_VEL, topics.Q_TABLE) if n in bag.topics]
    decoder = Decoder(bag.topics[name] for name in names)
    by_topic: dict[str, dict[int, Any]] = {name: {} for name in names}
    for message in bag.messages(names):
        latched = message.topic == topics.Q_TABLE
        stamp_ns = message.time_ns if latched else stamp_of(message.data)
        by_topic[message.topic][stamp_ns] = decoder.decode(message.topic, message.data)
    stamps = sorted(set.intersection(*(set(by_topic[name]) for name in needed)))
    if not stamps:
        raise GoalreachError(f'{bag.path}: truth, pose and state have no stamp in common')
    poses = [by_topic[topics.POSE][s].pose for s in stamps]
    states = [by_topic[topics.STATE][s].status[0] for s in stamps]
    doubt = np.array([[state.level != 0] for state in states])
    region = np.array([3 * x + y for x, y in (parse_region(s.message) for s in states)])
    commands = by_topic.get(topics.CMD_VEL, {})
    return RunSeries(
        arena=recorded_arena(bag),
        time_s=np.array(stamps) * _NS,
        truth=np.array([_pose(by_topic[topics.GROUND_TRUTH][s].pose.pose) for s in stamps]),
        estimate=np.where(doubt, np.nan, [_pose(pose.pose) for pose in poses]),
        sigma=np.where(doubt, np.nan, [_sigma(pose.covariance) for pose in poses]),
        memberships=np.array([_memberships(state) for state in states]),
        region=region,
        q=_q_over_time(by_topic.get(topics.Q_TABLE, {}), stamps, region),
        command=np.array([_command(commands.get(s)) for s in stamps]),
    )


def _pose(pose: Any) -> tuple[float, float, float]:  # noqa: ANN401 - a decoded message
    q = pose.orientation
    return pose.position.x, pose.position.y, float(2.0 * np.arctan2(q.z, q.w))


def _sigma(covariance: Any) -> Floats:  # noqa: ANN401 - a decoded message
    diagonal = np.asarray(covariance, dtype=np.float64).reshape(6, 6).diagonal()
    sigma: Floats = np.sqrt(np.maximum(diagonal[list(_PLANAR)], 0.0))
    return sigma


def _memberships(status: Any) -> list[float]:  # noqa: ANN401 - a decoded message
    values = {pair.key: pair.value for pair in status.values}
    keys = [f'mu_x.{label}' for label in X_LABELS] + [f'mu_y.{label}' for label in Y_LABELS]
    return [float(values.get(key, 'nan')) for key in keys]


def _command(message: Any) -> tuple[float, float]:  # noqa: ANN401 - a decoded message
    if message is None:
        return float('nan'), float('nan')
    return message.twist.linear.x, message.twist.angular.z


def _q_over_time(
    tables: Mapping[int, Any], stamps: list[int], region: NDArray[np.int64]
) -> Floats:
    """Return the Q-values of the region, from the table valid at each stamp."""
    if not tables:
        return np.full((len(stamps), 8), np.nan)
    times = sorted(tables)
    q = np.array([np.asarray(tables[t].data, dtype=np.float64).reshape(9, -1) for t in times])
    valid = np.maximum(np.searchsorted(times, stamps, side='right') - 1, 0)
    return np.asarray(q[valid, region], dtype=np.float64)
