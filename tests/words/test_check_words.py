#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of tools/check_words.py: each rule finds what it is for and leaves plain sentences alone."""
import pathlib
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import check_words  # noqa: E402

# rule -> (sentences that break it, sentences that do not)
SENTENCES = {
    "what": (["What is not finite lies nearest.", "It skips what is hidden.", "What the eye sees is kept.",
              "The first half of what was drawn stays.", "Whose most of the pixel is counts.",
              "Chunks are read, what needs a file waits.",
              "What their exponents share in a column is computed once."],
             ["A chunk whose bounds are not finite is treated as nearest.", "What is the largest error?",
              "The error says what is wrong.", "The result depends on what the camera shows.",
              "It prints what it does.", "The table shows what is missing."]),
    "who": (["It is built for who asks for a distance.", "Who asks for it waits.", "The pool, who holds it, is full."],
            ["Users who ask for a distance wait.", "The people, who walk, give way.", "This page says who it is for.",
             "A person of radius 0.3 who stands still is passed."]),
    "person": (["The reader wants the size.", "One who looks sees it.", "Whoever takes it frees it.",
                "Nobody reads it.", "The others get zero.",
                "The backend knows nothing of meshes.", "He waits.", "The file wants a header.",
                "Each lane that wants one gets one.", "The file has more rows than the header promises."],
               ["A caller that looks sees it.", "No thread reads it.", "The other rows are zero.", "There it is.",
                "People who have a file and want a scene begin here."]),
    "per": (["It takes 3 ms a frame.", "A warp reads 16 bytes a lane.", "There is one thread a pixel.",
             "It is drawn once a frame.", "A list has 12 properties a chunk.", "It draws 30.5 frames a second.",
             "It takes 0.05 ms an action.", "It takes 3 ms a step.", "It takes 2 ms a policy.",
             "It holds 4 MB a process.", "Plots frames a second over time.", "It reads influences a vertex.",
             "The head says %d actions a row.", "It moves %.1f mm a step.", "Wall collisions an episode: 3.",
             "Views a scene, at least one.",
             "Timed runs a setting.", "A WebP has 16383 pixels a side.", "One kernel a tile runs.",
             "A value a pixel is stored."],
            ["It takes 3 ms per frame.", "This renders a frame.", "Once a frame has been drawn, it is sent.",
             "1 for a walker that stands.", "It is 1e-5 of a pixel.", "It makes one pass over a row.",
             "Of 2 cameras, a camera is drawn first.", "It samples a row.", "Begins a frame.",
             "Viewpoints a cell apart.", "Views a scene of 2 files.", "It is 0 without a GPU.",
             "It takes two seconds a little later.", "A value that a pixel has is stored."]),
    "many": (["Rows are tested so many at a time.", "It has room for as many as were counted.", "It moves by as much.",
              "The pool starts as many threads."],
             ["Rows are tested 64 at a time.", "There are so many rows that lists overflow.",
              "It uses as many threads as cores."]),
    "same": (["The same holds here.", "They are opaque, and the same goes.", "The result is the same.",
              "It draws the same again.", "The surface stays the same, but its tiles differ.", "The same object.",
              "It is built all the same.", "The same bits come back.", "The same follows."],
             ["The same holds for meshes.", "Both have the same bits.", "It is the same as before.",
              "Whether two files are the same.", "All three images are the same.",
              "The same calls give the same bits.", "The same bits come back as from a single thread."]),
    "beside": (["It is fast beside the CPU.", "Queries beside Detour's.", "One setting beside another.",
                "It is twice as good, beside gsplat, at least."],
               ["The NavMesh is the file beside the scene.", "It refuses to load beside another module."]),
    "possessive": (["0 is the default of Mip-Splatting's.", "The axes are the file's.", "It is faster than ours."],
                   ["0 is Mip-Splatting's default.", "The file's axes are kept.", "It is faster than our kernel."]),
    "of": (["Of a chunk in view the rows are tested.", "Tiles are of 8 pixels.",
            "Slices are skipped where one is as good."],
           ["The rows of a chunk in view are tested.", "Of course it is."]),
    "old": (["It is exact but for rounding.", "No file can be had.", "Memory is the host's or not, as the set has it."],
            ["It is exact, rounding aside.", "No file is available.", "The set says where its memory is."]),
    "history": (["Larger tiles were tried and not kept.", "Lists used to be sorted twice.",
                 "Meshes were opaque once.", "Previously it was sorted.", "Formerly a list.", "It once was a list.",
                 "In version 0.1 this was slower.", "We tried a hash and dropped it.", "This no longer copies.",
                 "We no longer sort twice.", "Lists no longer overlap.", "This was slower in version 0.1.",
                 "They were opaque.", "The settings were opaque.", "The ratio was 3.8, 1.7 and 1.3."],
                ["The flag is used to be explicit.", "Lists are sorted once.", "It is float16 in version 1.",
                 "It names content that no longer exists.", "They were read.", "The bytes were read.",
                 "A file of version 2 is read."]),
    "colon": (["It has two parts: one for rows: the other for columns."],
              ["It has two parts: rows and columns. It returns one: rows.", "At 12:30 it takes `a: b` from a::b: fine.",
               'It prints "file: what: why".']),
}
LONG = " ".join(["word"] * 31) + "."


def rules(name, text, **options):
    return {f.rule for f in check_words.check_text(name, text, **options)}


class Rules(unittest.TestCase):
    def test_every_rule_has_sentences(self):
        self.assertEqual(set(SENTENCES) | {"columns", "sentence", "goal"}, set(check_words.RULES))

    def test_sentences_in_every_kind_of_file(self):
        wrap = {"docs/a.md": "# Title\n\nText.\n\n{}\n", "include/a.hpp": "/// {}\nint f();\n",
                "src/a.cu": "int a;  // {}\n", "src/b.cpp": "/* {} */\n", "tools/a.py": '"""{}"""\n',
                "docs/a.svg": '<svg><text x="1" y="2" class="note">{}</text></svg>\n',
                "tools/b.py": "a = 1  # {}\n", "tools/a.sh": "# {}\n",
                "cmake/a.cmake": "set(a b)\n# {}\n", "CMakeLists.txt": "# {}\n"}
        for rule, (wrong, right) in SENTENCES.items():
            for name, form in wrap.items():
                for said in wrong:
                    self.assertIn(rule, rules(name, form.format(said)), f"{name}: {said}")
                for said in right:
                    if not (name == "tools/a.py" and '"' in said):
                        self.assertNotIn(rule, rules(name, form.format(said)), f"{name}: {said}")

    def test_sentence_length(self):
        self.assertIn("sentence", rules("README.md", LONG))
        self.assertNotIn("sentence", rules("README.md", LONG.replace("word ", "", 1)))
        self.assertNotIn("sentence", rules("README.md", f"# T\n\n{LONG[5:]} {LONG[5:]}\n"))
        self.assertNotIn("sentence", rules("a.hpp", f"// {LONG}\n"))
        self.assertIn("sentence", rules("a.hpp", f"// {LONG[:-1]}\n// {LONG}\n"))
        # An abbreviation ends no sentence, inline code is one word, items of a list are sentences of their own.
        self.assertIn("sentence", rules("README.md", LONG.replace("word word", "word, e.g. word", 1)))
        self.assertNotIn("sentence", rules("README.md", "`" + " ".join(["word"] * 40) + "` is one."))
        self.assertNotIn("sentence", rules("README.md", "".join(f"- {LONG[:60]}\n" for _ in range(5))))

    def test_goal(self):
        self.assertIn("goal", rules("README.md", LONG[20:], goal=True))
        self.assertNotIn("goal", rules("README.md", LONG[20:]))

    def test_columns(self):
        wide = " ".join(["word"] * 20) + " " + "x" * 8
        for name, form in (("README.md", "{}\n"), ("a.hpp", "// {}\n")):
            self.assertIn("columns", rules(name, form.format(wide)), name)
        for name in ("a.py", "a.sh", "a.cmake"):
            self.assertIn("columns", rules(name, f"# {wide} {'x' * 12}\n"), name)
            self.assertNotIn("columns", rules(name, f"# {wide}\n"), name)
        self.assertNotIn("columns", rules("README.md", wide[:105]))
        self.assertNotIn("columns", rules("README.md", f"| {wide} |\n|---|\n\n```\n{wide}\n```\n\n    {wide}\n"))
        self.assertNotIn("columns", rules("a.py", f"a = f('{wide}')\n"))

    def test_lines_are_named(self):
        found = check_words.check_text("a.hpp", "int a;\n/// The set is read.\n/// It skips\n/// what is hidden.\n")
        self.assertEqual([(f.line, f.rule) for f in found], [(3, "what")])


class Text(unittest.TestCase):
    def test_code_is_skipped(self):
        said = "What is hidden lies nearest."
        self.assertFalse(rules("a.md", f"```\n{said}\n```\n\n    {said}\n\nUse `{said}` [here](what-is-hidden).\n"))
        self.assertFalse(rules("a.hpp", f"/// Reads it.\n/// @code\n/// {said}\n/// @endcode\nint f();\n"))
        self.assertFalse(rules("a.sh", f"cat << 'END'\n# {said}\nEND\n"))
        self.assertIn("what", rules("a.sh", f"cat << 'END'\n# {said}\nEND\n# {said}\n"))

    def test_only_short_quotations_and_code_are_skipped(self):
        self.assertFalse(rules("a.md", 'It says "of what is" and `skips what is hidden from view`.\n'))
        self.assertIn("what", rules("a.md", 'It says "skips what is hidden".\n'))
        self.assertIn("what", rules("a.hpp", '/// It says "skips what is hidden".\n'))
        self.assertIn("what", rules("a.md", "It skips `rows` of what is hidden.\n"))

    def test_text_of_drawings(self):
        lines = ('<text x="1" y="20" class="note">skips all of what</text>\n'
                 '<text x="{}" y="{}" class="note">is hidden</text>')
        self.assertIn("what", rules("docs/a.svg", lines.format(1, 35)))
        self.assertFalse(rules("docs/a.svg", lines.format(90, 35)) | rules("docs/a.svg", lines.format(1, 90)))
        self.assertIn("what", rules("docs/a.svg", "<svg>\n<title>all of what is hidden</title></svg>"))
        self.assertIn("what", rules("docs/a.svg", '<text x="1" y="2">what <tspan>is</tspan> hidden</text>'))
        self.assertFalse(rules("docs/a.svg", '<path d="M1,2" class="what is hidden"/><text x="1" y="2">rows</text>'))
        found = check_words.check_text("docs/a.svg", "<svg>\n<text x='1'>a</text>\n<text x='2'>what is left</text>")
        self.assertEqual([(f.line, f.rule) for f in found], [(3, "what")])

    def test_headings_and_heads_of_tables_may_ask(self):
        self.assertFalse(rules("a.md", "# What is guaranteed\n\n| a | what it shows |\n|---|---|\n| b | rows |\n"))
        self.assertIn("what", rules("a.md", "| a | b |\n|---|---|\n| b | what is left of it |\n"))

    def test_strings(self):
        said = "Skips what is hidden from view."
        self.assertIn("what", rules("tools/a.cpp", f'add("--a", "{said}");\n'))
        self.assertIn("what", rules("tools/a.cpp", 'add("--a", "Skips all of what"\n    " is hidden.");\n'))
        self.assertIn("what", rules("tools/a.py", f'parser.add_argument("-a", help="{said}")\n'))
        self.assertIn("what", rules("examples/a/help.txt", f"  --a    {said}\n"))
        self.assertFalse(rules("tests/a.cpp", f'TEST_CASE("{said}") {{}}\n'))
        self.assertFalse(rules("tools/a.cpp", f'auto a = R"html({said})html";\n'))
        script = f'auto a = R"js(let a = "https://b";\n// {said}\n)js";\n'
        self.assertEqual([(f.line, f.rule) for f in check_words.check_text("tools/a.cpp", script)], [(2, "what")])
        self.assertFalse(rules("tools/a.cpp", "const int a = 1'000'000;  // rows\n"))
        self.assertNotIn("colon", rules("tools/a.cpp", 'error("file: what it holds: why it is wrong");\n'))

    def test_comments_are_joined_and_separated(self):
        self.assertIn("what", rules("a.hpp", "int a = 1;  ///< first of\n            ///< what is drawn\n"))
        self.assertNotIn("colon", rules("a.hpp", "int a;  ///< rows: all\nint b;  ///< columns: all\n"))
        self.assertNotIn("colon", rules("a.hpp", "/// @param a  rows: all\n/// @param b  columns: all\n"))
        self.assertNotIn("colon", rules("a.sh", "#   -a   rows: all\n#   -b   columns: all\n"))

    def test_history_may_be_in_the_changelog(self):
        said = "Lists used to be sorted twice.\n"
        self.assertIn("history", rules("docs/lod.md", said))
        self.assertFalse(rules("CHANGELOG.md", said) | rules("docs/notes/sorting.md", said))


class Tree(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name).resolve()
        for name, text in (("docs/a.md", "Skips what is hidden.\n"), ("src/a.cpp", "// Nobody reads it.\n"),
                           ("build/b.md", "Nobody reads it.\n"), ("src/data.bin", "Nobody reads it.\n")):
            (self.root / name).parent.mkdir(exist_ok=True)
            (self.root / name).write_text(text)

    def check(self, *paths):
        return check_words.check(self.root, [self.root / p for p in paths] or [self.root])

    def test_folders_and_files(self):
        self.assertEqual([f.path for f in self.check()[1]], ["docs/a.md", "src/a.cpp"])
        self.assertEqual([f.path for f in self.check("src")[1]], ["src/a.cpp"])
        self.assertEqual([f.path for f in self.check("docs/a.md")[1]], ["docs/a.md"])
        with self.assertRaises(SystemExit):
            self.check("none")

    def test_exceptions_have_reasons_and_are_needed(self):
        (self.root / "tools").mkdir()
        file = self.root / "tools/check_words_exceptions.txt"
        file.write_text("# why\nsrc/a.cpp | person | Nobody reads | a title\n")
        self.assertEqual(([f.path for f in self.check()[1]], self.check()[2]), (["docs/a.md"], []))
        file.write_text("src/a.cpp | person | Nobody writes | a title\n")
        self.assertEqual(len(self.check()[2]), 1)
        self.assertEqual(self.check("docs")[2], [])
        for wrong in ("src/a.cpp | person | Nobody reads\n", "src/a.cpp | no rule | Nobody reads | a title\n"):
            file.write_text(wrong)
            with self.assertRaises(SystemExit):
                self.check()


if __name__ == "__main__":
    unittest.main()
