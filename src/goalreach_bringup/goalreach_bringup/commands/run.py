"""The `run` command: the whole graph, driving."""

import os

from goalreach_bringup.launch.auxiliary_processes import PageProcess
from goalreach_bringup.launch.options import RunOptions

SUMMARY = 'Bring the graph up, one process per node, and drive'
Options = RunOptions


def execute(options: Options) -> int:
    """Run the graph; return 0 where every requested path reached the goal, else 1.

    The page stays open after the run, and can start another, where a person has it open: see
    `RunRequests.next_options`.
    """
    from goalreach_bringup.launch.session import RunSession

    page: PageProcess | None = None
    try:
        while True:
            session = RunSession(options, page)
            before = dict(os.environ)
            try:
                status = session.execute()
            finally:
                page = session.page
                os.environ.clear()  # a run adds variables, such as the folder of its logs
                os.environ.update(before)
            if session.next_options is None:
                return status
            options = session.next_options
    finally:
        if page is not None:
            page.stop()
