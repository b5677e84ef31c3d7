"""The paper's seven figures, drawn from data."""
