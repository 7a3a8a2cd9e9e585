"""Extras of the program as it is installed: a password in the keyring."""

from installer.trial import Trial

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
