"""Tables and figures to reach, as text."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Goal:
    """A figure of the project's own, and what came out."""

    what: str
    reached: str
    wanted: str
    holds: bool

    def __str__(self) -> str:
        mark = "reached" if self.holds else "MISSED"
        return f"{mark:8} {self.what}: {self.reached}, wanted {self.wanted}"


def table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """A Markdown table with aligned columns."""
    widths = [max(len(row[k]) for row in [head, *rows]) for k in range(len(head))]

    def line(cells: tuple[str, ...]) -> str:
        return f"| {' | '.join(c.ljust(w) for c, w in zip(cells, widths, strict=True))} |"

    rule = f"|{'|'.join('-' * (w + 2) for w in widths)}|"
    return "\n".join([line(head), rule, *(line(row) for row in rows)])
