#!/usr/bin/env python3
"""Checks that every relative link in the Markdown files leads somewhere, and that every path into docs/ exists.

A link must name a file or folder of the repository, and its anchor (`page.md#a-heading`, `#a-heading`) a heading of that
page. A path such as docs/use/fitting.md in the text of any file (a comment, a message, a script, a test) must exist, and so
must a source file that a page names, such as `src/math/counted.rs`. docs/README.md must link to every page of docs/. Links to the web are not followed; links in code are not read.

    python3 scripts/check_links.py               exit code 1 and one line for each broken link, if there is any
    python3 scripts/check_links.py --self-test   checks this script on small made-up repositories
"""

import argparse
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from urllib.parse import unquote

from common import write_files

INDEX = "docs/README.md"
FENCE = re.compile(r"^ *(`{3,}|~{3,})")
HEADING = re.compile(r"^#{1,6}\s+(.*?)\s*#*\s*$")
CODE = re.compile(r"`[^`]*`")
LINK = re.compile(r"\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
LINKED = re.compile(r"\[([^\]]*)\]\([^)]*\)")
TARGET = re.compile(r"^\s{0,3}\[[^\]]+\]:\s+(\S+)")
WEB = re.compile(r"^[a-z][a-z0-9+.-]*:", re.IGNORECASE)
# A path from the repository's root: `docs/` that is not the tail of a longer path or an address.
DOCS_PATH = re.compile(r"(?:(?<![\w./-])|(?<=\"/))docs/[\w./-]*\w")
# A source file that a page names by its path from the root, such as `src/math/counted.rs`.
SOURCE_PATH = re.compile(r"`((?:src|tests|scripts|benches|fuzz)/[\w./-]+\.(?:rs|py))`")


def prose(text):
    """The lines outside fenced code, each with its number."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = FENCE.match(line)
        if fence is None and mark:
            fence = mark[1]
        elif fence is not None and mark and mark[1].startswith(fence) and line.strip() == mark[1]:
            fence = None
        elif fence is None:
            yield number, line


def anchors(text):
    """The anchors that the headings of a page get: lower case, spaces to hyphens, no punctuation; repeats are numbered."""
    found = set()
    for _, line in prose(text):
        if match := HEADING.match(line):
            heading = LINKED.sub(r"\1", match[1])
            anchor = re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-")
            repeat, name = 0, anchor
            while name in found:
                repeat += 1
                name = f"{anchor}-{repeat}"
            found.add(name)
    return found


def links(text):
    for number, line in prose(text):
        shown = CODE.sub(lambda code: " " * len(code[0]), line)
        for match in LINK.finditer(shown):
            yield number, match[1]
        if match := TARGET.match(shown):
            yield number, match[1]


def broken_link(root, page, target):
    """What is wrong with a link of a page, or nothing."""
    path, _, anchor = unquote(target).partition("#")
    file = (root / page).parent / path if path else root / page
    if path.startswith("/"):
        return f"{target}: expected a path relative to the page"
    if not file.exists():
        return f"{target}: no such file"
    if not file.resolve().is_relative_to(root.resolve()):
        return f"{target}: outside the repository"
    if anchor and (file.suffix != ".md" or anchor not in anchors(file.read_text(encoding="utf-8"))):
        return f"{target}: no such heading"
    return None


def complaints(root, files):
    """One line for each link or path that leads nowhere."""
    listed = set()
    for name in sorted(files):
        try:
            text = (root / name).read_text(encoding="utf-8")
        except (UnicodeDecodeError, FileNotFoundError):
            continue
        if name.endswith(".md"):
            for number, target in links(text):
                if WEB.match(target):
                    continue
                if problem := broken_link(root, name, target):
                    yield f"{name}:{number}: {problem}"
                elif name == INDEX and (path := target.partition("#")[0]):
                    listed.add(((root / name).parent / path).resolve())
            for number, line in prose(text):
                for match in SOURCE_PATH.finditer(line):
                    if not (root / match[1]).exists():
                        yield f"{name}:{number}: {match[1]}: no such file"
        for number, line in enumerate(text.splitlines(), 1):
            for match in DOCS_PATH.finditer(line):
                if not (root / match[0]).exists():
                    yield f"{name}:{number}: {match[0]}: no such file"
    for name in sorted(files):
        if name.startswith("docs/") and name.endswith(".md") and name != INDEX:
            if (root / name).resolve() not in listed:
                yield f"{INDEX}: expected a link to {name}"


def tracked(root):
    """The files under version control and new ones that are not ignored, but for this script, which quotes broken links."""
    command = ["git", "ls-files", "-z", "--cached", "--others", "--exclude-standard"]
    names = subprocess.run(command, cwd=root, check=True, capture_output=True, text=True).stdout.split("\0")
    return [name for name in names if name and name != "scripts/check_links.py"]


def self_test():
    index = {INDEX: "[a](use/a.md)"}
    cases = [
        ("links that lead somewhere", {**index, "docs/use/a.md": "# A\n[up](../README.md) [here](#a) [web](https://x.org/y.md)"}, []),
        ("no such file", {**index, "docs/use/a.md": "text\n[b](b.md)"}, ["docs/use/a.md:2: b.md: no such file"]),
        (
            "anchors: punctuation, code and repeats",
            {**index, "docs/use/a.md": "# `--fix`, and *more*\n# B\n# B\n[x](#--fix-and-more) [y](#b-1) [z](#b-2)"},
            ["docs/use/a.md:4: #b-2: no such heading"],
        ),
        (
            "an anchor of another page",
            {**index, "docs/use/a.md": "# A", "README.md": "[a](docs/use/a.md#a) [b](docs/use/a.md#b)"},
            ["README.md:1: docs/use/a.md#b: no such heading"],
        ),
        ("code is not read", {**index, "docs/use/a.md": "`[x](y)`\n```sh\n# not a heading\n[x](y)\n```\n"}, []),
        ("a heading in fenced code is none", {**index, "docs/use/a.md": "```\n# x\n```\n[x](#x)"}, ["docs/use/a.md:4: #x: no such heading"]),
        (
            "paths in other files",
            {
                **index,
                "docs/use/a.md": "",
                "src/x.rs": '//! docs/use/a.md, docs/b.md.\nlet p = concat!("x", "/docs/c.json"); // https://x.org/docs/d',
            },
            ["src/x.rs:1: docs/b.md: no such file", "src/x.rs:2: docs/c.json: no such file"],
        ),
        (
            "source files that a page names",
            {**index, "docs/use/a.md": "`src/x.rs` and `src/y.rs`, not `y.rs`", "src/x.rs": ""},
            ["docs/use/a.md:1: src/y.rs: no such file"],
        ),
        ("each page is in the index", {**index, "docs/use/a.md": "", "docs/b.md": ""}, [f"{INDEX}: expected a link to docs/b.md"]),
        ("links stay inside", {**index, "docs/use/a.md": "[x](../../..)"}, ["docs/use/a.md:1: ../../..: outside the repository"]),
        ("targets at the end of a page", {**index, "docs/use/a.md": "[x]\n\n[x]: y.md"}, ["docs/use/a.md:3: y.md: no such file"]),
    ]
    for name, files, expected in cases:
        with tempfile.TemporaryDirectory() as scratch:
            root = Path(scratch)
            write_files(root, files)
            found = list(complaints(root, files))
            assert found == expected, f"{name}: {found}"
    print(f"{len(cases)} cases: as expected")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--self-test", action="store_true", help="check this script on small made-up repositories")
    if parser.parse_args().self_test:
        self_test()
        return 0
    root = Path(__file__).resolve().parent.parent
    files = tracked(root)
    found = list(complaints(root, files))
    print("\n".join(found) if found else f"{sum(name.endswith('.md') for name in files)} pages: every link leads somewhere")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
