"""Report what goalreach runs on: `goalreach doctor`."""

from _bootstrap import run

if __name__ == '__main__':
    run('doctor')
