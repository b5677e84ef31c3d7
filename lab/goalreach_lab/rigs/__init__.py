"""Graphs, browsers and peers that benchmarks and studies measure with."""
