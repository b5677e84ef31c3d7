"""Options that every suite takes, and those of suites that keep the results of studies."""

from dataclasses import dataclass
from pathlib import Path

from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.options import SeededOptions, option


@dataclass(frozen=True, kw_only=True)
class BenchOptions(SeededOptions):
    """Base class of the options of a suite."""

    json: Path | None = option(None, 'write the rows as JSON', metavar='FILE')


@dataclass(frozen=True, kw_only=True)
class StudyOptions(BenchOptions):
    """Base class of the options of a suite whose studies can be interrupted and resumed."""

    jobs: int = option(1, 'number of processes', minimum=1)
    results: Path | None = option(
        None,
        'folder of the results of finished cases, which are not measured again',
        metavar='DIR',
    )
    as_it_is: bool = option(False, 'measure nothing, use only what --results holds')

    def __post_init__(self) -> None:
        """Require results where nothing is measured.

        Raises:
            ConfigurationError: They are missing, or a value is out of its range.
        """
        super().__post_init__()
        if self.as_it_is and self.results is None:
            raise ConfigurationError('--as-it-is', 'yes', 'together with --results DIR')


@dataclass(frozen=True, kw_only=True)
class DocumentOptions(StudyOptions):
    """Base class of the options of a suite that also writes a document."""

    out: Path | None = option(None, 'write the document, in Markdown', metavar='FILE')
