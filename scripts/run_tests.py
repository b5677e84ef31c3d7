"""Run every check of the project: style, types, tests, and the ROS 2 workspace."""

import sys

from _bootstrap import prepare

if __name__ == '__main__':
    prepare(group='dev')
    from gate import main

    raise SystemExit(main(sys.argv[1:]))
