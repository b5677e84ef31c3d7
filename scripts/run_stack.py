"""Bring up the graph and drive: `goalreach run`."""

from _bootstrap import run

if __name__ == '__main__':
    run('run')
