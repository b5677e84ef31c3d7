"""Ask for a room, and write it as an arena: `goalreach new-arena`."""

from _bootstrap import run

if __name__ == '__main__':
    run('new-arena')
