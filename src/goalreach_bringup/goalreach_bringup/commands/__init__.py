"""One module per command: `SUMMARY`, `Options`, `execute(options) -> status`.

`execute` raises `GoalreachError` for what the user can correct; it is reported in one line.
"""
