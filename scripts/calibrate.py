"""Measure mount, survey, odometry and delay of a robot: `goalreach calibrate`."""

from _bootstrap import run

if __name__ == '__main__':
    run('calibrate')
