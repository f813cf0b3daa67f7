#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks the commands of all pages: options that programs do not have, scripts and presets that do not exist.

    tools/check_commands.py              names each wrong option or path; exit status 1 if there is any
    tools/check_commands.py --self-test  checks the script itself

A command is a line of a shell block (indented, ```sh or without a language) or inline code. Options of the
tools are those of docs/reference/command_lines.md, which is made of their --help. Options of a script,
benchmark or example are those that its sources name, and those of the program that it runs (ALSO). Inline
code that is an option alone must be an option of some program. CMake's presets and GSNAV_ settings must be
in the files of CMake.
"""
import argparse
import pathlib
import re
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
HELP = "docs/reference/command_lines.md"
# Programs that pass options on to another, or whose sources are in two places.
ALSO = {"tools/run_demo.sh": ["nav_loop"], "nav_eval_mpi": ["gsnav-eval"],
        **{f"examples/python/{name}.py": ["examples/python/pointnav_worlds.py"]
           for name in ("train_pointnav", "play_pointnav", "pointnav_speed", "pointnav_replay")}}
OPTION = re.compile(r"(?<![\w-])--[a-z][\w-]*")
BLOCK = re.compile(r"^( *)```(\w*)\n(.*?)^ *```", re.MULTILINE | re.DOTALL)
INDENTED = re.compile(r"(?:(?<=\n\n)|\A)(?: {4}.*\n(?:\n(?= {4}))?)+", re.MULTILINE)
SPAN = re.compile(r"(?<!`)`([^`]+)`(?!`)")
PATH = re.compile(r"(?:tools|examples/python|bench|tests|\.ci)/[\w/]*\w+\.(?:py|sh)$")
OWN = re.compile(r"(?:^|/)(?:gsnav-[\w-]+|bench_\w+|test_\w+)$")
SECTION = re.compile(r"^##(?:#)? (\S+(?: \S+)?)\n(.*?)(?=^## |^### |\Z)", re.MULTILINE | re.DOTALL)


class Programs:
    """Options of each program, by its name, or by its path from the root."""

    def __init__(self, root):
        self.root, self.known, self.cmake = root, {}, ((), ())
        page = root / HELP
        for m in SECTION.finditer(page.read_text(encoding="utf-8") if page.is_file() else ""):
            self.known[m.group(1)] = set(OPTION.findall(m.group(2)))
        self.cmake = self.settings()

    def sources(self, word):
        """The files whose text has the options of a program, or nothing if the word is no program of this tree."""
        name = pathlib.PurePosixPath(word).name
        if PATH.match(word):
            return [self.root / word]
        if re.match(r"bench_\w+$", name):
            return [p for p in (self.root / "bench").glob("*.[ch]pp") if p.name == f"{name}.cpp" or p.suffix == ".hpp"]
        folder = self.root / "examples" / name
        return sorted(p for p in folder.iterdir()) if folder.is_dir() and name != "python" else []

    def options(self, word, following="", strict=True):
        """The options of a program, with its subcommand if `following` is one, else, unless `strict`, with any. None
        if the program is not of this tree."""
        name = pathlib.PurePosixPath(word).name
        key = f"{name} {following}" if f"{name} {following}" in self.known else name
        if key not in self.known:
            files = self.sources(word)
            if not files:
                return None
            texts = [p.read_text(encoding="utf-8") for p in files if p.is_file()]
            own = word if PATH.match(word) else name
            self.known[key] = set(OPTION.findall("\n".join(texts)))
            for other in ALSO.get(own, ()):
                self.known[key] |= self.options(other) or set()
        found = self.known[key] | {"--help"}
        if not strict:
            found = found.union(*(options for k, options in self.known.items() if k.startswith(f"{name} ")))
        return found

    def exists(self, word):
        """Whether a word that is named as the programs of this tree is one of them."""
        name = pathlib.PurePosixPath(word).name
        if name.startswith("test_"):
            made = re.compile(rf"gsnav_test\({name[5:]}\b")
            files = (self.root / "tests").rglob("CMakeLists.txt")
            return any(made.search(p.read_text(encoding="utf-8")) for p in files)
        return self.options(word, strict=False) is not None or any(k.startswith(f"{name} ") for k in self.known)

    def all(self):
        """The options of all programs."""
        for folder, pattern in (("tools", "*.py"), ("tools", "*.sh"), ("bench", "*.cpp"), ("examples", "*"),
                                ("examples/python", "*.py")):
            for path in (self.root / folder).glob(pattern):
                self.options(path.stem if folder in ("bench", "examples") else path.relative_to(self.root).as_posix())
        return set().union({"--help"}, *self.known.values())

    def settings(self):
        """Names of CMake's presets and of the project's settings."""
        files = [self.root / "CMakePresets.json", self.root / "CMakeLists.txt", self.root / "pyproject.toml",
                 *self.root.glob("cmake/*.cmake")]
        text = "\n".join(p.read_text(encoding="utf-8") for p in files if p.is_file())
        return set(re.findall(r'"name": "([\w-]+)"', text)), set(re.findall(r"\bGSNAV_\w+", text))


def commands(text):
    """(line, command, whether it is a line of a block) of all that may be a command on a page."""
    def at(offset):
        return text.count("\n", 0, offset) + 1

    blank = list(text)
    for m in BLOCK.finditer(text):
        if m.group(2) in ("", "sh", "bash", "console"):
            yield from lines(m.group(3), at(m.start(3)))
        blank[m.start():m.end()] = re.sub(r"[^\n]", " ", m.group())
    rest = "".join(blank)
    for m in INDENTED.finditer(rest):
        yield from lines(m.group(), at(m.start()))
    rest = INDENTED.sub(lambda m: re.sub(r"[^\n]", " ", m.group()), rest)
    for m in SPAN.finditer(rest):
        yield at(m.start()), m.group(1), False


def lines(block, first):
    """(line, command, True) of each command of a block. A backslash at the end of a line continues it."""
    said, number = "", first
    for k, line in enumerate(block.split("\n")):
        number = first + k if not said else number
        said += " " + line.rstrip("\\").strip()
        if not line.rstrip().endswith("\\"):
            yield number, said.strip(), True
            said = ""


def faults(command, in_block, programs, alone):
    """Yields the faults of a command. `alone`: the options of all programs, for code that is an option alone."""
    presets, settings = programs.cmake
    for preset in re.findall(r"--preset[ =]([\w-]+)", command):
        if preset not in presets:
            yield f"CMakePresets.json has no preset {preset}"
    for setting in re.findall(r"-D ?(GSNAV_\w+)", command):
        if setting not in settings:
            yield f"no file of CMake has the setting {setting}"
    command = re.sub(r"\s#\s.*", "", command)
    first = command.split(" ")[0].split("=")[0]
    if OPTION.fullmatch(first):
        for option in OPTION.findall(command):
            if option not in alone:
                yield f"{option}: no program has this option"
        return
    for part in re.split(r"&&|\|\|?|;", command):
        words = part.replace("\n", " ").split()
        known, program = None, ""
        for k, word in enumerate(words):
            word = re.sub(r"^(?:\./|build/\w+/|\$\w+/|\.\./)+", "", word)
            if PATH.match(word) and not (programs.root / word).is_file():
                yield f"there is no {word}"
            elif k == 0 and in_block and OWN.search(word) and not programs.exists(word):
                yield f"there is no program {word}"
            elif known is None and not word.startswith("-"):
                known = programs.options(word, words[k + 1] if k + 1 < len(words) else "", in_block)
                program = word if known is not None else program
            elif known is not None and word == "--":
                break
            elif known is not None:
                option = OPTION.match(word)
                google = program.rpartition("/")[2].startswith("bench_") and word.startswith("--benchmark_")
                if option and option.group() not in known and not google:
                    yield f"{program} has no option {option.group()}"


def check(root):
    programs, wrong, count = Programs(root), [], 0
    alone = programs.all()
    pages = [root / "README.md", root / "CONTRIBUTING.md", *sorted((root / "docs").rglob("*.md"))]
    for page in pages:
        name = page.relative_to(root).as_posix()
        if not page.is_file() or name == HELP:
            continue
        for line, command, in_block in commands(page.read_text(encoding="utf-8")):
            count += 1
            wrong += [f"{name}:{line}: {said}" for said in faults(command, in_block, programs, alone)]
    return wrong, count


RIGHT = """# Page

    cmake --preset release -DGSNAV_CUDA=ON && gsnav-a --one 1   # --none
    python tools/a.py --two \\
        --two-more x
    mpirun -n 2 build/release/examples/loop --three=3 | sort --reverse

```sh
build/release/tools/gsnav-b make --four
ls --all
```

`gsnav-b --four`, `--one`, `bench_a --five --benchmark_filter=x` and `git log --oneline` are right.

```cpp
--none;
```
"""
WRONG = {"    gsnav-aa --one 1\n": "there is no program gsnav-aa",
         "    build/ci/tests/lod/test_no -d\n": "there is no program tests/lod/test_no",
         "    gsnav-a --tow 1\n": "gsnav-a has no option --tow", "`gsnav-a --tow`": "gsnav-a has no option --tow",
         "`--none`": "--none: no program has this option", "    gsnav-b --four\n": "gsnav-b has no option --four",
         "```sh\nls | tools/a.py --one\n```\n": "tools/a.py has no option --one",
         "```\ngsnav-a \\\n  --tow\n```\n": "gsnav-a has no option --tow",
         "    python tools/none.py\n": "there is no tools/none.py", "`bench_a --one`": "bench_a has no option --one",
         "    cmake --preset fast\n": "CMakePresets.json has no preset fast",
         "    cmake -DGSNAV_NONE=ON\n": "no file of CMake has the setting GSNAV_NONE"}


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for name, text in ((HELP, "# Programs\n\n## gsnav-a\n\n```\n--one N\n```\n\n## gsnav-b\n\n"
                                  "### gsnav-b make\n\n```\n--four\n```\n"),
                           ("tools/a.py", 'add_argument("--two"); add_argument("--two-more")'),
                           ("examples/loop/main.cpp", '"--three"'), ("bench/bench_a.cpp", '"--five"'),
                           ("CMakePresets.json", '{"name": "release"}'), ("CMakeLists.txt", "option(GSNAV_CUDA)")):
            (root / name).parent.mkdir(parents=True, exist_ok=True)
            (root / name).write_text(text, encoding="utf-8")
        page, failed = root / "docs/a.md", 0
        for text, expected in {RIGHT: None, **WRONG}.items():
            page.write_text(f"before\n\n{text}\n\nafter\n", encoding="utf-8")
            found = [w.partition(": ")[2] for w in check(root)[0]]
            if found != ([expected] if expected else []):
                failed += 1
                print(f"check_commands.py: expected {expected}, found {found}", file=sys.stderr)
    print(f"check_commands.py: {len(WRONG) + 1} cases, {failed} failed")
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--self-test", action="store_true", help="check the script itself")
    if parser.parse_args().self_test:
        return self_test()
    wrong, count = check(ROOT)
    print("".join(f"{w}\n" for w in wrong) + f"check_commands.py: {count} pieces of code, {len(wrong)} wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
