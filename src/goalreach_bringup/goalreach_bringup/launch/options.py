"""Options of a run."""

from dataclasses import dataclass
import math
from pathlib import Path

from goalreach_bags.storage import STORAGES
from goalreach_evaluation.choices import arena_option, learner_option, policy_option
from goalreach_evaluation.starts import RunSeeds
from goalreach_learning.blending import MODES
from goalreach_learning.policy_file import policy_names
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NOISE_PRESETS
from goalreach_msgs_py.options import SeededOptions, option, parse_namespace
from goalreach_msgs_py.topics import NODES, ROBOT
from goalreach_msgs_py.values import Pose2


def parse_start(text: str) -> Pose2:
    """Return the pose of `X,Y,HEADING_DEG` (metres, metres, degrees)."""
    try:
        x_m, y_m, heading_deg = map(float, text.split(','))
    except ValueError:
        x_m = y_m = heading_deg = math.nan
    if not all(map(math.isfinite, (x_m, y_m, heading_deg))):
        raise ConfigurationError('--start', text, 'X,Y,HEADING_DEG in metres and degrees')
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg))


def _parse_remap(text: str) -> str:
    if ':=' not in text:
        raise ConfigurationError('--remap', text, 'FROM:=TO or NODE:FROM:=TO')
    return text


@dataclass(frozen=True, kw_only=True)
class RunOptions(SeededOptions):
    """Options of `run`; None where the parameter file or the default decides."""

    seed: int = option(
        0, 'seed of everything random, for a repeatable run', minimum=0, maximum=2**31 - 1
    )
    policy: str | None = policy_option()
    mode: str | None = option(None, 'how the heading is chosen (default: fuzzy)', choices=MODES)
    behaviors: str | None = option(
        None,
        'behaviours, such as "first(escape, blend(avoid, patience, goal))" (default: goal)',
        metavar='TEXT',
    )
    paths: int = option(0, 'number of paths; 0: until Ctrl-C', minimum=0, maximum=1_000_000)
    arena: str = arena_option()
    starts: str = option('paper', 'where paths begin', choices=('paper', 'random'))
    start_poses: tuple[Pose2, ...] = option(
        (), 'start of a path, metres and degrees, in place of --starts; repeatable',
        flag='--start', metavar='X,Y,HEADING_DEG', repeatable=True, parse=parse_start,
    )  # fmt: skip
    clock: str | None = option(
        None, 'how time passes (default: realtime)', choices=('realtime', 'lockstep')
    )
    speed: float | None = option(None, 'multiple of real time, with --clock realtime')
    noise: str = option('nominal', 'sensor errors', choices=NOISE_PRESETS)
    learn: bool = option(
        False, 'learn over the live graph, into the file --policy; continues where it ends'
    )
    learner: str | None = learner_option(None)
    record: Path | None = option(None, 'record every topic into a bag', metavar='DIR')
    storage: str = option('mcap', 'storage format of the bag', choices=STORAGES)
    composed: bool = option(False, 'all nodes in one process')
    external: tuple[str, ...] = option(
        (), 'external node: wait for it instead of starting ours; repeatable',
        metavar='NODE', choices=NODES, repeatable=True,
    )  # fmt: skip
    placement_service: str = option(
        '', 'service (std_srvs/Trigger) that puts an external robot at the start of each path',
        metavar='NAME',
    )  # fmt: skip
    no_drive: bool = option(
        False, 'show what the robot would be commanded, and send it on /cmd_vel_not_sent instead'
    )
    dashboard: bool | None = option(
        None, 'show the live page (default: on a terminal, in real time)'
    )
    remaps: tuple[str, ...] = option(
        (), 'ROS 2 remapping rule for the nodes; repeatable', flag='--remap',
        metavar='[NODE:]FROM:=TO', repeatable=True, parse=_parse_remap,
    )  # fmt: skip
    namespace: str = option(
        '', 'namespace of the nodes, so that several robots share a ROS domain', metavar='NAME',
        parse=parse_namespace,
    )  # fmt: skip
    params_file: Path | None = option(None, 'ROS 2 parameter file', metavar='YAML')
    network: bool = option(
        False, 'admit other machines: they can see, drive and change everything'
    )
    summary: Path | None = option(None, 'write the summary of the run', metavar='JSON')
    quiet: bool = option(False, 'show errors only')

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.placement_service and ROBOT not in self.external:
            allowed = f'given with --external {ROBOT}'
            raise ConfigurationError('--placement-service', self.placement_service, allowed)
        if self.no_drive and self.clock == 'lockstep':
            raise ConfigurationError('--no-drive', self.clock, 'in real time')
        if self.learner is not None and not self.learn:
            raise ConfigurationError('--learner', self.learner, 'given with --learn')
        if self.learn and self.policy in policy_names():
            allowed = f'a file to learn into, such as ./{self.policy}'
            raise ConfigurationError('--policy', self.policy, allowed)

    @property
    def seeds(self) -> RunSeeds:
        """Seeds of the random parts of the run."""
        return RunSeeds.spawn(self.seed)
