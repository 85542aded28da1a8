"""A blind check from start to end: draw, publish the key's hash, diagnose, open the key, score."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from backdrive_bayes.blind import seal
from backdrive_bayes.blind.answers import ANSWER_SCHEMA, read_answer
from backdrive_bayes.blind.drawing import assignments, draw_and_write, put, unit_name
from backdrive_bayes.blind.key import digest, key_bytes, read_key
from backdrive_bayes.blind.request import LISTED, Request
from backdrive_bayes.blind.scoring import score
from backdrive_bayes.blind.workers import run_all
from backdrive_bayes.errors import BadInput
from backdrive_bayes.mechanics.registry import OPERATOR_PROPERTIES
from backdrive_bayes.results import BLIND

ROUNDS = ("blind", "oracle", "removed")


@dataclass(frozen=True)
class Study:
    """How a request is carried out.

    ``diagnose(folder, allowed)`` gives the object of diagnosis.json and must be importable by a fresh process; ``oracle`` units
    are diagnosed again with nothing but their true effects in the library, ``removed`` ones with all but these. ``write(path,
    object)`` writes JSON in one step, ``note(text, share)`` shows progress.
    """

    request: Request
    out: Path
    diagnose: Callable
    write: Callable
    oracle: int = 0
    removed: int = 0
    workers: int = 1
    note: Callable[[str, float], None] = lambda text, share: None


def run_study(study: Study) -> dict:
    """Carry out a blind check and return the object of blind.json; answers that are in OUT already are kept.

    Once the key has been opened no answer is added. Raises BadInput where OUT holds another check, or tells the truth.
    """
    opened = (study.out / seal.KEY).exists()
    data = _opened_key(study) if opened else _sealed_key(study)
    key = json.loads(data)
    for kind in ROUNDS:
        _answer(study, kind, _calls(study, kind, key["units"]), opened)
    seal.refuse_changed(study.out, key["units"], opened)
    if not opened:
        (study.out / seal.KEY).parent.mkdir(exist_ok=True)
        (study.out / seal.KEY).write_bytes(data)
    key = read_key((study.out / seal.KEY).read_bytes(), seal.published(study.out))
    answers = {kind: _read(study, kind, _calls(study, kind, key["units"])) for kind in ROUNDS}
    head = {"schema": BLIND, "key_sha256": digest(data), "request": key["request"]}
    return head | score(key, answers["blind"], answers["oracle"], answers["removed"])


def _sealed_key(study):
    """Draw all units and publish the hash of their key, which stays in this process's memory."""
    # What is refused is refused before hours of drawing; what a killed process left of it is taken away.
    drawing, units = study.out / seal.DRAWING, study.out / seal.UNITS
    shutil.rmtree(drawing, ignore_errors=True)
    seal.refuse_early_answers(study.out)
    seal.refuse_leaks(study.out)
    drawing.mkdir(parents=True)
    calls = {unit_name(i): (study.request, i, effects, drawing) for i, effects in enumerate(assignments(study.request))}
    entries = {}

    def drawn(name, outcome):
        if outcome.error:
            raise RuntimeError(f"{name} could not be drawn: {outcome.error}")
        entries[name] = outcome.value
        study.note(f"drawn {len(entries)} of {len(calls)} units", len(entries) / len(calls))

    try:
        run_all(draw_and_write, calls, study.workers, drawn)
        data = key_bytes(study.request, [entries[name] for name in calls])
        seal.publish(study.out, digest(data))
        units.mkdir(exist_ok=True)
        for name in calls:
            put(drawing / name, units / name, entries[name]["folder_sha256"])
    finally:
        shutil.rmtree(drawing, ignore_errors=True)
    seal.refuse_leaks(study.out)
    seal.refuse_others(study.out, calls)
    return data


def _opened_key(study):
    data = (study.out / seal.KEY).read_bytes()
    key = read_key(data, seal.published(study.out))
    if key["request"] != study.request.as_json():
        raise BadInput(study.out, "the options and seed that its key was made with", "others: take a new OUT")
    return data


def _calls(study, kind, entries):
    """Folder and library of every diagnosis of one round."""
    named = [entry for entry in entries if entry["effects"] and set(entry["effects"]) <= set(LISTED)]
    # What the class holds with or without its name leaves nothing unknown behind.
    outside = [entry for entry in named if not set(entry["effects"]).intersection(OPERATOR_PROPERTIES)]
    chosen = {"blind": entries, "oracle": named[: study.oracle], "removed": outside[: study.removed]}[kind]
    library = {
        "blind": lambda true: None,
        "oracle": tuple,
        "removed": lambda true: tuple(name for name in LISTED if name not in true),
    }[kind]
    return {entry["unit"]: (study.out / seal.UNITS / entry["unit"], library(entry["effects"])) for entry in chosen}


def _answer(study, kind, calls, opened):
    """Diagnose what has no answer yet and keep each answer as it comes."""
    folder = study.out / seal.ANSWERS / kind
    folder.mkdir(parents=True, exist_ok=True)
    left = {name: call for name, call in calls.items() if not (folder / f"{name}.json").exists()}
    if left and opened:
        raise BadInput(folder, "an answer to every unit, for the key has been opened", f"none to {', '.join(list(left)[:3])}")
    done = len(calls) - len(left)

    def keep(name, outcome):
        nonlocal done
        done += 1
        body = {"error": outcome.error} if outcome.error else {"diagnosis": outcome.value}
        study.write(folder / f"{name}.json", {"schema": ANSWER_SCHEMA, "unit": name, **body})
        raised = f": {name} raised" if outcome.error else ""
        study.note(f"diagnosed {done} of {len(calls)} units ({kind}){raised}", done / len(calls))

    run_all(study.diagnose, left, study.workers, keep)


def _read(study, kind, calls):
    return {name: read_answer(study.out / seal.ANSWERS / kind / f"{name}.json") for name in calls}
