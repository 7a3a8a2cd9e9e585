"""Signatures of entries: made as they are entered, and verified.

An entry is signed over its hash, and so over all entries before it. The signature is
kept beside the text: 64 hexadecimal digits of the public key, then 128 of the
signature. As the name of a chain is the hash of its first key, nobody else can continue
it, nor begin one of that name; how it gets another key, see
`lightpen.record.library.signing.chain_keys`.
"""

from lightpen.archive.chains.entries import SHORT, ChainHead, Event, Kind, StoredEntry
from lightpen.errors import ArchiveError, FileError
from lightpen.messages import Message
from lightpen.record.library.signing.chain_keys import (
    STATION_KEY,
    ChainKeys,
    entry_text,
)
from lightpen.record.library.signing.keys import chain_of, station_key


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
    return key.public + key.sign(entry_text(sha256))


def signature_finding(keys: ChainKeys, entry: StoredEntry) -> Message | None:
    """Return the fault of the signature of the next entry; None if it is valid."""
    event, number = entry.entry.event, entry.entry.number
    found = event.kind, event.settings, entry.sha256, entry.signature
    return keys.finding(number, *found)
