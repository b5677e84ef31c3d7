"""Giving an MCAP file the indexes and the summary that its writer did not come to write."""

from __future__ import annotations

from pathlib import Path

from goalreach_bringup.bags.mcap_layout import ChunkInfo
from goalreach_bringup.bags.mcap_scan_file import McapScan
from goalreach_bringup.bags.mcap_summary import ChunkTotals, tail

__all__ = ['repair_mcap']


def repair_mcap(scan: McapScan, metadata: str) -> None:
    """Cut off what is not sound, and end the file as it should.

    Where only the last chunk lacks indexes they are added in place; a file whose chunks in the
    middle lack them is written anew beside the old one, which it then replaces.

    Args:
        scan: What is sound in it.
        metadata: The bag's summary.

    Raises:
        OSError: The disk takes no more.
    """
    if all(chunk.indexed for chunk in scan.chunks[:-1]):
        _finish_in_place(scan, metadata)
    else:
        _write_anew(scan, metadata)


def _finish_in_place(scan: McapScan, metadata: str) -> None:
    chunks = [chunk.info for chunk in scan.chunks]
    position, missing = scan.end, b''
    if scan.chunks and not scan.chunks[-1].indexed:
        last = scan.chunks[-1]
        position = last.info.offset + last.info.length
        missing = b''.join(last.content.index_records().values())
        chunks[-1] = _placed(scan, len(chunks) - 1, last.info.offset)
    with scan.path.open('r+b') as stream:
        stream.truncate(position)
        stream.seek(position)
        stream.write(missing + _tail(scan, chunks, position + len(missing), metadata))


def _write_anew(scan: McapScan, metadata: str) -> None:
    path = scan.path.with_suffix('.mcap.repair')
    with scan.path.open('rb') as old, path.open('wb') as new:
        new.write(old.read(scan.body))
        chunks = []
        for index, chunk in enumerate(scan.chunks):
            old.seek(chunk.info.offset)
            chunks.append(_placed(scan, index, new.tell()))
            new.write(old.read(chunk.info.length))
            new.write(b''.join(chunk.content.index_records().values()))
        new.write(_tail(scan, chunks, new.tell(), metadata))
    Path(path).replace(scan.path)


def _placed(scan: McapScan, index: int, offset: int) -> ChunkInfo:
    chunk = scan.chunks[index]
    info = chunk.info
    return chunk.content.placed(offset, info.length, info.compression, info.sizes)


def _tail(scan: McapScan, chunks: list[ChunkInfo], position: int, metadata: str) -> bytes:
    return tail(
        position,
        schemas=list(scan.schemas.values()),
        channels=list(scan.channels.values()),
        totals=ChunkTotals.of(chunks),
        metadata=metadata,
    )
