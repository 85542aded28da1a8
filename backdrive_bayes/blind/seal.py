"""What keeps a blind check blind: the key's hash comes first, the key last, and nothing in between tells the truth."""

from __future__ import annotations

import re
from pathlib import Path

from backdrive_bayes.bench.benches import DEFAULT_BENCH, find_bench
from backdrive_bayes.bench.registry import EFFECTS
from backdrive_bayes.blind.key import folder_digest
from backdrive_bayes.errors import BadInput

HASH, KEY, UNITS, ANSWERS, DRAWING = "key.sha256", Path("key") / "key.json", "units", "answers", ".drawing"
_TELLING = re.compile("|".join((*EFFECTS, *find_bench(DEFAULT_BENCH).unlisted, "truth", "severity", "planted")), re.IGNORECASE)
_UNIT_FILES = re.compile(r"unit\.toml|\d+-rate-[^/]*\.csv\.gz")


def refuse_early_answers(out: Path) -> None:
    """Raise BadInput where an answer was there before the key's hash."""
    path = Path(out) / HASH
    if not path.exists() and any((Path(out) / ANSWERS).rglob("*.json")):
        raise BadInput(path, "the key's hash before the first answer", "answers without one: take a new OUT")


def publish(out: Path, sha256: str) -> None:
    """Write the key's hash before any diagnosis; BadInput where another one was there first."""
    path = Path(out) / HASH
    if not path.exists():
        path.write_text(f"{sha256}  {KEY.as_posix()}\n", encoding="ascii")
    elif published(out) != sha256:
        raise BadInput(path, "the hash of the units that these options and this seed give", "another one: take a new OUT")


def published(out: Path) -> str:
    """The published hash of the key."""
    return (Path(out) / HASH).read_text(encoding="ascii").split()[0]


def refuse_leaks(out: Path) -> None:
    """Raise BadInput when a diagnosis that looks around in OUT could learn the truth."""
    leaks = find_leaks(out)
    if leaks:
        raise BadInput(out, "a folder that does not tell the truth before it is diagnosed", "; ".join(leaks[:3]))


def find_leaks(out: Path) -> list[str]:
    """Files of OUT that tell, or could tell, what the key holds, in words; [] where it is sealed.

    Answers are left out: they are what the diagnosis says itself.
    """
    out, found = Path(out), []
    for path in sorted(p for p in out.rglob("*") if p.is_file()):
        place = path.relative_to(out)
        if place.parts[0] == ANSWERS or place.as_posix() == HASH:
            continue
        if place.parts[0] != UNITS or not _UNIT_FILES.fullmatch(path.name):
            found.append(f"{place} should not be there")
        elif path.suffix == ".toml" and (word := _TELLING.search(path.read_text(encoding="utf-8"))):
            found.append(f"{place} says '{word.group()}'")
    return found


def refuse_others(out: Path, names) -> None:
    """Raise BadInput where the units' folder holds another one than those of these names."""
    others = sorted({p.name for p in (Path(out) / UNITS).iterdir()} - set(names))
    if others:
        raise BadInput(Path(out) / UNITS, "the units of this check alone", f"{others[0]} beside them")


def refuse_changed(out: Path, entries, opened: bool) -> None:
    """Raise BadInput when a unit's folder is not the one that the key was made for; once it is ``opened`` it may be gone."""
    for entry in entries:
        folder = Path(out) / UNITS / entry["unit"]
        if opened and not folder.exists():
            continue
        if not folder.is_dir():
            raise BadInput(folder, "the files that were drawn", "none")
        if folder_digest(folder) != entry["folder_sha256"]:
            raise BadInput(folder, "the files that were drawn", "changed ones")
