"""The signature of a delivery: HMAC-SHA256 over its time and its body.

The time is part of what is signed, so a receiver that refuses old times cannot be fed a recorded
delivery again.
"""

import hashlib
import hmac

TIMESTAMP, SIGNATURE = "Robocal-Timestamp", "Robocal-Signature"


def sign(secret: str, timestamp: str, body: bytes) -> str:
    """Value of the header `Robocal-Signature`."""
    message = timestamp.encode() + b"." + body
    return "sha256=" + hmac.new(secret.encode(), message, hashlib.sha256).hexdigest()
