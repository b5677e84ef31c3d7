"""The whole loop in one process without ROS, path metrics, figures and sweeps.

Each name is imported with its module on first use: a command that needs `choices` alone loads
neither OpenCV nor matplotlib.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from goalreach_evaluation.choices import choose_arena, choose_noise, choose_policy
    from goalreach_evaluation.drive import DriveFrame, InProcessDrive
    from goalreach_evaluation.evaluation import (
        Evaluation,
        EvaluationPlan,
        EvaluationRequest,
        SessionResult,
        drive_sessions,
        evaluate,
    )
    from goalreach_evaluation.path_metrics import PathMeter, PathResult, PathTally, wilson_interval
    from goalreach_evaluation.results_file import ResultsFile
    from goalreach_evaluation.starts import RunSeeds, border_starts, choose_starts, random_starts
    from goalreach_evaluation.summary_file import RecordedRun, read_recorded_run
    from goalreach_evaluation.sweep import SweepCase, drive_case, run_cases

_EXPORTS = {
    'choices': ('choose_arena', 'choose_noise', 'choose_policy'),
    'drive': ('DriveFrame', 'InProcessDrive'),
    'evaluation': (
        'Evaluation',
        'EvaluationPlan',
        'EvaluationRequest',
        'SessionResult',
        'drive_sessions',
        'evaluate',
    ),
    'path_metrics': ('PathMeter', 'PathResult', 'PathTally', 'wilson_interval'),
    'results_file': ('ResultsFile',),
    'starts': ('RunSeeds', 'border_starts', 'choose_starts', 'random_starts'),
    'summary_file': ('RecordedRun', 'read_recorded_run'),
    'sweep': ('SweepCase', 'drive_case', 'run_cases'),
}
__all__ = [
    'DriveFrame',
    'Evaluation',
    'EvaluationPlan',
    'EvaluationRequest',
    'InProcessDrive',
    'PathMeter',
    'PathResult',
    'PathTally',
    'RecordedRun',
    'ResultsFile',
    'RunSeeds',
    'SessionResult',
    'SweepCase',
    'border_starts',
    'choose_arena',
    'choose_noise',
    'choose_policy',
    'choose_starts',
    'drive_case',
    'drive_sessions',
    'evaluate',
    'random_starts',
    'read_recorded_run',
    'run_cases',
    'wilson_interval',
]


def __getattr__(name: str) -> object:
    for module, names in _EXPORTS.items():
        if name in names:
            return getattr(import_module(f'{__name__}.{module}'), name)
    raise AttributeError(f'module {__name__!r} has no attribute {name!r}')
