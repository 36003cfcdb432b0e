"""Ports to listen on, apart from those of tests that run at the same time."""

from __future__ import annotations

import os


def port_of_this_worker(port: int) -> int:
    """Processes that share the tests out have a thousand ports each: gw0, gw1, ..."""
    return port + 1000 * int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
