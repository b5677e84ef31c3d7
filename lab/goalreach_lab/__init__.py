"""Benchmarks, studies, fault injection and fuzzing of goalreach itself."""
