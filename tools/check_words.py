#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the wording of pages, comments and messages against the style rules in CONTRIBUTING.md.

Reads Markdown, the text of SVG files, comments of C++ (// in raw strings too), CUDA, Python, shell and CMake,
Python docstrings, and string literals of at least four words outside tests/ (help texts and messages). Skips
code, inline code, link targets and quotations of up to three words.

usage: check_words.py                 check the folders that must be clean (CLEAN in this script)
       check_words.py PATH...         check these files and folders
       check_words.py --all           check the whole tree
options:
       --rules columns,who,...        report these rules only (--list shows them)
       --goal                         report sentences over 25 words too, as rule 'goal'
       --count                        print the number of findings per folder and rule instead of lines
       --root FOLDER                  the tree to check (default: this script's, else the current folder)
       --list                         print the rules

Each finding is one line, 'file:line: rule: text'. The exit status is 1 if there are any. Lines that must
stay are listed in tools/check_words_exceptions.txt, each with a reason.
"""
import argparse
import bisect
import collections
import html
import io
import pathlib
import re
import sys
import tokenize

# Files and folders without findings. A path is added once it is clean, and no finding may come back.
CLEAN = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", ".ci", ".github", "backends", "bindings", "cmake",
         "docs", "examples", "include", "src", "bench", "tests/site", "tests/words", "tools")
# Files that quote what this script looks for.
SKIPPED = {"tools/check_words.py", "tests/words/test_check_words.py"}
MOST_COLUMNS, MOST_COLUMNS_OF_SCRIPTS = 105, 120
MOST_WORDS, GOAL_WORDS, MOST_WORDS_OF_COMMENT = 30, 25, 45
CPP = {".hpp", ".cpp", ".cu", ".cuh", ".h", ".inl"}
RULES = {
    "columns": f"a line of text or comment has at most {MOST_COLUMNS} columns, in scripts {MOST_COLUMNS_OF_SCRIPTS}",
    "sentence": f"a sentence of a page has at most {MOST_WORDS} words, one of a comment {MOST_WORDS_OF_COMMENT}",
    "goal": f"with --goal: a sentence has at most {GOAL_WORDS} words",
    "colon": "a sentence has at most one colon",
    "what": "no clause as a noun: 'a chunk whose bounds are not finite', not 'what is not finite'",
    "who": "'who' follows a person: 'callers that ask for ...', not 'who asks for ...'",
    "person": "data are not persons: no 'one who', 'whoever', 'nobody', 'others get'",
    "per": "'3 ms per frame', not '3 ms a frame'",
    "many": "a number has a name: '64 rows at a time', not 'so many rows'; 'as many as' needs a noun",
    "same": "'the same' names what it is the same as: 'the same holds for meshes', not 'the same holds here'",
    "possessive": "a noun follows 's: 'the scene's images', not 'they are the scene's'; no 'ours', 'theirs'",
    "beside": "'compared with' or 'next to', where two things are compared; a file may lie beside another",
    "of": "a sentence starts with its subject, not with 'Of ...'",
    "old": "plain words: no 'whence', 'lest', 'therein', 'but for', 'can be had', 'as the table has it'",
    "history": "what the code did before belongs in the changelog, what was tried in the notes",
}

UNIT = (r"(?:frame|pixel|tile|row|column|camera|second|minute|hour|episode|thread|core|lane|warp|block|splat|"
        r"gaussian|triangle|voxel|vertex|chunk|slice|byte|view|image|sensor|environment|call|axis|channel|node|joint|"
        r"level|batch|ray|scene|avatar|agent|person|metre|layer|kernel|backend|file|line|cell|set|walker|sample|action|"
        r"step|process|policy|body|capsule|setting|measurement|device|GPU|worker|world|mesh|query|path|run|side)")
SIZE_OR_TIME = r"(?:ms|us|ns|milliseconds?|microseconds?|nanoseconds?|seconds|bytes|[KMG]i?B)"
COUNTED = (r"(?:[Gg]aussians|pixels|triangles|voxels|threads|registers|allocations|multiplications|additions|times|"
           r"actions|values|influences|collisions|cameras|bones|episodes|environments|agents|floats|vertices|faces|"
           r"chunks|tiles|capsules|joints|queries|rays|kernels|sensors|walkers|evaluations|weights|[Tt]imed runs|"
           r"[Vv]iews(?= a scene[,;:)]))")
NUMBER = r"(?<![\w.-])(?:\d[\d.,/x]*(?<![.,/])|%[\d.]*(?:d|f|g|zu|u|ll[du])|\{[^{}\s]*\})"
PERSONS = (r"(?i:people|persons?|users?|agents?|avatars?|walkers?|readers?|authors?|researchers?|engineers?|"
           r"developers?|contributors?|maintainers?|pedestrians?|reviewers?|actors?|teams?|those|anyone|someone|"
           r"everyone|everybody|somebody|nobody|strangers?|bystanders?|observers?|humans?)")
ASKS = (r"(?:sa(?:y|ys|id)|tells?|told|prints?|shows?|shown|knows?|sees?|asks?|decides?|checks?|explains?|describes?|"
        r"names?|reports?|lists?|exactly|just|about|learns?|finds? out|depends? on|records?|states?|compares?|defines?|"
        r"note[sd]?|matters?)")
VERB = (r"(?:is|are|was|were|has|have|had|does|do|can|cannot|may|must|will|would|should|lies?|comes?|goes|stands?|"
        r"remains?|follows|needs?|makes|holds?|differs?|belongs?|changes|moves|falls|begins|ends|takes|costs|gives)")
WHAT_SUBJECT = (r"(?:an?|the|its?|they|this|these|those|each|every|one|no|all|earlier|later|others?|you|we|their|our|"
                r"your|both|some|such|most|many|Q+)")
BEFORE_NOUN = r"(?:of|from|with|by|for|to|in|on|than|behind|beyond|into|as|at|over|under|and|or|but|that)"

SMALL = r"(?:for|of|in|by|as|than|or|and|on|to|with|at|from|per|if|when|where|is|are|into|against|is|has|have|without)"
NO_VERB = r"(?! (?:is|are|has|have|was|were|may|can|that|which|apart|away|ago|later|long|wide|high|too|takes|needs)\b)"

ALIKE = r"(?:\b(?:both|all|any|every|two|three|four|\d+) .*\b|\bwhether .*\b|\bnot )(?:are|is|be|have|has) the same"

# rule -> patterns. In the text inline code is a run of Q.
DEVICES = {
    "what": [
        rf"(?:^|(?<=[;:,(] ))[Ww]hat {VERB}\b(?![^.?!]*\?)", rf"^What {WHAT_SUBJECT} (?![^.?!]*\?)",
        rf"(?<!\w)(?!{ASKS}\b)[\w-]+,? what {VERB}\b(?![^.?!]*\?)",
        rf"\b(?<!depends )(?<!depend )(?<!based ){BEFORE_NOUN} what (?:{WHAT_SUBJECT} )?\w",
        r"^Whose\b(?![^.?!]*\?)", r"\bwhose most\b"],
    "who": [r"(?:^|(?<=[;:(] ))[Ww]ho (?!it is|this is|owns what)[\w-]+(?![^.?!]*\?)",
            rf"^(?!.*\b{PERSONS}\b.* who)(?:.*[^\w-])?(?!(?:{ASKS}|and|or|as)\b,?)[\w-]+,? who (?!it is)\w+"],
    "person": [r"\b[Oo]nes? who\b", r"\b[Ww]ho(?:m)?ever\b", r"\b[Nn]obody(?:'s)?\b", r"\b[Nn]o one\b",
               r"\b[Ss]omebody\b", r"\b[Ee]verybody\b", r"\b[Oo]thers (?:get|go|take|keep|find|know|want|ask|wait)\b",
               r"\b(?:knows?|knew) nothing\b", r"\b[Rr]eaders? wants?\b",
               r"\b(?:header|file|format|reader|kernel) promises?\b",
               rf"^(?!.*\b(?:{PERSONS}|who|you|we|they|I)\b.* want).*\bwants?\b",
               r"\b(?:[Hh]e|[Ss]he|[Hh]is|[Hh]er|[Hh]im)\b"],
    "per": [rf"{NUMBER}(?: (?!{SMALL}\b)[\w-]+)? an? {UNIT}\b{NO_VERB}",
            rf"\b{SIZE_OR_TIME} an? (?!few\b|little\b)[a-zA-Z][\w-]*{NO_VERB}",
            rf"\b{COUNTED} an? {UNIT}\b{NO_VERB}", r"\bframes a (?:second|minute|hour)\b",
            rf"\b(?:one|once|twice|two|three|four)(?: (?!{SMALL}\b)[\w-]+)? an? {UNIT}(?=[.,;:)]|$)",
            rf"^(?:An?|One|Two|Three|Four) (?!{SMALL}\b)[\w-]+ an? {UNIT} (?:is|are|was|were|runs?)\b"],
    "many": [r"\b[Ss]o (?:many|much)\b(?!.*\bthat\b)", r"\b[Aa]s (?:many|much)(?= as\b|[.,;:)]|$| of\b| at\b)",
             r"\b[Aa]s (?:many|much) (?!.* as\b)"],
    "same": [r"\b[Tt]he same (?:holds?|is true|goes|applies|here|there)\b(?! (?:for|of|to|with|in) )",
             rf"^(?!.*{ALIKE}).*\b[Tt]he same(?=[.,;:)]|$| again\b)", r"\ball the same(?! \w)",
             r"^[Tt]he same [\w-]+[.;]?$",
             r"^[Tt]he same [\w-]+ (?:comes?|returns?|results?|follows?|appears?)(?: back| out)?[.;]?$"],
    "possessive": [r"\w's(?=[.;:,)]|$)", r"\b(?:[Oo]urs|[Tt]heirs)\b"],
    "beside": [r"\b(?:fast|slow|small|large|cheap|good|better|worse)(?:er)?\b[\w ,]{0,20} beside\b",
               r"\b[Bb]eside (?:(?:the )?(?:CPUs?|GPUs?|best|fast|exact)|without|those of|Detour|gsplat|Habitat|itself|"
               r"another(?=[.,;)]|$)|\d+)\b"],
    "of": [r"^Of (?!course\b)", r"\b(?:is|are) of (?:\d|two|three|four)", r"\bone is as\b"],
    "old": [r"\b(?:[Ww]hence|[Tt]hence|[Ww]herein|[Ww]hereof|[Tt]hereof|[Tt]herein|[Tt]hereby|[Ll]est|[Aa]ught|"
            r"[Ff]orthwith)\b", r"\bbut for\b", r"\bas [\w ]{1,40} (?:has|have) it\b",
            r"\b(?:to|can|could) be had\b", r"\bas ever\b"],
    "history": [r"\btried (?:and|but) (?:not|dropped|given)", r"\b(?:was|were|is) formerly\b",
                r"(?<!is )(?<!are )\bused to (?:be|have|take|do|give|go|make)\b", r"\bin earlier versions\b",
                r"\b[Pp]reviously\b", r"\b(?:was|were) [\w-]+ once\b", r"\b[Ff]ormerly\b", r"\bonce (?:was|were|had)\b",
               r"\b(?:was|were) once\b", r"\b[Ww]e (?:tried|dropped)\b",
                r"^(?:This|It|They|We|The [\w-]+|[A-Z]\w+s) no longer\b",
               r"\b(?:[Ii]n|[Bb]efore|[Uu]ntil) version \d[\d.]*,? (?:.* )?(?:was|were|had)\b",
                r"\b(?:was|were|had)\b.* in (?:version|release) \d",
                r"\b(?:was|were) \d[\d.]*(?:, \d[\d.]*)* and \d",
                r"^(?:It|They|The [\w-]+) (?:was|were) (?!(?:\w+(?:ed|en|t|n|nd|de|ld|id)|read)\b)\w+[.;]?$"],
}
DEVICES = {rule: [re.compile(p) for p in patterns] for rule, patterns in DEVICES.items()}
ABBREVIATION = re.compile(r"(?:\b(?:e\.g|i\.e|vs|etc|cf|Fig|Eq|Sec|No|approx|al|resp|incl|max|min)|^\W*\d+|\b[A-Z])$")
SENTENCE_END = re.compile(r"[.!?][\"')\]*_]*\s+")
INLINE_CODE = re.compile(r"(`+)(?!`).*?(?<!`)\1(?!`)|(?<!\w)\"[^\s\"]{1,60}(?: [^\s\"]+){0,2}\"(?!\w)")
LINK = re.compile(r"\]\([^)\s]*(?: \"[^\"]*\")?\)|<?https?://[^\s>)]+>?")
LIST_ITEM = re.compile(r"\s*(?:[-*+]|\d+[.)])\s+|\s*-{1,2}\w")
Finding = collections.namedtuple("Finding", "path line rule text")


class Paragraph:
    """Consecutive lines that are one text. `kind` is page, heading, cell, comment or string."""

    def __init__(self, kind):
        self.kind, self.starts, self.numbers, self.parts, self.length = kind, [], [], [], 0

    def add(self, number, text):
        self.starts.append(self.length)
        self.numbers.append(number)
        self.parts.append(text.strip())
        self.length += len(self.parts[-1]) + 1

    def text(self):
        return " ".join(self.parts)

    def line(self, offset):
        return self.numbers[max(bisect.bisect_right(self.starts, offset) - 1, 0)]


def plain(text):
    """The text with inline code as runs of Q and links without their targets, every other character in its place."""
    text = INLINE_CODE.sub(lambda m: "Q" * len(m.group()), text)
    text = LINK.sub(lambda m: ("Q" if m.group()[0] != "]" else " ") * len(m.group()), text)
    return re.sub(r"[*_\[\]](?!\w*\()|(?<=\s)\"|\"(?=\s)", " ", text) if "[" in text or "*" in text else text


def sentences(text):
    """(offset, sentence) of each, its end marks included."""
    begin = 0
    for end in SENTENCE_END.finditer(text):
        if text[end.start()] == "." and ABBREVIATION.search(text, begin, end.start()):
            continue
        yield begin, text[begin:end.end()].rstrip()
        begin = end.end()
    if text[begin:].strip():
        yield begin, text[begin:].rstrip()


def markdown(lines):
    """Paragraphs of a Markdown page, and the numbers of lines whose columns count."""
    found, current, fence, wide, code_before = [], None, "", [], False
    for number, line in enumerate(lines, 1):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark or fence:
            if mark and not fence:
                fence = mark.group(1)
            elif mark and line.strip() == fence:
                fence = ""
            current = None
            continue
        blank = not line.strip()
        if line.startswith("    ") and (current is None or code_before) and not (found and LIST_ITEM.match(line)):
            code_before = current is None
            if not (found and found[-1].kind == "item"):
                continue
        if blank or re.match(r"\s*(<!--.*|<[^>]*>|\[[^]]*\]:.*)$", line):
            current = None
            continue
        if line.lstrip().startswith("|"):
            current = None
            if re.match(r"\s*\|[\s:|-]+$", line):
                if found and found[-1].kind == "cell":
                    while found and found[-1].kind == "cell" and found[-1].numbers == [number - 1]:
                        found.pop()  # the head of a table names columns
                continue
            for cell in re.split(r"(?<!\\)\|", line.strip().strip("|")):
                if cell.strip():
                    found.append(Paragraph("cell"))
                    found[-1].add(number, cell)
            continue
        if line.startswith("#"):
            found.append(Paragraph("heading"))
            found[-1].add(number, line.lstrip("# "))
            current = None
            continue
        if not re.match(r"^[^ ]*$", line):
            wide.append(number)
        item = LIST_ITEM.match(line) if not line.lstrip().startswith("--") else None
        if current is None or item or line.lstrip().startswith(">"):
            continues = found and found[-1].kind == "item" and line.startswith("  ")
            current = Paragraph("item" if item or continues else "page")
            found.append(current)
        current.add(number, re.sub(r"^\s*(?:[-*+]|\d+[.)])\s+|^\s*>\s?", "", line))
    return found, wide


OPENS = re.compile(r"\s*\S+(?: \S+)?\s{2,}\S|\s*[@\\](?:param|return|throws|tparam|note|see|warning|brief)\b")
COMMENT_MARK = re.compile(r"^\s*(?:[-*+]|\d+[.)])\s+|^\s*[@\\](?:param(?:\[\w+\])?\s+\S+|\w+)\s*")


class Comments:
    """Collects the lines of comments as paragraphs."""

    def __init__(self):
        self.found, self.wide = [], []
        self.last = (-2, None, -1)  # line, column and indentation of the line before
        self.code = False

    def add(self, number, column, text, whole):
        """One line of a comment, without its marks; `whole` if no code stands before it."""
        if whole:
            self.wide.append(number)
        text = text.rstrip().rstrip("*/").rstrip() if text.rstrip().endswith("*/") else text.rstrip()
        bare = text.strip()
        if re.match(r"[@\\](?:code|verbatim|dot)\b|```", bare) and not (self.code and bare.startswith("```")):
            self.code = True
            self.last = (-2, None, -1)
            return
        if self.code:
            self.code = whole and not re.match(r"[@\\]end(?:code|verbatim|dot)\b|```", bare)
            return
        bare = re.sub(r"^-{2,}\s*|\s*-{3,}$|^={3,}$", "", bare)
        if not re.search(r"[A-Za-z]{2}", bare) or re.match(r"SPDX|clang-format|NOLINT|shellcheck|cmake-|!|type:", bare):
            self.last = (-2, None, -1)
            return
        indent = len(text) - len(text.lstrip())
        line_before, column_before, indent_before = self.last
        item = LIST_ITEM.match(text) or OPENS.match(text)
        if not (number == line_before + 1 and column == column_before and whole and not item and
                (indent >= indent_before or indent_before == 0 or len(self.found[-1].parts) > 1) and
                (indent <= indent_before or len(self.found[-1].parts) == 1 and self.found[-1].listed)):
            self.found.append(Paragraph("comment"))
            self.found[-1].listed = bool(item)
        self.found[-1].add(number, COMMENT_MARK.sub("", text))
        self.last = (number, column, indent)


CPP_TOKEN = re.compile(r"\b\d[\w.]*(?:'\w+)+|//[^\n]*|/\*.*?\*/|R\"([^()\s\\]{0,16})\(.*?\)\1\"|\"(?:\\.|[^\"\\\n])*\"|"
                       r"'(?:\\.|[^'\\\n])+'", re.DOTALL)


def add_string(found, text, number, joined):
    """A string literal; one that directly follows another is joined with it."""
    for k, part in enumerate(re.split(r"\\n", text)):
        if not (joined and k == 0 and found):
            found.append(Paragraph("string"))
        if part.strip():
            found[-1].add(number, re.sub(r"\\(.)", r"\1", part))


def cpp(text):
    comments, strings, before = Comments(), [], None
    newlines = [m.start() for m in re.finditer("\n", text)]
    for m in CPP_TOKEN.finditer(text):
        token = m.group()
        if token[0] not in "/\"R":
            continue
        row = bisect.bisect_left(newlines, m.start())
        begin = newlines[row - 1] + 1 if row else 0
        if token[0] == "R":  # scripts and shaders
            for k, line in enumerate(token.split("\n")):
                said = re.match(r"((?:.*\s)?)//[/!]?\s(.*)", line)
                if said:
                    comments.add(row + 1 + k, len(said.group(1)), said.group(2), not said.group(1).strip())
            continue
        if token[0] == '"':
            add_string(strings, token[1:-1], row + 1, before is not None and not text[before:m.start()].strip())
            before = m.end()
            continue
        whole = not text[begin:m.start()].strip()
        column = m.start() - begin
        if token.startswith("//"):
            comments.add(row + 1, column, re.sub(r"^//[/!]?<?\s?", "", token), whole)
        else:
            for k, line in enumerate(token[2:].split("\n")):
                mark = r"^\s*\*+(?!/)\s?<?" if k else r"^[*!]*<?\s?"
                comments.add(row + 1 + k, column, re.sub(mark, "", line), whole or k > 0)
    return comments, strings


def python(text):
    comments, strings, statement = Comments(), [], True
    try:
        tokens = list(tokenize.generate_tokens(io.StringIO(text).readline))
    except (tokenize.TokenError, IndentationError):
        return comments, strings
    for k, t in enumerate(tokens):
        if t.type == tokenize.COMMENT:
            comments.add(t.start[0], t.start[1], re.sub(r"^#+:?\s?", "", t.string), not t.line[:t.start[1]].strip())
        elif t.type == tokenize.STRING:
            raw = re.sub(r"^[A-Za-z]*(\"\"\"|'''|\"|')|(\"\"\"|'''|\"|')$", "", t.string)
            if statement and tokens[k + 1].type in (tokenize.NEWLINE, tokenize.NL):
                for n, line in enumerate(raw.split("\n")):
                    comments.add(t.start[0] + n, t.start[1], line[t.start[1]:] if n else line, True)
            elif "r" not in t.string[:2].lower().split("\"")[0] and "\n" not in raw:
                add_string(strings, raw, t.start[0], k > 0 and tokens[k - 1].type == tokenize.STRING)
        if t.type not in (tokenize.COMMENT, tokenize.NL):
            statement = t.type in (tokenize.NEWLINE, tokenize.INDENT, tokenize.DEDENT, tokenize.ENCODING)
    return comments, strings


def hashes(lines):
    """Comments of shell and CMake; here-documents are skipped."""
    comments, until = Comments(), None
    for number, line in enumerate(lines, 1):
        if until:
            until = None if line.strip() == until else until
            continue
        here = re.search(r"<<-?\s*['\"]?(\w+)['\"]?", line)
        until = here.group(1) if here and "<<<" not in line else None
        comment = re.match(r"(\s*)#(?!!)\s?(.*)", line)
        after = comment or re.match(r"((?:[^\"'#]|\"[^\"]*\"|'[^']*')*\s)#\s(.*)", line)
        if after:
            comments.add(number, len(after.group(1)), after.group(2), bool(comment))
    return comments, []


SVG_TEXT = re.compile(r"<(text|title|desc)\b([^>]*)>(.*?)</\1>", re.DOTALL)


def svg(text):
    """Text of a drawing. Lines below each other at the same x are one paragraph."""
    found, before = [], (None, 0)
    for m in SVG_TEXT.finditer(text):
        place = [re.search(rf'\b{key}="([-\d.]+)"', m.group(2)) for key in "xy"]
        x, y = (float(p.group(1)) if p else 0 for p in place)
        style = (m.group(1), x, re.sub(r'\by="[^"]*"', "", m.group(2)))
        if style != before[0] or not 0 < y - before[1] <= 20:
            found.append(Paragraph("cell"))
        words = html.unescape(re.sub(r"<[^>]*>", " ", m.group(3)))
        found[-1].add(text.count("\n", 0, m.start()) + 1, " ".join(words.split()))
        before = (style, y)
    return found


def count_words(text):
    return sum(1 for word in text.split() if re.search(r"\w", word))


def colons(text):
    return len(re.findall(r"(?<![\d:]):(?=\s|$)|(?<=\d):(?=\s)", text))


MOST_WORDS_OF = {"page": MOST_WORDS, "item": MOST_WORDS, "cell": MOST_WORDS, "comment": MOST_WORDS_OF_COMMENT}


def check_paragraph(p, goal):
    """(offset, rule, text) of each finding."""
    text = plain(p.text())
    if p.kind == "string" and count_words(text) < 4:
        return
    for offset, sentence in sentences(text):
        body = sentence.lstrip("\"'( ")
        shift = offset + len(sentence) - len(body)
        words = count_words(sentence)
        most = MOST_WORDS_OF.get(p.kind)
        if most and words > most:
            yield offset, "sentence", f"{words} words: {sentence[:60]}"
        elif most and goal and words > GOAL_WORDS:
            yield offset, "goal", f"{words} words: {sentence[:60]}"
        if p.kind not in ("string", "heading") and colons(sentence) > 1:
            yield offset, "colon", f"{colons(sentence)} colons: {sentence[:70]}"
        for rule, patterns in DEVICES.items():
            if p.kind == "heading" and rule in ("what", "who"):
                continue
            for m in (m for pattern in patterns if (m := pattern.search(body))):
                yield shift + m.start(), rule, body[max(m.start() - 25, 0):m.end() + 35]
                break


def check_text(name, text, goal=False):
    """Findings of one file, named from the root of the tree."""
    lines = text.splitlines()
    suffix, strings = pathlib.PurePath(name).suffix, []
    if suffix == ".md":
        paragraphs, wide = markdown(lines)
    elif suffix == ".svg":
        paragraphs, wide = svg(text), []
    elif name.endswith("help.txt"):
        paragraphs, wide = [], []
        for number, line in enumerate(lines, 1):
            add_string(paragraphs, line, number, False)
    else:
        if suffix in CPP:
            comments, strings = cpp(text)
        elif suffix == ".py":
            comments, strings = python(text)
        else:
            comments, strings = hashes(lines)
        paragraphs, wide = comments.found, comments.wide
    if not name.startswith("tests/"):
        paragraphs = paragraphs + strings
    most = MOST_COLUMNS if suffix == ".md" or suffix in CPP else MOST_COLUMNS_OF_SCRIPTS
    found = {(n, "columns", f"{len(lines[n - 1])} columns") for n in wide
             if n <= len(lines) and len(lines[n - 1]) > most}
    found |= {(p.line(at), rule, said) for p in paragraphs if p.parts for at, rule, said in check_paragraph(p, goal)}
    if name == "CHANGELOG.md" or name.startswith("docs/notes/"):
        found = {f for f in found if f[1] != "history"}
    return [Finding(name, *f) for f in sorted(found)]


def wanted(path):
    name = path.name
    return (path.suffix in CPP | {".md", ".py", ".sh", ".cmake", ".svg"} or name in {"CMakeLists.txt", "help.txt"} or
            name.endswith(".cmake.in") or path.parts[-2:] == (".ci", "run"))


def files_of(root, paths):
    """(name from the root, path) of each file under these paths, in order. Build folders are skipped."""
    found = set()
    for path in paths:
        if not path.exists():
            raise SystemExit(f"check_words.py: {path}: there is no such file or folder")
        files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file() and wanted(p)]
        for file in files:
            try:
                name = file.resolve().relative_to(root)
            except ValueError:
                name = file
            if not any(re.match(r"build|out|\.(?!ci)", part) for part in name.parts[:-1]):
                found.add((name.as_posix(), file))
    return sorted((name, file) for name, file in found if name not in SKIPPED)


def exceptions(root):
    """[path, rule, text, reason] of each line 'path | rule | text | reason' of the list beside this script."""
    for folder in (root / "tools", pathlib.Path(__file__).parent):
        file = folder / "check_words_exceptions.txt"
        if file.is_file():
            lines = [line for line in file.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
            listed = [[part.strip() for part in line.split(" | ")] for line in lines]
            wrong = [lines[k] for k, e in enumerate(listed) if len(e) != 4 or e[1] not in RULES or not all(e)]
            if wrong:
                raise SystemExit(f"{file}: not 'path | rule | text | reason': {wrong[0]}")
            return listed
    return []


def check(root, paths, goal=False):
    """(number of files, findings, exceptions that nothing needed)."""
    listed, used, found = exceptions(root), set(), []
    files = files_of(root, paths)
    for name, file in files:
        for f in check_text(name, file.read_text(encoding="utf-8", errors="replace"), goal):
            match = [k for k, (path, rule, text, _) in enumerate(listed)
                     if path == f.path and rule == f.rule and text in f.text]
            used.update(match)
            if not match:
                found.append(f)
    names = {name for name, _ in files}
    unused = [e for k, e in enumerate(listed) if k not in used and e[0] in names]
    return len(files), found, unused


def main():
    parser = argparse.ArgumentParser(add_help=False)
    parser.add_argument("paths", nargs="*", type=pathlib.Path)
    parser.add_argument("--root", type=pathlib.Path)
    parser.add_argument("--rules")
    for flag in ("--all", "--goal", "--count", "--list", "--help", "-h"):
        parser.add_argument(flag, action="store_true")
    o = parser.parse_args()
    if o.help or o.h:
        return print(__doc__) or 0
    if o.list:
        return print("\n".join(f"{rule:9} {text}" for rule, text in RULES.items())) or 0
    own = pathlib.Path(__file__).resolve().parents[1]
    root = (o.root or (own if (own / "include/gsnav").is_dir() else pathlib.Path.cwd())).resolve()
    paths = [root] if o.all else o.paths or [root / p for p in CLEAN]
    rules = set(o.rules.split(",")) if o.rules else set(RULES)
    if rules - set(RULES):
        parser.error(f"no rule is called {', '.join(sorted(rules - set(RULES)))}; --list shows them")
    files, found, unused = check(root, paths, o.goal)
    found = [f for f in found if f.rule in rules]
    if o.count:
        table = collections.Counter(("/".join(f.path.split("/")[:2]), f.rule) for f in found)
        print("\n".join(f"{n:5} {folder:24} {rule}" for (folder, rule), n in sorted(table.items())))
    else:
        print("".join(f"{f.path}:{f.line}: {f.rule}: {f.text}\n" for f in found), end="")
    print("".join(f"tools/check_words_exceptions.txt: not needed any more: {' | '.join(e)}\n" for e in unused), end="")
    print(f"{files} files, {len(found)} findings")
    return 1 if found or unused else 0


if __name__ == "__main__":
    sys.exit(main())
