"""Where a webhook may be sent: http and https, to public addresses and to networks named.

A subscriber's URL makes this machine send requests. Without care it could be pointed at things that
only this machine reaches: its own loopback, the plant's network, a cloud's metadata address. So the
address behind the name is looked up at every attempt, judged, and then used as it is, so that the
name cannot turn into another address between judging and connecting.
"""

import socket
from dataclasses import dataclass
from ipaddress import IPv4Address, IPv6Address, ip_address, ip_network

import httpx

Address = IPv4Address | IPv6Address
_SCHEMES = ("http", "https")
_PORTS = range(1, 65536)


class Forbidden(Exception):
    """A webhook must not be sent there; the message says why."""


@dataclass(frozen=True)
class Destination:
    """An address that was judged, and the name under which it was asked for."""

    url: httpx.URL
    """With the address in place of the name."""
    host: str
    """For the Host header."""
    name: str
    """For the server's certificate."""


def checked_url(text: str) -> httpx.URL:
    """A URL that may be stored; raises `Forbidden`. Nothing is looked up."""
    try:
        url = httpx.URL(text)
    except httpx.InvalidURL as error:
        raise Forbidden(f"'{text[:80]}' is no URL ({error})") from error
    if url.scheme not in _SCHEMES or not url.raw_host:
        raise Forbidden("a webhook goes to a http or https URL with a host")
    if not _can_be_looked_up(url):
        raise Forbidden(
            f"the host of '{text[:80]}' is no name that can be looked up; give an address, or a "
            "name whose parts between the dots have 1 to 63 characters"
        )
    if url.userinfo or url.fragment:
        raise Forbidden("the URL must hold neither user, password nor fragment")
    if url.port is not None and url.port not in _PORTS:
        raise Forbidden(f"port {url.port} does not exist; give one from 1 to {_PORTS[-1]}")
    return url


def destination(text: str, networks: tuple[str, ...]) -> Destination:
    """The address to which a webhook is sent now.

    Parameters
    ----------
    networks
        Networks that are not public and yet allowed, `10.20.0.0/16`.

    Raises
    ------
    Forbidden
        If the URL leads elsewhere.
    OSError
        If the name is not known.
    """
    url = checked_url(text)
    port = url.port or (443 if url.scheme == "https" else 80)
    found = socket.getaddrinfo(url.raw_host.decode("ascii"), port, type=socket.SOCK_STREAM)
    addresses = [ip_address(entry[4][0]) for entry in found]
    refused = [address for address in addresses if not _is_allowed(address, networks)]
    if refused:
        raise Forbidden(
            f"'{url.host}' is {refused[0]}, which is not public; name its network in "
            "ROBOCAL_WEBHOOK_NETWORKS to allow it"
        )
    return Destination(
        url.copy_with(host=str(addresses[0])), url.netloc.decode("ascii"), url.raw_host.decode()
    )


def _can_be_looked_up(url: httpx.URL) -> bool:
    try:
        # Spells out an international name, then splits it into the labels of DNS.
        url.host.encode("idna")
        url.raw_host.decode("ascii").encode("idna")
    except UnicodeError:
        return False
    return True


def _is_allowed(address: Address, networks: tuple[str, ...]) -> bool:
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        address = address.ipv4_mapped
    if address.is_global and not address.is_multicast:
        return True
    return any(address in ip_network(network) for network in networks)
