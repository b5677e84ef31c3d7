"""The rows of `goalreach bench`: ours beside floors and peers, and docs/PERFORMANCE.md."""
