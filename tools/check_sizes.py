#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks sizes of sources: at most 350 lines per file and 80 per function or macro. In tests/ a file has
at most 650 lines and a TEST_CASE at most 120. A program examples/*.cpp has at most 40 lines of code.

usage: check_sizes.py              check this source tree
       check_sizes.py --self-test  check that long functions are found
"""
import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).parents[1]
MOST_LINES, MOST_OF_FUNCTION = 350, 80
MOST_LINES_OF_TESTS, MOST_OF_TEST_CASE = 650, 120
MOST_OF_EXAMPLE = 40
FOLDERS = ("include", "src", "backends", "bindings", "tools", "bench", "examples", "tests")
SOURCES = {".hpp", ".cpp", ".cu", ".cuh", ".h", ".inl"}
NO_CODE = re.compile(r'//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'', re.DOTALL)
DIRECTIVE = re.compile(r"^[ \t]*#(?:.*\\\n)*.*", re.MULTILINE)
SEPARATED = re.compile(r"\b\d[\w.]*(?:'\w+)+")  # a number with separators, which look like quotes
# These have parentheses in the head of a type, too.
OF_TYPE = re.compile(r"\b(alignas|decltype|__attribute__|__declspec|explicit|noexcept|requires) *\(\)")
TYPE = re.compile(r"(?:export |inline |typedef |static |const |constexpr |friend )*"
                  r"(?:namespace|class|struct|enum|union|extern)\b")
LAMBDA = re.compile(r"(?:^|[^\w\]\[)> ]|\breturn) *\[\] *(?:<>)? *(?:\(\))?"
                    r" *(?:(?:mutable|constexpr|noexcept(?: *\(\))?|static|[A-Z][A-Z0-9_]+) *)*(?:->[^=;]*)?$")
REQUIRES = re.compile(r"\brequires *(?:\(\))?$")


def without(text, opened, closed):
    """The text without everything between these brackets."""
    out, depth = [], 0
    for at, char in enumerate(text):
        if char == closed and depth > 0 and text[at - 1] != "-":  # not the arrow ->
            depth -= 1
        if depth == 0:
            out.append(char)
        if char == opened:
            depth += 1
    return "".join(out)


def is_body(head, inside_parentheses):
    """Whether a brace behind this text opens the body of a function. The text is outside functions."""
    head = without(without(without(head, "(", ")"), "[", "]"), "{", "}")
    head = " ".join(re.sub(r"\boperator *(?:<=>|<<|>>|<=|>=|->|<|>)", "operator", head).split())
    head = without(head, "<", ">")
    if LAMBDA.search(head):
        return True
    if inside_parentheses or REQUIRES.search(head):
        return False
    head = re.sub(r"^(?:(?:public|protected|private) *: *)+", "", head)
    head = re.sub(r"^(?:template *<> *(?:requires .*?(?=\b(?:class|struct|union)\b))?)+", "", head)
    head = re.sub(r"^(?:\[\] *)+", "", head)
    if TYPE.match(head):
        head = re.sub(r"\b(class|struct|union) +[A-Z][A-Z0-9_]+ *\(\)", r"\1", OF_TYPE.sub("", head))
    if "(" not in head or head.endswith(("=", ",", "(")):
        return False
    # In a constructor's list of initialisers, the body comes after a closed initialiser.
    listed = re.search(r"\).*?(?<!:):(?!:)", head)
    return not listed or head.endswith((")", "}"))


def functions(text):
    """(first line, number of lines, head) of each function body, including nested functions. A macro of several
    lines counts as a function body."""
    text = SEPARATED.sub(lambda m: m.group().replace("'", " "), text)
    code = NO_CODE.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), text)
    found = [(code.count("\n", 0, m.start()) + 1, m.group().count("\n") + 1, " ".join(m.group().split("\\")[0].split()))
             for m in DIRECTIVE.finditer(code) if re.match(r"[ \t]*#[ \t]*define\b", m.group())]
    code = DIRECTIVE.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), code)
    # (bracket, its position, start of the declaration around it, opens a body, declaration continues behind it)
    opened, begin, inside = [], 0, 0  # inside: number of open braces in a body
    for at, char in enumerate(code):
        if inside and char in "{}":
            inside += 1 if char == "{" else -1
        if inside:
            continue
        if char in "([":
            opened.append((char, at, begin, False, True))
        elif char in ")]":
            if opened and opened[-1][0] == {")": "(", "]": "["}[char]:
                opened.pop()
        elif char == "{":
            in_parentheses = bool(opened) and opened[-1][0] != "{"
            head = code[opened[-1][1] + 1:at] if in_parentheses else code[begin:at]
            body = is_body(head, in_parentheses)
            scope = re.search(r"\b(?:namespace\b[^=]*|extern *)$", " ".join(head.split()))
            opened.append((char, at, begin, body, in_parentheses or not (body or scope)))
            inside, begin = int(body), at + 1
        elif char == "}":
            while opened and opened[-1][0] != "{":
                opened.pop()
            if not opened:
                continue
            _, start, before, body, goes_on = opened.pop()
            if body:
                first = code.count("\n", 0, start) + 1
                found.append((first, code.count("\n", start, at) + 1, " ".join(code[before:start].split())))
            begin = before if goes_on else at + 1
        elif char == ";" and (not opened or opened[-1][0] == "{"):
            begin = at + 1
    return found


def too_long(name, text):
    """Lines 'file: problem' of one file, whose path is relative to the root of the tree."""
    of_tests = name.startswith("tests/")
    most, lines = MOST_LINES_OF_TESTS if of_tests else MOST_LINES, text.count("\n")
    wrong = [f"{name}: {lines} lines, more than {most}"] if lines > most else []
    code = sum(1 for line in text.split("\n") if line.strip() and not line.strip().startswith("//"))
    if re.fullmatch(r"examples/[^/]+\.cpp", name) and code > MOST_OF_EXAMPLE:
        wrong.append(f"{name}: {code} lines of code, more than {MOST_OF_EXAMPLE}")
    for first, n, head in functions(text):
        most = MOST_OF_TEST_CASE if of_tests and re.match(r"(?:TEST|SCENARIO)_?\w*\(", head) else MOST_OF_FUNCTION
        if n > most:
            wrong.append(f"{name}:{first}: {n} lines in one function, more than {most}: {head[-60:]}")
    return wrong


def check(root):
    wrong, files = [], 0
    for top in FOLDERS:
        for file in sorted(p for p in (root / top).rglob("*") if p.suffix in SOURCES):
            files += 1
            wrong += too_long(file.relative_to(root).as_posix(), file.read_text(encoding="utf-8"))
    return files, wrong


def self_test():
    def found(text):
        return any(n > MOST_OF_FUNCTION for _, n, _ in functions(text))

    body = "  f();\n" * 80
    for head in ("int f() ", "struct A {\n A() : a_{}, b_(0) ", "struct A {\n A() : b_(0), a_{} ",
                 "template <class T>\nvoid f(T x)\n  requires true ", "namespace n {\n}\nint f() ",
                 "namespace n {\nclass B {\n  bool operator()(char c = '\\'') const ",
                 "void f(const Settings& s = {}, int b = 1'000) ", "void f(A a = {.b = {1, 2}}) noexcept ",
                 "struct S f(int a) ", "template <class T>\nstruct S<T> f(int a) const ", "enum E f(int a) ",
                 'extern "C" int f(int a) ', 'extern "C" {\nint f(int a) ', "inline constexpr auto f = [] ",
                 "const auto f = [](int a) mutable -> int ", "struct A {\n  std::function<void()> f = [this] ",
                 "void g(F f = [](int a) ", 'const Table t[] = {{"a", [] ', "bool operator<(A a) ",
                 "template <class T>\n  requires requires(T t) { t.a; }\nvoid f(T t) ",
                 "struct A {\n  operator bool() const ", "auto f() -> std::vector<int> ", "A::~A() noexcept(true) ",
                 "[[nodiscard]] int f() ", "struct A {\n public:\n  A() "):
        # A brace in a string or a comment does not count.
        if not found(head + '{  // {\n  g("{");\n' + body + "}\n}\n"):
            sys.exit(f"not found: {head}")
    if not found("#define F(a) \\\n" + "  f(a); \\\n" * 80 + "  f(a)\n"):
        sys.exit("not found: a macro")
    members = "  int f(int a = {}) { return 1; }\n" * 90
    for head in ("namespace n {\nstruct A ", "struct alignas(16) A ", "class A : public B<void(int)> ", 'extern "C" ',
                 "template <class T>\n  requires (sizeof(T) == 4)\nclass A ", "struct hash<void(int)> "):
        if found(head + "{\n" + members + "};\n}\n"):
            sys.exit(f"taken for a function: {head}")
    for head in ("const int a[] = ", "const std::array<int, f(3)> a", "enum class A : int "):
        if found(head + "{\n" + "  1,\n" * 90 + "};\n"):
            sys.exit(f"taken for a function: {head}")
    lines, helper = "int a;\n" * 400, "int f() {\n" + body + "}\n"
    case = "TEST_CASE(\"a\") {\n" + "  f();\n" * 100 + "}\n"
    for name, text, expected in (("src/a.cpp", lines, 1), ("tests/a.cpp", lines, 0), ("tests/a.cpp", 2 * lines, 1),
                                 ("src/a.cpp", case, 1), ("tests/a.cpp", case, 0), ("tests/a.cpp", helper, 1),
                                 ("examples/a.cpp", "int a;  //\n" * 41, 1),
                                 ("examples/a.cpp", "int a;\n\n// a\n" * 40, 0)):
        if len(too_long(name, text)) != expected:
            sys.exit(f"{name}: not {expected} places")
    with tempfile.TemporaryDirectory() as folder:
        for top in FOLDERS:
            file = pathlib.Path(folder, top, "a", "long.cpp")
            file.parent.mkdir(parents=True)
            file.write_text(2 * lines)
        if (checked := check(pathlib.Path(folder)))[0] != len(FOLDERS) or len(checked[1]) != len(FOLDERS):
            sys.exit(f"not all folders are read: {checked[1]}")
    print("long functions are found")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
    elif sys.argv[1:2] in (["--help"], ["-h"]):
        print(__doc__)
    else:
        checked, violations = check(ROOT)
        print("\n".join(violations) or f"{checked} files are short")
        sys.exit(1 if violations or not checked else 0)
