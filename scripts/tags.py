"""Write the pages of an arena's tags: `goalreach tags`."""

from _bootstrap import run

if __name__ == '__main__':
    run('tags')
