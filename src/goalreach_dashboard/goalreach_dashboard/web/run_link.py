"""The run that started the page: what it reports, and what the page asks of it.

The launcher appends JSON objects to a file, one a line; the page prints its requests, and the
launcher reads them from the page's log.
"""

from collections.abc import Iterator, Mapping
import json
from pathlib import Path
import tarfile
from typing import Any, Final

from goalreach_dashboard.address import REQUEST

_CHUNK_BYTES: Final = 1 << 18


class RunLink:
    """Reads what the launcher reports, and tells it what the page asks for.

    Args:
        path: File of the reports.
    """

    def __init__(self, path: Path) -> None:
        self._file = path.open(encoding='utf-8')
        self._partial = ''

    def events(self) -> list[Mapping[str, Any]]:
        """Return what has been reported since the last call."""
        *lines, self._partial = (self._partial + self._file.read()).split('\n')
        return [json.loads(line) for line in lines]

    def tell(self, **values: object) -> None:
        """Tell the launcher something."""
        print(REQUEST + json.dumps(values), flush=True)


def tar_of(folder: Path) -> Iterator[bytes]:
    """Yield a tar archive of the files of a folder, without holding any of them in memory."""
    for path in sorted(each for each in folder.iterdir() if each.is_file()):
        info = tarfile.TarInfo(f'{folder.name}/{path.name}')
        info.size, info.mtime = path.stat().st_size, int(path.stat().st_mtime)
        yield info.tobuf()
        with path.open('rb') as file:
            left = info.size
            while chunk := file.read(min(_CHUNK_BYTES, left)):
                left -= len(chunk)
                yield chunk
        yield bytes(left + -info.size % tarfile.BLOCKSIZE)
    yield bytes(2 * tarfile.BLOCKSIZE)
