"""The parts of the launcher that take part in the graph."""
