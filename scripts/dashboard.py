"""Show the live page of a running graph: `goalreach dashboard`."""

from _bootstrap import run

if __name__ == '__main__':
    run('dashboard')
