"""What the door has to say of the data: findings of three levels, each with a code, a text and the record it is about."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Finding:
    """One finding; an 'error' speaks against inference, ``record`` is None where the whole unit is meant."""

    level: str
    code: str
    text: str
    record: str | None = None

    def to_json(self) -> dict:
        """Ready for JSON, keys as in check.json's ``findings``."""
        return {"level": self.level, "code": self.code, "text": self.text, "record": self.record}

    @property
    def line(self) -> str:
        """The text with the record's name in front."""
        return f"{self.record}: {self.text}" if self.record else self.text

    def message(self, full: bool = True) -> dict:
        """The form of check.json's ``messages``: level ('info', 'warning', 'error') and text."""
        return {"level": "info" if self.level == "note" else self.level, "text": self.line if full else self.text}


def errors_of(findings) -> list[str]:
    """Lines of the findings that speak against inference."""
    return [finding.line for finding in findings if finding.level == "error"]


def warnings_of(findings) -> list[str]:
    """Lines of the findings to keep in mind."""
    return [finding.line for finding in findings if finding.level == "warning"]
