"""A line to a server that can be cut: refused, or silent."""

import socket
from enum import Enum, auto
from threading import Thread


class Line(Enum):
    """What a line does.

    Attributes
    ----------
    OPEN
        It carries.
    REFUSED
        Nobody answers at its end, and what was open is ended.
    SILENT
        It takes all that is sent, carries nothing, and never says so; what was open
        then stays silent for ever.
    """

    OPEN = auto()
    REFUSED = auto()
    SILENT = auto()


class Relay:
    """Carries connections to a port of this machine, until it is stopped."""

    def __init__(self, port: int) -> None:
        self._target = port
        self._line = Line.OPEN
        self._ends: list[socket.socket] = []
        self._dead: list[socket.socket] = []
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.port: int = self._listener.getsockname()[1]
        Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def become(self, line: Line) -> None:
        """Let the line be so from now on."""
        self._line, ends, self._ends = line, self._ends, []
        if line is Line.SILENT:
            self._dead += ends  # held, so that no end is reported
        elif line is Line.REFUSED:
            for end in ends:
                end.close()

    def close(self) -> None:
        """End all."""
        self.become(Line.REFUSED)
        self._listener.close()
        for end in self._dead:
            end.close()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                near, _ = listener.accept()
            except OSError:  # it was closed
                return
            if self._line is Line.REFUSED:
                near.close()
            elif self._line is Line.SILENT:
                self._dead.append(near)
            else:
                try:
                    far = socket.create_connection(("127.0.0.1", self._target))
                except OSError:  # the server is away
                    near.close()
                    continue
                self._ends += [near, far]
                for one, other in ((near, far), (far, near)):
                    Thread(target=self._carry, args=(one, other), daemon=True).start()

    def _carry(self, one: socket.socket, other: socket.socket) -> None:
        try:
            while data := one.recv(65536):
                if one in self._dead:
                    continue  # taken, and carried nowhere
                other.sendall(data)
            if one not in self._dead:
                other.shutdown(socket.SHUT_WR)
        except OSError:  # it was cut
            pass
