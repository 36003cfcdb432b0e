"""Whom the live page answers: who asks for this machine by a name that is known to be its own.

A page of anybody can have its own name lead to 127.0.0.1 and ask there (DNS rebinding). It then asks for that name, so
that a request for another name than those below is from a stranger, whatever address it came to.
"""

from __future__ import annotations

import socket
from dataclasses import dataclass
from ipaddress import ip_address
from urllib.parse import urlsplit

EVERYWHERE = ("", "0.0.0.0", "::")
"""What stands for every interface."""


@dataclass(frozen=True)
class Names:
    """The names that a server goes by: those of the loopback, and what it was told to listen on.

    Attributes:
        given: besides the loopback, in small letters.
        any_address: whether addresses in digits count too; no name can be made to lead to them.
    """

    given: frozenset[str]
    any_address: bool

    @classmethod
    def of(cls, host: str) -> Names:
        """Those of a server that listens on a host: where that is every interface, the machine's own name as well."""
        if host in EVERYWHERE:
            return cls(frozenset({socket.gethostname().lower(), socket.getfqdn().lower()}), True)
        return cls(frozenset({host.lower()}), False)

    def have(self, authority: str) -> bool:
        """Whether `NAME` or `NAME:PORT`, as it stands in `Host` or behind the `//` of `Origin`, is one of them."""
        try:
            name = urlsplit(f"//{authority}").hostname or ""
        except ValueError:
            return False
        if "@" in authority or "/" in authority:
            return False
        try:
            address = ip_address(name)
        except ValueError:
            return name == "localhost" or name in self.given
        return address.is_loopback or self.any_address or name in self.given


def authority_of(origin: str) -> str:
    """`NAME:PORT` of an `Origin`; "" where there is none, as in "null"."""
    return origin.partition("://")[2]
