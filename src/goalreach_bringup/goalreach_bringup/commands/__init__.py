"""One module per command: `SUMMARY`, `configure(parser)`, `execute(arguments) -> status`."""
