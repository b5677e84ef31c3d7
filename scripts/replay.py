"""Play a bag back: `goalreach replay`."""

from _bootstrap import run

if __name__ == '__main__':
    run('replay')
