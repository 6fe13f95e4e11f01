"""Draws sentences at random from the help, the documentation and the comments, to be read aloud.

    python scripts/sentences.py [--number 20] [--seed 1]

Pages that are made from other files (docs/use/models.md), tables, headings and code are left out. Doc comments of command-line arguments are
its help. A sentence that a native engineer would not say aloud like this wants rewriting.
"""

import argparse
import pathlib
import random
import re
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent
SHORTEST = 40  # characters; a shorter one is a label


def split(paragraph: str) -> list[str]:
    text = " ".join(paragraph.split())
    return [s for s in re.split(r"(?<=[.!?])\s+(?=[A-Z`])", text) if len(s) >= SHORTEST]


def of_markdown(text: str) -> list[str]:
    text = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    lines = ("" if line.startswith(("|", "#", "<!--")) else line for line in text.split("\n"))
    return [s for paragraph in re.split(r"\n\s*\n", "\n".join(lines)) for s in split(paragraph)]


def of_rust(text: str) -> list[str]:
    sentences, comment = [], []
    for line in [*text.split("\n"), ""]:
        found = re.match(r"\s*//[/!]? ?(.*)", line)
        if found:
            comment.append(found.group(1))
        elif comment:
            sentences += of_markdown("\n".join(comment))
            comment = []
    return sentences


def self_test() -> None:
    first, second = "The first sentence is as long as this one is.", "The second one of the page is about as long."
    assert of_markdown(f"# The heading of a page\n\n{first} {second}\nToo short.\n\n| a | b |\n") == [first, f"{second}"]
    assert of_rust("/// What this function is good for, in a line.\nfn f() {}\n") == ["What this function is good for, in a line."]
    print("sentences.py: as expected")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--number", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return 0
    pages = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
    drawn = [(path, s) for path in pages if path.name != "models.md" for s in of_markdown(path.read_text())]
    drawn += [(path, s) for path in sorted((ROOT / "src").rglob("*.rs")) for s in of_rust(path.read_text())]
    for path, sentence in random.Random(arguments.seed).sample(drawn, arguments.number):
        print(f"{path.relative_to(ROOT)}: {sentence}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
