"""Where the page is served, when nothing else is said; apart, so that nobody loads viser for it."""

from __future__ import annotations

DEFAULT_PORT = 8080
LOOPBACK = '127.0.0.1'
