"""What the check of the data found, repeated wherever a result rests on it."""

from __future__ import annotations

from backdrive_bayes.report.blocks import Banner, Block, Paragraph
from backdrive_bayes.report.text import free

MOST = 4
"""Warnings that a summary names."""
PROVISIONAL = "? marks provisional numbers: not to be used."
FORCED = "FORCED: the check finds the data unfit."
_FORCED = "The check finds the data unfit and --force overruled it: nothing that rests on them is to be trusted."


def findings_blocks(result: dict) -> list[Block]:
    """A banner where data were forced, and the errors and warnings of the check; notes are left to the files."""
    found = [f for f in result.get("findings") or [] if f.get("level") != "note"]
    blocks: list[Block] = [Banner("bad", "FORCED: unfit data", _FORCED)] if result.get("forced") else []
    if found:
        told = "; ".join(free(_line(f), 200) for f in found[:MOST])
        more = f"; and {len(found) - MOST} more in the result file" if len(found) > MOST else ""
        blocks.append(Paragraph(f"Check of the data: {told}{more}."))
    return blocks


def warned(result: dict) -> str:
    """The same in a few words for an overview; empty where there is nothing to say."""
    levels = [f.get("level") for f in result.get("findings") or []]
    counts = [(levels.count(level), level) for level in ("error", "warning")]
    found = " and ".join(f"{n} {level}{'s'[: n != 1]}" for n, level in counts if n)
    forced = "FORCED on unfit data" if result.get("forced") else ""
    return ", ".join(filter(None, [forced, f"{found} of the check" if found else ""]))


def _line(finding):
    where = " of ".join(filter(None, [str(finding.get("record") or ""), str(finding.get("unit") or "")]))
    return f"{finding['level']}, {where}: {finding['text']}" if where else f"{finding['level']}: {finding['text']}"
