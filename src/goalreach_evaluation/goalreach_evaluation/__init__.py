"""The whole loop in one process without ROS, path metrics, figures and sweeps.

Each name is imported with its module on first use: a command that needs `choices` alone loads
neither OpenCV nor matplotlib.
"""

from typing import TYPE_CHECKING

from goalreach_msgs_py.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from goalreach_evaluation.choices import choose_arena as choose_arena
    from goalreach_evaluation.choices import choose_noise as choose_noise
    from goalreach_evaluation.choices import choose_policy as choose_policy
    from goalreach_evaluation.drive import DriveFrame as DriveFrame
    from goalreach_evaluation.drive import InProcessDrive as InProcessDrive
    from goalreach_evaluation.evaluation import Evaluation as Evaluation
    from goalreach_evaluation.evaluation import EvaluationPlan as EvaluationPlan
    from goalreach_evaluation.evaluation import EvaluationRequest as EvaluationRequest
    from goalreach_evaluation.evaluation import SessionResult as SessionResult
    from goalreach_evaluation.evaluation import drive_sessions as drive_sessions
    from goalreach_evaluation.evaluation import evaluate as evaluate
    from goalreach_evaluation.path_metrics import PathMeter as PathMeter
    from goalreach_evaluation.path_metrics import PathResult as PathResult
    from goalreach_evaluation.path_metrics import PathTally as PathTally
    from goalreach_evaluation.path_metrics import wilson_interval as wilson_interval
    from goalreach_evaluation.results_file import ResultsFile as ResultsFile
    from goalreach_evaluation.starts import RunSeeds as RunSeeds
    from goalreach_evaluation.starts import border_starts as border_starts
    from goalreach_evaluation.starts import choose_starts as choose_starts
    from goalreach_evaluation.starts import random_starts as random_starts
    from goalreach_evaluation.summary_file import RecordedRun as RecordedRun
    from goalreach_evaluation.summary_file import read_recorded_run as read_recorded_run
    from goalreach_evaluation.sweep import SweepCase as SweepCase
    from goalreach_evaluation.sweep import drive_case as drive_case
    from goalreach_evaluation.sweep import run_cases as run_cases

__all__, __getattr__, __dir__ = lazy_exports(__name__)
