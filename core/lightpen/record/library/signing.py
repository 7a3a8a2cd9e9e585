"""Keys of stations and supervisors, and what a user account remembers."""

import logging
import os
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from os.path import normcase
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar

import platformdirs
from msgspec import Meta, Struct

from lightpen.errors import FileError, NameTakenError
from lightpen.formats.files import (
    MEGABYTE,
    create_whole,
    read_bytes,
    strerror,
    write_whole,
)
from lightpen.formats.own_json import DamagedError, Digest, json_bytes, parse_own_json
from lightpen.messages import Message, message

if TYPE_CHECKING:
    from cryptography.hazmat.primitives.asymmetric.ed25519 import (
        Ed25519PrivateKey,
        Ed25519PublicKey,
    )


# Ed25519 keys of stations and supervisors.
#
# Every chain of an archive has a station key [1]_, whose private half never leaves the
# user account in which the chain began: it is a file of mode 0600 in `key_folder`,
# outside of the data folder, so that a copy of a data folder cannot sign. The name of
# the chain is the hash of the public key. So the first key of a chain needs no
# certificate, and another key takes its place only if it is introduced by the old key
# or a supervisor.
#
# A supervisor's key follows from the password by Argon2id [2]_ with a random salt. Only
# the salt and the public key are stored. A signature by it proves to anybody with the
# public key that the password was entered; the station key does not suffice to forge
# it. The parameters of Argon2id are those below; none is read from a file.
#
# References
# ----------
# .. [1] RFC 8032, "Edwards-Curve Digital Signature Algorithm (EdDSA)", 2017.
# .. [2] RFC 9106, "Argon2 Memory-Hard Function for Password Hashing and Proof-of-Work
#    Applications", 2021; parameters: its second recommended option.


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


# What a user account remembers of the archive of its station, beside the private keys.
#
# The last entry of its chain: so an archive that was removed or replaced by an older
# copy is found, whatever else was removed with it, and at whatever path. Which chain a
# data folder has: so another one in its place is found. And the files that the program
# is writing, until they are entered: after a power cut these are entered, and no
# others.


S = TypeVar("S", bound=Struct)

_logger = logging.getLogger(__name__)


class RememberedHead(Struct, frozen=True):
    """Number and hash of the last entry of a chain."""

    number: int
    sha256: Digest


class _Folder(Struct, frozen=True):
    chain: str
    path: str


class OwedFile(Struct, frozen=True):
    """A file that the program wrote and will enter."""

    place: str  # from the data folder
    sha256: Digest
    approval: str = ""  # signature of a supervisor, see `approval_of`

    @property
    def name(self) -> str:
        """Name under which it is noted."""
        return sha256(f"{self.place}\n{self.sha256}".encode()).hexdigest()[:32]


def head_file(chain: str) -> Path:
    """Return the file in which this account remembers the last entry of a chain."""
    return key_folder() / f"head-{chain}.json"


def remembered_head(chain: str) -> RememberedHead | None:
    """Return the last entry of a chain that this account knows, if any."""
    file = head_file(chain)
    if not file.exists():
        return None
    return _read(file, RememberedHead)


def remember_head(chain: str, number: int, digest: str) -> None:
    """Remember an entry, once it is durable; an earlier one changes nothing.

    A full disk leaves the memory as it was: the next entry brings it up to date.
    """
    try:
        before = remembered_head(chain)
        if before is None or before.number < number:
            _write(head_file(chain), RememberedHead(number, digest))
    except FileError as error:
        _logger.warning("the last entry is not remembered: %s", error)


def remembered_chain(data: Path) -> str:
    """Return the chain that a data folder had in this account; empty if not known."""
    files = [file for file in _folder_files(data) if file.exists()]
    return _read(files[0], _Folder).chain if files else ""


def remember_chain(data: Path, chain: str) -> None:
    """Remember the chain of a data folder, by its path as it is given and as it is."""
    try:
        for file in _folder_files(data):
            if not file.exists() or _read(file, _Folder).chain != chain:
                _write(file, _Folder(chain, str(data)))
    except FileError as error:
        _logger.warning("the chain of %s is not remembered: %s", data, error)


def approval_of(key: SigningKey | None, chain: str, place: str, digest: str) -> str:
    """Return the signature by which a supervisor approves a file; empty without one."""
    return "" if key is None else key.sign(_approved(chain, place, digest))


def is_approved(
    public: str, approval: str, chain: str, place: str, digest: str
) -> bool:
    """Return whether the supervisor with a public key approved a file."""
    return is_signed(public, approval, _approved(chain, place, digest))


def owe(chain: str, file: OwedFile) -> None:
    """Note a file before it is written."""
    _write(_owed(chain) / f"{file.name}.json", file)


def owed_files(chain: str) -> tuple[OwedFile, ...]:
    """Return the files that are not entered yet, in the order of their writing."""
    found = []
    for note in _owed(chain).glob("*.json") if chain else ():
        with suppress(FileNotFoundError):  # it was entered just now
            found.append((note.stat().st_mtime_ns, note))
    return tuple(_read(note, OwedFile) for _, note in sorted(found) if note.exists())


def forget_owed(chain: str, file: OwedFile) -> None:
    """Forget a file that was entered, or not written; else the next start does."""
    with suppress(OSError):
        (_owed(chain) / f"{file.name}.json").unlink()


def _folder_files(data: Path) -> list[Path]:
    paths = {normcase(data.absolute()), normcase(data.resolve())}
    names = (sha256(os.fsencode(path)).hexdigest()[:32] for path in sorted(paths))
    return [key_folder() / f"folder-{name}.json" for name in names]


def _owed(chain: str) -> Path:
    return key_folder() / f"owed-{chain}"


def _approved(chain: str, place: str, digest: str) -> bytes:
    return f"lightpen approval\n{chain}\n{place}\n{digest}".encode()


def _read(file: Path, kind: type[S]) -> S:
    try:
        return parse_own_json(read_bytes(file, WHAT, MEGABYTE), kind)
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error


def _write(file: Path, content: Struct) -> None:
    make_private_folder(file.parent)
    write_whole(file, json_bytes(content))


# The keys that may sign a chain, by its entries of limits in their order.
#
# A chain gets another key by an entry of limits whose settings have ``station_key``,
# with the signature of `key_change` by the key before, or by the present supervisor,
# whose key an earlier entry has as ``supervisor_key``. A station without a supervisor
# password that lost its key continues with a new one that nothing approves; a check
# says so.


LIMITS = "limits"  # kind of the entries that change keys
STATION_KEY = "station_key"
OLD_KEY_SIGNATURE = "station_key_signature"
SUPERVISOR_KEY = "supervisor_key"
SUPERVISOR_SIGNATURE = "supervisor_signature"
UNAPPROVED = "archive.key-unapproved"  # of a station without a supervisor
_SHORT = 8  # characters by which a chain is named
_KEY_LENGTH = 64
_LENGTH = 192


def key_change(chain: str, public: str) -> bytes:
    """Return the text whose signature approves another station key of a chain."""
    return f"lightpen station key\n{chain}\n{public}".encode()


def entry_text(sha256: str) -> bytes:
    """Return the text that is signed for an entry."""
    return b"lightpen entry\n" + sha256.encode()


def key_in(signature: str) -> str:
    """Return the public key in the signature of an entry; empty if unsigned."""
    return signature[:_KEY_LENGTH] if len(signature) == _LENGTH else ""


class ChainKeys:
    """The key that may sign a chain now, and the supervisor who may approve.

    Once another key is introduced, the previous one may sign nothing more.
    """

    def __init__(self, chain: str) -> None:
        self._chain = chain
        self.station = ""  # the present key
        self.supervisor = ""

    def finding(
        self,
        number: int,
        kind: str,
        settings: Mapping[str, Any],
        sha256: str,
        signature: str,
    ) -> Message | None:
        """Return the fault of the signature of the next entry; None if it is valid.

        Changes of keys are followed.
        """
        chain, key = self._chain[:_SHORT], key_in(signature)
        if not key or not is_signed(key, signature[_KEY_LENGTH:], entry_text(sha256)):
            return message("archive.signature-wrong", number=number, chain=chain)
        is_known = key == self.station or (
            not self.station and chain_of(key) == self._chain
        )
        is_introduced = kind == LIMITS and settings.get(STATION_KEY) == key
        if is_known or (is_introduced and self._is_approved(settings, key)):
            supervisor = settings.get(SUPERVISOR_KEY)
            if kind == LIMITS and isinstance(supervisor, str):
                self.supervisor = supervisor
            self.station = key
            return None
        if is_introduced and not self.supervisor:
            self.station = key
            return message("archive.key-unapproved", number=number, chain=chain)
        return message("archive.signature-foreign", number=number, chain=chain)

    def _is_approved(self, settings: Mapping[str, Any], key: str) -> bool:
        content = key_change(self._chain, key)
        old = str(settings.get(OLD_KEY_SIGNATURE, ""))
        approval = str(settings.get(SUPERVISOR_SIGNATURE, ""))
        return is_signed(self.station, old, content) or (
            self.supervisor != "" and is_signed(self.supervisor, approval, content)
        )


# The name of a data folder's chain: the hash of its first station key.
#
# ``station.pub`` has that key, so that the notes on files and the chain of the archive
# begin with the same one, whichever is first. Which keys count from then on, the signed
# entries say; the file is not asked again.


STATION_FILE = "station.pub"
STATION_KEY_FILE = message("file.station-key")


class _StationFile(Struct):
    station_key: PublicKey


def known_station_name(data: Path) -> str:
    """Return the name of the chain of a data folder; empty if it has not begun."""
    file = data / STATION_FILE
    if not file.exists():
        return ""
    try:
        found = parse_own_json(
            read_bytes(file, STATION_KEY_FILE, MEGABYTE), _StationFile
        )
    except DamagedError as error:
        raise FileError("signing.key-damaged", file=file) from error
    return chain_of(found.station_key)


def station_name(data: Path) -> str:
    """Return the name of the chain of a data folder, begun if need be."""
    file = data / STATION_FILE
    if not file.exists():
        public = make_station_key().public
        data.mkdir(parents=True, exist_ok=True)
        with suppress(NameTakenError):  # another program was first
            create_whole(file, json_bytes({"station_key": public}))
    return known_station_name(data)
