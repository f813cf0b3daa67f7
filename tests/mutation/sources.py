# SPDX-License-Identifier: Apache-2.0
"""Finds code by the function that it stands in and by its tokens: moved files, line breaks and comments do not
matter."""
from __future__ import annotations

import bisect
import pathlib
import re

SUFFIXES = (".hpp", ".cpp", ".cu", ".cuh")
FOLDERS = ("include", "backends", "src")

_TOKEN = re.compile(
    r"""(?P<skip>\s+|//[^\n]*|/\*.*?\*/)
      | (?P<token>[A-Za-z_]\w*
          | \.?\d(?:[eEpP][+-]|[\w.'])*
          | "(?:[^"\\\n]|\\.)*" | '(?:[^'\\\n]|\\.)*'
          | <<=|>>=|->\*|\.\.\.|::|->|\+\+|--|<<|<=|>=|==|!=|&&|\|\||[-+*/%&|^]=
          | .)""", re.DOTALL | re.VERBOSE)


class Tokens:
    """The tokens of a text and where each begins and ends."""

    def __init__(self, text: str):
        self.text, self.words, self.begins, self.ends = text, [], [], []
        for m in _TOKEN.finditer(text):
            if m.lastgroup == "token":
                self.words.append(m.group("token"))
                self.begins.append(m.start())
                self.ends.append(m.end())
        self.places: dict[str, list[int]] = {}
        for i, w in enumerate(self.words):
            self.places.setdefault(w, []).append(i)

    def closing(self, i: int) -> int:
        """The token that closes the bracket at token i, or the number of tokens."""
        pairs = {"(": ")", "{": "}", "[": "]"}
        opened, closed, depth = self.words[i], pairs[self.words[i]], 0
        for j in range(i, len(self.words)):
            depth += (self.words[j] == opened) - (self.words[j] == closed)
            if depth == 0:
                return j
        return len(self.words)

    def bodies(self, name: str):
        """(first, last) tokens of each definition of a function, struct, enum or constant of this name: from its
        name to the closing brace or semicolon."""
        for i in self.places.get(name, ()):
            before = self.words[i - 1] if i else ""
            j = i + 1
            if j < len(self.words) and self.words[j] == "=":  # a constant
                yield i, self.words.index(";", j)
                continue
            if before in ("struct", "class", "enum", "namespace"):
                while j < len(self.words) and self.words[j] not in "{;(=":
                    j += 1
            elif j < len(self.words) and self.words[j] == "(" and before not in (".", "->", "return", "="):
                j = self._body(self.closing(j) + 1)
            else:
                continue
            if j < len(self.words) and self.words[j] == "{":
                yield i, self.closing(j)

    def _body(self, j: int) -> int:
        """From behind a parameter list to the opening brace of the body, or to a token that is none."""
        initialisers = False
        while j < len(self.words):
            w = self.words[j]
            if w == "{":
                # A member's initialiser in braces is followed by another or by the body.
                if not initialisers or self.words[j - 1] in (")", "}"):
                    return j
                j = self.closing(j) + 1
            elif w == "(":
                j = self.closing(j) + 1
            elif w == ":":
                initialisers = True
                j += 1
            elif w in (";", "=", ")", "]", "}") or (w == "," and not initialisers):
                return j
            else:
                j += 1
        return j

    def find(self, pattern: list[str], first: int, last: int) -> list[tuple[int, int]]:
        """Where a run of tokens stands within tokens first to last: (begin, end) in the text."""
        found = []
        places = self.places.get(pattern[0], [])
        for i in places[bisect.bisect_left(places, first):bisect.bisect_right(places, last)]:
            if i + len(pattern) - 1 <= last and self.words[i:i + len(pattern)] == pattern:
                found.append((self.begins[i], self.ends[i + len(pattern) - 1]))
        return found


class Sources:
    """The library's files below a folder, read when asked for."""

    def __init__(self, root: pathlib.Path):
        self.texts = {f: f.read_text() for d in FOLDERS for f in sorted((root / d).rglob("*"))
                      if f.suffix in SUFFIXES}
        self.tokens: dict[pathlib.Path, Tokens] = {}

    def tokens_of(self, file: pathlib.Path) -> Tokens:
        if file not in self.tokens:
            self.tokens[file] = Tokens(self.texts[file])
        return self.tokens[file]

    def find(self, function: str, old: str) -> list[tuple[pathlib.Path, int, int]]:
        """Each place of `old` in a definition of `function`: file, begin and end in its text. `function` may name what
        it stands in before it: "Cells::add" is the `add` within the definition of `Cells`."""
        pattern = Tokens(old).words
        *outer, name = function.split("::")
        found = set()
        for file, text in self.texts.items():
            if any(part not in text for part in (*outer, name)):
                continue
            tokens = self.tokens_of(file)
            scopes = [(0, len(tokens.words) - 1)]
            for part in outer:
                scopes = [b for b in tokens.bodies(part) if any(s[0] <= b[0] and b[1] <= s[1] for s in scopes)]
            for body in tokens.bodies(name):
                if any(s[0] <= body[0] and body[1] <= s[1] for s in scopes):
                    found.update((file, *place) for place in tokens.find(pattern, *body))
        return sorted(found)


def place_of(sources: Sources, edit):
    """(file, begin, end) of the tokens to replace, or why there is no such place."""
    found = sources.find(edit.function, edit.old)
    if len(found) == 1:
        return found[0], ""
    return None, f"{edit.function} holds {len(found)} times: {edit.old.strip().splitlines()[0]}"
