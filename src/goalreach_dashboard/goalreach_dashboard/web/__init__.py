"""Web server, access control and controls of the live page."""
