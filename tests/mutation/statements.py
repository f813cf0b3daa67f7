# SPDX-License-Identifier: Apache-2.0
"""Brackets, blocks and statements of C++: the pieces of a file that may hold code twice, to choose at run time."""
from __future__ import annotations

import re

from sources import Tokens

CLOSING = {"(": ")", "{": "}", "[": "]"}
WITH_CONDITION = ("if", "for", "while", "switch", "catch")
BEFORE_BODY = ("else", "do", "try", "const", "noexcept", "mutable")
ASSIGNMENTS = ("=", "+=", "-=", "*=", "/=", "%=", "|=", "&=", "^=", "<<=", ">>=")
DECLARES = ("auto", "const", "constexpr", "static", "using", "typedef", "struct", "class", "enum", "union", "template",
            "case", "default", "goto", "thread_local", "extern", "unsigned", "typename", "alignas", "static_assert")
BEGINS_STATEMENT = ("if", "for", "while", "switch", "do", "try", "return", "break", "continue", "throw", "delete", "++",
                    "--", "*", "(", "{", ";")
TYPE_TOKEN = re.compile(r"[A-Za-z_]\w*|::|<|>|>>|,|\*|&|\d+u?")


class Code:
    """The tokens of a text with their brackets."""

    def __init__(self, text: str):
        self.tokens = Tokens(text)
        self.text, self.words = text, self.tokens.words
        self.closes: dict[int, int] = {}
        self.opens: dict[int, int] = {}
        self.parent: list[int] = []  # the innermost open bracket, or -1
        stack: list[int] = []
        self.balanced = True
        for i, w in enumerate(self.words):
            if w in CLOSING.values():
                if not stack or CLOSING[self.words[stack[-1]]] != w:
                    self.balanced = False
                    return
                self.closes[stack[-1]], self.opens[i] = i, stack[-1]
                stack.pop()
            self.parent.append(stack[-1] if stack else -1)
            if w in CLOSING:
                stack.append(i)
        self.balanced = not stack

    def word(self, i: int) -> str:
        return self.words[i] if 0 <= i < len(self.words) else ""

    def is_name(self, i: int) -> bool:
        return re.fullmatch(r"[A-Za-z_]\w*", self.word(i)) is not None

    def covering(self, begin: int, end: int) -> tuple[int, int]:
        """The first and the last token of a piece of the text."""
        inside = [i for i in range(len(self.words)) if begin <= self.tokens.begins[i] and self.tokens.ends[i] <= end]
        return inside[0], inside[-1]

    def is_block(self, i: int) -> bool:
        """Whether the brace at token i begins statements, as far as the tokens before it tell."""
        before = self.word(i - 1)
        if before == ")":
            return self.word(self.opens[i - 1] - 1) != "switch"
        if before in BEFORE_BODY:
            return True
        if before in (";", "{", "}", ":"):
            outer = self.parent[i]
            return outer >= 0 and self.word(outer) == "{" and (self.is_block(outer) or self.is_switch(outer))
        if before == "]":
            opened = self.opens[i - 1]
            if self.word(opened + 1) == "[":  # an attribute
                return self.word(opened - 1) in (")", "else")
            return not self.is_name(opened - 1) or self.word(opened - 1) == "return"
        j = i - 1
        while TYPE_TOKEN.fullmatch(self.word(j)):
            j -= 1
        if self.word(j) == "->":  # the type of what a lambda returns
            return self.word(j - 1) in (")", *BEFORE_BODY) or self.word(j - 1).isupper()
        names = self.words[j + 1:i]
        return self.word(j) == ")" and all(re.fullmatch(r"[A-Z_]+|final|override|noexcept|const", n) for n in names)

    def is_switch(self, i: int) -> bool:
        return self.word(i - 1) == ")" and self.word(self.opens[i - 1] - 1) == "switch"

    def blocks_around(self, i: int) -> list[int]:
        """The braces of statements that token i stands in, from inside."""
        found = []
        while (i := self.parent[i]) >= 0:
            if self.word(i) == "{" and self.is_block(i):
                found.append(i)
        return found

    def end_of(self, i: int) -> int:
        """The last token of the statement that begins at token i."""
        w = self.word(i)
        if w == "{":
            return self.closes[i]
        if w in WITH_CONDITION:
            end = self.end_of(self.behind_condition(i))
            return self.end_of(end + 2) if w == "if" and self.word(end + 1) == "else" else end
        if w == "do":
            return self.closes[self.end_of(i + 1) + 2] + 1
        if w == "try":
            end = self.closes[i + 1]
            while self.word(end + 1) == "catch":
                end = self.end_of(end + 1)
            return end
        if w == "#":
            line_end = re.compile(r"(?<!\\)\n|$").search(self.text, self.tokens.begins[i]).start()
            while i + 1 < len(self.words) and self.tokens.begins[i + 1] < line_end:
                i += 1
            return i
        last = ":" if w in ("case", "default") else ";"
        while self.word(i) not in (last, ""):
            i = self.closes.get(i, i) + 1
        return i

    def behind_condition(self, i: int) -> int:
        """The first token of what an if or a loop at token i governs."""
        i += 2 if self.word(i + 1) == "constexpr" else 1
        i = self.closes[i] + 1
        return self.closes[i] + 1 if self.word(i) == "[" and self.word(i + 1) == "[" else i

    def statements(self, first: int, last: int) -> list[tuple[int, int]]:
        """The statements from token first to token last: the first and last token of each."""
        found = []
        while first <= last:
            end = self.end_of(first)
            found.append((first, end))
            first = end + 1
        return found

    def run_around(self, block: int, first: int, last: int) -> tuple[int, int]:
        """The least run of whole statements of a block that holds tokens first to last. A statement that an if or a
        loop governs is one, with braces or without."""
        run = [s for s in self.statements(block + 1, self.closes[block] - 1) if s[1] >= first and s[0] <= last]
        begin, end = run[0][0], run[-1][1]
        while len(run) == 1 and (governed := self.governed_around(begin, first, last)):
            begin, end = governed
        return begin, end

    def governed_around(self, i: int, first: int, last: int):
        """The statement below the one at token i that holds tokens first to last, or None."""
        parts = []
        if self.word(i) in WITH_CONDITION:
            parts.append(self.behind_condition(i))
            end = self.end_of(parts[0])
            if self.word(i) == "if" and self.word(end + 1) == "else":
                parts.append(end + 2)
        whole = [(p, self.end_of(p)) for p in parts]
        return next(((b, e) for b, e in whole if b <= first and last <= e and self.word(b) != "{"), None)

    def declares_nothing(self, first: int, last: int) -> bool:
        """Whether no statement from token first to last is a declaration, as far as its tokens tell."""
        return all(self._is_expression(b, e) for b, e in self.statements(first, last))

    def _is_expression(self, i: int, end: int) -> bool:
        if self.word(i) in BEGINS_STATEMENT:
            return True
        if self.word(i) in DECLARES or not self.is_name(i):
            return False
        i += 1
        while i <= end:
            w = self.word(i)
            if w in ASSIGNMENTS or w in ("++", "--"):
                return True
            if w == ";":
                return self.word(i - 1) == ")"
            if w in ("(", "["):
                i = self.closes[i] + 1
            elif w in (".", "->", "::") and self.is_name(i + 1):
                i += 2
            else:
                return False
        return False

    def condition_around(self, first: int, last: int):
        """The condition of an `if` or a loop that holds tokens first to last, or None: its first and last token."""
        opened = self.parent[first]
        if opened < 0 or self.word(opened) != "(" or self.closes[opened] < last:
            return None
        begin, end, keyword = opened + 1, self.closes[opened] - 1, self.word(opened - 1)
        if keyword == "for":
            cuts = [i for i in range(begin, end) if self.word(i) == ";" and self.parent[i] == opened]
            if len(cuts) != 2 or not cuts[0] < first or not last < cuts[1]:
                return None
            return cuts[0] + 1, cuts[1] - 1
        return (begin, end) if keyword in ("if", "while") else None

    def initialiser_around(self, begin: int, first: int, last: int):
        """(type, first and last token of the value) where the statement at token begin is `type name = value;`, perhaps
        with further names, and tokens first to last stand in one value; or None."""
        i = begin + (self.word(begin) == "const")
        at = i
        if not self.is_name(i) or self.word(i) in {*DECLARES, *BEGINS_STATEMENT} - {"auto"}:
            return None
        i += 1
        while self.word(i) == "::" and self.is_name(i + 1):
            i += 2
        if self.word(i) == "<":
            depth = 1
            while depth > 0:
                i += 1
                depth += {"<": 1, ">": -1}.get(self.word(i), 0)
                if not TYPE_TOKEN.fullmatch(self.word(i)):
                    return None
            i += 1
        type_ = " ".join(self.words[at:i])
        if type_ == "auto" and self.word(i) == "[":
            i = self.closes[i]
        elif not self.is_name(i):
            return None
        if self.word(i + 1) != "=" or self.word(i + 2) == "{":
            return None
        return self._value_of(type_, begin, i + 2, first, last)

    def _value_of(self, type_: str, begin: int, i: int, first: int, last: int):
        """Of the values from token i, the one that holds tokens first to last."""
        end, cuts = self.end_of(begin), [i - 1]
        level = [j for j in range(i, end) if self.parent[j] == self.parent[begin]]
        angles = any(self.word(j) in ("<", ">") for j in level)
        commas = [j for j in level if self.word(j) == ","]
        if commas and (angles or type_ == "auto"):
            return None
        for c in commas:
            if not self.is_name(c + 1) or self.word(c + 2) != "=":
                return None
        cuts += [c + 2 for c in commas]
        for cut, stop in zip(cuts, [*commas, end]):
            if cut < first and last < stop and self.word(cut + 1) != "{":
                return type_, cut + 1, stop - 1
        return None

    def argument_around(self, first: int, last: int):
        """The whole argument, or member's initialiser in parentheses, that holds tokens first to last, or None."""
        opened = self.parent[first]
        if opened < 0 or self.word(opened) not in ("(", "{") or self.closes[opened] < last:
            return None
        begin, end = opened + 1, self.closes[opened] - 1
        level = [i for i in range(begin, end + 1) if self.parent[i] == opened]
        if any(self.word(i) in ("<", ">", ";") for i in level):
            return None
        commas = [i for i in level if self.word(i) == ","]
        begin = max([begin, *(c + 1 for c in commas if c < first)])
        end = min([end, *(c - 1 for c in commas if c > last)])
        return (begin, end) if not any(begin <= c <= end for c in commas) else None
