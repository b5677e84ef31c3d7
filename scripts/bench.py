"""Measure the benchmark tables and run the studies in lab/."""

from _bootstrap import prepare

if __name__ == '__main__':
    prepare(group='dev')
    from goalreach_lab.cli import main

    raise SystemExit(main())
