"""The `run` command: the whole graph, driving."""

from goalreach_bringup.launch.options import RunOptions

SUMMARY = 'Bring the graph up, one process per node, and drive'
Options = RunOptions


def execute(options: Options) -> int:
    """Run the graph; return 0 where every requested path reached the goal or Ctrl-C ended it.

    Raises:
        GoalreachError: An option, a file or a parameter is refused, or a node died.
    """
    from goalreach_bringup.launch.session import RunSession

    return RunSession(options).execute()
