"""Record the running graph to a bag: `goalreach record`."""

from _bootstrap import run

if __name__ == '__main__':
    run('record')
