#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Tests of tools/make_site.py: links and headings of pages, groups and lines of headers, errors of Doxygen."""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tools"))
import make_site  # noqa: E402

HEADER = """// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

namespace gsnav {

/// A place.
struct Place {
  double x = 0, y = 0;  ///< metres
  /// Whether it is here.
  bool here() const;
  /// Whether the other is here.
  bool here(int other) const;
  bool operator==(const Place&) const = default;
};

/// Finds a place.
Place find();

}  // namespace gsnav
"""


class Tree(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name).resolve()
        self.addCleanup(setattr, make_site, "ROOT", make_site.ROOT)
        self.addCleanup(setattr, make_site, "SITE", make_site.SITE)
        make_site.ROOT = self.root
        shutil.copytree(ROOT / "docs/site", self.root / "docs/site")
        make_site.SITE = self.root / "docs/site"
        for group in make_site.GROUPS:
            if group[2]:
                self.write(f"include/gsnav/{group[2]}.hpp", "#pragma once\n\n// A module.\n\n")
        self.write("include/gsnav/version.hpp", (ROOT / "include/gsnav/version.hpp").read_text())
        rule = "/// A rule.\nstruct Response {\n};\n"
        self.write("include/gsnav/frame/rules.hpp",
                   f"#pragma once\nnamespace gsnav {{\n{rule}}}  // namespace gsnav\n")
        self.write("include/gsnav/nav/place.hpp", HEADER)
        self.write("README.md", "![A room](docs/a.svg)\n\n# Name\n\n"
                                "See [the\npage](docs/a.md#two-words) and [code](src).\n")
        self.write("src/a.cpp", "")
        self.write("docs/a.svg", "<svg xmlns='http://www.w3.org/2000/svg' width='8' height='8'/>")
        self.write("docs/a.md", "# Page\n\n## Two words\n\n```\n[not](a-link.md)\n```\n")

    def write(self, name, text):
        (self.root / name).parent.mkdir(parents=True, exist_ok=True)
        (self.root / name).write_text(text)

    def test_links_lead_to_pages_and_headings(self):
        missing = []
        text = make_site.page_text("README.md", {"README.md", "docs/a.md"}, missing)
        self.assertTrue(text.startswith("# Name {#page_README}"))
        self.assertIn("[the page](@ref page_docs_a__two-words) and code.", text)
        text = make_site.page_text("docs/a.md", {"README.md", "docs/a.md"}, missing)
        self.assertIn("## Two words {#page_docs_a__two-words}", text)
        self.assertIn("[not](a-link.md)", text)
        self.assertEqual(missing, [])
        self.write("docs/b.md", "# Page\n\nSee [this](c.md).\n")
        make_site.page_text("docs/b.md", {"docs/b.md"}, missing)
        self.assertEqual(missing, ["docs/b.md: error: c.md: there is no such file"])

    def test_enumerators_need_comments(self):
        bare = lambda text: make_site.bare_enumerators(text, "a.hpp")  # noqa: E731
        self.assertEqual(bare("/// A kind.\nenum class Kind {\n  one,  ///< First.\n  /// Second.\n  two,\n};\n"), [])
        self.assertEqual(bare("/// A kind: one or two.\nenum class Kind { one, two };\n"), [])
        self.assertEqual(bare("/// A kind.\nenum Kind : int {\n  one,\n  two,  ///< Second.\n};\n"),
                         ["a.hpp: error: Kind: no documentation of one"])
        two = "enum class Kind {\n  one,  ///< First.\n        ///< Of two.\n  two\n};\n"
        missing = ["a.hpp: error: Kind: no documentation of two"]
        self.assertEqual(bare(two), missing)
        self.assertEqual(bare("enum class Kind { one,  ///< First.\n  two };\n"), missing)
        self.assertEqual(bare("enum class Kind {\n  one, two,  ///< Both.\n  three,  ///< Third.\n};\n"),
                         ["a.hpp: error: Kind: no documentation of one, two,  ///< Both."])
        hidden = "class A {\n public:\n  int f();\n\n private:\n  enum Kind {\n    one,\n  };\n};\n"
        self.assertEqual(bare(hidden), [])
        self.assertEqual(bare(hidden + two), missing)  # behind a class, not in it
        inner = "".join(f"  {line}\n" for line in two.splitlines())
        self.assertEqual(bare(hidden + "struct B {\n" + inner + "};\n"), missing)
        self.assertEqual(bare("class A {\n" + inner + "};\n"), [])

    def test_concepts_need_comments(self):
        bare = lambda text: make_site.bare_concepts(text, "a.hpp")  # noqa: E731
        concept = "template <class A,\n          class B>\nconcept Both = requires(A a) { a.b; };\n"
        self.assertEqual(bare("/// A kind of both.\n" + concept), [])
        self.assertEqual(bare("int a;  ///< A number.\n" + concept),
                         ["a.hpp: error: concept Both: no documentation"])
        self.assertEqual(bare("\ntemplate <class A> concept One = true;\n"),
                         ["a.hpp: error: concept One: no documentation"])

    @unittest.skipUnless(shutil.which("doxygen"), "no doxygen here")
    def test_the_search_finds_each_word_of_a_heading(self):
        self.write("docs/a.md", "# Page\n\nRun `render_scan` on a `Box<S>`.\n\n## Two words\n\n"
                                "| name | what |\n|---|---|\n"
                                "| **median depth** | of `x` |\n\n    pip install a\n\n"
                                "## On a [GPU](../README.md)\n\n## A place\n")
        self.assertEqual(self.run_doxygen().returncode, 0)
        found = "".join(p.read_text() for p in (self.root / "out/html/search").glob("all_*.js"))
        self.assertIn("""['gpu_""", found)
        self.assertIn("""["On a GPU",["../page_docs_a.html#page_docs_a__on-a-gpu",1,"Page"]]""", found)
        self.assertIn("""["render_scan",["../page_docs_a.html",1,"Page"]]""", found)
        self.assertIn("""["median depth",["../page_docs_a.html#page_docs_a__two-words",1,"Page"]]""", found)
        self.assertIn("""['pip_20install_""", found)
        self.assertIn("""["Box&lt;S&gt;",""", found)
        self.assertIn("""['here_""", found)  # names of the library stay
        self.assertLess(found.index("structgsnav_1_1Place.html"), found.index("""["A place","""))  # and come first
        self.assertIn("""['on_20a_20gpu_""", found)
        self.assertNotIn("""['a_20gpu_""", found)

    def test_headers_join_their_group_and_keep_their_lines(self):
        path = self.root / "include/gsnav/nav/place.hpp"
        self.assertEqual(make_site.headers()[path], "nav")
        text = make_site.header_text(path, "gsnav/nav/place.hpp", "nav")
        self.assertIn("@addtogroup nav\n@{", text)
        line = [k for k, t in enumerate(HEADER.split("\n")) if "struct Place" in t]
        self.assertEqual(line, [k for k, t in enumerate(text.split("\n")) if "struct Place" in t])
        self.assertIn("/** metres */ double y = 0; double x = 0; ///< metres", text)

    def test_comments_that_are_left_to_write(self):
        found = lambda text, name="a.hpp": make_site.unfinished(text, name)  # noqa: E731
        self.assertEqual(found("/// A.\n/// TODO\nint f();\nint g();  ///< FIXME: units\n"),
                         ["a.hpp:2: error: 'TODO' is no documentation", "a.hpp:4: error: 'FIXME' is no documentation"])
        self.assertEqual(found('const char* name = "/tmp/XXX";\n/// Names end in XXXXXX, as for mkstemp.\n'), [])
        self.assertEqual(found("# Page\n\nTBD\n", "a.md"), ["a.md:3: error: 'TBD' is no documentation"])

    def test_comments_of_templates_are_no_markup(self):
        said = make_site.plain_comments("/// Box<b> and `Box<b>`.\n///     Box<b> a;\nBox<b> c;  ///< Box<b>\n")
        self.assertEqual(said, "/// Box\\<b> and `Box<b>`.\n///     Box<b> a;\nBox<b> c;  ///< Box\\<b>\n")
        shown = "/// @code\n/// auto s = Box<b>::create(2);\n/// @endcode\n/// \"<name>_end\"\n"
        self.assertEqual(make_site.plain_comments(shown), shown)
        self.assertEqual(make_site.plain_comments(shown + "/// Box<b>"), shown + "/// Box\\<b>")

    def test_escapes_that_a_page_shows(self):
        (self.root / "shown").mkdir()
        for name, text in (("a", "Box\\::create"), ("b", "Box\\&lt;B&gt;"), ("c", "a\\@b"), ("d", "Box::create &lt;")):
            (self.root / f"shown/{name}.html").write_text(f"<p>{text}</p>")
        self.assertEqual([line[0] for line in make_site.shown_escapes(self.root / "shown")], ["a", "b", "c"])

    def run_doxygen(self):
        program = ("import sys, pathlib; sys.path.insert(0, sys.argv[1]); import make_site\n"
                   "root = pathlib.Path(sys.argv[2]); make_site.ROOT = root; make_site.SITE = root / 'docs/site'\n"
                   "sys.exit(make_site.make(root / 'out', 'doxygen'))")
        return subprocess.run([sys.executable, "-c", program, str(ROOT / "tools"), str(self.root)],
                              capture_output=True, text=True, check=False)

    @unittest.skipUnless(shutil.which("doxygen"), "no doxygen here")
    def test_what_is_not_documented_is_an_error(self):
        done = self.run_doxygen()
        self.assertEqual(done.returncode, 0, done.stdout)
        html = self.root / "out/html"
        self.assertIn("Whether it is here.", (html / "structgsnav_1_1Place.html").read_text())
        self.assertIn("page_docs_a.html", (html / "index.html").read_text())
        self.assertTrue((html / "search").is_dir())
        for wrong, said in ((HEADER.replace("  /// Whether it is here.\n", ""), "here() const (function) of struct"),
                            (HEADER.replace("  /// Whether the other is here.\n", ""), "here(int other) const"),
                            (HEADER.replace("Finds a place.", "TODO"), "'TODO' is no documentation"),
                            (HEADER.replace("/// A place.\n", ""), "Compound gsnav::Place is not documented"),
                            (HEADER.replace("  ///< metres", ""), "Member x (variable)")):
            self.write("include/gsnav/nav/place.hpp", wrong)
            done = self.run_doxygen()
            self.assertNotEqual(done.returncode, 0)
            self.assertIn(said, done.stdout)
            self.assertIn("include/gsnav/nav/place.hpp:", done.stdout)

    @unittest.skipUnless(shutil.which("doxygen"), "no doxygen here")
    def test_markup_that_wraps(self):
        page = "# Page\n\nSee [the\n  name](../README.md), [two\nwords](#two-words), `a\nb` and " \
               "[it\nall](https://a.b/).\n\n" \
               "| a | b |\n|---|---|\n| `c` | d |\n\n## Two words\n\n- see [the\n  name](../README.md)\n\n" \
               "```\n# @ref of code\n```\n\n### Three\n"
        self.write("docs/a.md", page)
        done = self.run_doxygen()
        self.assertEqual(done.returncode, 0, done.stdout)
        text = (self.root / "out/html/page_docs_a.html").read_text()
        self.assertEqual(len(re.findall(r'href="index.html[^"]*">the name</a>', text)), 2)
        self.assertIn("<code>a b</code>", text)
        self.assertEqual(text.count("<table class=\"markdownTable\">"), 1)
        self.assertEqual((text.count("<h1>"), text.count("<h2>")), (1, 1))

    def test_pages_that_doxygen_wrecks_are_errors(self):
        html = self.root / "out/html"
        heading = '<h1><a id="x"></a>Two words</h1>'
        wrong = lambda text: self.write("out/html/page_docs_a.html", text) or make_site.wrong_pages(html)  # noqa: E731
        self.write("out/html/index.html", "<p>See it</p>")
        self.assertEqual(wrong(f"{heading}<pre>@ref @section &lt;tt&gt;</pre>"), [])
        for said in ("@section", "@subsection", "@ref", "&lt;tt&gt;"):
            self.assertEqual(wrong(f"{heading}<p>{said} a</p>"), [f"docs/a.md: error: Doxygen left {said} as text"])
        self.assertEqual(wrong("<p>Two words</p>"), ["docs/a.md: error: 1 headings, but 0 on the site"])
        self.assertEqual(wrong(heading * 2), ["docs/a.md: error: 1 headings, but 2 on the site"])

    @unittest.skipUnless(shutil.which("doxygen"), "no doxygen here")
    def test_pictures_in_other_folders(self):
        self.write("docs/images/b.png", "a picture")
        self.write("docs/guide/c.md", "# Guide\n\nText.\n\n![Two\nrooms](../images/b.png)\n")
        done = self.run_doxygen()
        self.assertEqual(done.returncode, 0, done.stdout)
        text = (self.root / "out/html/page_docs_guide_c.html").read_text()
        self.assertRegex(text, r'<img src="b.png"[^>]*/>(?s:.{0,40})Two rooms')
        self.assertTrue((self.root / "out/html/b.png").is_file())
        self.write("docs/guide/c.md", "# Guide\n\n![Two rooms](../images/d.png)\n")
        done = self.run_doxygen()
        self.assertEqual(done.returncode, 1)
        self.assertIn("d.png", done.stdout)
        self.write("docs/guide/b.png", "another picture")
        self.assertIn("two pictures are called b.png", self.run_doxygen().stdout)

    def test_a_drawing_links_to_its_file(self):
        page = self.root / "a.html"
        page.write_text('<object type="image/svg+xml" data="a.svg" style="pointer-events: none;"></object>\n'
                        '<div class="caption">\nA &amp; B</div></div>\n')
        make_site.link_drawings(self.root)
        self.assertIn('<a href="a.svg"><img class="drawing" src="a.svg" alt="A &amp; B"/></a>', page.read_text())

    def test_dead_links(self):
        html = self.root / "out/html"
        self.write("out/html/b.html", '<a id="it"></a>')
        for link, said in (('<a href="b.html#it">', ""), ('<a href="#own">', ""), ('<a href="https://a.b/#c">', ""),
                           ('<a href="c.html">', "c.html: there is no such file"),
                           ('<img src="../b.png"/>', "../b.png: there is no such file"),
                           ('<a href="b.html#own">', "b.html#own: there is no such anchor"),
                           ('<a href="#it">', "#it: there is no such anchor")):
            self.write("out/html/a.html", f'<h1 id="own">A</h1>{link}')
            self.assertEqual(make_site.dead_links(html), [f"a.html: error: {said}"] if said else [])


if __name__ == "__main__":
    unittest.main()
