"""The live page of a running graph.

`goalreach_dashboard.web.server.serve` serves it; that module needs the extra `dashboard`.
"""

from goalreach_dashboard.address import (
    REQUEST,
    TOKEN_VARIABLE,
    bind,
    is_loopback,
    url,
)

__all__ = ['REQUEST', 'TOKEN_VARIABLE', 'bind', 'is_loopback', 'url']
