#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the API site by Doxygen: README, the pages of docs/ and every type and function for users.

usage: make_site.py [--out FOLDER] [--doxygen PROGRAM]

Writes FOLDER/html/index.html (default: build/site). Fails where a public entity, each overload too, has no
documentation or one that says TODO, or a page has a dead link, lost headings or markup that is shown as
text. Headers for users are those of include/gsnav outside detail/, those that a module header includes, and
those of the backends.
"""
import argparse
import os
import pathlib
import re
import shutil
import subprocess
import sys
import urllib.parse
from html import unescape
from xml.sax.saxutils import quoteattr

import site_search

ROOT = pathlib.Path(__file__).resolve().parents[1]
SITE = ROOT / "docs/site"
# Group, its title, the module header that has it (or none) and the folders whose other headers belong to it.
ABOUT_GROUPS = {"core": "Errors, random numbers, arrays in the memory of a backend, and the concept of a backend.",
                "math": "Vectors, quaternions, matrices, boxes and capsules.",
                "backends": "Backends by their own names, for the templates that take one.",
                "interop": "Views and copies of the types of other libraries."}
GROUPS = (("render", "Scenes and rendering", "render", ("render", "image", "frame", "mesh", "scene", "device")),
          ("avatar", "Avatars", "avatar", ("avatar", "skin")),
          ("rigging", "Making avatars", "rigging", ("rigging",)),
          ("nav", "Navigation", "nav", ("nav", "sweep")),
          ("sim", "Simulator", "sim", ("sim",)),
          ("io", "Files", "io", ("io",)),
          ("eval", "Errors and oracles", "eval", ("eval",)),
          ("demo", "Scenes and people made by code", "demo", ("demo",)),
          ("open", "Opening a scene", "open", ("open",)),
          ("core", "Status, buffers and backends", None, ("core", "config.hpp", "version.hpp")),
          ("math", "Mathematics", None, ("math",)),
          ("backends", "Serial, OpenMP and CUDA", None, ("backends",)),
          ("interop", "Eigen, GLM and DLPack", None, ("interop",)))
# Launch sizes of the CUDA kernels. Only changes of the backend read them.
NOT_FOR_USERS = {"policy.hpp"}
# Folders of pages, in the order of the menu.
SECTIONS = (("Guide", "docs/guide"), ("Concepts", "docs/concepts"), ("Reference", "docs/reference"),
            ("Notes", "docs/notes"))
ABOUT = ("CONTRIBUTING.md", "CHANGELOG.md")
FENCE = re.compile(r"\s*(```|~~~)")
REFERENCE = re.compile(r"\[([^\]]*)\]\(@ref [^)]*\)")
SPAN = re.compile(r"`(?:[^`\n]|\n(?!\n))+`")  # on one line, because Doxygen may take a second one for a list
IMAGE = re.compile(r"!\[([^\]]*)\]\(([^)\s]+)\)")
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)\s]+)\)")


def headers():
    """{header: group} of all headers for users."""
    found = {}
    for group, _, module, _ in GROUPS:
        if module:
            text = (ROOT / f"include/gsnav/{module}.hpp").read_text(encoding="utf-8")
            for name in re.findall(r'#include "(gsnav/[^"]+)"', text):
                found.setdefault(ROOT / "include" / name, group)
    public = [p for p in (ROOT / "include/gsnav").rglob("*.hpp") if "detail" not in p.parts]
    for path in public + [
            p for p in ROOT.glob("backends/*/gsnav/**/*.hpp") if p.name not in NOT_FOR_USERS]:
        own = path.is_relative_to(ROOT / "include")
        part = path.relative_to(ROOT / "include/gsnav").parts[0] if own else "backends"
        for group, _, _, folders in GROUPS:
            if part in folders:
                found.setdefault(path, group)
    return found


def pages():
    """Pages of the site, named from the root."""
    found = ["README.md", *ABOUT] + [p.relative_to(ROOT).as_posix() for p in sorted((ROOT / "docs").rglob("*.md"))]
    return [p for p in found if (ROOT / p).is_file() and not p.startswith("docs/site/")]


def label(page, heading=""):
    """Label of a page or of one of its headings."""
    text = re.sub(r"[^\w]+", "_", page.removesuffix(".md")) + ("__" + slug(heading) if heading else "")
    return "page_" + text


def slug(heading):
    """The anchor that GitHub gives a heading."""
    heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w-]", "", heading.strip().lower().replace(" ", "-"))


def title_of(page):
    for line in (ROOT / page).read_text(encoding="utf-8").splitlines():
        if line.startswith("# "):
            return line[2:].strip().replace("`", "")
    return page


def joined(text):
    """A link or span on one line: Doxygen loses the rest of a page behind one that wraps."""
    return re.sub(r"[ \t]*\n\s*", " ", text)


def page_text(name, known, missing):
    """A page with labels on its headings and links that Doxygen resolves. `missing` gets a line for each dead link."""
    folder, code, seen, out = (ROOT / name).parent, False, set(), []

    def link(m):
        text, target = m.group(1), m.group(2)
        if re.match(r"\w+:", target):
            return joined(m.group())
        file, _, anchor = target.partition("#")
        path = pathlib.Path(os.path.normpath(folder / file)) if file else ROOT / name
        linked = path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ""
        if linked not in known:  # not on the site: a folder, a source
            if not path.exists():
                missing.append(f"{name}: error: {target}: there is no such file")
            return text if "`" in text else f"`{linked}`" if text == linked else text
        return f"[{joined(text)}](@ref {label(linked, anchor)})"

    def image(m):  # Doxygen puts all pictures beside the pages
        return f"![{joined(m.group(1))}]({pathlib.PurePath(m.group(2)).name})"

    source = (ROOT / name).read_text(encoding="utf-8")
    title = re.search(r"^# .*\n", source, re.MULTILINE)  # Doxygen takes it for the title where it is first
    source = title.group() + source[:title.start()] + source[title.end():] if title else source
    parts = re.split(r"(^ *```.*?^ *```|^    [^\n]*)", source, flags=re.DOTALL | re.MULTILINE)
    parts[::2] = (SPAN.sub(lambda m: joined(m.group()), LINK.sub(link, IMAGE.sub(image, part))) for part in parts[::2])
    source = "".join(parts)
    for line in source.splitlines():
        code ^= bool(FENCE.match(line))
        heading = re.match(r"(#{1,6}) (.*?)#*$", line)
        if code or line.startswith("    "):
            out.append(line)
        elif heading:
            mark, text = heading.group(1), REFERENCE.sub(r"\1", heading.group(2).strip())
            own = label(name) if mark == "#" and not seen else label(name, text)
            out.append(f"{mark} {text}" + (f" {{#{own}}}" if own not in seen else ""))
            seen.add(own)
        else:
            parts = re.split(r"(`[^`]*`|\]\(@ref [^)]*\))", line)
            out.append("".join(part if k % 2 else re.sub(r"@|<(?=[\d\s=])", r"\\\g<0>", part)
                               for k, part in enumerate(parts)))
    return "\n".join(out) + "\n"


FLAGS = re.MULTILINE | re.DOTALL


def header_text(path, name, group):
    """A header whose namespaces are members of its group. Lines behind the first namespace keep their numbers."""
    text = path.read_text(encoding="utf-8")
    opens = re.compile(r"^(?:inline )?namespace gsnav(?:::(?!detail)\w+)* \{", re.MULTILINE)
    for _ in opens.findall(text):  # each takes one line more
        text = re.sub(r"\A(.*?)\n\n", r"\1\n", text, count=1, flags=re.DOTALL)
    text = opens.sub(rf"\g<0> /** @addtogroup {group}\n@{{ */", text)
    text = re.sub(r"^\}  // namespace gsnav(?:::(?!detail)\w+)*$", r"/** @} */ \g<0>", text, flags=re.MULTILINE)
    text = text.replace("#pragma once", f"/** @file {name} */", 1)
    # The inline namespace of an instruction set has a macro for its name.
    text = re.sub(r"^inline namespace GSNAV_LANES_TAG \{$|^\}  // (?:inline )?namespace GSNAV_LANES_TAG$", "", text,
                  flags=re.MULTILINE)
    # Explicit instantiations repeat a template that is documented elsewhere.
    text = re.sub(r"^(?:extern template |GSNAV_\w+_FUNCTIONS\(extern)[^;]*;",
                  lambda m: "\n" * m.group().count("\n"), text, flags=re.MULTILINE)
    return document_the_obvious(plain_comments(text))


NO_MARKUP = re.compile(r"<(?=/?[A-Za-z])|(?<!\\)\\(?=x)|(?<=\w)@(?=\w)|(?<=[\w>])::(?=create\b)")


def plain_comments(text):
    """Escapes in comments what Doxygen would take for HTML or a command: Simulator<B>, \\xNN. Code and quotations,
    which Doxygen shows as they are, stay."""
    out, code = [], False
    for line in text.split("\n"):
        code = (code or "@code" in line) and "///" in line and "@endcode" not in line
        comment = re.search(r"///<? ?(?! {4})", line)
        if comment and not code and "@code" not in line:
            parts = re.split(r"(`[^`]*`|\"[^\"]*\")", line[comment.start():])
            line = line[:comment.start()] + "".join(part if k % 2 else NO_MARKUP.sub(r"\\\g<0>", part)
                                                    for k, part in enumerate(parts))
        out.append(line)
    return "\n".join(out)


def shown_escapes(html):
    """Lines for pages that show an escape of plain_comments()."""
    return [f"{page.name}: error: it shows {m.group()}" for page in sorted(html.glob("*.html"))
            for m in [re.search(r"\\(?:::|&lt;|@)", page.read_text(encoding="utf-8"))] if m]


# Functions whose meaning the language fixes.
OBVIOUS = ((re.compile(r"^ *(?:explicit )?(\w+)\(\1&&\)"), "Moves from the other, which is empty afterwards."),
           (re.compile(r"^ *(?:explicit )?(\w+)\(const \1&\)"), "Copies the other."),
           (re.compile(r"^ *\w+& operator=\(\w+&&\)"), "Moves from the other, which is empty afterwards."),
           (re.compile(r"^ *\w+& operator=\(const \w+&\)"), "Copies the other."),
           (re.compile(r"^ *(?:virtual )?~\w+\("), "Releases all that it holds."),
           (re.compile(r"^ *(?:friend )?(?:constexpr )?(?:bool|auto) operator(?:==|<=>)\(.*\).* = default;"),
            "Compares all members."),
           (re.compile(r"^ *explicit operator bool\(\) const"), "Same as ok()."))
FIELD = r"[A-Za-z_]\w*(?:\[\w+\])?(?: = [^,;]+|\{[^{}]*\})?"
FIELDS = re.compile(r"^( *)((?:static |inline |constexpr |mutable )*(?:[\w:]+(?:<[^;={}]*>)?)[*&]? )"
                    rf"({FIELD}(?:, {FIELD})+);(?:\s*///< (.*))?$")


def document_the_obvious(text):
    """Gives functions that the language defines their meaning, and several fields of one line its comment each.
    Lines keep their numbers."""
    lines, out, above = text.split("\n"), [], ""
    for line in lines:
        commented = above.startswith("///") and not above.startswith("///<")
        several = FIELDS.match(line)
        if several and (several.group(4) or commented) and "(" not in several.group(3).split("=")[0]:
            said = several.group(4) or above.lstrip("/ ")
            names = re.split(r", (?=[A-Za-z_]\w*(?: =|\{|\[|,|$))", several.group(3))
            first = several.group(1) + several.group(2) + names[0] + ";" + (f" ///< {said}" if not commented else "")
            rest = " ".join(f"/** {said} */ {several.group(2)}{name};" for name in names[1:])
            line = f"{several.group(1)}{rest} {first.strip()}" if not commented else f"{first} {rest}"
        elif not commented:
            for pattern, said in OBVIOUS:
                if pattern.match(line):
                    line = f"/** {said} */ {line}"
                    break
        out.append(line)
        above = line.strip() if not line.strip().startswith("template") else above
    return "\n".join(out)


UNFINISHED = re.compile(r"\b(TODO|FIXME|XXX|TBD)\b|\?\?\?")


def unfinished(text, name):
    """Lines for comments and pages that say that something is left to write."""
    return [f"{name}:{number}: error: '{m.group()}' is no documentation"
            for number, line in enumerate(text.split("\n"), 1)
            if (m := UNFINISHED.search(line)) and (name.endswith(".md") or "//" in line[:m.start()])]


ENUM = re.compile(r"^( *)enum (?:class |struct )?(\w+)[^;{]*\{(.*?)\};", FLAGS)
SCOPE = re.compile(r"( *)(?:(public|protected|private):|(?:template <.*> )?(class|struct|union)\b(?!.*;))")


def is_private(text, indent):
    """Whether a member that stands `indent` columns in, behind this text, is for its class alone."""
    for line in reversed(text.splitlines()):
        scope = SCOPE.match(line)
        if scope and len(scope.group(1)) < indent:
            return scope.group(2) in ("protected", "private") or scope.group(3) == "class"
    return False


def bare_enumerators(text, name):
    """Lines for enumerators without a comment. A public enumeration of one line has one comment for all."""
    found = []
    for enum in ENUM.finditer(text):
        lines, above = enum.group(3).splitlines(), ""
        if len(lines) < 2 or (enum.group(1) and is_private(text[:enum.start()], len(enum.group(1)))):
            continue
        for line in lines:
            several = re.match(r" *\w+(?: = [^,/]+)?, *\w", line)
            if re.match(r" *\w", line) and (several or ("///<" not in line and not re.match(r"///(?!<)", above))):
                found.append(f"{name}: error: {enum.group(2)}: no documentation of {line.strip(' ,')}")
            above = line.strip()
    return found


def bare_concepts(text, name):
    """Lines for concepts without a comment above their template. Doxygen says no more of them than a dead anchor."""
    found, lines = [], text.split("\n")
    for k, line in enumerate(lines):
        concept = re.match(r" *(?:template <.*> )?concept (\w+) =", line)
        while concept and k > 0 and not re.match(r" *template <", lines[k]):
            k -= 1
        if concept and not re.match(r" *///(?!<)", lines[k - 1]):
            found.append(f"{name}: error: concept {concept.group(1)}: no documentation")
    return found


def write_inputs(out):
    """Copies of the pages and headers for Doxygen, in folders as in the tree. Their paths, and lines for errors."""
    known, copies, wrong = set(pages()), {}, []
    for name in sorted(known):
        copies[name] = page_text(name, known, wrong)
        wrong += unfinished((ROOT / name).read_text(encoding="utf-8"), name)
    for path, group in headers().items():
        name = path.relative_to(ROOT).as_posix()
        copies[name] = header_text(path, re.sub(r"^include/|^backends/\w+/", "", name), group)
        wrong += bare_enumerators(copies[name], name) + bare_concepts(copies[name], name)
        wrong += unfinished(path.read_text(encoding="utf-8"), name)
    for name, text in copies.items():
        (out / "input" / name).parent.mkdir(parents=True, exist_ok=True)
        (out / "input" / name).write_text(text, encoding="utf-8")
    return [out / "input" / name for name in sorted(copies)], wrong


def module_comment(module):
    """The comment of a module header."""
    text = (ROOT / f"include/gsnav/{module}.hpp").read_text(encoding="utf-8")
    block = re.search(r"#pragma once\n\n((?://.*\n)+)", text)
    return " ".join(re.sub(r"^///? ?", "", line) for line in block.group(1).splitlines()) if block else ""


def write_groups(out):
    lines = []
    for group, title, module, _ in GROUPS:
        text = (f"{module_comment(module)}\n\n`#include \"gsnav/{module}.hpp\"`" if module else ABOUT_GROUPS[group])
        lines.append(f"/** @defgroup {group} {title}\n{text}\n*/")
    for name, text in (("gsnav", "All names of the library."), ("gsnav::io", "Files: readers and writers."),
                       ("gsnav::interop", "Types of other libraries.")):
        lines.append(f"/** @namespace {name}\n{text} */")
    (out / "groups.dox").write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_layout(out):
    """The menu: sections of pages, modules, an index of names."""
    tabs = ['<tab type="mainpage" visible="yes" title="Overview"/>']
    known = [p for p in pages() if p != "README.md"]
    sections = [(title, [p for p in known if pathlib.PurePath(p).parent.as_posix() == folder])
                for title, folder in (*SECTIONS, ("Project", "docs"))]
    sections[-1][1].extend(p for p in ABOUT if p in known)
    for title, listed in sections:
        if listed:
            entries = "".join(f'<tab type="user" url="@ref {label(p)}" title={quoteattr(title_of(p))}/>'
                              for p in listed)
            tabs.append(f'<tab type="usergroup" visible="yes" title="{title}">{entries}</tab>')
    tabs.append('<tab type="modules" visible="yes" title="API"/>')
    tabs.append('<tab type="usergroup" visible="yes" title="Index"><tab type="classlist" visible="yes" title="Types"/>'
                '<tab type="namespacemembers" visible="yes" title="Functions and names"/>'
                '<tab type="filelist" visible="yes" title="Headers"/></tab>')
    text = (SITE / "layout.xml").read_text(encoding="utf-8")
    (out / "layout.xml").write_text(text.replace("@TABS@", "\n".join(tabs)), encoding="utf-8")


def version():
    text = (ROOT / "include/gsnav/version.hpp").read_text(encoding="utf-8")
    return ".".join(re.findall(r"#define GSNAV_VERSION_(?:MAJOR|MINOR|PATCH) (\d+)", text))


def headings(name):
    """Texts of the headings of a page, the title first."""
    code, found = False, []
    for line in (ROOT / name).read_text(encoding="utf-8").splitlines():
        code ^= bool(FENCE.match(line))
        heading = re.match(r"#{1,6} (\S.*)", line)
        if heading and not code:
            found.append(heading.group(1).strip())
    return found


def searchable():
    """Text, address and page of each heading and term, for the search field."""
    for name in pages():
        lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
        for term, text in site_search.terms(lines if name != "CHANGELOG.md" else []):
            yield term, f"../{html_of(name)}" + (f"#{label(name, text)}" if text else ""), title_of(name)
        for k, text in enumerate(headings(name)):
            plain = LINK.sub(r"\1", text).replace("`", "")
            yield plain, f"../{html_of(name)}" + (f"#{label(name, text)}" if k else ""), title_of(name)


RAW = re.compile(r"@(?:sub)*section\b|@ref\b|&lt;/?tt&gt;")


def html_of(name):
    """The file that Doxygen makes of a page."""
    return "index.html" if name == "README.md" else f"{label(name)}.html"


def wrong_pages(html):
    """Lines for pages on which Doxygen took commands for text, or lost or made headings."""
    found = []
    for name in pages():
        text = (html / html_of(name)).read_text(encoding="utf-8")
        prose = re.sub(r"<pre\b.*?</pre>|<div class=\"fragment\">.*?</div><!-- fragment -->", "", text, flags=re.DOTALL)
        found += [f"{name}: error: Doxygen left {m} as text" for m in sorted(set(RAW.findall(prose)))]
        made = len(re.findall(r"<h[1-6]\b", prose))
        asked = len(headings(name)) - 1
        if made != asked:
            found.append(f"{name}: error: {asked} headings, but {made} on the site")
    return found


def drop_links_to_nothing(html):
    """Removes links that Doxygen 1.9.4 makes to a heading of nested classes that it does not write."""
    for page in html.glob("*.html"):
        text = page.read_text(encoding="utf-8")
        if 'href="#nested-classes"' in text and 'name="nested-classes"' not in text:
            text = re.sub(r'<a href="#nested-classes">[^<]*</a>(?: &#124;\s*)?', "", text)
            page.write_text(text, encoding="utf-8")


DRAWING = re.compile(r'<object type="image/svg\+xml" data="([^"]+)"[^>]*></object>\s*'
                     r'<div class="caption">\s*([^<"]*)</div>')


def link_drawings(html):
    """Makes each drawing a picture that links to its file, where a phone can enlarge it."""
    for page in html.glob("*.html"):
        text = page.read_text(encoding="utf-8")
        linked = DRAWING.sub(lambda m: f'<a href="{m[1]}"><img class="drawing" src="{m[1]}" alt="{m[2].strip()}"/>'
                                       f'</a>\n<div class="caption">\n{m[2]}</div>', text)
        if linked != text:
            page.write_text(linked, encoding="utf-8")


def dead_links(html):
    """Lines for pictures, files and anchors that a page names and that are not on the site."""
    texts = {p.name: p.read_text(encoding="utf-8") for p in html.glob("*.html")}
    anchors = {name: set(re.findall(r'\b(?:id|name)="([^"]+)"', text)) for name, text in texts.items()}
    found = []
    for name, text in sorted(texts.items()):
        for target in sorted(set(re.findall(r'\b(?:href|src)="([^"]*)"', text))):
            target = urllib.parse.unquote(unescape(target))
            if re.match(r"\w+:", target):
                continue
            file, _, anchor = target.partition("#")
            if not (html / (file or name)).is_file():
                found.append(f"{name}: error: {target}: there is no such file")
            elif anchor and anchor not in anchors.get(file or name, ()):
                found.append(f"{name}: error: {target}: there is no such anchor")
    return found


def make(out, doxygen):
    if shutil.which(doxygen) is None:
        print(f"make_site.py: there is no program {doxygen}; Debian's package is doxygen", file=sys.stderr)
        return 1
    shutil.rmtree(out, ignore_errors=True)
    out.mkdir(parents=True)
    write_groups(out)
    write_layout(out)
    inputs, wrong = write_inputs(out)
    inputs.append(out / "groups.dox")
    pictures = [p for p in (ROOT / "docs").rglob("*") if p.suffix in {".png", ".svg", ".webp"}]
    names = [p.name for p in pictures]
    if len(set(names)) != len(names):
        print(f"docs: error: two pictures are called {max(names, key=names.count)}")
        return 1
    images = {p.parent for p in pictures}
    values = {"OUT": out, "IMAGES": " ".join(f'"{p}"' for p in sorted(images)),
              "ROOT": ROOT, "SITE": SITE, "VERSION": version(),
              "INPUT": " \\\n  ".join(f'"{p}"' for p in inputs)}
    text = (SITE / "Doxyfile.in").read_text(encoding="utf-8")
    (out / "Doxyfile").write_text(re.sub(r"@([A-Z]+)@", lambda m: str(values[m.group(1)]), text), encoding="utf-8")
    done = subprocess.run([doxygen, str(out / "Doxyfile")], cwd=ROOT, capture_output=True, text=True, check=False)
    said = (done.stdout + done.stderr).replace(f"{out}/input/", "")
    print(said, end="")
    if done.returncode != 0 or "warning:" in said or "error:" in said:
        print("\n".join(wrong))
        return 1
    drop_links_to_nothing(out / "html")
    link_drawings(out / "html")
    wrong += wrong_pages(out / "html") + dead_links(out / "html") + shown_escapes(out / "html")
    if wrong:
        print("\n".join(wrong))
        return 1
    site_search.widen(out / "html/search", searchable())
    with open(out / "html/search/search.css", "a", encoding="utf-8") as style:
        style.write((SITE / "search.css").read_text(encoding="utf-8"))
    print(f"{out}/html/index.html")
    return 0


def main():
    parser = argparse.ArgumentParser(description="Makes the API site by Doxygen.")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "build/site", help="folder to write (build/site)")
    parser.add_argument("--doxygen", default="doxygen", help="the program")
    o = parser.parse_args()
    return make(o.out.resolve(), o.doxygen)


if __name__ == "__main__":
    sys.exit(main())
