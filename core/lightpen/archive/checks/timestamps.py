"""Timestamps of chains by an independent authority, as RFC 3161 [1]_ has them.

A timestamp is of the text of the last entry, by its SHA-256, and so of all entries
before. It proves that they existed at its time, also against whoever has the key of the
station. The response of the authority is stored unchanged, one file for each entry, so
that other programs can verify it.

References
----------
.. [1] RFC 3161, "Internet X.509 Public Key Infrastructure Time-Stamp Protocol (TSP)",
   2001.
"""

import re
from dataclasses import dataclass, replace
from datetime import datetime, timedelta
from http.client import HTTPException
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import select

from lightpen.archive.chains.chains import chain_at_home, heads
from lightpen.archive.chains.entries import SHORT, StoredEntry
from lightpen.archive.chains.rows import READ, read_entries
from lightpen.archive.checks.check import ArchiveCheckResult
from lightpen.archive.store.database import Database
from lightpen.archive.store.tables import ENTRIES
from lightpen.errors import ArchiveError, FileError, LightpenError
from lightpen.formats.files import MEGABYTE, create_whole, read_bytes
from lightpen.formats.machine_settings import machine_settings
from lightpen.messages import Message, message, printable
from lightpen.record.library.numbered_files import make_folder

if TYPE_CHECKING:
    from cryptography.x509 import Certificate
    from rfc3161_client import TimeStampResponse, Verifier

TIMESTAMPS = "timestamps"  # folder in the data folder
LONGEST_ANSWER_S = 30.0
LARGEST = 100_000  # bytes; an answer with its certificates has some 5000
_RESOLUTION = timedelta(seconds=1)  # of the times of authorities
_EARLY = "archive.timestamp-early"
_SHA256 = "2.16.840.1.101.3.4.2.1"
_NAME = re.compile(r"([0-9a-f]{32})-([1-9][0-9]{0,11})\.tsr")


@dataclass(frozen=True)
class Authority:
    """A time stamping authority."""

    address: str = ""
    certificate: Path | None = None  # PEM with its root; also its own, if given


@dataclass(frozen=True)
class Timestamp:
    """Proof that the entries of a chain up to a number existed at a time."""

    number: int
    at: datetime
    file: Path


def authority(address: str = "", certificate: Path | None = None) -> Authority:
    """Return the given authority; by default that of the machine settings."""
    settings = machine_settings()
    if certificate is None and settings.timestamp_certificate:
        certificate = Path(settings.timestamp_certificate)
    return Authority(address or settings.timestamp_authority, certificate)


def request_timestamp(database: Database, data: Path, by: Authority) -> Timestamp:
    """Have the last entry of the own chain timestamped, and store the answer.

    Raises `ArchiveError` if there is no new entry or no package for it, the authority
    gives no valid answer, or the clock of the station is ahead.
    """
    home = chain_at_home(database)
    number = next((each.number for each in heads(database) if each.chain == home), 0)
    entry = None if home is None else _entry(database, home, number)
    if home is None or entry is None:
        raise ArchiveError("timestamp.nothing")
    file = data / TIMESTAMPS / f"{home}-{number}.tsr"
    if file.exists():
        raise ArchiveError("timestamp.known", number=number)
    client = _Client(by.certificate)
    answer = client.ask(by.address, entry)
    finding = client.finding(by.address, answer, entry)
    if finding is not None and finding.code == _EARLY:
        raise ArchiveError("timestamp.clock-ahead", number=number)
    if finding is not None:
        raise ArchiveError("timestamp.invalid", authority=printable(by.address))
    make_folder(file.parent)
    create_whole(file, answer)
    return Timestamp(number, client.time_of(answer), file)


def with_timestamps(
    checked: ArchiveCheckResult,
    database: Database,
    data: Path,
    certificate: Path | None = None,
) -> ArchiveCheckResult:
    """Verify the timestamps of a data folder; return the check with its findings.

    ``certificate`` is the authority's, see `Authority.certificate`; None takes the one
    of the machine settings. Without any, signatures are not verified, which is noted.
    """
    findings, notes, n_sound = list[Message](), list[Message](), 0
    try:
        by = authority(certificate=certificate)
        files = sorted((data / TIMESTAMPS).glob("*.tsr"))
        home, last = chain_at_home(database), 0
        clients = [_Client(by.certificate)] if files else []
        for client, file in product(clients, files):
            found, chain, number = _stored_finding(database, client, file)
            findings += [] if found is None else [found]
            n_sound += found is None
            if found is None and chain == home:
                last = max(last, number)
        if files and by.certificate is None:
            notes.append(message("archive.timestamps-unverified", n=len(files)))
        if files or by.address:
            notes += [
                message("archive.not-timestamped", n=head.number - last, after=last)
                for head in heads(database)
                if head.chain == home and head.number > last
            ]
    except ArchiveError as error:  # the package is not installed
        notes.append(error.message)
    except FileError as error:
        findings.append(error.message)
    return replace(
        checked,
        findings=(*checked.findings, *findings),
        notes=(*checked.notes, *notes),
        n_timestamps=n_sound,
    )


class _Client:
    """Functions of rfc3161-client; `ArchiveError` if it is not installed."""

    def __init__(self, certificate: Path | None) -> None:
        try:
            import rfc3161_client
        except ModuleNotFoundError as error:
            raise ArchiveError("timestamp.no-package") from error
        self._package = rfc3161_client
        self._certificate = "" if certificate is None else printable(str(certificate))
        self._verifiers = [] if certificate is None else self._made(certificate)

    def ask(self, address: str, entry: StoredEntry) -> bytes:
        """Return the response of an authority; refuse one with another nonce."""
        query = (
            self._package.TimestampRequestBuilder()
            .data(entry.text.encode())
            .hash_algorithm(self._package.HashAlgorithm.SHA256)
            .build()
        )
        why = ""
        try:
            content = _answer(address, query.as_bytes())
            answer = self._package.decode_timestamp_response(content)
            why = ", ".join(answer.status_string)  # of a refusal
            if answer.tst_info.nonce == query.nonce:
                return content
            why = "nonce"
        except (OSError, HTTPException, ValueError) as error:
            why = why or str(error)
        raise ArchiveError(
            "timestamp.no-answer", authority=printable(address), reason=printable(why)
        )

    def finding(self, place: str, content: bytes, entry: StoredEntry) -> Message | None:
        """Return the fault of a timestamp of an entry; None if it is valid."""
        place, number = printable(place), entry.entry.number
        digest = bytes.fromhex(entry.sha256)
        try:
            answer = self._package.decode_timestamp_response(content)
            imprint = answer.tst_info.message_imprint
            algorithm = imprint.hash_algorithm.dotted_string
            if (algorithm, imprint.message) != (_SHA256, digest):
                return message(
                    "archive.timestamp-other",
                    file=place,
                    number=number,
                    chain=entry.entry.chain[:SHORT],
                )
            is_signed = not self._verifiers or any(
                self._is_by(each, answer, digest) for each in self._verifiers
            )
        except Exception:  # whatever a forged certificate in it leads to
            is_signed = False
        if not is_signed:
            return message("archive.timestamp-wrong", file=place)
        if self.time_of(content) + _RESOLUTION <= entry.entry.event.at:
            return message("archive.timestamp-early", file=place, number=number)
        return None

    def time_of(self, content: bytes) -> datetime:
        """Return the time that a sound timestamp states."""
        return self._package.decode_timestamp_response(content).tst_info.gen_time

    def _is_by(
        self, verifier: "Verifier", answer: "TimeStampResponse", digest: bytes
    ) -> bool:
        try:
            return verifier.verify(answer, digest)
        except self._package.VerificationError:
            return False

    def _made(self, file: Path) -> list["Verifier"]:
        """Return a verifier for each certificate of an authority, else for its root."""
        from cryptography.x509 import load_pem_x509_certificates

        content = read_bytes(file, message("file.certificate"), MEGABYTE)
        try:
            all_of = load_pem_x509_certificates(content)
            roots = [each for each in all_of if each.issuer == each.subject]
            signers = [each for each in all_of if _is_for_stamping(each)]
        except ValueError as error:
            raise _no_root(file) from error
        if not roots:
            raise _no_root(file)
        return [
            self._package.VerifierBuilder(
                tsa_certificate=each, intermediates=all_of, roots=roots
            ).build()
            for each in signers or (None,)
        ]


def _is_for_stamping(certificate: "Certificate") -> bool:
    from cryptography.x509 import ExtendedKeyUsage, ExtensionNotFound
    from cryptography.x509.oid import ExtendedKeyUsageOID

    try:
        usage = certificate.extensions.get_extension_for_class(ExtendedKeyUsage)
    except ExtensionNotFound:
        return False
    return ExtendedKeyUsageOID.TIME_STAMPING in usage.value


def _no_root(file: Path) -> FileError:
    return FileError("timestamp.no-root", file=file)


def _answer(address: str, query: bytes) -> bytes:
    """Return the HTTP response of an authority to a query."""
    from urllib.request import Request, urlopen

    if not address.startswith(("http://", "https://")):
        raise ValueError("http://, https://")
    asked = Request(address, query, {"Content-Type": "application/timestamp-query"})
    with urlopen(asked, timeout=LONGEST_ANSWER_S) as stream:
        content: bytes = stream.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise ValueError(f"> {LARGEST} bytes")
    return content


def _stored_finding(
    database: Database, client: _Client, file: Path
) -> tuple[Message | None, str, int]:
    """Return the fault of a stored timestamp, with its chain and number."""
    place, named = f"{TIMESTAMPS}/{file.name}", _NAME.fullmatch(file.name)
    if named is None:
        return message("archive.timestamp-wrong", file=printable(place)), "", 0
    chain, number = named[1], int(named[2])
    try:
        entry = _entry(database, chain, number)
        content = read_bytes(file, message("file.timestamp"), LARGEST)
    except LightpenError as error:
        return error.message, chain, number
    if entry is not None:
        return client.finding(place, content, entry), chain, number
    missing = message(
        "archive.timestamp-no-entry",
        file=printable(place),
        number=number,
        chain=chain[:SHORT],
    )
    return missing, chain, number


def _entry(database: Database, chain: str, number: int) -> StoredEntry | None:
    wanted = select(*READ).where(ENTRIES.c.chain == chain, ENTRIES.c.number == number)
    return next(iter(read_entries(database, wanted)), None)
