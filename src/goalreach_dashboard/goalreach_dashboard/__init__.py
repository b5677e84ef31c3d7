"""The live page of a running graph."""
