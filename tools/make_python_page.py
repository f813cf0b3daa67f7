#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes docs/reference/python.md of the type stubs and the docstrings of the Python package.

    tools/make_python_page.py --stubs build/python/bindings/python/_gsnav.pyi           writes the page
    tools/make_python_page.py --stubs build/python/bindings/python/_gsnav.pyi --check   names differences

The build of the package writes the stubs (tools/run_python_tests.sh). --check ends with 1 if anything differs.
"""
import argparse
import ast
import difflib
import inspect
import pathlib
import re
import sys
import textwrap

ROOT = pathlib.Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "reference" / "python.md"
PACKAGE = ROOT / "bindings" / "python" / "gsnav"
# Module, and its purpose.
MODULES = (("gsnav", "Scenes, rendering, navigation, simulators and environments."),
           ("gsnav.io", "Files."),
           ("gsnav.eval", "Reference images and errors."),
           ("gsnav.ray", "Rollouts and evaluations on a Ray cluster (`pip install \"gsnav[ray]\"`)."),
           ("gsnav.sb3", "Environments for Stable-Baselines3."))
HEAD = """# Python API

<!-- Made by tools/make_python_page.py; do not edit. -->

For people who write Python with gsnav. After reading you know every class and function of the package.
`help(gsnav.Renderer)` prints the same text. [Python](../guide/python.md) is the tutorial.

Names, fields and defaults are those of C++. A class of settings takes its fields as keywords.

| module | what it has |
|---|---|
"""
WIDTH = 100
SHORT = ((r"(?:collections\.abc|numpy\.typing|numpy|npt|np|typing|os)\.(?=\w)", ""),
         (r"NDArray\[bool_\]", "NDArray[bool]"), (r"'", ""))


def unquoted(node):
    """Source of a type or default, with short names."""
    text = ast.unparse(node)
    for pattern, short in SHORT if not isinstance(node, ast.Constant) else ():
        text = re.sub(pattern, short, text)
    return text


def arguments_of(function, skip_self):
    """The arguments of a function as text."""
    a = function.args
    plain = a.posonlyargs + a.args
    defaults = [None] * (len(plain) - len(a.defaults)) + a.defaults
    pairs = list(zip(plain, defaults))[1 if skip_self else 0:]
    parts = []

    def add(argument, default):
        text = argument.arg + (f": {unquoted(argument.annotation)}" if argument.annotation else "")
        parts.append(text + (f" = {unquoted(default)}" if default is not None else ""))

    for argument, default in pairs:
        add(argument, default)
    if a.vararg:
        parts.append("*" + a.vararg.arg)
    elif a.kwonlyargs:
        parts.append("*")
    for argument, default in zip(a.kwonlyargs, a.kw_defaults):
        add(argument, default)
    if a.kwarg:
        parts.append("**" + a.kwarg.arg)
    return ", ".join(parts)


def filled(text, first, later):
    """Text in lines of at most WIDTH columns, with these indents."""
    return textwrap.fill(text, WIDTH, initial_indent=first, subsequent_indent=later, break_long_words=False,
                         break_on_hyphens=False)


def paragraphs(doc):
    """The paragraphs of a docstring. One begins behind an empty line, at the description of an argument, and where
    the indent of such a description ends."""
    found, before = [], ""
    for line in inspect.cleandoc(doc or "").split("\n"):
        if not found or not before.strip() or re.match(r"\w+: ", line) or before[:1] == " " != line[:1]:
            found.append("")
        found[-1] = f"{found[-1]} {line.strip()}".strip()
        before = line
    return [p for p in found if p]


def documented(signature, doc):
    """A signature with its docstring below."""
    return "\n".join([filled(signature, "", " " * 8), *(filled(p, " " * 4, " " * 4) for p in paragraphs(doc))])


def is_property(node):
    return any(ast.unparse(d) in ("property", "functools.cached_property") for d in node.decorator_list)


def constructor(name, node):
    """The call that makes an object, or None if it has no documented one."""
    if node.args.kwonlyargs and all(isinstance(d, ast.Constant) and d.value is ... for d in node.args.kw_defaults):
        return None  # a class of settings
    return f"{name}({arguments_of(node, True)})"


def members(node, source):
    """(signature, docstring) of the public members of a class."""
    body = node.body
    for i, item in enumerate(body):
        following = body[i + 1] if i + 1 < len(body) else None
        told = (following.value.value if isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
                and isinstance(following.value.value, str) else "")
        if isinstance(item, ast.Assign) and isinstance(item.targets[0], ast.Name):
            name = item.targets[0].id
            if not name.startswith("_"):
                yield name, told
        elif isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            line = source[item.lineno - 1]
            told = line.partition("  # ")[2] or told
            if not item.target.id.startswith("_"):
                yield f"{item.target.id}: {unquoted(item.annotation)}", told
        elif isinstance(item, ast.FunctionDef):
            doc = ast.get_docstring(item)
            if item.name == "__init__":
                made = constructor(node.name, item)
                if made and doc:
                    yield made, doc
            elif item.name == "__getitem__":
                yield f"[{arguments_of(item, True)}] -> {unquoted(item.returns)}", doc
            elif item.name == "__call__":
                yield f"({arguments_of(item, True)}) -> {unquoted(item.returns)}", doc
            elif item.name.startswith("_") or any(ast.unparse(d).endswith(".setter") for d in item.decorator_list):
                continue
            elif is_property(item):
                yield f"{item.name}: {unquoted(item.returns)}", doc
            else:
                static = any(ast.unparse(d) == "staticmethod" for d in item.decorator_list)
                yield f"{item.name}({arguments_of(item, not static)}) -> {unquoted(item.returns)}", doc


def section(name, nodes, source):
    """The part of the page for one name, which has several nodes if it is overloaded."""
    node = nodes[0]
    if isinstance(node, ast.ClassDef):
        bases = [b for b in map(unquoted, node.bases) if not b.startswith("enum.") and b != "Any"]
        parts = [documented(f"class {name}" + (f"({', '.join(bases)})" if bases else ""), ast.get_docstring(node))]
        parts += [documented(s, d) for s, d in members(node, source)]
    elif isinstance(node, ast.FunctionDef):
        parts = [documented(f"{name}({arguments_of(n, False)}) -> {unquoted(n.returns)}", ast.get_docstring(n))
                 for n in nodes]
    else:
        return None
    return f"### {name}\n\n```\n" + "\n\n".join(p.rstrip() for p in parts) + "\n```\n"


class Names:
    """Definitions of a module, by name."""

    def __init__(self, path):
        text = path.read_text(encoding="utf-8")
        self.source, self.nodes, self.origins, self.public = text.splitlines(), {}, {}, []
        tree = ast.parse(text)
        self.doc = ast.get_docstring(tree) or ""
        for item in tree.body:
            if isinstance(item, (ast.ClassDef, ast.FunctionDef)):
                self.nodes.setdefault(item.name, []).append(item)
            elif isinstance(item, ast.ImportFrom) and item.level == 1 and item.module:
                for alias in item.names:
                    self.origins[alias.asname or alias.name] = (item.module, alias.name)
            elif isinstance(item, ast.Assign) and ast.unparse(item.targets[0]) == "__all__":
                self.public = list(ast.literal_eval(item.value))


def page(stubs):
    files = {"_gsnav": Names(stubs)}

    def module(name):
        if name not in files:
            files[name] = Names(PACKAGE / f"{name}.py")
        return files[name]

    text = HEAD + "".join(f"| [{name}](#{name.replace('.', '')}) | {what} |\n" for name, what in MODULES)
    for name, _ in MODULES:
        part = module("__init__" if name == "gsnav" else name.partition(".")[2])
        own = [n for n in part.nodes if not n.startswith("_")]
        text += f"\n## {name}\n"
        for public in part.public or own:
            if public in part.nodes:
                found = section(public, part.nodes[public], part.source)
            elif public in part.origins and part.origins[public][0] != "":
                where, original = part.origins[public]
                there = module(where)
                found = section(public, there.nodes.get(original, [None]), there.source)
            else:
                found = None  # a module or a constant
            if found:
                text += "\n" + found
    return text


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--stubs", type=pathlib.Path, required=True, help="type stubs of the compiled module")
    parser.add_argument("--check", action="store_true", help="write nothing, name what differs")
    options = parser.parse_args()
    new = page(options.stubs)
    if not options.check:
        PAGE.write_text(new, encoding="utf-8")
        return
    old = PAGE.read_text(encoding="utf-8") if PAGE.exists() else ""
    if new != old:
        sys.stdout.writelines(difflib.unified_diff(old.splitlines(True), new.splitlines(True), str(PAGE), "docstrings"))
        sys.exit("make_python_page.py: the page differs from the package; run it without --check")


if __name__ == "__main__":
    main()
