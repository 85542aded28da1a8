"""What README and pages quote exists: verbs, options, make targets, files, links; the README stays short."""

import re
from pathlib import Path

import pytest

from backdrive_bayes.commands.main import VERBS, main

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md")), *sorted((ROOT / "reports" / "measured").glob("*.txt"))]
MOST_WORDS = 600
INLINE, FENCED = re.compile(r"(?<!`)`([^`\n]+)`(?!`)"), re.compile(r"^```[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\]\((?!https?:|#|_generated)([^)#\s]+)[^)]*\)")
FOLDERS = ("backdrive_bayes/", "data/", "docs/", "examples/", "studies/", "tests/")
ELSEWHERE = {"--quiet"}


def text_of(page):
    return page.read_text(encoding="utf-8")


def quoted(text):
    """Inline code and the lines of code blocks, prompts taken off."""
    lines = [line for block in FENCED.findall(text) for line in block.splitlines()]
    return [*INLINE.findall(FENCED.sub("", text)), *(line.removeprefix("$ ").strip() for line in lines)]


def commands(text):
    """The words of every quoted command line, the program's name taken off."""
    typed = [x[2:] for x in text.splitlines() if x.startswith("$ ")]
    found = [q.split("#")[0].split() for q in dict.fromkeys([*quoted(text), *typed])]
    return [w[1:] for w in found if w[:1] == ["backdrive-bayes"] and len(w) > 1 and w[1] != "VERB"]


@pytest.fixture(scope="module")
def helps():
    import contextlib
    import io

    found = {}
    for verb in VERBS:
        text = io.StringIO()
        with contextlib.redirect_stdout(text):
            assert main([verb, "--help"]) == 0
        found[verb] = set(re.findall(r"(?<![\w-])--?[a-z][\w-]*", text.getvalue()))
    return found


def wrong_commands(text, helps):
    found = []
    for words in commands(text):
        if words[0] not in helps:
            found.append(words[0])
            continue
        found += [w for w in words[1:] if w.startswith("-") and w.split("=")[0] not in helps[words[0]]]
    return found


def wrong_options(text, helps):
    known = set().union(*helps.values()) | ELSEWHERE
    options = [w.split("=")[0] for q in quoted(text) for w in q.split() if re.match(r"--[a-z]", w)]
    return [o for o in options if o not in known]


def missing_files(text, folder):
    links = [target for target in LINK.findall(text) if not (folder / target).exists()]
    paths = [w for q in INLINE.findall(text) for w in q.split() if w.startswith(FOLDERS) and "…" not in w]
    return links + [p for p in paths if not (ROOT / p).exists()]


def missing_targets(text):
    targets = set(re.findall(r"^([a-z]+):", text_of(ROOT / "Makefile"), re.MULTILINE))
    return [t for q in quoted(text) for t in re.findall(r"^make ([a-z]+)", q) if t not in targets]


@pytest.mark.parametrize("page", PAGES, ids=lambda p: p.name)
def test_what_a_page_quotes_exists(page, helps):
    text = text_of(page)
    assert not wrong_commands(text, helps)
    assert not wrong_options(text, helps)
    assert not missing_targets(text)
    assert not missing_files(text, page.parent)


def test_the_checks_see_what_they_forbid(helps):
    assert wrong_commands("```\n$ backdrive-bayes fit a --nowhere\n```", helps) == ["--nowhere"]
    assert wrong_commands("`backdrive-bayes guess a`", helps) == ["guess"]
    assert wrong_options("`--nowhere`", helps) == ["--nowhere"]
    assert missing_files("[x](no.md) `studies/no.py`", ROOT) == ["no.md", "studies/no.py"]
    assert missing_targets("`make nothing`") == ["nothing"]


def test_commands_are_found_at_all():
    assert sum(len(commands(text_of(p))) for p in PAGES) >= 10


def test_the_readme_is_short_and_names_every_verb():
    text = text_of(ROOT / "README.md")
    assert len(text.split()) <= MOST_WORDS
    assert all(re.search(rf"`{verb}\b", text) for verb in VERBS)


def test_the_readmes_python_is_that_of_the_package():
    from backdrive_bayes import __doc__ as about

    example = FENCED.findall(text_of(ROOT / "README.md").partition("## In Python")[2])[0]
    steps = [x.strip() for x in example.splitlines() if re.match(r"(fitted|verdict|report)\b", x)]
    assert steps == [x.strip() for x in about.splitlines() if re.match(r" +(fitted|verdict|report)\b", x)] and len(steps) == 3
