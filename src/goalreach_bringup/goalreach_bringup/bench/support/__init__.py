"""What suites need beside themselves: peers, and graphs that are looked on."""
