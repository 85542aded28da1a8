"""The corpus: named inputs that must end in a refusal, in an error or warning of ``check``, or in a note and a right reading."""

from __future__ import annotations

import dataclasses
import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np
from hostile_formats import FORMATS, LIMITS, UNIT, loop, table, write

TIME, TORQUE, ANGLE = loop()
VERBS = ("fit", "diagnose", "accept", "compare")


@dataclasses.dataclass(frozen=True)
class Case:
    """``make`` fills a folder and returns the arguments of a command; ``code`` and ``words`` are what has to come back.

    A ``code`` of None allows 0 (what is left can be read) and 2.
    """

    name: str
    make: Callable[[Path], list[str]]
    code: int | None
    words: tuple[str, ...] = ()


def corpus() -> list[Case]:
    """All cases, in the order of the report's table."""
    return [*_physics(), *_verbs(), *_sizes(), *_foreign(), *_texts(), *_bytes(), *_usage()]


def _unit(folder: Path, time=TIME, torque=TORQUE, angle=ANGLE, more: str = "", rated: str = "1.0", file: str = "a.csv") -> Path:
    unit = folder / "unit"
    unit.mkdir()
    write(unit / file, time, torque, angle)
    (unit / "unit.toml").write_text(UNIT.format(file=file).replace("rated_torque_Nm = 1.0", f"rated_torque_Nm = {rated}") + more)
    return unit


def _check(**changes) -> Callable[[Path], list[str]]:
    return lambda folder: ["check", str(_unit(folder, **changes))]


def _physics():
    frozen, half = np.where(TIME > 2.0, ANGLE[500], ANGLE), slice(0, len(TIME) // 2)
    mended = '[record.columns]\ntime = "time_s"\ntorque = "torque_Nm"\nangle = "-angle_deg"\n'
    yield Case("sound record", _check(), 0, ("inference may go on",))
    yield Case("angle inverted", _check(angle=-ANGLE), 2, ('angle = "-angle_deg"',))
    yield Case("torque inverted", _check(torque=-TORQUE), 2, ("wrong sign",))
    yield Case("angle inverted and mended by a minus", _check(angle=-ANGLE, more=mended), 0)
    yield Case("torque and angle inverted", _check(torque=-TORQUE, angle=-ANGLE), 0)
    for offset in (0.005, 0.012, -0.01):
        wrapped = (ANGLE + offset) % (2 * np.pi)
        yield Case(f"wrap at 360°, offset {offset} rad", _check(angle=wrapped), 0, ("full turn taken out",))
    yield Case("wrap at 90°", _check(angle=(ANGLE + 0.004) % (np.pi / 2)), 0, ("constant 90° taken out",))
    yield Case("wrap and inverted", _check(angle=(0.004 - ANGLE) % (2 * np.pi)), 2, ("wrong sign", "full turn"))
    yield Case("encoder slips by 17°", _check(angle=ANGLE + 0.3 * (TIME > 2.5)), 2, ("jumps",))
    yield Case("angle 3000 times too large", _check(angle=3000 * ANGLE), 0, ("wrong unit?",))
    yield Case("angle 10⁵ times too large", _check(angle=1e5 * ANGLE), 2, ("between two samples",))
    yield Case("angle frozen from 2 s on", _check(angle=frozen), 2, ("stands still",))
    yield Case("loop passed the wrong way", _check(torque=TORQUE[::-1], angle=ANGLE[::-1]), 2, ("wrong way",))
    yield Case("another channel for the angle", _check(angle=0.02 * np.sqrt(TIME) + ANGLE * 0), 2, ("does not follow",))
    yield Case("half a cycle", _check(time=TIME[half], torque=TORQUE[half], angle=ANGLE[half]), 2, ("full torque cycle",))
    yield Case("one-sided torque", _check(torque=np.abs(TORQUE)), 2, ("positive and negative",))
    yield Case("constant torque", _check(torque=0 * TORQUE + 0.5), 2, ("constant 0.5",))
    yield Case("constant angle", _check(angle=0 * ANGLE), 2, ("constant",))
    yield Case("rated torque 10¹²", _check(rated="1e12"), 0, ("1e+12 N·m", "wrong unit or column", "lost motion is not defined"))
    yield Case("rated torque 1/1000 of the tested", _check(rated="1e-3"), 0, ("0.001 N·m", "wrong unit or column"))
    yield Case("loop smaller than k·T_r", _check(rated="40"), 0, ("lost motion is not defined", "k·T_r"))
    yield Case("torque of 1e308", _check(torque=1e307 * TORQUE), 2, ("below 1e+60",))


def _verbs():
    def made(verb):
        def make(folder):
            (folder / "limits.toml").write_text(LIMITS)
            unit = str(_unit(folder, angle=-ANGLE))
            more = {"accept": ["--limits", str(folder / "limits.toml")], "compare": [unit]}.get(verb, [])
            return [verb, unit, *more]

        return make

    for verb in VERBS:
        yield Case(f"{verb} of an inverted angle", made(verb), 2, ("--force", "wrong sign"))


def _sizes():
    for count, words in ((1, "24 samples"), (12, "24 samples"), (20, "24 samples"), (30, "only 30 samples")):
        at = np.linspace(0, len(TIME) - 1, count).astype(int)
        yield Case(f"{count} samples", _check(time=TIME[at], torque=TORQUE[at], angle=ANGLE[at]), 2, (words,))
    bomb = gzip.compress(b"time_s,torque_Nm,angle_deg\n") + 30 * gzip.compress(b"0,0,0\n" * 500_000)
    yield Case("gzip bomb", _bytes_case("a.csv.gz", bomb), 2, ("inflated",))
    yield Case("40 000 columns", _bytes_case("a.csv", b",".join([b"x"] * 40_000) + b"\n"), 2)


def _foreign():
    for name in FORMATS:
        yield Case(f"sound {name}", lambda folder, name=name: ["check", str(write(folder / name, TIME, TORQUE, ANGLE))], 0)
    german = "sep=;\nZeit [s];Drehmoment [Nm];Winkel [°]"
    said = ("read 'Drehmoment [Nm]'",)
    yield Case("Excel's sep=; and German names", _csv(table(TIME, TORQUE, ANGLE, german, ";", ",")), 0, said)
    units = "Bench 3\n\nZeit;Drehmoment;Winkel\n[s];[Nm];[deg]"
    yield Case("preamble and units row", _csv(table(TIME, TORQUE, ANGLE, units, ";", ",")), 0, ("above the header left out",))
    yield Case("names without units", _csv(table(TIME, TORQUE, ANGLE, "Zeit,Drehmoment,Winkel")), 2, ("columns = {time =",))
    yield Case("headers of something else", _csv("id,name,price\n1,a,2\n2,b,3\n"), 2, ("columns = {time =",))
    for suffix in ("xlsx", "parquet", "tdms", "mat", "mf4", "csv.gz", "csv.xz"):
        yield Case(f"text called .{suffix}", _bytes_case(f"a.{suffix}", b"nothing of the kind\n" * 30), 2)
        yield Case(f"empty .{suffix}", _bytes_case(f"a.{suffix}", b""), 2, ("empty file",))
    yield Case("a picture called .csv", _bytes_case("a.csv", b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20), 2)
    yield Case("UTF-16 without a mark", _bytes_case("a.csv", table(TIME, TORQUE, ANGLE).encode("utf-16-le")), 2, ("UTF-8",))


def _texts():
    hostile = {
        "integer of 400 digits": ("rated_torque_Nm = 1" + "0" * 400, "300 digits"),
        "integer of 5000 digits": ("rated_torque_Nm = 1" + "0" * 5000, "300 digits"),
        "hexadecimal integer of 9000 digits": ("rated_torque_Nm = 0x" + "f" * 9000, "300 digits"),
        "arrays 20 000 deep": ("rated_torque_Nm = " + "[" * 20_000, "TOML"),
        "key of 900 parts": (".".join("a" * 900) + " = 1", "tables within"),
        "20 000 tables": ("[[loop_area_J]]\nmax = 1\n" * 20_000, "at most 1000"),
        "1.2 MB of comment": ("#" * 1_200_000, "1 MB"),
        "path above the folder": (UNIT.format(file="../x.csv"), "inside"),
        "NUL in a path": (UNIT.format(file="a\\u0000.csv"), "file"),
    }
    for name, (text, words) in hostile.items():
        yield Case(f"unit.toml: {name}", _toml("unit.toml", text, lambda f: ["check", str(f)]), 2, (words,))
    limits = lambda f: ["accept", str(f / "none"), "--limits", str(f / "limits.toml")]  # noqa: E731
    for name in ("integer of 400 digits", "20 000 tables", "arrays 20 000 deep"):
        yield Case(f"limits.toml: {name}", _toml("limits.toml", hostile[name][0], limits), 2, (hostile[name][1],))
    yield Case("indicators.json 200 000 deep", _deep_json, 2, ("deep",))


def _deep_json(folder: Path) -> list[str]:
    (folder / "indicators.json").write_text("[" * 200_000)
    (folder / "posterior.nc").write_bytes(b"x")
    (folder / "limits.toml").write_text(LIMITS)
    return ["accept", str(folder), "--limits", str(folder / "limits.toml")]


def _bytes():
    for name in FORMATS:
        for share in (0.1, 0.5, 0.9):
            yield Case(f"{name} cut at {share:.0%}", _cut(name, share), None)
        yield Case(f"{name} with a head of 0xff", _headless(name), None)


def _usage():
    yield Case("NUL in -o", lambda f: ["check", str(_unit(f)), "-o", "a\0b"], 2, ("NUL",))
    yield Case("NUL in UNIT", lambda f: ["check", "a\0b"], 2, ("NUL",))
    yield Case("a name of 5000 letters", lambda f: ["check", "x" * 5000], 2)
    yield Case("no such unit", lambda f: ["check", str(f / "none")], 2, ("nothing there",))
    in_the_way = lambda f: ["check", str(_unit(f)), "-o", str(f / "unit" / "a.csv")]  # noqa: E731
    yield Case("OUT is a file", in_the_way, 2, ("a folder to write into",))


def _bytes_case(name: str, data: bytes):
    def make(folder: Path) -> list[str]:
        (folder / name).write_bytes(data)
        return ["check", str(folder / name)]

    return make


def _csv(text: str):
    return _bytes_case("a.csv", text.encode())


def _toml(name: str, text: str, arguments):
    def make(folder: Path) -> list[str]:
        (folder / name).write_text(text)
        return arguments(folder)

    return make


def _cut(name: str, share: float):
    def make(folder: Path) -> list[str]:
        path = write(folder / name, TIME, TORQUE, ANGLE)
        data = path.read_bytes()
        path.write_bytes(data[: int(share * len(data))])
        return ["check", str(path)]

    return make


def _headless(name: str):
    def make(folder: Path) -> list[str]:
        path = write(folder / name, TIME, TORQUE, ANGLE)
        path.write_bytes(b"\xff" * 64 + path.read_bytes()[64:])
        return ["check", str(path)]

    return make
