"""Mutation testing: how many small faults, planted one by one, the tests notice.

Faults are those of the package cosmic-ray: operators, comparisons, numbers, booleans, conditions,
exceptions, loops and decorators, each changed in one place. Each is tried in a copy of the tree,
against the tests that mirror its module, then those of its package that start no graph; in the
code of nodes and launcher also against those that do.
"""

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import difflib
import itertools
import os
from pathlib import Path
import shutil
import subprocess
import sys
import tempfile
from typing import Any, Final

import numpy as np

from goalreach_lab.options import StudyOptions
from goalreach_lab.row import BenchRow, Goal
from goalreach_lab.study import Case, Result, Study, find, per_case
from goalreach_lab.study_file import code_version
from goalreach_msgs_py.errors import GoalreachError
from goalreach_msgs_py.options import option

SUMMARY: Final = 'Plant small faults one by one; which do the tests notice?'

PACKAGES: Final = (
    'goalreach_sim',
    'goalreach_perception',
    'goalreach_learning',
    'goalreach_bags',
    'goalreach_bringup',
)
_ROOT: Final = Path(__file__).resolve().parents[2]
_TIMEOUT_S: Final = 1200.0
_TOTAL_GOAL, _PACKAGE_GOAL = 0.90, 0.85


@dataclass(frozen=True, kw_only=True)
class Options(StudyOptions):
    """Options of the suite."""

    count: int = option(400, 'number of faults', minimum=1)
    package: tuple[str, ...] = option((), f'of {", ".join(PACKAGES)} (default: all)')


def execute(options: Options) -> list[BenchRow]:
    """Plant the faults; print each that no test notices; return the rows.

    Raises:
        GoalreachError: The package cosmic-ray is missing, or a test fails without a fault.
    """
    packages = options.package or PACKAGES
    cases = _drawn(packages, options.count, np.random.default_rng(options.seed))
    for package in () if options.as_it_is else packages:
        modules = (str(one['module']) for one in cases if f'/{package}/' in str(one['module']))
        for module in {str(_tests_of(Path(one))[-1]): one for one in modules}.values():
            if is_noticed(module, (_ROOT / module).read_text()):
                raise GoalreachError(f'the tests of {package} fail without a fault')
    study = Study(
        name='mutation',
        key=('module', 'operator', 'occurrence'),
        cases=cases,
        measure=per_case(measure, jobs=options.jobs),
        settings={'seed': options.seed, 'code': code_version('src', 'test')},
    )
    results = find(study, options.results, measure=not options.as_it_is) or []
    for result in results:
        if not result['noticed']:
            print(f'{result["module"]}: no test notices\n{result["change"]}')
    return _rows(packages, results)


def measure(case: Case) -> Result:
    """Plant a fault, run the tests, return whether one noticed it, and the change.

    Args:
        case: Module, operator and occurrence of the fault.
    """
    module = str(case['module'])
    before = (_ROOT / module).read_text()
    after = planted(before, str(case['operator']), int(case['occurrence'])) or before
    change = difflib.unified_diff(before.splitlines(), after.splitlines(), n=0, lineterm='')
    return {'noticed': is_noticed(module, after), 'change': '\n'.join(list(change)[2:])}


def is_noticed(module: str, text: str) -> bool:
    """Return whether a test fails in a copy of the tree in which a module has another text.

    Tests that take longer than twenty minutes count as failed: a fault may be an endless loop.

    Args:
        module: Path of the module from the root of the repository.
        text: Its text.
    """
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder, 'tree')
        ignore = shutil.ignore_patterns('.*', '__pycache__', 'build', 'install', 'log', 'out')
        shutil.copytree(_ROOT, tree, ignore=ignore)
        (tree / module).write_text(text)
        return any(_fails(tree, tests) for tests in _tests_of(Path(module)))


def faults(source: str) -> list[tuple[str, int]]:
    """Return operator and occurrence of every fault that can be planted in a module.

    Args:
        source: The text of the module.

    Raises:
        GoalreachError: The package cosmic-ray is missing.
    """
    plugins = _cosmic_ray().plugins
    nodes = list(_cosmic_ray().ast.ast_nodes(_cosmic_ray().ast.get_ast(source)))
    found = []
    for name in plugins.operator_names():
        operator = plugins.get_operator(name)
        if operator.arguments() or name.endswith('/NoOp'):
            continue
        positions = sum(len(list(operator().mutation_positions(node))) for node in nodes)
        found += [(name, occurrence) for occurrence in range(positions)]
    return found


def planted(source: str, name: str, occurrence: int) -> str | None:
    """Return the text of a module with a fault, or None where it says the same or nothing.

    Args:
        source: The text of the module.
        name: Operator of cosmic-ray.
        occurrence: Which of the places where it can be applied.
    """
    cosmic_ray = _cosmic_ray()
    operator = cosmic_ray.plugins.get_operator(name)()
    changed: str = cosmic_ray.mutating.mutate_code(source, operator, occurrence)
    try:
        same = _without_annotations(changed) == _without_annotations(source)
    except SyntaxError:  # it takes the stars of arguments for operators
        return None
    return None if same else changed


def _cosmic_ray() -> Any:
    try:
        import cosmic_ray.ast
        import cosmic_ray.mutating
        import cosmic_ray.plugins
    except ModuleNotFoundError as error:
        message = 'mutation testing needs cosmic-ray: pip install cosmic-ray'
        raise GoalreachError(message) from error
    return cosmic_ray


def _without_annotations(source: str) -> str:
    tree = ast.parse(source)
    for node in ast.walk(tree):
        if isinstance(node, ast.AnnAssign):
            node.annotation = ast.Constant(value=None)
        elif isinstance(node, ast.arg):
            node.annotation = None
        elif isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            node.returns = None
    return ast.dump(tree)


def _drawn(packages: Sequence[str], count: int, rng: np.random.Generator) -> list[Case]:
    """Draw faults, each as likely as another, whatever module it is in."""
    sources = {
        path.relative_to(_ROOT).as_posix(): path.read_text()
        for package in packages
        for path in sorted((_ROOT / 'src' / package / package).rglob('*.py'))
    }
    possible = [(module, *fault) for module, text in sources.items() for fault in faults(text)]
    order = (possible[index] for index in rng.permutation(len(possible)))
    drawn = (
        {'module': module, 'operator': name, 'occurrence': occurrence}
        for module, name, occurrence in order
        if planted(sources[module], name, occurrence) is not None
    )
    return list(itertools.islice(drawn, count))


def _tests_of(module: Path) -> list[list[str]]:
    """Return the tests of a module: those that mirror it, those of its package, then graphs."""
    package, *folders = module.parts[2:-1]
    mirrored = Path('test', package, *folders, f'test_{module.name}')
    first = [[mirrored.as_posix()]] if (_ROOT / mirrored).exists() else []
    tests = [*first, [f'test/{package}', '-m', 'not graph']]
    if 'ros' in folders or 'launch' in folders or module.stem.endswith('_node'):
        tests.append([f'test/{package}', '-m', 'graph', '-n', '2'])
    return tests


def _fails(tree: Path, tests: Sequence[str]) -> bool:
    folders = [*sorted((tree / 'src').iterdir()), tree / 'lab', tree / 'test' / 'support']
    path = os.pathsep.join(map(str, folders))
    command = [sys.executable, '-B', '-m', 'pytest', '-x', '-q', '-p', 'no:cacheprovider', *tests]
    try:
        ended = subprocess.run(
            command,
            cwd=tree,
            env={**os.environ, 'PYTHONPATH': path},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            timeout=_TIMEOUT_S,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return True
    return ended.returncode not in (0, 5)  # 5: all tests of a file are left out


def _rows(packages: Sequence[str], results: Sequence[Mapping[str, Any]]) -> list[BenchRow]:
    def row(name: str, bound: float) -> BenchRow:
        of = [r['noticed'] for r in results if name in ('all', str(r['module']).split('/')[1])]
        return BenchRow(
            name=f'planted faults noticed, {name}',
            unit='',
            ours=float(np.mean(of)) if of else float('nan'),
            goal=Goal(of='ours', relation='>=', bound=bound),
            n=len(of),
        )

    return [row('all', _TOTAL_GOAL), *(row(package, _PACKAGE_GOAL) for package in packages)]
