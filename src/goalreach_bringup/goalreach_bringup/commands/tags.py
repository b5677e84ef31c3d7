"""The `tags` command: the AprilTags of an arena as pages for a printer."""

from dataclasses import dataclass
from pathlib import Path

from goalreach_evaluation.choices import arena_option, choose_arena
from goalreach_msgs_py.errors import ConfigurationError
from goalreach_msgs_py.files import write_bytes_atomically
from goalreach_msgs_py.options import CommandOptions, option

SUMMARY = 'Write the AprilTags of an arena as pages to scale, each with a ruler and its place'


@dataclass(frozen=True, kw_only=True)
class Options(CommandOptions):
    """Options of the command."""

    arena: str = arena_option()
    out: Path = option(Path('tags.pdf'), 'file for the pages')


def execute(options: Options) -> int:
    """Write the pages."""
    from goalreach_evaluation.figures.tag_pages import tag_pages

    arena = choose_arena(options.arena)
    if not arena.tags:
        raise ConfigurationError('--arena', options.arena, 'one with tags')
    write_bytes_atomically(options.out, tag_pages(arena))
    print(options.out)
    return 0
