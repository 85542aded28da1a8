"""Plain data, as read from TOML or JSON, into typed objects; what does not fit becomes one clear line."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any, TypeVar, cast

import msgspec
from msgspec import inspect

from backdrive_bayes.errors import BadInput

T = TypeVar("T")
SHOWN = 60
"""Characters of a found value that an error repeats."""
_PLACE = re.compile(r"^(?P<what>.*?)(?: - at (?P<label>`key` in )?`\$(?P<path>[^`]*)`)?$", re.DOTALL)
_STEP = re.compile(r"\.([^.\[]+)|\[(\d+|\.\.\.)\]")
_NAMED = re.compile(r"Object (?:contains unknown|missing required) field `(.*)`", re.DOTALL)


def typed(value: Any, shape: type[T], where: object) -> T:
    """``value`` as an object of ``shape``.

    Raises BadInput at ``where`` and the key, with the words of the key's type and the value found. An object's own
    ``__post_init__`` may raise a BadInput whose place is a key.
    """
    try:
        return msgspec.convert(value, shape)
    except msgspec.ValidationError as error:
        raise _refusal(error, value, shape, where) from None


def nearest(key: str, known: Iterable[str], least: float = 0.6) -> str:
    """A question whether a near key was meant, empty where none is as like it as ``least`` (difflib's ratio)."""
    known = list(known)
    near = [name for name in known if name.casefold() == key.casefold()]
    near = near or difflib.get_close_matches(key, known, n=1, cutoff=least)
    return f" (did you mean {near[0]}?)" if near else ""


def shown(value: object) -> str:
    """A found value as an error repeats it."""
    text = repr(value)
    return text if len(text) <= SHOWN else f"{text[: SHOWN - 1]}…"


def _refusal(error: msgspec.ValidationError, value, shape, where) -> BadInput:
    match = _PLACE.match(str(error))
    what, path = (match["what"], match["path"] or "") if match else (str(error), "")
    walk = _Walk(where, value, _type_of(shape))
    try:
        for name, index in _STEP.findall(path):
            key = _culprit(walk.value, value, shape, str(error)) if index == "..." else int(index or 0)
            walk.step(name or key)
    except (LookupError, TypeError):  # an unknown key may be named like a place
        return BadInput(where, "known keys", shown(what))
    if isinstance(error.__cause__, BadInput):
        cause = error.__cause__
        return BadInput(walk.place(cause.where), cause.expected, cause.found)
    if named := _NAMED.match(what):
        return walk.refuse_key(named[1])
    if match and match["label"]:
        walk.to_label()
        return BadInput(walk.place(), f"as its name {walk.expected(what)}", shown(_culprit(walk.value, value, shape, str(error))))
    return BadInput(walk.place(), walk.expected(what), _counted(what, walk.value))


def _counted(what: str, value) -> str:
    """What was found: its number where only that is wrong."""
    if "of length" in what and len(value):
        return f"{len(value)} characters" if isinstance(value, str) else f"{len(value)}"
    return shown(value)


class _Walk:
    """Where in the data an error lies: its place in words, the value there, and the types that may stand there."""

    def __init__(self, where, value, kind):
        self.where, self.value, self.keys = str(where), value, []
        self.metas: list[str] = []
        self.kinds = list(_flat(kind, self.metas))

    def step(self, key: str | int) -> None:
        """Into a key or an index."""
        inner = [kind for outer in self.kinds for kind in _inside(outer, key)]
        self.metas = []
        self.kinds = [flat for kind in inner for flat in _flat(kind, self.metas)]
        in_tables = isinstance(key, int) and any(isinstance(k, inspect.StructType) for k in self.kinds)
        self.value = self.value[key]
        if in_tables:
            self.where, self.keys = f"{self.where}, {'.'.join(self.keys)} {cast(int, key) + 1}", []
        else:
            self.keys.append(f"no. {key + 1}" if isinstance(key, int) else key)

    def to_label(self) -> None:
        """To the type of the keys of the mapping that it stands at."""
        labels = [kind.key_type for kind in self.kinds if isinstance(kind, inspect.DictType)]
        self.metas = []
        self.kinds = [flat for kind in labels for flat in _flat(kind, self.metas)]

    def place(self, more: str = "") -> str:
        keys = [*self.keys, *([more] if more else [])]
        text = ".".join(keys).replace(".no. ", ", no. ")
        return f"{self.where}, key {text[:200]}" if keys else self.where

    def refuse_key(self, name: str) -> BadInput:
        """An unknown key, or one that is missing."""
        known = [field for kind in self.kinds for field in _fields(kind)]
        if not isinstance(self.value, dict) or name in self.value:
            found = f"'{name[:SHOWN]}'{nearest(name, [k for k in known if k not in self.value])}"
            return BadInput(self.place(name), f"one of {', '.join(known)}", found)
        here = _Walk(self.place(name), None, next(_fields(kind)[name] for kind in self.kinds if name in _fields(kind)))
        return BadInput(here.where, here.expected("a value"), "no such key")

    def expected(self, otherwise: str) -> str:
        allowed = [repr(v) for kind in self.kinds if isinstance(kind, inspect.LiteralType) for v in kind.values]
        tables = any(isinstance(kind, inspect.StructType | inspect.DictType) for kind in self.kinds)
        if self.metas:
            return " or ".join(dict.fromkeys(self.metas))
        if allowed:
            return allowed[0] if len(allowed) == 1 else f"one of {', '.join(allowed)}"
        return "a table" if tables else otherwise.removeprefix("Expected ").split(", got")[0].replace("`", "")


def _culprit(mapping: dict, whole, shape, message: str) -> str:
    """The key of ``mapping``, somewhere in ``whole``, whose value does not fit: messages tell the keys of classes only."""
    items = dict(mapping)
    try:
        for key, value in items.items():
            mapping.clear()
            mapping[key] = value
            if _message(whole, shape) == message:
                return key
    finally:
        mapping.clear()
        mapping.update(items)
    return next(iter(items))


def _message(value, shape) -> str:
    try:
        msgspec.convert(value, shape)
    except msgspec.ValidationError as error:
        return str(error)
    return ""


@lru_cache
def _type_of(shape) -> inspect.Type:
    return inspect.type_info(shape)


def _flat(kind: inspect.Type, metas: list[str]) -> Iterator[inspect.Type]:
    """The types of a union, with the titles on the way noted."""
    if isinstance(kind, inspect.Metadata):
        title = (kind.extra_json_schema or {}).get("title")
        if title:
            metas.append(str(title))
        yield from _flat(kind.type, metas)
    elif isinstance(kind, inspect.UnionType):
        for one in kind.types:
            yield from _flat(one, metas)
    else:
        yield kind


def _inside(kind: inspect.Type, key: str | int) -> Iterator[inspect.Type]:
    if isinstance(kind, inspect.StructType) and key in _fields(kind):
        yield _fields(kind)[cast(str, key)]
    elif isinstance(kind, inspect.DictType) and isinstance(key, str):
        yield kind.value_type
    elif isinstance(kind, inspect.ListType | inspect.VarTupleType) and isinstance(key, int):
        yield kind.item_type


def _fields(kind: inspect.Type) -> dict[str, inspect.Type]:
    return {f.encode_name: f.type for f in kind.fields} if isinstance(kind, inspect.StructType) else {}
