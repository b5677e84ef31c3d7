"""Look into the running graph with the words of ros2: `goalreach ros2`."""

from _bootstrap import run

if __name__ == '__main__':
    run('ros2')
