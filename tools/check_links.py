#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the links of all Markdown files: files, folders and anchors that a link names must exist.

    tools/check_links.py               names each link that leads nowhere; exit status 1 if there is any
    tools/check_links.py --self-test   checks the script itself

A link is `[text](target)`, an image `![text](target)`, `<img src="target">`, `<a href="target">` or a
definition `[name]: target`. Code is not read for links. Links with a scheme (https:, mailto:) are not
followed. Anchors are those that GitHub makes of headings. Pages and pictures under docs/ that sources,
scripts and CMake files name are checked too, except where a string is the whole name.
"""
import argparse
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^ {0,3}(```+|~~~+)")
INLINE_CODE = re.compile(r"(`+)(?:.|\n)*?\1")
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^()\s>]+(?:\([^()\s]*\)[^()\s>]*)*)>?(?:\s+\"[^\"]*\")?\s*\)")
DEFINITION = re.compile(r"^ {0,3}\[[^\]]+\]:\s*<?(\S+?)>?\s*$", re.MULTILINE)
ATTRIBUTE = re.compile(r"<(?:img|a|source)\b[^>]*?\b(?:src|href|srcset)=\"([^\"]+)\"", re.DOTALL)
HEADING = re.compile(r"^ {0,3}#{1,6}\s+(.*?)\s*#*\s*$")
EXPLICIT_ANCHOR = re.compile(r"<a\s+(?:id|name)=\"([^\"]+)\"")
PAGE = re.compile(r"(?<![\"'/\w])docs/[\w./-]+\.(?:md|svg|png)\b")
SOURCES = ("*.hpp", "*.cpp", "*.cu", "*.cuh", "*.py", "*.sh", "*.cmake", "*.in", "*CMakeLists.txt", "*.txt", "*.yml")


def without_code_blocks(text):
    """The text with the lines of fenced and indented code emptied, so that line numbers stay."""
    lines, fence, blank = [], None, True
    for line in text.split("\n"):
        mark = FENCE.match(line)
        if fence:
            if mark and line.strip().startswith(fence) and not line.strip().strip(fence[0]):
                fence = None
            line = ""
        elif mark:
            fence, line = mark.group(1), ""
        elif line.startswith("    ") and blank:
            line = ""
            lines.append(line)
            continue  # an indented block goes on while its lines are indented
        blank = not line.strip()
        lines.append(line)
    return "\n".join(lines)


def emptied(match):
    return re.sub(r"[^\n]", " ", match.group(0))


def slug(heading):
    """GitHub's anchor of a heading: small letters, no punctuation, hyphens for spaces."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)  # the text of a link
    text = re.sub(r"<[^>]*>", "", text).replace("`", "").replace("*", "").replace("\\", "")
    return re.sub(r"[^\w\- ]", "", text.strip().lower()).replace(" ", "-")


def anchors(path):
    text = without_code_blocks(path.read_text(encoding="utf-8"))
    found, times = set(EXPLICIT_ANCHOR.findall(text)), {}
    for line in text.split("\n"):
        heading = HEADING.match(line)
        if heading:
            name = slug(heading.group(1))
            found.add(name if name not in times else f"{name}-{times[name]}")
            times[name] = times.get(name, 0) + 1
    return found


def links(text):
    """(line, target) of each link of a page."""
    text = INLINE_CODE.sub(emptied, without_code_blocks(text))
    for pattern in (LINK, DEFINITION, ATTRIBUTE):
        for match in pattern.finditer(text):
            yield text.count("\n", 0, match.start(1)) + 1, match.group(1)


def problem(page, target, root, known):
    """The fault of a link of `page`, or None."""
    if re.match(r"[a-zA-Z][\w+.-]*:", target) or target.startswith("//"):
        return None
    name, _, anchor = urllib.parse.unquote(target).partition("#")
    if name.startswith("/"):
        return f"{target}: a path from the root of a site; write it relative to this page"
    to = (page.parent / name).resolve() if name else page
    if root != to and root not in to.parents:
        return f"{target}: leads out of the repository"
    if not to.exists():
        return f"{target}: there is no {to.relative_to(root)}"
    if anchor and to.suffix == ".md":
        if to not in known:
            known[to] = anchors(to)
        if anchor not in known[to]:
            return f"{target}: {to.relative_to(root)} has no heading #{anchor}"
    return None


def tracked(root, *patterns):
    out = subprocess.run(["git", "-C", str(root), "ls-files", "-z", "--cached", "--others", "--exclude-standard", "--",
                          *patterns], capture_output=True, text=True, check=True).stdout
    return [root / f for f in sorted(set(out.split("\0"))) if f and (root / f).is_file()]


def is_source_tree(root):
    """True if git is installed and knows the folder."""
    return shutil.which("git") is not None and subprocess.run(
        ["git", "-C", str(root), "rev-parse"], capture_output=True, check=False).returncode == 0


def found(root, *patterns):
    """Files of the repository; without git, in an archive, all files. Virtual environments of Python are skipped."""
    environments = {p.parent for p in root.glob("*/pyvenv.cfg")}
    if is_source_tree(root):
        files = tracked(root, *patterns)
    else:
        files = sorted({f for p in patterns for f in root.rglob(p)})
        files = [f for f in files if not any(d.startswith("build") for d in f.relative_to(root).parts)]
    return [f for f in files if environments.isdisjoint(f.parents)]


def check(root):
    wrong, known, count = [], {}, 0
    for page in found(root, "*.md"):
        for line, target in links(page.read_text(encoding="utf-8")):
            count += 1
            said = problem(page.resolve(), target, root, known)
            if said:
                wrong.append(f"{page.relative_to(root)}:{line}: {said}")
    for source in found(root, *SOURCES):
        if source.name == pathlib.Path(__file__).name or source.name.startswith("test_") and source.suffix == ".py":
            continue
        for number, line in enumerate(source.read_text(encoding="utf-8", errors="replace").split("\n"), 1):
            for name in PAGE.findall(line):
                count += 1
                if not (root / name).exists():
                    wrong.append(f"{source.relative_to(root)}:{number}: there is no {name}")
    return wrong, count


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder).resolve()
        (root / "docs").mkdir()
        (root / "docs" / "a.md").write_text(
            "# One `code` heading: 1/2\n\n## Twice\n\n## Twice\n\n[b](b.md#there) [self](#twice-1) [up](../README.md)\n"
            "[s](#one-code-heading-12) [web](https://example.org/x.md#y) `[code](none.md)`\n\n"
            "```\n[fenced](none.md)\n```\n\n    [indented](none.md)\n\n<img src=\"p.svg\">\n")
        (root / "docs" / "b.md").write_text("# There\n")
        (root / "docs" / "p.svg").write_text("<svg/>")
        (root / "README.md").write_text("[a](docs/a.md)\n[folder](docs)\n")
        wrong, count = check(root)
        assert not wrong and count == 8, (wrong, count)
        faults = ["[x](none.md)", "[x](docs/b.md#nowhere)", "![x](docs/none.svg)", "[x](../outside.md)",
                  "[x](/docs/a.md)", "<img src=\"none.png\">", "[x]: none.md", "[two\nlines](none.md)"]
        for fault in faults:
            (root / "README.md").write_text(fault + "\n")
            assert len(check(root)[0]) == 1, fault
        (root / "README.md").write_text("fine\n")
        (root / "x.hpp").write_text("// see docs/none.md\n")
        assert check(root)[0] == ["x.hpp:1: there is no docs/none.md"], check(root)
        (root / "venv").mkdir()
        (root / "x.hpp").rename(root / "venv" / "x.hpp")
        assert len(check(root)[0]) == 1, check(root)
        (root / "venv" / "pyvenv.cfg").write_text("home = /usr/bin\n")
        assert not check(root)[0], check(root)
    print("check_links.py: the script finds each of the faults that it is given")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--self-test", action="store_true", help="check the script itself")
    if parser.parse_args().self_test:
        return self_test()
    wrong, count = check(ROOT)
    if wrong:
        sys.exit("\n".join(wrong + [f"check_links.py: {len(wrong)} of {count} links lead nowhere"]))
    print(f"check_links.py: {count} links, all lead somewhere")
    return None


if __name__ == "__main__":
    main()
