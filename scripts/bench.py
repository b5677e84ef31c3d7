"""Measure the benchmark tables: `goalreach bench`."""

from _bootstrap import run

if __name__ == '__main__':
    run('bench')
