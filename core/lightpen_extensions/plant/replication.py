"""Replication of a station's entries to a server whenever it is reachable.

The archive of the station itself is what waits to be delivered: it has every entry
before the server does, and keeps it. So nothing is lost while the server is away, and
as entries are copied in their order and known ones passed over, none is doubled.

The connection to the server is closed after each delivery: it has many stations to
serve, and a line that is kept may be dead without either end knowing.
"""

from contextlib import closing
from threading import Event, Thread

from lightpen.archive.store.database import Database
from lightpen.errors import ArchiveError
from lightpen.messages import Message
from lightpen_extensions.plant.exchange import deliver
from lightpen_extensions.plant.server import open_server

AGAIN_S = 30.0  # after a server did not answer
LOOK_S = 300.0  # interval of looking for entries of other programs


class Replicator:
    """Replicates the chain of a data folder to a server in its own thread.

    For the address see `lightpen_extensions.plant.server.open_server`. The server
    has ``n_delivered`` entries, None until it answered first; the fault is why the
    last attempt failed.
    """

    def __init__(self, database: Database, chain: str, address: str) -> None:
        self._database = database
        self._chain = chain
        self._address = address
        self._is_due, self._is_ending = Event(), Event()
        self.n_delivered: int | None = None
        self.fault: Message | None = None
        self._thread = Thread(target=self._run, name="delivery", daemon=True)
        self._is_due.set()
        self._thread.start()

    def wake(self) -> None:
        """Deliver soon."""
        self._is_due.set()

    def close(self, timeout_s: float) -> None:
        """Finish the current transfer, within a time limit, and end."""
        self._is_ending.set()
        self._is_due.set()
        self._thread.join(timeout_s)

    def _run(self) -> None:
        while True:
            self._is_due.wait(LOOK_S if self.fault is None else AGAIN_S)
            self._is_due.clear()
            try:
                with closing(open_server(self._address)) as server:
                    copied = deliver(self._database, self._chain, server)
                self.n_delivered = copied.n_known + copied.n_new
                self.fault = None
            except ArchiveError as error:
                self.fault = error.message
            if self._is_ending.is_set():
                break
