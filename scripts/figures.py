"""Draw the figures: `goalreach figures`."""

from _bootstrap import run

if __name__ == '__main__':
    run('figures')
