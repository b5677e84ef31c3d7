"""Plans, starts and supervises the nodes of a run."""
