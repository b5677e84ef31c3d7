"""Drive one path fuzzy and crisp from the same start, and write both as a short animation.

python examples/path_animation.py path.gif
"""

import sys

from matplotlib.animation import FuncAnimation, PillowWriter
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle

import goalreach

if not sys.argv[1:]:
    sys.exit(__doc__)
START = (0.4, 4.6, -90.0)
FRAMES, HELD, PER_SECOND = 48, 12, 12
BODY_M = 0.225
STYLES = {'fuzzy': ('#0072b2', '-'), 'crisp': ('#d55e00', '--')}

arena, policy = goalreach.Arena(), goalreach.train(seed=7)
figure = Figure(figsize=(4.0, 5.4), layout='constrained')
axes = figure.add_subplot(xlabel='x (m)', ylabel='y (m)', aspect='equal')
axes.set(xlim=(-0.1, arena.width_m + 0.1), ylim=(-0.1, arena.length_m + 0.1))
axes.add_patch(Rectangle((0.0, 0.0), arena.width_m, arena.length_m, fill=False))
x_low, y_low, x_high, y_high = arena.regions.bounds(arena.regions.goal)
axes.add_patch(Rectangle((x_low, y_low), x_high - x_low, y_high - y_low, color='#c7e8dd'))
tracks, trails, bodies = {}, {}, {}
for mode, (color, line) in STYLES.items():
    frames = goalreach.simulate(policy, start=START, mode=mode, seed=7)
    tracks[mode] = [(frame.true_pose.x_m, frame.true_pose.y_m) for frame in frames]
    (trails[mode],) = axes.plot([], [], line, color=color, label=mode)
    bodies[mode] = Circle(START[:2], BODY_M, fill=False, edgecolor=color)
    axes.add_patch(bodies[mode])
axes.legend(loc='upper right')
longest = max(map(len, tracks.values()))


def draw(number: int) -> list[Artist]:
    """Show the paths up to a frame; the last ones hold the end before the loop starts again."""
    shown = 1 + (longest - 1) * min(number, FRAMES - 1) // (FRAMES - 1)
    for mode, track in tracks.items():
        trails[mode].set_data(*zip(*track[:shown], strict=True))
        bodies[mode].set_center(track[:shown][-1])
    return [*trails.values(), *bodies.values()]


animation = FuncAnimation(figure, draw, frames=FRAMES + HELD)
animation.save(sys.argv[1], writer=PillowWriter(fps=PER_SECOND), dpi=80)
