"""The functions of the public interface: train, evaluate, simulate, figures."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
import math
from pathlib import Path

import numpy as np

from goalreach_evaluation.choices import choose_arena, choose_policy
from goalreach_evaluation.drive import DriveFrame
from goalreach_evaluation.evaluation import Evaluation, EvaluationRequest
from goalreach_evaluation.evaluation import evaluate as evaluate_request
from goalreach_evaluation.summary_file import RecordedRun, read_recorded_run, recorded_run
from goalreach_learning import training
from goalreach_learning.policy import Policy
from goalreach_learning.q_learning import LearningConfig
from goalreach_msgs_py.arena import Arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.noise import NoiseModel
from goalreach_msgs_py.values import Pose2

Start = Pose2 | Sequence[float]
"""A starting pose: a `Pose2`, or x and y in metres and the heading in degrees."""


def train(
    *, arena: Arena | Path | str = 'paper', seed: int = 0, config: LearningConfig | None = None
) -> Policy:
    """Learn a policy by the paper's procedure: Q-learning over trials of one path from each start.

    The learning phase is kinematic, without images, and takes some ten milliseconds. It is that
    of the command `goalreach train`: the same seed gives the same policy.

    Args:
        arena: 'paper', 'large', 'narrow' or 'side_goal', a YAML file, or an `Arena`.
        seed: Seed of every random draw, at least 0.
        config: Learning rate, discount, temperatures and trials; the defaults if None.

    Returns:
        The learned policy; `write_policy` writes it to a file.

    Raises:
        GoalreachError: The arena or the seed is refused.

    >>> policy = train(seed=7)
    >>> policy.greedy_action((0, 0))  # LEFT-SIDE/NEAR: heading 0 degrees, to the right
    0
    """
    if seed < 0:
        raise ConfigurationError('seed', seed, 'a whole number >= 0')
    rng = np.random.default_rng(seed)
    policy = training.train(choose_arena(arena), config or LearningConfig(), rng=rng).policy
    return replace(policy, learning={**policy.learning, 'seed': seed})


def evaluate(
    policy: Policy | Path | str | None = None,
    *,
    arena: Arena | Path | str = 'paper',
    starts: str | Sequence[Start] = 'paper',
    noise: NoiseModel | Path | str = 'nominal',
    mode: str = 'fuzzy',
    seed: int = 0,
    jobs: int = 1,
) -> Evaluation:
    """Drive a policy from many starts through rendered images, localizer and fuzzy state.

    The result is that of the command `goalreach evaluate` with the same seed.

    Args:
        policy: The policy, its name ('paper') or its file; None to learn one first.
        arena: As in `train`; the policy must have been learned on its regions.
        starts: 'paper' for the 22 of the paper, 'random:N' over the floor, 'border:N' along the
            walls, or poses: `Pose2`, or x and y in metres and the heading in degrees.
        noise: 'none', 'nominal', 'harsh', 'abroad', a YAML file, or a `NoiseModel`.
        mode: 'fuzzy', 'crisp', 'fuzzy-eq3' (unit vectors weighted by equation (3)) or
            'fuzzy-as-printed' (equation (3) as printed).
        seed: Seed of every random draw, at least 0.
        jobs: Number of processes; the result does not depend on it.

    Returns:
        The driven paths, with `success_rate`, `paths`, `to_json()` and `write(path)`.

    Raises:
        GoalreachError: A value or a file is refused.

    >>> result = evaluate(starts=[(1.2, 2.5, 90.0)], noise='none', mode='crisp')
    >>> [path.outcome for path in result.paths]
    ['goal']
    """
    poses = starts if isinstance(starts, str) else [_pose(start) for start in starts]
    request = EvaluationRequest(
        policy=policy, arena=arena, starts=poses, noise=noise, mode=mode, seed=seed
    )
    return evaluate_request(request, jobs=jobs)


def simulate(
    policy: Policy | Path | str | None = None,
    *,
    start: Start | None = None,
    arena: Arena | Path | str = 'paper',
    noise: NoiseModel | Path | str = 'nominal',
    mode: str = 'fuzzy',
    seed: int = 0,
) -> Iterator[DriveFrame]:
    """Drive one path, frame by frame.

    Each frame has `time_s`, `image` (height, width) of grey values, the estimated `pose` and its
    `covariance`, `true_pose`, the region `state` with its memberships, and the `command` driven
    until the next frame. The last one has the `result` of the path.

    Args:
        policy: The policy, its name ('paper') or its file; None to learn one first.
        start: `Pose2`, or x and y in metres and the heading in degrees; the arena's first start
            if None.
        arena: As in `evaluate`, like `noise` and `mode`.
        noise: Errors of the sensors.
        mode: How the heading is chosen.
        seed: Seed of every random draw, at least 0.

    Returns:
        An iterator over the frames, 25 per simulated second.

    Raises:
        GoalreachError: A value or a file is refused.

    >>> frame = next(simulate(start=(1.2, 4.5, -90.0)))
    >>> frame.image.shape, frame.command.linear_m_per_s
    ((480, 640), 0.0)
    """
    poses = choose_arena(arena).starts[:1] if start is None else [_pose(start)]
    request = EvaluationRequest(
        policy=policy, arena=arena, starts=poses, noise=noise, mode=mode, seed=seed
    )
    return request.plan.session_drive(0).drive_frames(request.plan.starts[0])


def figures(
    policy: Policy,
    result: Evaluation | Path | str | None = None,
    *,
    out: Path | str = 'figures',
    arena: Arena | Path | str | None = None,
    formats: Sequence[str] = ('svg', 'png'),
) -> list[Path]:
    """Draw the paper's figures from a policy and driven paths, and write them.

    Args:
        policy: The policy.
        result: Result of `evaluate`, or a file of `goalreach evaluate --json` or
            `goalreach run --summary`; without it figure 7 is left out.
        out: Folder for the files, made if it does not exist.
        arena: As in `train`; the arena of an `Evaluation`, else the paper's, if None.
        formats: 'svg', 'png' or both.

    Returns:
        The files, in the paper's order.

    Raises:
        GoalreachError: A value is refused, or a file cannot be read or written.
    """
    # Importing matplotlib takes longer than all the rest.
    from goalreach_evaluation.figures.figure_file import write_figure  # noqa: PLC0415
    from goalreach_evaluation.figures.paper_figures import paper_figures  # noqa: PLC0415

    formats = (formats,) if isinstance(formats, str) else formats
    if wrong := set(formats) - {'svg', 'png'}:
        raise ConfigurationError('formats', sorted(wrong), "'svg', 'png' or both")
    if isinstance(result, Evaluation):
        arena = arena or result.request.plan.arena
    room = choose_arena(arena or 'paper')
    drawn = paper_figures(room, choose_policy(policy, room), _recorded(result))
    return [
        file
        for name, figure in drawn.items()
        for file in write_figure(figure, Path(out), name, formats)
    ]


def _recorded(result: Evaluation | Path | str | None) -> RecordedRun | None:
    if isinstance(result, Evaluation):
        return recorded_run(result.to_json())
    return None if result is None else read_recorded_run(result)


def _pose(start: Start) -> Pose2:
    if isinstance(start, Pose2):
        return start
    try:
        x_m, y_m, heading_deg = (float(number) for number in start)
    except (TypeError, ValueError):
        allowed = 'x and y in metres and the heading in degrees'
        raise ConfigurationError('start', start, allowed) from None
    return Pose2(x_m=x_m, y_m=y_m, heading_rad=math.radians(heading_deg))
