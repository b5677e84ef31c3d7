"""Benchmarks against floors and peers."""
