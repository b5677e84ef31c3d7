"""Coverage-guided fuzzing of file readers by atheris.

It takes over its process, so that each reader gets a process of its own: `run_guided` starts it,
and it runs `main`.
"""

from importlib.util import find_spec
from pathlib import Path
import re
import subprocess
import sys
from typing import Final

from goalreach_lab.fuzz.reader import Tally
from goalreach_msgs_py.errors import GoalreachError

GUIDED: Final = (
    'policy file', 'arena file', 'arena file, read alone', 'noise file', 'parameter file',
    'evaluation file', 'bag, mcap, .mcap', 'bag, sqlite3, .db3', 'bag, mcap, .yaml',
)  # fmt: skip
"""Names of the targets."""

_SLOW_S: Final = 20
_INCLUDED: Final = [
    'goalreach_bags', 'goalreach_evaluation', 'goalreach_learning', 'goalreach_msgs_py', 'yaml',
]  # fmt: skip
_LONGEST_BYTES: Final = 20_000
"""Long enough for every valid file; chosen."""


def is_guided_installed() -> bool:
    """Return whether atheris is installed."""
    return find_spec('atheris') is not None


def run_guided(name: str, *, runs: int, seed: int, folder: Path) -> Tally:
    """Fuzz one reader in a process of its own, until the first failure.

    Args:
        name: Name of the target.
        runs: Number of inputs.
        seed: Seed of the choice of inputs.
        folder: An empty folder for its files.
    """
    command = [sys.executable, '-m', __name__, name, str(runs), str(seed), str(folder)]
    done = subprocess.run(command, capture_output=True, text=True, errors='replace', check=False)
    output = done.stderr + done.stdout
    count = re.search(r'^Done (\d+)', output, re.MULTILINE)
    tally = Tally(f'{name}, guided')
    tally.inputs = int(count[1]) if count else 0  # atheris does not tell which were refused
    if done.returncode or not count:
        words = re.search(r'^.*(?:Error|ERROR).*$', output, re.MULTILINE)
        tally.tracebacks.append((seed, words[0] if words else f'status {done.returncode}'))
    return tally


def main() -> None:
    """Fuzz the target of the command line; atheris ends the process."""
    import atheris

    name, runs, seed, words = sys.argv[1:5]
    folder = Path(words)
    with atheris.instrument_imports(include=_INCLUDED):
        from goalreach_lab.fuzz.valid_inputs import bag_targets, document_targets
    targets = [*document_targets(folder), *bag_targets(folder)]
    target = next(one for one in targets if one.name == name)
    corpus = folder / 'corpus'
    corpus.mkdir()
    (corpus / 'valid').write_bytes(target.encode(target.valid))

    def attempt(data: bytes) -> None:
        try:
            target.take(data)
        except GoalreachError as error:
            if len(str(error).splitlines()) != 1:
                raise AssertionError(f'not one clear line: {error}') from None

    flags = [f'-atheris_runs={runs}', f'-seed={seed}', f'-timeout={_SLOW_S}']
    flags += [f'-max_len={_LONGEST_BYTES}', f'-artifact_prefix={folder}/', str(corpus)]
    atheris.Setup([sys.argv[0], *flags], attempt)
    atheris.Fuzz()


if __name__ == '__main__':
    main()
