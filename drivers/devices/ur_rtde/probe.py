"""A look at the controller's ports before the client library touches them.

The library's constructors wait for ever, and say nothing, where a port is closed by a firewall
or a controller hangs; two plain sockets with deadlines tell those apart.
"""

import socket

from drivers.errors import BadReply, DriverError, Unreachable

DASHBOARD_PORT = 29999
RTDE_PORT = 30004
DEADLINE_S = 2.0

GREETING = b"Connected: Universal Robots Dashboard Server"
ASK_PROTOCOL_2 = bytes.fromhex("0005560002")
PROTOCOL_2_ACCEPTED = bytes.fromhex("00045601")


def probe(device: str, address: str) -> None:
    """Check that a UR controller listens at an address.

    Reads the dashboard's greeting and negotiates RTDE version 2 (``00 05 56 00 02`` answered by
    ``00 04 56 01``), then closes both connections.

    Raises
    ------
    Unreachable
        Nobody listens, or nobody answers.
    BadReply
        Something else than a UR controller answers.
    """
    _expect(device, (address, DASHBOARD_PORT), b"", GREETING)
    _expect(device, (address, RTDE_PORT), ASK_PROTOCOL_2, PROTOCOL_2_ACCEPTED)


def _expect(device: str, end_point: tuple[str, int], request: bytes, reply: bytes) -> None:
    try:
        with socket.create_connection(end_point, DEADLINE_S) as connection:
            connection.settimeout(DEADLINE_S)
            connection.sendall(request)
            received = _receive(connection, len(reply))
    except OSError as error:
        raise _explain(device, end_point, error) from error
    if received != reply:
        raise BadReply(
            device,
            f"connect to port {end_point[1]}",
            "no UR controller of PolyScope 3 or 5 answers there: check the address",
            received,
        )


def _receive(connection: socket.socket, count: int) -> bytes:
    received = b""
    while len(received) < count and (chunk := connection.recv(count - len(received))):
        received += chunk
    return received


def _explain(device: str, end_point: tuple[str, int], error: OSError) -> DriverError:
    if isinstance(error, ConnectionRefusedError):
        reason = "the connection is refused: is this the robot's address, and has it started up?"
    elif isinstance(error, TimeoutError):
        reason = (
            f"nothing answers within {DEADLINE_S:g} s: check power, cable, address and firewall, "
            "and restart the controller if it hangs"
        )
    else:
        reason = f"{error.strerror or error}: check the address and the network"
    return Unreachable(device, f"connect to port {end_point[1]}", reason)
