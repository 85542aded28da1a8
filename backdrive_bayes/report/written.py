"""When results were written, so that the report can be dated and stay the same for the same files."""

from __future__ import annotations

import datetime
from pathlib import Path

from backdrive_bayes.report.sections import SECTIONS


def written_on(folders: list[Path]) -> str:
    """Day of the newest result file in ``folders``, such as "22 November 2026"."""
    times = [path.stat().st_mtime for folder in folders for name in SECTIONS if (path := Path(folder) / name).exists()]
    day = datetime.datetime.fromtimestamp(max(times)).date() if times else None
    return f"{day.day} {_MONTHS[day.month - 1]} {day.year}" if day else "not recorded"


_MONTHS = (
    "January", "February", "March", "April", "May", "June", "July", "August", "September", "October", "November", "December",
)  # fmt: skip
