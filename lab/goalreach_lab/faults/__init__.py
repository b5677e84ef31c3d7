"""Fault injection into live graphs, soak and start-stop tests."""
