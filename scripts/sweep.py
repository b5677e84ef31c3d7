"""Learn and drive over seeds, noise and arenas: `goalreach sweep`."""

from _bootstrap import run

if __name__ == '__main__':
    run('sweep')
