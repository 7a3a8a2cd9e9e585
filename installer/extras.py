"""Extras of the program as it is installed: a password in the keyring, timestamps."""

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from installer.trial import Trial
from tests.timestamp_authority import running_tsa

SECRET = "geheim ä 密"
# Reads it as the program does for an address that names the keyring.
KEEP_PASSWORD = f"""
import compiled_modules; compiled_modules.install()
import keyring; from lightpen.archive.replication.server import server_url
place = "lightpen-trial", "hall_2"
keyring.set_password(*place, {SECRET!a})
read = server_url("postgresql://hall_2@server/archive?keyring=lightpen-trial").password
keyring.delete_password(*place)
print(keyring.get_keyring().name, read == {SECRET!a}, keyring.get_password(*place))
"""


def try_keyring(trial: Trial) -> None:
    """Keep the password of a server in Windows' own keyring, and read it there."""
    python = trial.program("runtime/python.exe")
    said = trial.machine.run([python, "-c", KEEP_PASSWORD])
    is_read = said.output.split()[-3:] == ["WinVaultKeyring", "True", "None"]
    trial.expect("a password is kept in the keyring of Windows", is_read, said)


def try_timestamp(trial: Trial) -> None:
    """Have an archive timestamped by an authority on this computer, and check it."""
    if shutil.which("openssl") is None:
        print("skip a timestamp: OpenSSL is not installed")
        return
    had_keys = trial.keys.exists()
    place = trial.machine.drive / "archive 档案"
    data = ("--data", trial.machine.windows_path(place))
    with TemporaryDirectory() as folder, running_tsa(Path(folder) / "tsa") as tsa:
        by = ("--certificate", trial.machine.windows_path(tsa.root))
        trial.console("tips", "add", "cone", "C-1", *data)
        asked = trial.console("archive", "timestamp", "--tsa", tsa.address, *by, *data)
        checked = trial.console("archive", "check", *by, *data)
    is_sound = (
        asked.status == checked.status == 0 and "timestamps: 1." in checked.output
    )
    trial.expect("the archive is timestamped", is_sound, (asked, checked))
    shutil.rmtree(place)
    if not had_keys:
        shutil.rmtree(trial.keys)
