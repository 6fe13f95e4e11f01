#!/usr/bin/env python3
"""Finds circles between the files of src/: files that import one another, directly or by way of others.

A file imports another through a `use` declaration, through a path in its code (`crate::a::b`, `super::x::y`,
`module::item`), through a module named in a registry such as `subcommands!`, or by calling a macro that the other
defines. A path counts as an import of the file that defines the item, however many `pub use` lie between.

Not counted: a parent's `mod` lines and its `pub use` of what its children define (unless the parent's own code uses the
name), and whatever stands under `#[cfg(test)]`.

    python3 scripts/check_circles.py               exit code 1 and the lines of each circle, if there is any
    python3 scripts/check_circles.py --self-test   checks this script on small made-up crates
"""

import argparse
import os
import re
import sys
import tempfile
from dataclasses import dataclass, field
from pathlib import Path

from common import write_files

LIBRARY = "brdfit"
IDENTIFIER = r"[A-Za-z_][A-Za-z0-9_]*"

# What is blanked out before anything else is looked for: comments, strings, characters. Lines keep their numbers.
HIDDEN = re.compile(
    r"""//[^\n]*
      | /\*.*?\*/
      | b?r(?P<hashes>\#*)".*?"(?P=hashes)
      | b?"(?:\\.|[^"\\])*"
      | b?'(?:\\(?:u\{[^}]*\}|x..|.)|[^'\\\n])'
    """,
    re.VERBOSE | re.DOTALL,
)
TEST_ITEM = re.compile(r"#\[cfg\(test\)\]")
MODULE_LINE = re.compile(rf"\bmod\s+({IDENTIFIER})\s*;")
USE = re.compile(r"\b(?P<public>pub(?:\([^)]*\))?\s+)?use\s+(?P<tree>[^;]+);")
ITEM = re.compile(rf"\b(?:fn|struct|enum|union|trait|type|const|static)\s+(?:mut\s+)?({IDENTIFIER})")
MACRO = re.compile(rf"\bmacro_rules!\s*({IDENTIFIER})")
MACRO_CALL = re.compile(rf"(?<![\w$])({IDENTIFIER})!\s*(?=[({{\[])")
PATH = re.compile(rf"(?<![\w$:.])({IDENTIFIER}(?:\s*::\s*{IDENTIFIER})+)")


@dataclass(frozen=True)
class Use:
    """One name that a `use` declaration brings into a module; `name` is `*` for all that the path holds."""

    name: str
    path: tuple[str, ...]
    public: bool
    line: int


@dataclass
class Module:
    """A module that has a file of its own."""

    path: tuple[str, ...]  # The name of the crate first.
    file: Path
    code: str  # Without comments, strings, tests and `use` declarations.
    children: set[str] = field(default_factory=set)
    items: set[str] = field(default_factory=set)
    macros: dict[str, set[str]] = field(default_factory=dict)  # With the types and constants that each makes.
    uses: list[Use] = field(default_factory=list)


def blank(text):
    """Spaces in place of everything but line ends."""
    return re.sub(r"[^\n]", " ", text)


def end_of_block(code, opening):
    """The position behind the bracket that closes the one at `opening`."""
    depth = 0
    for position in range(opening, len(code)):
        if code[position] in "({[":
            depth += 1
        elif code[position] in ")}]":
            depth -= 1
            if depth == 0:
                return position + 1
    return len(code)


def visible_code(text):
    """The text without comments, strings and items under `#[cfg(test)]`."""
    code = HIDDEN.sub(lambda match: blank(match[0]), text)
    while match := TEST_ITEM.search(code):
        end = re.compile(r"[;{]").search(code, match.end())
        end = len(code) if end is None else end.end() if end[0] == ";" else end_of_block(code, end.start())
        code = code[: match.start()] + blank(code[match.start() : end]) + code[end:]
    return code.replace("$crate", " crate")


def top_level(code):
    """The code outside of all braces."""
    kept, depth = [], 0
    for letter in code:
        depth -= letter == "}"
        kept.append(letter if depth == 0 or letter == "\n" else " ")
        depth += letter == "{"
    return "".join(kept)


def line_of(code, position):
    return code.count("\n", 0, position) + 1


def names_of_tree(tree, prefix=()):
    """The paths that a `use` tree stands for, with the names that they get: `a::{b, c as d}` has two."""
    tree = tree.strip()
    if "{" in tree:
        head, rest = tree.split("{", 1)
        prefix += tuple(segment.strip() for segment in head.split("::") if segment.strip())
        depth, part = 0, ""
        for letter in rest[: rest.rindex("}")] + ",":
            depth += (letter == "{") - (letter == "}")
            if letter == "," and depth == 0:
                if part.strip():
                    yield from names_of_tree(part, prefix)
                part = ""
            else:
                part += letter
        return
    tree, _, alias = (part.strip() for part in re.sub(r"\s+as\s+", "\0", tree).partition("\0"))
    path = prefix + tuple(segment.strip() for segment in tree.split("::") if segment.strip())
    if path[-1] == "self" and len(path) > 1:
        path = path[:-1]
    yield alias or path[-1], path


def read_module(path, file):
    code = visible_code(file.read_text(encoding="utf-8"))
    module = Module(path, file, "")
    for use in USE.finditer(code):
        line = line_of(code, use.start())
        for name, target in names_of_tree(use["tree"]):
            module.uses.append(Use(name, target, bool(use["public"]), line))
    for macro in MACRO.finditer(code):
        body = code[macro.end() : end_of_block(code, macro.end())]
        module.macros[macro[1]] = {name for name in ITEM.findall(body) if not name[0].islower()}
    module.code = USE.sub(lambda match: blank(match[0]), code)
    outside = top_level(module.code)
    module.children = set(MODULE_LINE.findall(outside))
    module.items = set(ITEM.findall(outside)) | module.macros.keys()
    return module


def read_crate(name, root):
    """Every module of a crate by its path."""
    modules, waiting = {}, [((name,), root)]
    while waiting:
        path, file = waiting.pop()
        module = modules[path] = read_module(path, file)
        folder = file.parent if file.name in ("lib.rs", "main.rs", "mod.rs") else file.with_suffix("")
        for child in module.children:
            candidates = [folder / f"{child}.rs", folder / child / "mod.rs"]
            found = next((candidate for candidate in candidates if candidate.exists()), None)
            if found is None:
                raise SystemExit(f"{file}: no file for `mod {child};`")
            waiting.append(((*path, child), found))
    return modules


class Source:
    """The library and the binary under src/."""

    def __init__(self, folder):
        self.folder = folder
        self.modules = {}
        for name, root in ((LIBRARY, "lib.rs"), ("main", "main.rs")):
            if (folder / root).exists():
                self.modules |= read_crate(name, folder / root)
        self.macros = {
            (path[0], name): path for path, module in self.modules.items() for name in module.macros
        }
        for module in self.modules.values():
            for name in MACRO_CALL.findall(module.code):
                if defined := self.macros.get((module.path[0], name)):
                    module.items |= self.modules[defined].macros[name]

    def resolve(self, module, path, followed=frozenset()):
        """The module that a path leads to and what is left of it: nothing, or an item of that module and its parts.

        `None` for paths into other crates. `followed` are the `use` declarations passed on the way, each with its module.
        """
        first, *rest = path
        if first == "crate":
            return self.walk(module.path[:1], rest, followed)
        if first == "self":
            return self.walk(module.path, rest, followed)
        if first == "super":
            return self.walk(module.path[:-1], rest, followed) if len(module.path) > 1 else None
        if first in module.children or first in module.items:
            return self.walk(module.path, path, followed)
        found = self.imported(module, path, followed)
        if found is None and first == LIBRARY and module.path[0] != LIBRARY:
            return self.walk((LIBRARY,), rest, followed)
        return found

    def walk(self, at, rest, followed):
        """Follows `rest` from the module `at`, through the names that modules re-export."""
        rest = tuple(rest)
        while rest:
            module, name = self.modules[at], rest[0]
            if name == "super":
                at, rest = at[:-1], rest[1:]
            elif name in module.children:
                at, rest = (*at, name), rest[1:]
            elif name in module.items:
                return at, rest
            else:
                # What no declaration shows counts as the module's own.
                return self.imported(module, rest, followed) or (at, rest)
        return at, rest

    def imported(self, module, path, followed):
        """Where a path leads that begins with a name that the module has by `use`."""
        for use in module.uses:
            step = (module.path, use)
            if step in followed:
                continue
            if use.name == path[0]:
                return self.resolve(module, use.path + tuple(path[1:]), followed | {step})
            if use.name == "*":
                found = self.resolve(module, use.path[:-1] + tuple(path), followed | {step})
                if found and found[1] and found[1][0] in self.modules[found[0]].items:
                    return found
        return None

    def imports(self, module):
        """(module imported, line, text) for everything that the module's file imports."""
        for use in module.uses:
            text = "::".join(use.path)
            if use.name == "*":
                yield from self.by_glob(module, use)
                continue
            found = self.resolve(module, use.path, frozenset({(module.path, use)}))
            # A module by itself is not an import: the paths that begin with its name are.
            if found is None or not found[1]:
                continue
            of_child = found[0][: len(module.path)] == module.path
            if use.public and of_child and not uses_name(module.code, use.name):
                continue
            yield found[0], use.line, f"use {text}"
        for match in PATH.finditer(module.code):
            path = tuple(re.split(r"\s*::\s*", match[1]))
            found = self.resolve(module, path)
            if found:
                yield found[0], line_of(module.code, match.start()), "::".join(path)
        for match in MACRO_CALL.finditer(module.code):
            defined = self.macros.get((module.path[0], match[1]))
            if defined is None:
                continue
            line = line_of(module.code, match.start())
            yield defined, line, f"{match[1]}!"
            yield from self.in_registry(module, match)

    def by_glob(self, module, use):
        """What a glob brings that the module's code uses."""
        followed = frozenset({(module.path, use)})
        target = self.resolve(module, use.path[:-1], followed)
        if target is None or target[1]:
            return
        source = self.modules[target[0]]
        for name in source.items | {other.name for other in source.uses} - {"*"}:
            if uses_name(module.code, name):
                found = self.walk(source.path, (name,), followed)
                yield found[0], use.line, f"use {'::'.join(use.path)} ({name})"

    def in_registry(self, module, call):
        """The modules that a registry names without a path, as `subcommands!` does."""
        end = end_of_block(module.code, call.end())
        for match in re.finditer(rf"(?<![\w$:.]){IDENTIFIER}(?!\w|\s*::)", module.code[call.end() : end]):
            if match[0] in module.children:
                line = line_of(module.code, call.end() + match.start())
                yield (*module.path, match[0]), line, f"{call[1]}! ({match[0]})"

    def graph(self):
        """By file, the files that it imports, each with the lines that do it."""
        graph = {module.file: {} for module in self.modules.values()}
        for module in self.modules.values():
            for target, line, text in self.imports(module):
                file = self.modules[target].file
                if file != module.file:
                    graph[module.file].setdefault(file, []).append((line, text))
        return graph


def uses_name(code, name):
    """Whether code uses an item of that name. A function's name counts where it is called: variables have such names, too."""
    if name[0].islower():
        return re.search(rf"(?<![\w.$])(?<!fn ){name}\s*(\(|::|!)", code) is not None
    return re.search(rf"(?<![\w$]){name}(?!\w)", code) is not None


def circles(graph):
    """The strongly connected components of more than one file (Tarjan 1972, doi:10.1137/0201010)."""
    index, low, stack, found = {}, {}, [], []

    def visit(file):
        index[file] = low[file] = len(index)
        stack.append(file)
        for other in sorted(graph[file]):
            if other not in index:
                visit(other)
                low[file] = min(low[file], low[other])
            elif other in stack:
                low[file] = min(low[file], index[other])
        if low[file] == index[file]:
            component = [stack.pop()]
            while component[-1] != file:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    sys.setrecursionlimit(10_000)
    for file in sorted(graph):
        if file not in index:
            visit(file)
    return sorted(found)


def check(folder):
    """Prints the circles; how many there are."""
    graph = Source(folder).graph()
    found = circles(graph)
    for component in found:
        print(f"a circle of {len(component)} files:")
        for file in component:
            for other in sorted(graph[file].keys() & set(component)):
                for line, text in sorted(set(graph[file][other])):
                    print(f"  {file}:{line}: {text} -> {other}")
    edges = sum(len(others) for others in graph.values())
    print(f"{len(graph)} files, {edges} imports, {len(found)} circles")
    return len(found)


def self_test():
    """Small crates, each with what it must be found to import."""
    cases = [
        (
            "nested braces, self, super, crate, aliases",
            {
                "lib.rs": "mod a; mod b; mod c;",
                "a.rs": "use crate::{b::{self, One as Uno}, c::Three};\nfn f() -> Uno { b::two() }",
                "b.rs": "pub struct One; pub fn two() {}",
                "c.rs": "pub struct Three; // use crate::a::f;\nconst S: &str = \"crate::a::f\";",
            },
            {"a.rs": {"b.rs", "c.rs"}},
            [],
        ),
        (
            "a re-export is followed to the file that defines the item",
            {
                "lib.rs": "mod a; mod b;",
                "a.rs": "use crate::b::Deep; impl Deep {}",
                "b/mod.rs": "mod inner; pub use inner::*; pub struct Own;",
                "b/inner.rs": "mod deep; pub use deep::Deep;",
                "b/inner/deep.rs": "use crate::b::Own; pub struct Deep(Own);",
            },
            {"a.rs": {"b/inner/deep.rs"}, "b/inner/deep.rs": {"b/mod.rs"}},
            [],
        ),
        (
            "a parent that uses what it re-exports",
            {
                "lib.rs": "mod p;",
                "p/mod.rs": "mod c; pub use c::{CHILD, helper}; pub struct P; fn f() -> u8 { helper(CHILD) }",
                "p/c.rs": "use super::P; pub const CHILD: u8 = 1; pub fn helper(p: P) {}",
            },
            {"p/mod.rs": {"p/c.rs"}, "p/c.rs": {"p/mod.rs"}},
            [["p/c.rs", "p/mod.rs"]],
        ),
        (
            "mod and pub use lines alone are no import, tests do not count",
            {
                "lib.rs": "mod p;",
                "p/mod.rs": "mod c; pub use c::helper; pub struct P;\n"
                "#[cfg(test)]\nmod tests { use super::c::helper; fn f() { helper() } }",
                "p/c.rs": "use super::P; pub fn helper(p: P) {}",
            },
            {"p/c.rs": {"p/mod.rs"}},
            [],
        ),
        (
            "registries, by path and by name, and macros",
            {
                "lib.rs": "mod r; pub use r::*; mod s;",
                "r/mod.rs": "mod x; mod y;\n"
                "macro_rules! list { ($($m:ident),*) => { enum Any {} $($m::go();)* } }\n"
                "pub trait T {}\nlist! { x, y }",
                "r/x.rs": "use super::T; struct X; impl T for X {}",
                "r/y.rs": "pub fn go() {}",
                "s.rs": "fn f(any: crate::Any) {}",
            },
            {"r/mod.rs": {"r/x.rs", "r/y.rs"}, "r/x.rs": {"r/mod.rs"}, "s.rs": {"r/mod.rs"}},
            [["r/mod.rs", "r/x.rs"]],
        ),
        (
            "inline paths, from the binary, too",
            {
                "lib.rs": "pub mod a; pub mod b; pub use a::A;",
                "a.rs": "pub struct A; fn f() { super::b::g(); }",
                "b.rs": "pub fn g() { let x: crate::A; }",
                "main.rs": "use brdfit::b; fn main() { b::g(); brdfit::A; std::mem::drop(1); }",
            },
            {"a.rs": {"b.rs"}, "b.rs": {"a.rs"}, "main.rs": {"a.rs", "b.rs"}},
            [["a.rs", "b.rs"]],
        ),
        (
            "globs count by the names that are used",
            {
                "lib.rs": "mod a; mod b; mod c;",
                "a.rs": "use crate::b::*; use x::x; use y; fn f(x: B) { x::z(); y::z() }",
                "b.rs": "pub use crate::c::C; pub struct B;",
                "c.rs": "pub struct C; fn lifetimes<'a>(x: &'a str) -> char { '\"' }",
            },
            {"a.rs": {"b.rs"}, "b.rs": {"c.rs"}},
            [],
        ),
    ]
    for name, files, imports, expected in cases:
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch)
            write_files(folder, files)
            graph = Source(folder).graph()
            short = lambda path: path.relative_to(folder).as_posix()
            found = {short(file): {short(other) for other in others} for file, others in graph.items() if others}
            assert found == imports, f"{name}: {found}"
            found = [[short(file) for file in component] for component in circles(graph)]
            assert found == expected, f"{name}: {found}"
    print(f"{len(cases)} cases: as expected")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--self-test", action="store_true", help="check this script on small made-up crates")
    if parser.parse_args().self_test:
        self_test()
        return 0
    source = Path(__file__).resolve().parent.parent / "src"
    return 1 if check(Path(os.path.relpath(source))) else 0


if __name__ == "__main__":
    sys.exit(main())
