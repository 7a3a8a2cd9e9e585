"""The signature of a supervisor on the command line."""

import getpass
import os

from lightpen.record.library.supervision import Signature

PASSWORD = "LIGHTPEN_PASSWORD"  # names the variable with the password of a supervisor


def supervisor_signature(name: str | None) -> Signature | None:
    """Return the signature of a supervisor whose password is requested, or variable."""
    if name is None:
        return None
    password = os.environ.get(PASSWORD)
    if password is None:
        password = getpass.getpass("Supervisor's password: ")
    return Signature(name, password)
