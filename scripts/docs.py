"""Build the documentation site."""

import sys

from _bootstrap import prepare

if __name__ == '__main__':
    prepare(group='dev')
    from site_build import main

    raise SystemExit(main(sys.argv[1:]))
