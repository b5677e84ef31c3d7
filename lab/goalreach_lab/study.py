"""The shape of every study: measure cases, keep their results, analyse them, report rows."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
import functools
from pathlib import Path
from typing import Any

from goalreach_evaluation.evaluation import processes
from goalreach_evaluation.sweep import run_cases
from goalreach_evaluation.terminal import progress_bar
from goalreach_lab.row import BenchRow
from goalreach_lab.study_file import StudyFile

Case = Mapping[str, Any]
"""The fields that identify one case of a study: numbers and texts."""

Result = Mapping[str, Any]
"""What was measured of a case, JSON-ready."""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A measurement that can be interrupted and resumed.

    Attributes:
        name: Name of the study; its results are kept in `NAME.jsonl`.
        key: Names of the fields of a case.
        cases: The cases, in the order in which they are measured.
        measure: Measures the cases given and yields each with its result as soon as it is
            finished; see `per_case`.
        settings: What the results depend on besides the case and the code. Kept results of other
            settings are refused.
        seed: A seed that is not in the settings: results of another are told, not refused.
        analyse: Returns the findings of a list of results (key fields and result of each finished
            case, in the order of `cases`), for rows, tables and figures.
        rows: Returns the rows of the findings.
    """

    name: str
    key: tuple[str, ...]
    cases: Sequence[Case]
    measure: Callable[[Sequence[Case]], Iterable[tuple[Case, Result]]]
    settings: Mapping[str, object] = field(default_factory=dict)
    seed: int | None = None
    analyse: Callable[[Sequence[Result]], Any] = list
    rows: Callable[[Any], list[BenchRow]] = lambda _: []


def run_study(
    study: Study, folder: Path | None = None, *, measure: bool = True
) -> list[dict[str, Any]]:
    """Measure the cases whose results are not kept yet, and keep each as soon as it is finished.

    Args:
        study: The study.
        folder: Where results are kept, or None to keep them in memory only.
        measure: Whether to measure; without, only the results kept earlier are returned.

    Returns:
        Key fields and result of every finished case, in the order of the study's cases.

    Raises:
        FileFormatError: The file of results is refused or cannot be written.
    """
    path = None if folder is None else folder / f'{study.name}.jsonl'
    file = StudyFile(path, key=study.key, settings=study.settings, seed=study.seed)
    file.tell_others()
    missing = file.missing(study.cases)
    if measure and missing:
        with progress_bar(study.name, total=len(study.cases)) as advance:
            advance(len(study.cases) - len(missing))
            for case, result in study.measure(missing):
                file.add(case, result)
                advance(1)
    return file.select(study.cases)


def find(study: Study, folder: Path | None = None, *, measure: bool = True) -> Any:
    """Return the findings of a study, or None where no case is finished.

    Args:
        study: The study.
        folder: Where results are kept, or None to keep them in memory only.
        measure: Whether to measure the cases that are missing.

    Raises:
        FileFormatError: The file of results is refused or cannot be written.
    """
    results = run_study(study, folder, measure=measure)
    return study.analyse(results) if results else None


def per_case(
    function: Callable[[Case], Result], *, jobs: int = 1
) -> Callable[[Sequence[Case]], Iterator[tuple[Case, Result]]]:
    """Return a `Study.measure` that measures every case by itself.

    Args:
        function: Returns the result of a case. With more than one process it must be at the top
            level of a module, or a `functools.partial` of such a function.
        jobs: Number of processes. With one, the cases are measured in this process.
    """

    def measure(cases: Sequence[Case]) -> Iterator[tuple[Case, Result]]:
        if jobs == 1:
            return ((case, function(case)) for case in cases)
        return run_cases(cases, function, functools.partial(processes, jobs))

    return measure
