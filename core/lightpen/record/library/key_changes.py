"""Changes of the station key: their names in an entry, and what approves them."""

STATION_KEY = "station_key"
OLD_KEY_SIGNATURE = "station_key_signature"
SUPERVISOR_KEY = "supervisor_key"
SUPERVISOR_SIGNATURE = "supervisor_signature"


def key_change(chain: str, public: str) -> bytes:
    """Return the text whose signature approves another station key of a chain."""
    return f"lightpen station key\n{chain}\n{public}".encode()
