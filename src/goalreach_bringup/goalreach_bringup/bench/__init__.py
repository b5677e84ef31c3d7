"""Benchmarks and studies: one module per suite, each with `SUMMARY`, `configure`, `execute`.

A suite measures something of ours beside a floor or a peer in the same run and returns rows.
"""
