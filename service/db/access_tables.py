"""Tables of access: keys, people, logins, one-time links, and the trail of who did what.

No secret is stored, only SHA-256 of random tokens and argon2id of passwords.
"""

from sqlalchemy import CheckConstraint, ForeignKey, Index, text
from sqlalchemy.orm import Mapped, mapped_column

from service.db.base import Base


class ApiKeyRow(Base):
    """A key with which a program calls."""

    __tablename__ = "api_key"

    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    scope: Mapped[str]
    prefix: Mapped[str]
    """How the key begins, to tell keys apart."""
    secret_sha256: Mapped[str] = mapped_column(unique=True)
    created: Mapped[str]
    created_by: Mapped[str]
    last_used: Mapped[str | None]
    revoked: Mapped[str | None]

    __table_args__ = (
        CheckConstraint("scope IN ('read','operate','engineer')", name="scope"),
        Index(
            "one_valid_key_per_name",
            "name",
            unique=True,
            sqlite_where=text("revoked IS NULL"),
            postgresql_where=text("revoked IS NULL"),
        ),
    )


class PersonRow(Base):
    """Somebody who may log in."""

    __tablename__ = "person"

    name: Mapped[str] = mapped_column(primary_key=True)
    role: Mapped[str]
    password_hash: Mapped[str | None]
    """None until the person has chosen a password by a one-time link."""
    disabled: Mapped[bool] = mapped_column(default=False)
    created: Mapped[str]
    created_by: Mapped[str]

    __table_args__ = (CheckConstraint("role IN ('operate','engineer')", name="role"),)


class LoginRow(Base):
    """A person logged in from one browser."""

    __tablename__ = "login"

    token_sha256: Mapped[str] = mapped_column(primary_key=True)
    person: Mapped[str] = mapped_column(ForeignKey("person.name"))
    created: Mapped[str]
    expires: Mapped[str]

    __table_args__ = (Index(None, "person"),)


class LinkRow(Base):
    """A link by which one person, once, chooses a password."""

    __tablename__ = "one_time_link"

    token_sha256: Mapped[str] = mapped_column(primary_key=True)
    person: Mapped[str | None] = mapped_column(ForeignKey("person.name"))
    """None for the first engineer, who chooses the name as well."""
    created: Mapped[str]
    expires: Mapped[str]
    used: Mapped[str | None]


class AuditRow(Base):
    """One deed. Written once; the database refuses to change or delete it."""

    __tablename__ = "audit"

    id: Mapped[int] = mapped_column(primary_key=True)
    at: Mapped[str]
    who: Mapped[str]
    """'person anna', 'key mes', 'command root' …"""
    action: Mapped[str]
    """Method and path with its placeholders, or the command."""
    object: Mapped[str]
    """The path as it was called, or what the command was about."""
    status: Mapped[int]
    """HTTP status of the answer: below 400 it was done."""
    address: Mapped[str]

    __table_args__ = (Index(None, "at"),)
