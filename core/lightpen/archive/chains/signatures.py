"""Signatures of entries: who may sign which chain, and whether each entry is signed.

An entry is signed as it is entered: over its hash, and so over all entries before it.
The signature is kept beside the text: 64 hexadecimal digits of the public key, then 128
of the signature. As the name of a chain is the hash of its first key, nobody else can
continue it, nor begin one of that name, see `lightpen.record.library.signing.keys`.

A chain gets another key by an entry of limits whose settings have ``station_key``, with
the signature of `key_change` by the key before, or by a supervisor whose key an earlier
entry has as ``supervisor_key``. A station without a supervisor password that lost its
key continues with a new one that nothing approves; a check says so.
"""

from collections.abc import Iterable

from lightpen.archive.chains.entries import SHORT, ChainHead, Event, Kind, StoredEntry
from lightpen.errors import ArchiveError, FileError
from lightpen.messages import Message, message
from lightpen.record.library.key_changes import (
    OLD_KEY_SIGNATURE,
    STATION_KEY,
    SUPERVISOR_KEY,
    SUPERVISOR_SIGNATURE,
    key_change,
)
from lightpen.record.library.signing.keys import chain_of, is_signed, station_key

UNAPPROVED = "archive.key-unapproved"  # of a station without a supervisor
_KEY_LENGTH = 64
_LENGTH = 192


def entry_signature(head: ChainHead, event: Event, sha256: str) -> str:
    """Return the signature of an entry with a hash, by the chain before it.

    Raises `ArchiveError` if the key cannot be read or is not in this user account.
    """
    introduced = event.settings.get(STATION_KEY) if event.kind is Kind.LIMITS else None
    name = head.chain if not head.key else chain_of(head.key)
    if isinstance(introduced, str):
        name = chain_of(introduced)
    try:
        key = station_key(name)
    except FileError as error:
        raise ArchiveError(error.message) from error
    if key is None:
        raise ArchiveError("signing.key-missing", chain=head.chain[:SHORT])
    return key.public + key.sign(_content(sha256))


def key_in(signature: str) -> str:
    """Return the public key in the signature of an entry; empty if unsigned."""
    return signature[:_KEY_LENGTH] if len(signature) == _LENGTH else ""


class ChainKeys:
    """The key that may sign a chain, by its earlier entries of limits in their order.

    Once another key is introduced, the previous one may sign nothing more.
    """

    def __init__(self, chain: str, entries: Iterable[StoredEntry] = ()) -> None:
        self._chain = chain
        self._station = ""  # the present key
        self._supervisors = set[str]()
        for each in entries:
            self.finding(each)

    def finding(self, entry: StoredEntry) -> Message | None:
        """Return the fault of the signature of the next entry; None if it is valid.

        Changes of keys are followed.
        """
        event = entry.entry.event

        number, chain = entry.entry.number, self._chain[:SHORT]
        key, signature = key_in(entry.signature), entry.signature[_KEY_LENGTH:]
        if not key or not is_signed(key, signature, _content(entry.sha256)):
            return message("archive.signature-wrong", number=number, chain=chain)
        is_known = key == self._station or (
            not self._station and chain_of(key) == self._chain
        )
        is_introduced = event.kind is Kind.LIMITS and (
            event.settings.get(STATION_KEY) == key
        )
        if is_known or (is_introduced and self._is_approved(event, key)):
            self._follow(event)
            self._station = key
            return None
        if is_introduced and not self._supervisors:
            self._station = key
            return message("archive.key-unapproved", number=number, chain=chain)
        return message("archive.signature-foreign", number=number, chain=chain)

    def _follow(self, event: Event) -> None:
        supervisor = event.settings.get(SUPERVISOR_KEY)
        if event.kind is Kind.LIMITS and isinstance(supervisor, str):
            self._supervisors.add(supervisor)

    def _is_approved(self, event: Event, key: str) -> bool:
        content = key_change(self._chain, key)
        old = str(event.settings.get(OLD_KEY_SIGNATURE, ""))
        approval = str(event.settings.get(SUPERVISOR_SIGNATURE, ""))
        return is_signed(self._station, old, content) or any(
            is_signed(each, approval, content) for each in self._supervisors
        )


def _content(sha256: str) -> bytes:
    return b"lightpen entry\n" + sha256.encode()
