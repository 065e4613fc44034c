"""Errors of the numerics. A negative answer (not identifiable) is a result, not an error."""


class RobocalError(Exception):
    """Root of all errors that this package raises on purpose."""


class BadInput(RobocalError):
    """The input cannot be used.

    Parameters
    ----------
    where
        File and, where known, line or field: ``measurements.csv line 17``.
    reason
        What is wrong and what to do, one sentence.
    """

    def __init__(self, where: str, reason: str) -> None:
        super().__init__(f"{where}: {reason}")
        self.where = where
        self.reason = reason

    def within(self, file: str) -> "BadInput":
        """The same complaint about a line of a file that whoever found it did not know."""
        return BadInput(f"{file} {self.where}", self.reason)


class NoAnswer(RobocalError):
    """The input is sound, but the numbers do not allow the answer that was asked for."""
