"""Random secrets, and what is stored of them and of passwords."""

import hashlib
import hmac
import secrets
from threading import BoundedSemaphore

from pwdlib import PasswordHash
from pwdlib.hashers.argon2 import Argon2Hasher

RANDOM_BYTES = 32
KEY_MARK = "rcal_"
PREFIX_LENGTH = len(KEY_MARK) + 6

_AT_ONCE = 2
"""Passwords hashed at the same time: each takes 64 MiB."""

_hasher = PasswordHash((Argon2Hasher(),))
_turns = BoundedSemaphore(_AT_ONCE)


def new_token() -> str:
    """Return 256 random bits as text that fits into an address."""
    return secrets.token_urlsafe(RANDOM_BYTES)


def new_key() -> str:
    """Return a key with a mark by which scanners of leaked secrets know it."""
    return KEY_MARK + new_token()


def digest(secret: str) -> str:
    """Hash a random secret. A fast hash is enough: 256 random bits are beyond guessing."""
    return hashlib.sha256(secret.encode()).hexdigest()


def same(one: str, other: str) -> bool:
    """Compare in a time that tells nothing about where they differ."""
    return hmac.compare_digest(one.encode(), other.encode())


def form_token(login_token: str) -> str:
    """Return what a page of this login sends along with every change (against CSRF)."""
    return hmac.new(login_token.encode(), b"forms", hashlib.sha256).hexdigest()


def password_digest(password: str) -> str:
    """Hash a password with argon2id."""
    with _turns:
        return _hasher.hash(password)


def is_password(password: str, stored: str | None) -> bool:
    """Whether the password is the stored one; takes as long where none is stored."""
    with _turns:
        if stored is None:
            _hasher.hash(password)
            return False
        return _hasher.verify(password, stored)
