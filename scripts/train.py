"""Learn a policy: `goalreach train`."""

from _bootstrap import run

if __name__ == '__main__':
    run('train')
