"""Drive a policy without ROS and judge it: `goalreach evaluate`."""

from _bootstrap import run

if __name__ == '__main__':
    run('evaluate')
