"""Checks of the house rules on source text; each returns complaints, none where all is well."""

import ast
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
import re
import sys

MODULE_LINES = 400
FUNCTION_LINES = 40

# The layers, lowest first: rule 2. A package imports those of lower layers only.
LAYERS = (
    ('goalreach_msgs_py',),
    ('goalreach_sim', 'goalreach_perception', 'goalreach_learning'),
    ('goalreach_evaluation', 'goalreach_dashboard'),
    ('goalreach_bags',),
    ('goalreach_bringup',),
    ('goalreach',),
)
PACKAGES = tuple(package for layer in LAYERS for package in layer)
LAB = 'goalreach_lab'
ALLOWED = {
    package: {lower for below in LAYERS[:height] for lower in below}
    for height, layer in enumerate([*LAYERS, (LAB,)])
    for package in layer
}
# Where rule 3 holds: no I/O but in modules named for it.
PURE = {'goalreach_msgs_py', 'goalreach_sim', 'goalreach_perception', 'goalreach_learning'}

# Keys under which package.xml names what is not a ROS package.
ROSDEP_KEYS = {
    'argcomplete': 'python3-argcomplete',
    'cv2': 'python3-opencv',
    'matplotlib': 'python3-matplotlib',
    'numpy': 'python3-numpy',
    'rich': 'python3-rich',
    'scipy': 'python3-scipy',
    'yaml': 'python3-yaml',
}
# Without such a key, or only in an extra: pyproject.toml alone names them.
PIP_ONLY = {
    'atheris', 'distributed', 'filterpy', 'gymnasium', 'irsim', 'mcap', 'rosbags', 'selenium',
    'stable_baselines3', 'starlette', 'torch', 'uvicorn', 'websockets', 'zstandard',
}  # fmt: skip

IO_MODULES = {
    'asyncio',
    'datetime',
    'logging',
    'multiprocessing',
    'os',
    'pathlib',
    'random',
    'secrets',
    'shutil',
    'socket',
    'subprocess',
    'sys',
    'tempfile',
    'threading',
    'time',
    'urllib',
}
IO_FUNCTIONS = {'input', 'open', 'print'}
IO_METHODS = re.compile(
    r'^(?:(?:np|numpy)\.(?:load|save|savez|loadtxt|savetxt|genfromtxt|fromfile)'
    r'|cv2\.(?:imread|imwrite|imshow|waitKey)'
    r'|.*\.(?:read_text|write_text|read_bytes|write_bytes|tofile|savefig))$'
)
# All of numpy.random and of OpenCV that draws from, or sets, a generator of the whole process.
GLOBAL_RANDOMNESS = re.compile(r'^(?:(?:np|numpy)\.random\.[a-z]\w*|cv2\.(?:rand\w+|setRNGSeed))$')
SEEDED = re.compile(r'^(?:np|numpy)\.random\.default_rng$')

TRACES = {
    'number of an issue': re.compile(r'\b(?:issue|pull request|ticket)s? #?\d', re.IGNORECASE),
    'path of one machine': re.compile(r'/(?:root|home|work|tmp)/'),
    'package registry': re.compile(r'pypi\.|python[h]osted', re.IGNORECASE),
}


@dataclass(frozen=True, kw_only=True)
class Module:
    """One module of ours.

    Attributes:
        name: Dotted name.
        text: Source.
    """

    name: str
    text: str

    @property
    def package(self) -> str:
        """The top-level package."""
        return self.name.partition('.')[0]

    @property
    def speaks_ros(self) -> bool:
        """Whether its place says that it may import ROS: rule 1."""
        return self.name.endswith('_node') or '.ros.' in f'{self.name}.'

    @property
    def is_pure(self) -> bool:
        """Whether rule 3 holds for it."""
        is_file = self.name.endswith(('_file', '.files'))
        return self.package in PURE and not self.speaks_ros and not is_file

    def nodes(self) -> Iterator[ast.AST]:
        """Yield the nodes of the syntax tree."""
        yield from ast.walk(ast.parse(self.text))

    def imports(self) -> set[str]:
        """Return the dotted names of all that is imported, wherever in the module.

        ``from a import b`` gives ``a.b``, which may be a module or a name in one.
        """
        found = set()
        for node in self.nodes():
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                base = self._base(node)
                found |= {f'{base}.{alias.name}' for alias in node.names}
        return found

    def calls(self) -> set[str]:
        """Return what is called, as it is written: ``open``, ``np.random.rand``."""
        return {ast.unparse(node.func) for node in self.nodes() if isinstance(node, ast.Call)}

    def _base(self, node: ast.ImportFrom) -> str:
        if not node.level:
            return str(node.module)
        parents = self.name.split('.')[: -node.level]
        return '.'.join([*parents, node.module] if node.module else parents)


def is_ros(name: str) -> bool:
    """Tell whether a dotted name belongs to a ROS package."""
    top = name.partition('.')[0]
    known = {'ament_index_python', 'rclpy', 'std_srvs'}
    return top in known or top.endswith(('_msgs', '_interfaces')) or top.startswith('rosidl_')


def check_ros_imports(module: Module) -> list[str]:
    """Rule 1: only `*_node` and what is in `ros/` imports ROS; pure packages none of those two."""
    if module.speaks_ros or module.package == LAB:
        return []
    wrong = {name for name in module.imports() if is_ros(name)}
    if module.package in PURE:
        wrong |= {name for name in module.imports() if _leads_to_ros(name)}
    return [f'{module.name} imports {name}' for name in sorted(wrong)]


def _leads_to_ros(name: str) -> bool:
    parts = name.split('.')
    ours = parts[0] in ALLOWED
    return ours and any(p == 'ros' or p.endswith('_node') for p in parts[1:])


def check_package_imports(module: Module) -> list[str]:
    """Rule 2: which of our packages imports which."""
    allowed = ALLOWED[module.package] | {module.package}
    ours = {*ALLOWED, 'scripts', 'test'}
    tops = {name.partition('.')[0] for name in module.imports()}
    return [f'{module.name} imports {top}' for top in sorted((tops & ours) - allowed)]


def check_purity(module: Module) -> list[str]:
    """Rule 3: no I/O, logging, clock or process in pure code; no global randomness anywhere."""
    calls = module.calls()
    wrong = {c for c in calls if GLOBAL_RANDOMNESS.match(c) and not SEEDED.match(c)}
    wrong |= {name for name in module.imports() if name.partition('.')[0] == 'random'}
    wrong |= {f'{c}() without a seed' for c in _unseeded(module)}
    if module.is_pure:
        wrong |= {c for c in calls if c in IO_FUNCTIONS or IO_METHODS.match(c)}
        wrong |= {name for name in module.imports() if name.partition('.')[0] in IO_MODULES}
    return [f'{module.name} uses {name}' for name in sorted(wrong)]


def _unseeded(module: Module) -> Iterator[str]:
    for node in module.nodes():
        if not isinstance(node, ast.Call) or node.args or node.keywords:
            continue
        if SEEDED.match(ast.unparse(node.func)):
            yield ast.unparse(node.func)


def check_manifest(package: str, modules: Iterable[Module], declared: set[str]) -> list[str]:
    """Rule 4: package.xml declares what is imported, and nothing else."""
    imported = {n.partition('.')[0] for m in modules for n in m.imports()} - {package}
    imported -= {*sys.stdlib_module_names, *PIP_ONLY}
    unknown = {n for n in imported if n not in ROSDEP_KEYS and n not in ALLOWED and not is_ros(n)}
    needed = {ROSDEP_KEYS.get(name, name) for name in imported - unknown}
    return [
        *(f'{package} imports {name}: no rosdep key is known' for name in sorted(unknown)),
        *(f'{package} lacks {name}' for name in sorted(needed - declared)),
        *(f'{package} does not import {name}' for name in sorted(declared - needed)),
    ]


def check_cycles(modules: Iterable[Module]) -> list[str]:
    """Rule 5: imports follow one order, so that no module reaches itself again."""
    by_name = {module.name: module for module in modules}
    graph = {name: set(_targets(module, by_name)) for name, module in by_name.items()}
    while True:
        leaves = {name for name, targets in graph.items() if not targets}
        if not leaves:
            break
        graph = {n: targets - leaves for n, targets in graph.items() if n not in leaves}
    on_cycle = {n for n in graph if n in reachable(n, graph)}
    return [f'{name} imports itself again' for name in sorted(on_cycle)]


def _targets(module: Module, known: Mapping[str, Module]) -> Iterator[str]:
    for name in module.imports():
        target = name if name in known else name.rpartition('.')[0]
        if target in known and known[target].name != module.package:
            yield target


def reachable(start: str, graph: Mapping[str, set[str]]) -> set[str]:
    """Return the nodes of a graph that arrows lead to from one of them."""
    seen: set[str] = set()
    todo = [start]
    while todo:
        new = graph[todo.pop()] - seen
        seen |= new
        todo += new
    return seen


def check_size(module: Module) -> list[str]:
    """Modules and functions fit on few screens."""
    lines = module.text.count('\n')
    complaints = [f'{module.name} has {lines} lines'] if lines > MODULE_LINES else []
    for node in module.nodes():
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            if length > FUNCTION_LINES:
                complaints.append(f'{module.name}.{node.name} has {length} lines')
    return complaints


def check_traces(name: str, text: str) -> list[str]:
    """No text speaks of the place or the process that made it."""
    return [
        f'{name}: {what}: {found.group()!r}'
        for what, pattern in TRACES.items()
        for found in pattern.finditer(text)
    ]
