"""Say what a robot lacks: `goalreach check-robot`."""

from _bootstrap import run

if __name__ == '__main__':
    run('check-robot')
