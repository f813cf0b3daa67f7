# SPDX-License-Identifier: Apache-2.0
"""Makes every word of the pages' titles, headings and terms known to the search field of the site.

Doxygen 1.9.4 compares the typed text with the beginning of a name or title only. widen() adds an entry for each
heading and for each later word, so that "gpu" finds the page "On a GPU". Among equal words, names of the library
come first. terms() finds the words that a page explains.
"""
import json
import re
from html import escape

ENTRY = re.compile(r"^  \['((?:[^'\\]|\\.)*?)_\d+',(\[.*\])\],?$", re.MULTILINE)
WORD = re.compile(r"[A-Za-z0-9][\w-]*")
FEW = frozenset(["a", "an", "and", "at", "by", "for", "from", "in", "is", "it", "of", "on", "or", "the", "to", "with"])


TERM = re.compile(r"`([^`\n]{3,40})`|\*\*([^*\n]{3,40})\*\*")
COMMAND = re.compile(r" *(?:python3? -m (?=pip)|build/\S*/)?"
                     r"(pip install|(?<=/)[a-z][\w-]+|ffmpeg|podman|docker|mpirun)\b")


def terms(lines):
    """(term, heading) of a page: code spans and bold words of at most four words, first cells of tables, and commands.
    A term is given once, with the heading that it stands under first; "" before the first heading below the title."""
    heading, fence, seen = "", False, set()
    for line in lines:
        fence ^= line.lstrip().startswith(("```", "~~~"))
        command = COMMAND.match(line)
        if command and (fence or line.startswith("    ")):
            found = [command.group(1)]
        elif fence or line.startswith("    "):
            continue
        elif line.startswith("#"):
            heading = "" if line.startswith("# ") else line.lstrip("#").strip()
            continue
        else:
            found = [code or bold for code, bold in TERM.findall(line)]
            if line.startswith("| "):
                found.insert(0, line.split("|")[1])
        for term in found:
            term = re.sub(r"\[([^]]*)\]\([^)]*\)|[`*:.]+$|[`*]", r"\1", term.strip()).strip()
            if re.search(r"[A-Za-z]{3}", term) and len(term.split()) <= 4 and term.lower() not in seen:
                seen.add(term.lower())
                yield term, heading


def key(text):
    """The form in which the page's script compares texts."""
    return re.sub(r"[^a-z0-9\u0080-\uffff]", lambda m: f"_{ord(m.group()):02x}", text.lower())


def widen(search, headings):
    """Adds entries to the index of all names.

    `search` is the folder of the search data. `headings` yields texts, addresses and titles of pages.
    """
    added = {}
    for text, address, page in headings:
        for k, word in enumerate(WORD.finditer(text)):
            if word.group().lower() not in FEW if k else text != page:  # Doxygen knows how titles begin
                script = "[{},[{},1,{}]]".format(*(json.dumps(escape(part, quote=False), ensure_ascii=False)
                                                   for part in (text, address, page if page != text else "")))
                added.setdefault(word.group()[0].lower(), {})[key(text[word.start():]), script] = None
    letters = re.search(r'0: "([^"]*)"', (search / "searchdata.js").read_text(encoding="utf-8")).group(1)
    for number, letter in enumerate(letters):
        path = search / f"all_{number:x}.js"
        names = set(ENTRY.findall(path.read_text(encoding="utf-8")))
        entries = sorted(names | added.get(letter, {}).keys(), key=lambda e: (e[0], e not in names, e[1]))
        lines = (f"  ['{name}_{k}',{script}]" for k, (name, script) in enumerate(entries))
        path.write_text("var searchData=\n[\n" + ",\n".join(lines) + "\n];\n", encoding="utf-8")
