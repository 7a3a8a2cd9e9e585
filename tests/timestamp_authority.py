"""A time stamping authority on the loopback, of OpenSSL."""

import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from threading import Thread

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.ec import (
    SECP256R1,
    EllipticCurvePrivateKey,
    generate_private_key,
)
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    NoEncryption,
    PrivateFormat,
)
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from lightpen.archive.checks.timestamps import Authority

CONFIG = """[tsa]
default_tsa = one
[one]
serial = {folder}/serial
digests = sha256
default_policy = 1.2.3.4
signer_digest = sha256
ess_cert_id_alg = sha256
"""
DAY = timedelta(days=1)


@dataclass(frozen=True)
class Tsa:
    """An authority that answers by HTTP.

    Attributes
    ----------
    root, own : Path
        Its root certificate, and both.
    """

    address: str
    root: Path
    own: Path

    @property
    def by(self) -> Authority:
        return Authority(self.address, self.root)


def _certificate(
    name: str,
    key: EllipticCurvePrivateKey,
    root: EllipticCurvePrivateKey,
    is_root: bool,
) -> bytes:
    issuer, subject = (
        x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, each)])
        for each in ("root", name)
    )
    made = (
        x509.CertificateBuilder(issuer, subject, key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(datetime.now(UTC) - DAY)
        .not_valid_after(datetime.now(UTC) + DAY)
        .add_extension(x509.BasicConstraints(is_root, None), critical=True)
    )
    if not is_root:
        usage = x509.ExtendedKeyUsage([ExtendedKeyUsageOID.TIME_STAMPING])
        made = made.add_extension(usage, critical=True)
    return made.sign(root, SHA256()).public_bytes(Encoding.PEM)


@contextmanager
def running_tsa(folder: Path) -> Iterator[Tsa]:
    folder.mkdir()
    root, key = generate_private_key(SECP256R1()), generate_private_key(SECP256R1())
    made = Tsa("", folder / "root.pem", folder / "own.pem")
    made.root.write_bytes(_certificate("root", root, root, is_root=True))
    signer = folder / "signer.pem"
    signer.write_bytes(_certificate("tsa", key, root, is_root=False))
    made.own.write_bytes(signer.read_bytes() + made.root.read_bytes())
    private = key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    (folder / "key.pem").write_bytes(private)
    (folder / "tsa.cnf").write_text(CONFIG.format(folder=folder))

    class Handler(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            query = folder / "query.tsq"
            query.write_bytes(self.rfile.read(int(self.headers["Content-Length"])))
            words = ["openssl", "ts", "-reply", "-config", "tsa.cnf"]
            words += ["-queryfile", query.name, "-inkey", "key.pem", "-signer"]
            answer = subprocess.run(
                [*words, signer.name], cwd=folder, capture_output=True, check=True
            ).stdout
            self.send_response(200)
            self.send_header("Content-Type", "application/timestamp-reply")
            self.send_header("Content-Length", str(len(answer)))
            self.end_headers()
            self.wfile.write(answer)

        def log_message(self, *words: object) -> None:
            pass

    with HTTPServer(("127.0.0.1", 0), Handler) as server:
        Thread(target=server.serve_forever, args=(0.02,), daemon=True).start()
        yield Tsa(f"http://127.0.0.1:{server.server_port}", made.root, made.own)
        server.shutdown()
