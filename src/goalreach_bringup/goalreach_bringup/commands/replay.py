"""The `replay` command: a bag into the graph, or through live perception."""

from goalreach_bags.options import ReplayOptions as Options
from goalreach_msgs_py.parameter_file import read_parameters

SUMMARY = 'Replay a rosbag2 directory into the graph, or through live perception'


def execute(options: Options) -> int:
    """Replay; with --recompute return 1 where something differs."""
    if not options.recompute:
        from goalreach_bags.ros.player import replay

        print(replay(options))
        return 0
    from goalreach_bags.report import show_recomputation
    from goalreach_bags.ros.recompute import recompute
    from goalreach_bringup.launch.plan import require_known

    require_known(read_parameters(options.params_file))
    results = recompute(
        options.bag,
        tolerance=options.tolerance,
        params_file=options.params_file,
        quiet=options.quiet,
    )
    show_recomputation(results, tolerance=options.tolerance)
    return 0 if all(result.same for result in results) else 1
