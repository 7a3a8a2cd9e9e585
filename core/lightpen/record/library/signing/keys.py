"""Ed25519 keys of stations and supervisors.

Every chain of an archive has a station key [1]_, whose private half never leaves the
user account in which the chain began: it is a file of mode 0600 in `key_folder`,
outside of the data folder, so that a copy of a data folder cannot sign. The name of the
chain is the hash of the public key. So the first key of a chain needs no certificate,
and another key takes its place only if it is introduced by the old key or a supervisor.

A supervisor's key follows from the password by Argon2id [2]_ with a random salt. Only
the salt and the public key are stored. A signature by it proves to anybody with the
public key that the password was entered; the station key does not suffice to forge it.
The parameters of Argon2id are those below; none is read from a file.

References
----------
.. [1] RFC 8032, "Edwards-Curve Digital Signature Algorithm (EdDSA)", 2017.
.. [2] RFC 9106, "Argon2 Memory-Hard Function for Password Hashing and Proof-of-Work
   Applications", 2021; parameters: its second recommended option.
"""

import os
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeAlias

import platformdirs
from msgspec import Meta

from lightpen.errors import FileError
from lightpen.formats.files import create_whole, read_bytes
from lightpen.formats.system_reasons import strerror
from lightpen.messages import message

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import (
        Ed25519PrivateKey,
        Ed25519PublicKey,
    )

KEYS = "LIGHTPEN_KEYS"  # names the variable with the folder of the private keys
WHAT = message("file.station-key")
SALT_LENGTH = 16  # bytes
PRIVATE = 0o600  # mode of files with keys or with data to guess passwords by
_SEED_LENGTH = 32  # bytes
_MEMORY_KIB, _TIME_COST, _LANES = 65_536, 3, 4
_CHAIN_LENGTH = 32  # hexadecimal digits

PublicKey: TypeAlias = Annotated[str, Meta(pattern="^[0-9a-f]{64}$")]


class SigningKey:
    """A private key, and its public key as 64 hexadecimal digits."""

    def __init__(self, private: "Ed25519PrivateKey") -> None:
        self._private = private
        self.public = private.public_key().public_bytes_raw().hex()

    def sign(self, content: bytes) -> str:
        """Return the signature of a content, 128 hexadecimal digits."""
        return self._private.sign(content).hex()

    def private_bytes(self) -> bytes:
        """Return the seed of the key, 32 bytes."""
        return self._private.private_bytes_raw()


def is_signed(public: str, signature: str, content: bytes) -> bool:
    """Return whether a signature is of a content and by a key."""
    from cryptography.exceptions import InvalidSignature

    try:
        _public_key(public).verify(bytes.fromhex(signature), content)
    except (InvalidSignature, ValueError):
        return False
    return True


def key_folder() -> Path:
    """Return the folder of the private keys of this user account."""
    chosen = os.environ.get(KEYS)
    if chosen:
        return Path(chosen)
    return platformdirs.user_data_path("lightpen-keys", appauthor=False)


def make_private_folder(folder: Path) -> None:
    """Create a folder that no other user may read."""
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    except OSError as error:
        raise FileError(
            "results.no-folder", folder=folder, reason=strerror(error)
        ) from error


def chain_of(public: str) -> str:
    """Return the name of the chain that begins with a key."""
    return sha256(bytes.fromhex(public)).hexdigest()[:_CHAIN_LENGTH]


def make_station_key() -> SigningKey:
    """Return a new station key, stored in `key_folder`."""
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    key = SigningKey(Ed25519PrivateKey.generate())
    file = _file_of(chain_of(key.public))
    make_private_folder(file.parent)
    create_whole(file, key.private_bytes().hex().encode(), PRIVATE)
    return key


def station_key(name: str) -> SigningKey | None:
    """Return the private key of a chain (`chain_of`); None if not in this account."""
    file = _file_of(name)
    if not file.exists():
        return None
    content = read_bytes(file, WHAT, 2 * _SEED_LENGTH)
    try:
        key = _kept_key(content)
    except ValueError as error:
        raise FileError("signing.key-damaged", file=file) from error
    if chain_of(key.public) != name:
        raise FileError("signing.key-damaged", file=file)
    return key


def supervisor_key(password: str, salt: bytes) -> SigningKey:
    """Return the key that follows from a supervisor's password, in some 0.1 s."""
    from argon2.low_level import Type, hash_secret_raw
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    seed = hash_secret_raw(
        password.encode("utf-8", "surrogatepass"),
        salt,
        _TIME_COST,
        _MEMORY_KIB,
        _LANES,
        _SEED_LENGTH,
        Type.ID,
    )
    return SigningKey(Ed25519PrivateKey.from_private_bytes(seed))


def _file_of(name: str) -> Path:
    return key_folder() / f"{name}.key"


@lru_cache(maxsize=64)
def _kept_key(content: bytes) -> SigningKey:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PrivateKey

    seed = bytes.fromhex(content.decode("ascii"))
    return SigningKey(Ed25519PrivateKey.from_private_bytes(seed))


@lru_cache(maxsize=256)
def _public_key(public: str) -> "Ed25519PublicKey":
    from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey

    return Ed25519PublicKey.from_public_bytes(bytes.fromhex(public))
