"""The table of a run of hostile inputs, as Markdown."""

from __future__ import annotations

HEAD = """# Hostile and foreign inputs

    python studies/hostile_inputs.py --fuzz {fuzz} --seed {seed} --out reports/hostile

{cases} named cases and {fuzz} mutated inputs, each a run of the command line in a process of its own: **{failed} failed**.
A run fails where exit code or words are not those expected, where a traceback shows, where a refusal is not one line on
standard error, where it takes more than 10 s or 1 GB (libraries included), or where litter stays behind.
"""


def readme(cases: list[dict], fuzz: list[dict], options, room: str) -> str:
    """README.md of the report; paths of the run are left out of what was said."""
    failed = sum(bool(row["faults"]) for row in [*cases, *fuzz])
    head = HEAD.format(fuzz=len(fuzz), seed=options.seed, cases=len(cases), failed=failed)
    return "\n".join([head, *_fuzz_table(fuzz), *_case_table(cases, room)]) + "\n"


def _fuzz_table(fuzz: list[dict]):
    if not fuzz:
        return
    yield "## Mutated inputs\n"
    yield from ("| file | inputs | read (0) | refused (2) | failed | slowest | most memory |", "|---|--:|--:|--:|--:|--:|--:|")
    for name in [*dict.fromkeys(row["format"] for row in fuzz), "all"]:
        rows = [row for row in fuzz if name in (row["format"], "all")]
        count = [sum(row["code"] == code for row in rows) for code in (0, 2)]
        slowest, most = max(row["seconds"] for row in rows), max(row["peak_MB"] for row in rows)
        failed = sum(bool(row["faults"]) for row in rows)
        yield f"| {name} | {len(rows)} | {count[0]} | {count[1]} | {failed} | {slowest:.1f} s | {most:.0f} MB |"
    yield "\nOf history, limits, claims and template files the other arguments are missing, so that a sound one is refused too."
    yield ""


def _case_table(cases: list[dict], room: str):
    yield from ("## Named cases\n", "| case | exit code | said | |", "|---|--:|---|---|")
    for row in cases:
        verdict = "pass" if not row["faults"] else f"**FAIL**: {'; '.join(row['faults'])}"
        yield f"| {_cell(row['case'])} | {row['code']} | {_cell(_said(row['line'], room))} | {verdict} |"


def _said(line: str, room: str) -> str:
    words = line.removeprefix("backdrive-bayes: ").split(" ")
    words = [word.rpartition("/")[2] if word.startswith(room) else word for word in words]
    text = " ".join(words)
    return text if len(text) < 160 else text[:157] + "…"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("[[", "\\[\\[")
