"""What of the lock file is installed on Windows, each file pinned by its hashes."""

import re
from dataclasses import dataclass

from packaging.requirements import Requirement


@dataclass(frozen=True)
class Pin:
    """One distribution of the lock file.

    Attributes
    ----------
    hashes : tuple of str
        ``sha256:`` and the digest, of every file that may be installed.
    """

    name: str
    version: str
    hashes: tuple[str, ...]

    def line(self) -> str:
        """Return it as a line of a file of requirements."""
        return " ".join([f"{self.name}=={self.version}", *map(_option, self.hashes)])


def windows_pins(lock: str, python: str) -> tuple[Pin, ...]:
    """Return what a lock file for all systems installs on 64-bit Windows.

    Parameters
    ----------
    lock : str
        Text of the file, with hashes, as ``uv pip compile --universal`` writes it.
    python : str
        Whole version of Python.

    Raises
    ------
    ValueError
        A distribution has no exact version or no hash.
    """
    lines = (line.strip() for line in lock.replace("\\\n", " ").splitlines())
    entries = [line for line in lines if line and not line.startswith("#")]
    system = _windows(python)
    return tuple(pin for entry in entries if (pin := _pin(entry, system)) is not None)


def _pin(entry: str, system: dict[str, str]) -> Pin | None:
    words, *hashes = re.split(r"\s+--hash=", entry)
    requirement = Requirement(words)
    if requirement.marker is not None and not requirement.marker.evaluate(system):
        return None
    versions = [each for each in requirement.specifier if each.operator == "=="]
    if len(versions) != 1 or not hashes:
        raise ValueError(f"{requirement.name} of the lock file is not pinned by hash.")
    return Pin(requirement.name, versions[0].version, tuple(hashes))


def _option(digest: str) -> str:
    return f"--hash={digest}"


def _windows(python: str) -> dict[str, str]:
    return {
        "implementation_name": "cpython",
        "os_name": "nt",
        "platform_machine": "AMD64",
        "platform_python_implementation": "CPython",
        "platform_system": "Windows",
        "python_full_version": python,
        "python_version": ".".join(python.split(".")[:2]),
        "sys_platform": "win32",
    }
