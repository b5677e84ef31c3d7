"""One module per command: `SUMMARY`, `Options`, `execute(options) -> status`."""
