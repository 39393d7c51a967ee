"""Find words that docs/words.yaml has retired, in messages, docstrings, help texts and docs: `make words`.

`python scripts/words.py` prints every place with the better word; `--update` writes today's counts to
tests/words_allowed.yaml, which it refuses where the sum of the source or of the docs would grow.
"""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[1]
LIST = ROOT / "docs" / "words.yaml"
ALLOWED = ROOT / "tests" / "words_allowed.yaml"
CODE = re.compile(r"^```(?:sh|python|yaml|json)\n.*?^```|`[^`\n]+`", re.DOTALL | re.MULTILINE)


@dataclass(frozen=True)
class Word:
    """A retired word as a pattern, and what to write."""

    pattern: re.Pattern[str]
    better: str


@dataclass(frozen=True)
class Place:
    """Where a retired word stands: file from the root, line, the words found, the better ones."""

    file: str
    line: int
    found: str
    better: str

    def __str__(self) -> str:
        """One line for a terminal, as compilers write them."""
        return f"{self.file}:{self.line}: {self.found!r}; write: {self.better}"


def words() -> list[Word]:
    """The list of docs/words.yaml."""
    rows = yaml.safe_load(LIST.read_text("utf-8"))
    return [Word(re.compile(rf"\b(?:{r['retired']})\b".replace(" ", r"\s+"), re.IGNORECASE), r["better"]) for r in rows]


def places(text: str, file: str, first_line: int, retired: list[Word]) -> Iterator[Place]:
    """Every retired word of a text."""
    for word in retired:
        for match in word.pattern.finditer(text):
            line = first_line + text.count("\n", 0, match.start())
            yield Place(file, line, " ".join(match[0].split()), word.better)


def messages(tree: ast.Module) -> Iterator[ast.Constant]:
    """String literals of more than one word: messages, help texts, docstrings."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and " " in node.value.strip():
            yield node


def pages() -> list[Path]:
    """Every page that a user reads, help texts (docs/reference.md) among them."""
    return sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])


def survey() -> list[Place]:
    """Every retired word of the repository."""
    retired = words()
    any_of_them = re.compile("|".join(word.pattern.pattern for word in retired), re.IGNORECASE)
    found: list[Place] = []
    for path in sorted((ROOT / "src").rglob("*.py")):
        for node in filter(lambda node: any_of_them.search(node.value), messages(ast.parse(path.read_text("utf-8")))):
            found += places(str(node.value), path.relative_to(ROOT).as_posix(), node.lineno, retired)
    for path in pages():
        plain = CODE.sub(lambda code: re.sub(r"[^\n]", " ", code[0]), path.read_text("utf-8"))
        found += places(plain, path.relative_to(ROOT).as_posix(), 1, retired)
    return found


def allowed() -> dict[str, int]:
    """How many each file may still have."""
    return yaml.safe_load(ALLOWED.read_text("utf-8")) or {}


def area(file: str) -> str:
    """`src` or `docs`: files move within them, so that only the sum of each is compared."""
    return "src" if file.startswith("src/") else "docs"


def update(today: Counter[str]) -> str | None:
    """Write the allow list, unless source or docs would get more than they had: then which."""
    before, after = Counter[str](), Counter[str]()
    for counts, sums in ((allowed() if ALLOWED.exists() else today, before), (today, after)):
        for file, count in counts.items():
            sums[area(file)] += count
    grown = [f"{name}: {after[name]}, {before[name]} before" for name in after if after[name] > before[name]]
    if grown:
        return "; ".join(grown)
    head = "# Retired words that each file still has: the list only shrinks (`python scripts/words.py --update`).\n"
    ALLOWED.write_text(head + "".join(f"{file}: {count}\n" for file, count in sorted(today.items())), "utf-8")
    return None


def main(arguments: list[str]) -> str | int:
    """Print every place, or update the allow list."""
    found = survey()
    if "--update" in arguments:
        return update(Counter(place.file for place in found)) or 0
    for place in found:
        print(place)
    print(f"{len(found)} in {len({place.file for place in found})} files")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
