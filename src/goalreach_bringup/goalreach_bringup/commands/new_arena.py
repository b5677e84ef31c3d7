"""The `new-arena` command: asks for the sizes of a room, and writes an arena file."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
import sys
from typing import TypeVar

from goalreach_msgs_py.arena_file import read_arena
from goalreach_msgs_py.errors import CommandError, FileFormatError
from goalreach_msgs_py.files import require_writable, write_text_atomically
from goalreach_msgs_py.options import CommandOptions, option

SUMMARY = 'Ask for width, length, landmarks and goal of a room, and write an arena with a drawing'
AnswerT = TypeVar('AnswerT')
_LED = '  - [{}, {}, {}]'
_TAG = '  - {{id: {}, size_m: {}, x_m: {}, y_m: {}, z_m: {}, facing_deg: {}}}'


@dataclass(frozen=True, kw_only=True)
class Options(CommandOptions):
    """Options of the command."""

    out: Path = option(Path('arena.yaml'), 'arena file; a drawing is written to the same folder')


def execute(options: Options) -> int:
    """Ask, write and draw."""
    from goalreach_evaluation.figures.arena_axes import arena_figure, draw_region_names
    from goalreach_evaluation.figures.figure_file import write_figure

    if options.out.exists():
        raise FileFormatError(options.out, 'exists already')
    require_writable(options.out)
    draft = Path(f'{options.out}.draft')  # stays where it is refused, to be corrected
    write_text_atomically(draft, _ask_arena(options.out.stem))
    arena = read_arena(draft)
    draft.rename(options.out)
    figure, axes = arena_figure(arena, arena.name)
    draw_region_names(axes, arena, size=6)
    print(options.out, *write_figure(figure, options.out.parent, options.out.stem, ('svg',)))
    return 0


def _ask_arena(name: str) -> str:
    """Return the text of an arena file from the user's answers."""
    print('The origin is a corner; x runs along the goal wall, y away from it.')
    width, length = (_ask(f'{side} of the room, m', 3.0, float) for side in ('width', 'length'))
    sizes = (('x', width), ('y', length))
    borders = {axis: [round(k * size / 3, 3) for k in (1, 2)] for axis, size in sizes}
    landmarks = _ask_landmarks(width, length)
    goal = _ask('goal: LEFT-SIDE, FRONT or RIGHT-SIDE/NEAR, MEDIUM or FAR', 'FRONT/NEAR', str)
    lines = [f'name: {name!r}', f'width_m: {width}', f'length_m: {length}']
    for entry, template in (('leds_m', _LED), ('tags', _TAG)):
        rows = [template.format(*row) for row in landmarks if len(row) == template.count('{}')]
        lines += [f'{entry}:', *rows] if rows else []
    lines += ['regions:', *(f'  {axis}_borders_m: {at}' for axis, at in borders.items())]
    transition = round(0.15 * min(width, length), 3)
    lines += [f'  transition_width_m: {transition}', f'  goal: {goal}', 'starts:', '  border: 22']
    return '\n'.join(lines) + '\n'


def _ask_landmarks(width: float, length: float) -> list[list[float]]:
    print('Landmarks, one a line. An LED: x y height. A tag: number size x y height facing_deg.')
    print('An empty line ends; at once, it stands for six tags of 0.16 m around the room.')
    rows, none = list[list[float]](), list[float]()
    while row := _ask('landmark', none, _numbers):
        rows.append(row)
    at = [(0.25, 0, 90), (0.75, 0, 90), (1, 0.5, 180), (0.75, 1, -90), (0.25, 1, -90), (0, 0.5, 0)]
    tags = [
        [k, 0.16, round(x * width, 3), round(y * length, 3), 1.2, facing]
        for k, (x, y, facing) in enumerate(at)
    ]
    return rows or tags


def _numbers(text: str) -> list[float]:
    row = [float(word) for word in text.replace(',', ' ').split()]
    if len(row) not in {_LED.count('{}'), _TAG.count('{}')}:
        raise ValueError(text)
    if len(row) == _TAG.count('{}'):
        row[0] = int(text.replace(',', ' ').split()[0])
    return row


def _ask(question: str, default: AnswerT, parse: Callable[[str], AnswerT]) -> AnswerT:
    """Return an answer, or the default for an empty line; ask again after an invalid one."""
    while True:
        print(f'{question} [{default}]: ' if default else f'{question}: ', end='', flush=True)
        if not (line := sys.stdin.readline()):
            raise CommandError(f'no answer: {question}')
        try:
            return parse(line.strip()) if line.strip() else default
        except ValueError:
            print(f'not understood: {line.strip()}')
