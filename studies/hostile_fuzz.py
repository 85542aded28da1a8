"""Mutations of sound files: flipped, cut, doubled and swapped bytes, and hostile words in text."""

from __future__ import annotations

import gzip
import io
import lzma
import zipfile

import numpy as np

WORDS = (
    b"nan", b"-inf", b"1e999", b"1e308", b"-1e-320", b"", b"\x00", b"\xff\xfe", b'"', b"'", b";", b",", b"\t", b"\r", b"\n\n",
    b"[", b"[[", b"{", b"]" * 50, b"[" * 5000, b"9" * 400, b"9" * 5000, b"0x" + b"f" * 9000, b"a." * 3000, b"\xf0\x9f\x94\xa9",
    b"sep=;\n", b"-", b"=",
    b"../", b"/etc/passwd", b"1_0", b"True", b"1979-05-27T07:32:00Z", b"\x1b[31m", b"%s", b"=1+1", b"0" * 70000,
)  # fmt: skip


def mutated(name: str, data: bytes, generator: np.random.Generator) -> bytes:
    """A damaged copy of a file; what is compressed is damaged inside or outside at even odds."""
    inner = generator.random() < 0.6
    if inner and name.endswith(".gz"):
        return gzip.compress(_damage(gzip.decompress(data), generator, True), mtime=0)
    if inner and name.endswith(".xz"):
        return lzma.compress(_damage(lzma.decompress(data), generator, True))
    if inner and name.endswith(".xlsx"):
        return _damaged_archive(data, generator)
    return _damage(data, generator, name.endswith((".csv", ".toml", ".json")))


def _damaged_archive(data: bytes, generator) -> bytes:
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as before, zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as after:
        hit = generator.integers(len(before.namelist()))
        for number, entry in enumerate(before.namelist()):
            content = before.read(entry)
            after.writestr(entry, _damage(content, generator, True) if number == hit else content)
    return out.getvalue()


def _damage(data: bytes, generator, text: bool) -> bytes:
    buffer = bytearray(data)
    for _ in range(int(generator.choice([1, 1, 1, 2, 4, 16]))):
        kind = generator.choice(["word", "flip", "cut", "double", "swap", "fill", "drop"] if text else _BINARY)
        # Heads of files hold what steers a reader: half of the damage is done there.
        reach = min(len(buffer), 600) if generator.random() < 0.5 else len(buffer)
        at, length = int(generator.integers(reach + 1)), int(2 ** generator.uniform(0, 9))
        part = bytes(buffer[at : at + length])
        if kind == "word":
            buffer[at : at + length * int(generator.integers(2))] = WORDS[generator.integers(len(WORDS))]
        elif kind == "flip":
            for k in generator.integers(len(buffer) or 1, size=int(generator.choice([1, 1, 2, 30]))):
                if k < len(buffer):
                    buffer[min(int(k), max(reach - 1, 0))] ^= 1 << int(generator.integers(8))
        elif kind == "cut":
            del buffer[at if generator.random() < 0.3 else len(buffer) - length :]
        elif kind == "double":
            buffer[at:at] = part * int(generator.choice([1, 2, 40]))
        elif kind == "swap":
            other = int(generator.integers(len(buffer) + 1))
            buffer[at : at + length], buffer[other : other + length] = buffer[other : other + length], part
        elif kind == "fill":
            buffer[at : at + min(length, 8)] = bytes([int(generator.choice([0, 255, 127, 128]))]) * len(part[:8])
        elif kind == "drop":
            del buffer[at : at + length]
    return bytes(buffer)


_BINARY = ["flip", "flip", "fill", "fill", "cut", "double", "swap", "drop", "word"]
