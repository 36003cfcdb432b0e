"""A meshcat server of our own, as a process that ends with its owner."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys

from softhand.errors import SofthandError

DEFAULT_PORT = 7000
_GRACE = 5.0  # [s] to end in


class MeshcatServer:
    """Listens on this machine alone, in a process of its own, until `close` or until this process ends.

    Attributes:
        zmq_url: where it takes commands.
        web_url: of its page.

    Args:
        port: of the page, the first to try; busy ones are passed over.

    Raises:
        SofthandError: it does not start.
    """

    def __init__(self, port: int = DEFAULT_PORT) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "softhand.viewer.meshcat.bridge", str(port)],
            stdin=subprocess.PIPE,  # its end is the server's
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))},
            start_new_session=True,  # a Ctrl-C is for us
            text=True,
        )
        said = {}
        assert self._process.stdout
        for _ in range(2):
            name, _, value = self._process.stdout.readline().strip().partition("=")
            said[name] = value
        if not {"zmq_url", "web_url"} <= said.keys():
            self.close()
            why = said.get("error") or "it ended before it listened"
            raise SofthandError(
                f"meshcat's server does not start at port {port}: {why}; give another port.", value=port
            )
        self.zmq_url, self.web_url = said["zmq_url"], said["web_url"]

    def close(self) -> None:
        """End the process; may be called twice."""
        process = self._process
        assert process.stdin and process.stdout
        with contextlib.suppress(OSError):
            process.stdin.close()
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        process.stdout.close()
