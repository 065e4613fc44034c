"""What was copied, for a person."""

from collections.abc import Sequence

from service.backup.rows import CopiedTable

DISARMED = (
    "no cell is armed: a campaign with poses left pauses until its cell is armed and it is resumed"
)
"""What a person has to know before starting the service on a copy."""


def copied_lines(copied: Sequence[CopiedTable]) -> str:
    """One line for every table that holds something."""
    lines = [f"{'table':16} {'rows':>8}  SHA-256 of all rows"]
    lines += [
        f"{table.name:16} {table.rows:8d}  {table.sha256[:16]}" for table in copied if table.rows
    ]
    return "\n".join(lines)
