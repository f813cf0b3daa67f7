# SPDX-License-Identifier: Apache-2.0
"""Writes many faults into one tree: each piece of code that a fault changes stands there as it is and once more for
each fault, and a number in the environment chooses at run time (mutate.py --together).

The piece is as small as the grammar allows. A fault has several forms, from the smallest piece to the rest of the
outermost block; the next is tried if one does not compile."""
from __future__ import annotations

import os
import pathlib
import re
from dataclasses import dataclass, field

from sources import Sources, place_of
from statements import Code

VARIABLE = "GSNAV_FAULT"  # of the environment: the number of the fault, or 0
HEADER = "gsnav_fault.hpp"  # included before all else
HEADER_TEXT = f"""#pragma once
#include <cstdlib>
inline const int gsnav_fault = [] {{
  const char* const number = std::getenv("{VARIABLE}");
  return number != nullptr ? std::atoi(number) : 0;
}}();
#define GSNAV_FAULT(number) (!__builtin_is_constant_evaluated() && gsnav_fault == (number))
"""


@dataclass(frozen=True)
class Form:
    """A piece of a file, and how it is written twice."""
    begin: int  # in the text
    end: int
    kind: str  # "statements", "condition", or "value", of a type or of its own
    type: str = ""

    def written(self, original: str, copies: list[tuple[int, str]]) -> str:
        if self.kind == "statements":
            chosen = "".join(f"if (GSNAV_FAULT({n})) {{{marked(n, c)}}} else " for n, c in copies)
            return f"{{ {chosen}{{\n{original}\n}} }}"
        if self.kind == "value" and not self.type:
            # Its returns have to be of one type.
            chosen = "".join(f"if (GSNAV_FAULT({n})) return {marked(n, c)}; " for n, c in copies)
            return f"[&]() __attribute__((always_inline)) {{ {chosen}return {original}; }}()"
        cast = f"static_cast<{self.type or 'bool'}>"
        chosen = "".join(f"GSNAV_FAULT({n}) ? {cast}({marked(n, c)}) : " for n, c in copies)
        return f"({chosen}{cast}({original}))"


def marked(number: int, text: str) -> str:
    """On lines of its own, for what a compiler says."""
    return f"/*<{number}*/\n{text}\n/*{number}>*/"


def forms_of(code: Code, begin: int, end: int, new: str) -> list[Form]:
    """How a file can hold the code from begin to end both as it is and as `new`, in the order in which to try."""
    first, last = code.covering(begin, end)
    found = []

    def add(piece, kind, type_=""):
        form = Form(code.tokens.begins[piece[0]], code.tokens.ends[piece[1]], kind, type_)
        edited = Code(code.text[form.begin:begin] + new + code.text[end:form.end])
        whole = edited.balanced and (kind in ("run", "statements") or ";" not in at_top(edited))
        if whole and (kind != "run" or edited.declares_nothing(0, len(edited.words) - 1)):
            found.append(Form(form.begin, form.end, "statements" if kind == "run" else kind, type_))

    blocks = [b for b in code.blocks_around(first) if last < code.closes[b]]
    if not blocks:
        if argument := code.argument_around(first, last):
            add(argument, "value")
        return found
    run = code.run_around(blocks[0], first, last)
    if code.word(run[0]) in ("if", "while", "for") and code.word(run[0] + 1) != "constexpr":
        if condition := code.condition_around(first, last):
            add(condition, "condition")
    if initialiser := code.initialiser_around(run[0], first, last):
        type_, *value = initialiser
        add(value, "value", "" if type_ == "auto" else type_)
    if code.declares_nothing(*run):
        add(run, "run")
    for block in blocks:
        run = code.run_around(block, first, last)
        run = next(s for s in code.statements(block + 1, code.closes[block] - 1) if s[1] >= run[0])
        add((run[0], code.closes[block] - 1), "statements")
    return list(dict.fromkeys(found))


def trimmed(code: Code, begin: int, end: int, new: str) -> tuple[int, int, str]:
    """An edit without the tokens that it begins and ends with before and after; one token of the file is left."""
    first, last = code.covering(begin, end)
    after = Code(new)
    i, j = 0, len(after.words)
    while first < last and i < j and code.word(first) == after.word(i):
        first, i = first + 1, i + 1
    while first < last and i < j and code.word(last) == after.word(j - 1):
        last, j = last - 1, j - 1
    left = new[after.tokens.begins[i]:after.tokens.ends[j - 1]] if i < j else ""
    return code.tokens.begins[first], code.tokens.ends[last], left


def at_top(code: Code) -> list[str]:
    return [w for w, p in zip(code.words, code.parent) if p < 0]


@dataclass(eq=False)
class Change:
    """An edit of a fault: its place and its forms."""
    number: int
    begin: int
    end: int
    new: str
    forms: list[Form] = field(default_factory=list)
    tried: int = 0

    @property
    def form(self) -> Form:
        return self.forms[self.tried]


class Switched:
    """A tree that holds many faults at once. A fault with a number is in it; the others have none."""

    def __init__(self, tree: pathlib.Path, faults):
        self.tree, self.numbers, self.names = tree, {}, {}
        self.changes: dict[pathlib.Path, list[Change]] = {}
        self.out: dict[str, str] = {}  # why a fault is not in the tree
        sources = Sources(tree)
        self.texts, codes = sources.texts, {}
        for number, fault in enumerate(faults, 1):
            self.names[number] = fault.name
            changes = []
            for e in fault.edits:
                place, why = place_of(sources, e)
                if place is None:
                    self.out[fault.name] = why
                    break
                file, *edit = place
                if file not in codes:
                    codes[file] = Code(self.texts[file])
                edit = trimmed(codes[file], *edit, e.new)
                forms = forms_of(codes[file], *edit) if codes[file].balanced else []
                if not forms:
                    self.out[fault.name] = "outside of what can stand twice"
                    break
                changes.append((file, Change(number, *edit, forms)))
            else:
                self.numbers[fault.name] = number
                for file, change in changes:
                    self.changes.setdefault(file, []).append(change)
        (tree / HEADER).write_text(HEADER_TEXT)
        for file in list(self.changes):
            self.write(file)

    def write(self, file: pathlib.Path):
        """A file with all its faults."""
        while crossing := next(iter(self._crossing(file)), None):
            self._try_next(crossing)
        text = self._written(file, 0, len(self.texts[file]), self.changes[file])
        if text != file.read_text():
            file.write_text(text)

    def _crossing(self, file):
        spans = [(c.form.begin, c.form.end, c) for c in self.changes[file]]
        return (c for b, e, c in spans for b2, e2, _ in spans if b < b2 < e < e2)

    def _written(self, file, begin: int, end: int, changes: list[Change]) -> str:
        """The text from begin to end with the forms that lie in it."""
        text, at, out = self.texts[file], begin, []
        forms = sorted({c.form for c in changes}, key=lambda f: (f.begin, -f.end, f.kind != "statements"))
        for form in forms:
            if form.begin < at:  # within the one before
                continue
            inner = [c for c in changes if c.form != form and form.begin <= c.form.begin and c.form.end <= form.end]
            numbers = dict.fromkeys(c.number for c in changes if c.form == form)
            copies = [(n, edited(text, form, [c for c in changes if c.number == n])) for n in numbers]
            original = self._written(file, form.begin, form.end, inner)
            out += [text[at:form.begin], form.written(original, copies)]
            at = form.end
        return "".join([*out, text[at:end]])

    def blamed(self, said: str) -> list[Change]:
        """The edits in whose lines a compiler found an error, or from whose lines it came there, or else those in the
        files with errors."""
        errors = self._places(r"^([^\s:]+):(\d+):\d+: (?:fatal )?error", said)
        ways = self._places(r"^([^\s:]+):(\d+):\d+: ", said)
        return (self._changes_at(errors) or self._changes_at(ways)
                or [c for f in errors for c in self.changes.get(f, ())])

    def try_next(self, changes: set[Change]):
        """The next form of some edits. A fault without one leaves the tree."""
        for change in changes:
            self._try_next(change)
        for file in self.changes:
            self.write(file)

    def _try_next(self, change: Change):
        change.tried += 1
        name = self.names[change.number]
        if change.tried < len(change.forms) or name not in self.numbers:
            return
        self.out[name] = "does not compile beside the code as it is"
        del self.numbers[name]
        for f, changes in self.changes.items():
            self.changes[f] = [c for c in changes if c.number != change.number]

    def _places(self, pattern: str, said: str) -> dict[pathlib.Path, set[int]]:
        """Lines that a compiler named, per file."""
        lines: dict[pathlib.Path, set[int]] = {}
        for name, line in re.findall(pattern, said, re.MULTILINE):
            lines.setdefault(self.tree / os.path.normpath(name.removeprefix("rewritten/")), set()).add(int(line))
        return lines

    def _changes_at(self, lines) -> list[Change]:
        return [c for f in lines for c in self.changes.get(f, ()) if lines[f] & self._lines_of(f, c.number)]

    @staticmethod
    def _lines_of(file, number: int) -> set[int]:
        text = file.read_text()
        return {line for m in re.finditer(rf"/\*<{number}\*/.*?/\*{number}>\*/", text, re.DOTALL)
                for line in range(text.count("\n", 0, m.start()) + 1, text.count("\n", 0, m.end()) + 2)}


def edited(text: str, form: Form, changes: list[Change]) -> str:
    """The piece of a form with the edits of one fault."""
    at, out = form.begin, []
    for c in sorted((c for c in changes if form.begin <= c.begin and c.end <= form.end), key=lambda c: c.begin):
        out += [text[at:c.begin], c.new]
        at = c.end
    return "".join([*out, text[at:form.end]])
