"""Sockets of the emulator: one thread, nothing blocks."""

import ipaddress
import selectors
import socket
from collections.abc import Callable
from typing import Protocol

from bolfi_liquids.hardware.errors import RigError
from bolfi_liquids.hardware.process import REAL_CLOCK, HostClock

MOST_UNSENT = 1 << 18  # bytes; a client that reads no more than this loses what comes later
RTDE, SCRIPT, DASHBOARD, ADMIN = 30004, 30003, 29999, 29997


class ClientSession(Protocol):
    """One client of one port."""

    def received(self) -> None:
        """Handle what has come in; closes its connection where the client is at fault."""
        ...


class Connection:
    """A client's socket with what has come in and what is still to go out."""

    def __init__(self, sock: socket.socket):
        self.socket = sock
        self.inbox = bytearray()
        self.closing = False
        self._outbox = bytearray()

    def send(self, data: bytes) -> None:
        """Send now as much as the socket takes, the rest later."""
        if len(self._outbox) + len(data) > MOST_UNSENT:
            return
        self._outbox += data
        self.flush()

    @property
    def unsent(self) -> bool:
        return bool(self._outbox)

    def flush(self) -> None:
        if not self._outbox:
            return
        try:
            del self._outbox[: self.socket.send(self._outbox)]
        except BlockingIOError:
            pass
        except OSError:
            self.closing = True

    def read(self) -> None:
        try:
            data = self.socket.recv(65536)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if data:
            self.inbox += data
        else:
            self.closing = True


class Network:
    """The four ports of a controller and their clients.

    Raises:
        RigError: The address is not one of this computer alone, or a port is taken.
    """

    def __init__(
        self,
        address: str,
        sessions: dict[int, Callable[[Connection], ClientSession]],
        clock: HostClock = REAL_CLOCK,
    ):
        check_address(address)
        self._clock = clock
        self._factories = sessions
        self._selector = selectors.SelectSelector()
        self._listeners: dict[int, socket.socket] = {}
        self._clients: dict[Connection, tuple[int, ClientSession]] = {}
        self._frozen_until: float | None = None
        try:
            for port in sessions:
                self._listeners[port] = _listen(address, port)
        except RigError:
            self.close()
            raise
        for port, listener in self._listeners.items():
            self._selector.register(listener, selectors.EVENT_READ, port)

    def sessions(self, port: int) -> list[ClientSession]:
        return [session for at, session in self._clients.values() if at == port]

    @property
    def frozen(self) -> bool:
        return self._frozen_until is not None

    def poll(self, timeout: float) -> None:
        """Wait for clients, up to `timeout` [s], and serve all that have sent something."""
        self._thaw()
        for key, events in self._selector.select(timeout):
            # an earlier one of this round may have frozen or dropped the rest
            if isinstance(key.data, int):
                if not self.frozen or key.data == ADMIN:
                    self._accept(key.data)
            elif key.data in self._clients and not self._stands_still(key.data):
                self._serve(key.data, events)
        for connection in [one for one in self._clients if one.closing]:
            self._forget(connection)

    def watch_unsent(self) -> None:
        """Let the next poll send what did not fit into the sockets."""
        for connection in self._clients:
            if connection.unsent and not self._stands_still(connection):
                events = selectors.EVENT_READ | selectors.EVENT_WRITE
                self._selector.modify(connection.socket, events, connection)

    def freeze(self, seconds: float) -> None:
        """Robot's ports take and send nothing for a while; their sockets stay open."""
        if not self.frozen:
            for port, listener in self._listeners.items():
                if port != ADMIN:
                    self._selector.unregister(listener)
            for connection, (port, _) in self._clients.items():
                if port != ADMIN:
                    self._selector.unregister(connection.socket)
        self._frozen_until = self._clock.now() + seconds

    def drop(self) -> None:
        """Close all connections but the admin's; the ports go on listening."""
        for connection in [one for one, (port, _) in self._clients.items() if port != ADMIN]:
            self._forget(connection)

    def close(self) -> None:
        for connection in list(self._clients):
            self._forget(connection)
        for listener in self._listeners.values():
            listener.close()
        self._selector.close()

    def _thaw(self) -> None:
        if self._frozen_until is None or self._clock.now() < self._frozen_until:
            return
        self._frozen_until = None
        for port, listener in self._listeners.items():
            if port != ADMIN:
                self._selector.register(listener, selectors.EVENT_READ, port)
        for connection, (port, _) in self._clients.items():
            if port != ADMIN:
                self._selector.register(connection.socket, selectors.EVENT_READ, connection)

    def _stands_still(self, connection: Connection) -> bool:
        return self.frozen and self._clients[connection][0] != ADMIN

    def _accept(self, port: int) -> None:
        try:
            sock, _ = self._listeners[port].accept()
        except OSError:
            return
        sock.setblocking(False)
        sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection = Connection(sock)
        self._clients[connection] = (port, self._factories[port](connection))
        self._selector.register(sock, selectors.EVENT_READ, connection)

    def _serve(self, connection: Connection, events: int) -> None:
        if events & selectors.EVENT_WRITE:
            connection.flush()
            if not connection.unsent:
                self._selector.modify(connection.socket, selectors.EVENT_READ, connection)
        if events & selectors.EVENT_READ:
            connection.read()
            # a last request before the end still counts
            self._clients[connection][1].received()

    def _forget(self, connection: Connection) -> None:
        if not self._stands_still(connection):
            self._selector.unregister(connection.socket)
        del self._clients[connection]
        connection.socket.close()


def check_address(address: str) -> None:
    """Raise `RigError` unless it is one of this computer alone."""
    try:
        inside = ipaddress.ip_address(address) in ipaddress.ip_network("127.0.0.0/8")
    except ValueError:
        inside = False
    if not inside:
        raise RigError(
            f"{address!r} is not an address of this computer alone",
            where="the emulator's address",
            fix="use one of 127.0.0.0/8, such as 127.0.0.5; anyone could move an open emulator",
        )


def _listen(address: str, port: int) -> socket.socket:
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((address, port))
        listener.listen(16)
    except OSError as err:
        listener.close()
        raise RigError(
            f"port {port} cannot be used: {err.strerror}",
            where=f"the emulator at {address}",
            fix="stop what listens there, or use another address of 127.0.0.0/8",
        ) from err
    listener.setblocking(False)
    return listener
