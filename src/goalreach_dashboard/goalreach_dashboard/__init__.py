"""The live page of a running graph.

`goalreach_dashboard.web.server.serve` serves it; that module needs the extra `dashboard`.
"""
