"""Messages of streaming: code, then template with named values."""

MESSAGES = {
    "stream.no-port": "port out of range",
    "stream.not-open": "Live stream not available at {place}: {reason}. Choose a free port from 1024 to 65535.",
    "stream.port-taken": "Port {port} is in use already, by another window or another program. Choose another port, or close that one.",
    "stream.no-address": "{address} is not an address of this computer. Give its address in the network of the clients, or {loopback} for this computer only.",
    "stream.no-package": 'Streaming needs the package pyigtl, which is not installed. Install it with: pip install "lightpen[stream]".',
}
