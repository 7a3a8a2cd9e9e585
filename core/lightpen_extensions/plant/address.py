"""The address of the server of the plant."""

import os

from lightpen.formats.machine_settings import machine_settings

SERVER = "LIGHTPEN_ARCHIVE"  # names the variable with the address of a server


def server_address() -> str:
    """Return the server address by environment variable or machine settings."""
    return os.environ.get(SERVER, "") or machine_settings().archive_server
