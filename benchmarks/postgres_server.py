"""A PostgreSQL server of this machine, on the loopback, for benchmarks and tests."""

import os
import secrets
import shutil
import socket
import subprocess
import sys
from contextlib import suppress
from pathlib import Path

PASSWORD = "a-secret-of-the-plant"
FIRST_PORT, N_PORTS = 20_000, 10_000  # below those that systems give to anybody
START_S = 60.0  # on a machine that does other things besides


def postgres_programs() -> Path | None:
    """Return the folder of its programs, as Debian installs them; None without any."""
    if sys.platform == "win32":
        return None
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    return programs[-1].parent if programs else None


def free_port() -> int:
    """Return a port of the loopback that nobody gets who asks for any.

    What starts late or again still finds it free.
    """
    start = os.getpid() % N_PORTS
    for n in range(N_PORTS):
        port = FIRST_PORT + (start + n) % N_PORTS
        with suppress(OSError), socket.create_server(("127.0.0.1", port)):
            return port
    raise OSError("Every port is taken.")


class Postgres:
    """A server on the loopback, which can be stopped and started again.

    Attributes
    ----------
    certificate : Path
        Of itself, for the name ``localhost``.
    """

    def __init__(self, folder: Path, programs: Path) -> None:
        self._folder, self._programs = folder, programs
        self.port = free_port()
        self._user = "postgres" if os.geteuid() == 0 else None
        secret = folder / "password"
        secret.write_text(PASSWORD)
        if self._user is not None:
            for path in (folder, secret):
                shutil.chown(path, self._user)
        self._run(
            *("initdb", "--no-sync", "--auth=scram-sha-256", "--username=plant"),
            f"--pwfile={secret}",
        )
        self.certificate = folder / "data" / "server.crt"
        self._run_any(
            *("openssl", "req", "-x509", "-nodes", "-newkey", "ec"),
            *("-pkeyopt", "ec_paramgen_curve:prime256v1"),
            *("-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"),
            *("-out", self.certificate, "-keyout", folder / "data" / "server.key"),
        )
        self.start()

    def start(self) -> None:
        """Start it, and wait until it answers."""
        options = f"-p {self.port} -c listen_addresses=127.0.0.1 -k {self._folder}"
        options += " -c ssl=on"
        self._run(
            *("pg_ctl", "start", "--wait", f"--timeout={START_S:.0f}"),
            *(f"--log={self._folder / 'log'}", f"--options={options}"),
        )

    def stop(self) -> None:
        """Stop it at once, as a power cut does."""
        self._run("pg_ctl", "stop", "--wait", "--mode=immediate")

    def new_database(self, sql: str | None = None) -> str:
        """Return the address of a database that is made anew.

        Parameters
        ----------
        sql : str, optional
            That sets it up; as an archive unless given.
        """
        import psycopg

        from lightpen_extensions.plant.server import server_sql

        name = f"plant_{secrets.token_hex(4)}"
        admin = self.address("postgres")
        with psycopg.connect(admin, autocommit=True) as connection:
            connection.execute(f"CREATE DATABASE {name}")
        with psycopg.connect(self.address(name), autocommit=True) as connection:
            connection.execute(server_sql() if sql is None else sql)
        return self.address(name)

    def new_role(self, address: str, group: str, name: str = "") -> str:
        """Return the address of a database for a new role of a group."""
        import psycopg

        role = name or f"role_{secrets.token_hex(4)}"
        with psycopg.connect(address, autocommit=True) as connection:
            connection.execute(
                f"CREATE ROLE {role} LOGIN PASSWORD '{PASSWORD}' IN ROLE {group}"
            )
        return address.replace("//plant:", f"//{role}:")

    def address(self, name: str, password: str = PASSWORD) -> str:
        """Return the address of a database, called without TLS."""
        place = f"127.0.0.1:{self.port}/{name}"
        return f"postgresql://plant:{password}@{place}?sslmode=disable"

    def _run(self, program: str, *words: str) -> None:
        data = f"--pgdata={self._folder / 'data'}"
        self._run_any(self._programs / program, data, *words)

    def _run_any(self, *words: str | Path) -> None:
        subprocess.run(
            words,
            user=self._user,
            cwd=self._folder,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            check=True,
        )
