from __future__ import annotations

from pathlib import Path

from goalreach_msgs_py.ros.dds_profile import count_local_participants

# Domain 0: 7410 = 1CF2 and 7411 = 1CF3 are participant 0 (discovery and data), 7412 = 1CF4 is
# participant 1. 7400 = 1CE8 is the port for multicast. 7660 = 1DEC is participant 0 of domain 1.
TABLE = """\
  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid
  10: 00000000:1CE8 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
  11: 00000000:1CE8 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
  12: 00000000:1CF2 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
  13: 00000000:1CF3 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
  14: 0100007F:1CF4 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
  15: 0100007F:1DEC 00000000:0000 07 00000000:00000000 00:00000000 00000000  1000
"""


def test_counts_the_discovery_ports_of_one_domain(tmp_path: Path) -> None:
    table = tmp_path / 'udp'
    table.write_text(TABLE, encoding='ascii')
    assert [count_local_participants(domain, table) for domain in (0, 1, 2)] == [2, 1, 0]


def test_system_without_the_table_has_none(tmp_path: Path) -> None:
    assert count_local_participants(0, tmp_path / 'missing') == 0
