"""Look into a bag: `goalreach bag`."""

from _bootstrap import run

if __name__ == '__main__':
    run('bag')
