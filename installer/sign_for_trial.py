"""Sign a file with a certificate made on the spot, to try signing without a real one.

    build.py --sign "python installer/sign_for_trial.py FOLDER"
    check.py --authority FOLDER/authority.pem SETUP.exe

The first call makes the certificate. Nobody trusts it: nothing that it signed is to be
handed out.
"""

import subprocess
import sys
from pathlib import Path

AUTHORITY, KEY = "authority.pem", "key.pem"
MAKE = (
    *("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2"),
    *("-subj", "/CN=Lightpen trial", "-addext", "extendedKeyUsage=codeSigning"),
)


def main() -> int:
    """Sign the file that is named after the folder of the certificate."""
    folder, file = map(Path, sys.argv[1:])
    authority, key, signed = folder / AUTHORITY, folder / KEY, Path(f"{file}.signed")
    if not authority.exists():
        folder.mkdir(parents=True, exist_ok=True)
        made: list[str | Path] = [*MAKE, "-keyout", key, "-out", authority]
        subprocess.run(made, stderr=subprocess.DEVNULL, check=True)
    words: list[str | Path] = [
        "osslsigncode",
        "sign",
        "-certs",
        authority,
        "-key",
        key,
        "-h",
        "sha256",
    ]
    words += ["-in", file, "-out", signed]
    subprocess.run(words, stdout=subprocess.DEVNULL, check=True)
    signed.replace(file)
    return 0


if __name__ == "__main__":
    sys.exit(main())
