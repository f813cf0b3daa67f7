#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Copies code from compiled sources into Markdown pages, so that pages show only code that tests have run.

A page names the source in a comment before a code block, and optionally a region of it:

    <!-- snippet: examples/render_scan.cpp render -->
    ```cpp
    ...
    ```

A C++ source marks a region with the lines `// [snippet: render]` and `// [/snippet]`, a Python or shell
source with `# [snippet: render]`. Whole files are shown without their licence line and their markers. All
C++ and Python of README.md and docs/ comes from sources, except blocks behind a comment with a reason,
`<!-- not compiled: its first line must not compile -->`.

usage: include_snippets.py                rewrite the code blocks of README.md and docs/**/*.md
       include_snippets.py --check        name each block that differs; exit status 1 if there is any
       include_snippets.py --self-test    check a scratch tree with known faults and expect to find each
       --root DIR                         a source tree (default: this one)
"""
import argparse
import pathlib
import re
import sys
import tempfile
import textwrap

BLOCK = re.compile(r"^<!-- snippet: (\S+)(?: (\S+))? -->\n+```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
CODE_BLOCK = re.compile(r"^(?:```|~~~) *(?i:cpp|c\+\+|cuda|python|py)\n"
                        r"|(?<=\n\n) {4}(?:#include |import |from [\w.]+ import |[^\n]*gsnav::)",
                        re.MULTILINE)
NOT_COMPILED = re.compile(r"^<!-- not compiled: \S.* -->\n+(?=```)", re.MULTILINE)
COMMENT = re.compile(r"^<!-- snippet:", re.MULTILINE)
BEGIN = re.compile(r"\s*(?://|#) \[snippet: (\S+)\]$")
END = re.compile(r"\s*(?://|#) \[/snippet\]$")
LICENCE = re.compile(r"(?://|#) SPDX-License-Identifier:.*")


class Wrong(Exception):
    """A reference to code that is not there."""


def snippet(root, name, region):
    """Lines of a source, or of one region of it, without common indentation and markers."""
    path = root / name
    if not path.is_file():
        raise Wrong(f"{name}: no such file")
    lines = path.read_text(encoding="utf-8").splitlines()
    taken, inside, found = [], region is None, region is None
    for line in lines:
        begin = BEGIN.fullmatch(line)
        if begin and begin[1] == region:
            if found:
                raise Wrong(f"{name}: two regions are called {region}")
            inside = found = True
        elif END.fullmatch(line):
            inside = region is None
        elif inside and not begin and not LICENCE.fullmatch(line):
            taken.append(line)
    if not found:
        raise Wrong(f"{name}: no region is called {region}")
    if region is not None and inside:
        raise Wrong(f"{name}: region {region} does not end")
    return textwrap.dedent("\n".join(taken)).strip("\n") + "\n"


def pages(root):
    return [p for p in (root / "README.md", *sorted((root / "docs").rglob("*.md"))) if p.is_file()]


def rewritten(root, page):
    """Returns the page with all code blocks taken from their sources, and a message for each difference."""
    text, wrong = page.read_text(encoding="utf-8"), []
    name = page.relative_to(root)

    def replace(match):
        line = text.count("\n", 0, match.start()) + 1
        source, region, language, old = match.groups()
        try:
            new = snippet(root, source, region)
        except Wrong as error:
            wrong.append(f"{name}:{line}: {error}")
            return match[0]
        if new != old:
            wrong.append(f"{name}:{line}: differs from {source}{' ' + region if region else ''}")
        head = match[0][:match[0].index("```")]
        return f"{head}```{language}\n{new}```"

    result = BLOCK.sub(replace, text)
    starts = {m.start() for m in BLOCK.finditer(text)}
    for comment in COMMENT.finditer(text):
        if comment.start() not in starts:
            line = text.count("\n", 0, comment.start()) + 1
            wrong.append(f"{name}:{line}: no code block follows this comment")
    blocks = [m.span() for m in BLOCK.finditer(text)]
    excused = {m.end() for m in NOT_COMPILED.finditer(text)}
    for code in CODE_BLOCK.finditer(text):
        if code.start() not in excused and not any(begin < code.start() < end for begin, end in blocks):
            wrong.append(f"{name}:{text.count(chr(10), 0, code.start()) + 1}: code without a snippet comment")
    return result, wrong


def run(root, check):
    """Returns the number of blocks and the messages. Without `check` it mends differing blocks."""
    blocks, all_wrong = 0, []
    for page in pages(root):
        text, wrong = rewritten(root, page)
        blocks += len(BLOCK.findall(text))
        if not check:
            if text != page.read_text(encoding="utf-8"):
                page.write_text(text, encoding="utf-8")
            wrong = [w for w in wrong if ": differs from " not in w]
        all_wrong += wrong
    return blocks, all_wrong


def self_test():
    source = ("// SPDX-License-Identifier: Apache-2.0\n#include <x>\nint main() {\n  // [snippet: a]\n  one();\n"
              "    two();\n  // [/snippet]\n  // [snippet: open]\n}\n")
    block = "<!-- snippet: examples/s.cpp {} -->\n```cpp\n{}```\n"
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "examples").mkdir()
        (root / "docs/guide").mkdir(parents=True)
        (root / "examples/s.cpp").write_text(source, encoding="utf-8")
        page = root / "docs/guide/page.md"
        whole = "#include <x>\nint main() {\n  one();\n    two();\n}\n"
        cases = [  # text, what --check must find, text after a rewrite
            (block.format("a", "one();\n  two();\n"), None, "one();\n  two();\n"),
            (block.format("a", "old();\n"), "differs from examples/s.cpp a", "one();\n  two();\n"),
            (block.format("a", ""), "differs from", "one();\n  two();\n"),
            (block.format("none", ""), "no region is called none", None),
            (block.format("open", ""), "region open does not end", None),
            ("<!-- snippet: examples/absent.cpp a -->\n```cpp\n```\n", "no such file", None),
            ("<!-- snippet: examples/s.cpp a -->\ntext\n", "no code block follows", None),
            ("<!-- snippet: examples/s.cpp -->\n```cpp\n```\n", "differs from examples/s.cpp", whole),
            ("```cpp\nlone();\n```\n", "code without a snippet comment", None),
            ("```python\nlone()\n```\n", "code without a snippet comment", None),
            ("<!-- not compiled: it is wrong -->\n```cpp\none();\n  two();\n```\n", None, "one();\n  two();\n"),
            ("    import lone\n", "code without a snippet comment", None),
            ("<!-- not compiled: -->\n```cpp\nlone();\n```\n", "code without a snippet comment", None),
        ]
        failed = 0
        for text, finds, after in cases:
            page.write_text("before\n\n" + text + "\nafter\n", encoding="utf-8")
            _, wrong = run(root, True)
            if (finds is None) != (not wrong) or (finds and finds not in wrong[0]):
                failed += 1
                print(f"self-test: expected '{finds}', found {wrong}", file=sys.stderr)
            _, left = run(root, False)
            result = page.read_text(encoding="utf-8")
            if after is not None and (left or f"```cpp\n{after}```\n\nafter\n" not in result or run(root, True)[1]):
                failed += 1
                print(f"self-test: wrong rewrite:\n{result}", file=sys.stderr)
            if after is None and not left:
                failed += 1
                print(f"self-test: a rewrite hid '{finds}'", file=sys.stderr)
        print(f"{len(cases)} cases, {failed} failed")
        return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="change nothing; fail if a block differs")
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--root", type=pathlib.Path, default=pathlib.Path(__file__).resolve().parent.parent)
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    blocks, wrong = run(options.root, options.check)
    for line in wrong:
        print(line, file=sys.stderr)
    if wrong and options.check:
        print("Run tools/include_snippets.py to take the code from its sources.", file=sys.stderr)
    print(f"{blocks} snippets, {len(wrong)} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
