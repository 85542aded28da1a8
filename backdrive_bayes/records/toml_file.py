"""Text files in TOML that a user writes: opened and judged in one place."""

from __future__ import annotations

import tomllib
from pathlib import Path

from backdrive_bayes.errors import BadInput

MAX_BYTES = 1_000_000


def read_toml(path: Path, what: str, missing: str = "nothing there") -> dict:
    """The table of a TOML file; ``what`` names the file expected, ``missing`` what is found where there is none.

    Raises BadInput where it is absent, larger than ``MAX_BYTES``, not UTF-8 or not TOML.
    """
    try:
        if not path.is_file():
            raise BadInput(path, what, "a folder" if path.is_dir() else missing)
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
        if len(data) > MAX_BYTES:
            raise BadInput(path, f"{what} of at most 1 MB", "a larger one")
        return tomllib.loads(data.decode("utf-8-sig").replace("\r\n", "\n"))
    except UnicodeDecodeError as error:
        raise BadInput(path, "text in UTF-8", f"another encoding (byte {error.start})") from error
    except (tomllib.TOMLDecodeError, RecursionError) as error:
        raise BadInput(path, "valid TOML", str(error)) from error
