"""The keys that may sign a chain, by its entries of limits in their order.

A chain gets another key by an entry of limits whose settings have ``station_key``, with
the signature of `key_change` by the key before, or by the present supervisor, whose key
an earlier entry has as ``supervisor_key``. A station without a supervisor password that
lost its key continues with a new one that nothing approves; a check says so.
"""

from collections.abc import Mapping
from typing import Any

from lightpen.messages import Message, message
from lightpen.record.library.signing.keys import chain_of, is_signed

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
