#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Finds pages of the API site that scroll sideways on a phone.

usage: check_widths.py SITE [PAGE...] [--width PIXELS] [--chromium PROGRAM]

Loads the pages of SITE (all of the folder html that tools/make_site.py writes) in Chromium, in a frame of
390 pixels. Prints a line for each that is wider, with the elements that stick out, and then returns 1.
"""
import argparse
import functools
import http.server
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

FRAMES, LONGEST_S = 4, 600
PROBE = """<!doctype html><meta charset="utf-8"><body><script>
const pages = %PAGES%, found = [];
function widest(d) {  // elements that reach beyond the frame, and that no parent cuts off or scrolls
  const most = d.documentElement.clientWidth, out = [];
  for (const e of d.body.querySelectorAll("*")) {
    if (e.getBoundingClientRect().right <= most + 0.5) continue;
    let p = e.parentElement;
    while (p && p !== d.body && d.defaultView.getComputedStyle(p).overflowX === "visible") p = p.parentElement;
    if (p === d.body) out.push(e.tagName.toLowerCase() + "." + e.className + " " + e.textContent.trim().slice(0, 40));
  }
  return out.slice(-3);
}
async function work() {
  const frame = document.createElement("iframe");
  frame.style = "border: 0; width: %WIDTH%px; height: 800px";
  document.body.append(frame);
  while (pages.length) {
    const page = pages.pop();
    await new Promise(done => { frame.onload = done; frame.src = "/" + page; });
    const d = frame.contentDocument, width = d.documentElement.scrollWidth;
    if (!d.title) found.push([page, 0, ["not loaded"]]);
    else if (width > %WIDTH%) found.push([page, width, widest(d)]);
  }
}
Promise.all(Array.from({length: %FRAMES%}, work)).then(
  () => fetch("/found", {method: "POST", body: JSON.stringify(found)}));
</script>"""


class Handler(http.server.SimpleHTTPRequestHandler):
    def do_GET(self):
        if self.path != "/probe":
            try:
                return super().do_GET()
            except ConnectionError:  # the browser needs a picture no longer
                return None
        self.send_response(200)
        self.send_header("Content-Type", "text/html")
        self.end_headers()
        return self.wfile.write(self.server.probe.encode())

    def do_POST(self):
        self.server.found = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()
        self.server.done.set()

    def log_message(self, *args):
        pass


def wide_pages(site, width, chromium, names=()):
    """[page, its width, its widest elements] of each page that is wider than `width`, or None without an answer."""
    handler = functools.partial(Handler, directory=str(site))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, \
            tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        pages = json.dumps(names or sorted(p.name for p in site.glob("*.html")))
        server.probe = PROBE.replace("%PAGES%", pages).replace("%WIDTH%", str(width)).replace("%FRAMES%", str(FRAMES))
        server.found, server.done = None, threading.Event()
        threading.Thread(target=server.serve_forever, daemon=True).start()
        browser = subprocess.Popen(
            [chromium, "--headless", "--no-sandbox", "--disable-gpu", f"--user-data-dir={profile}", "--hide-scrollbars",
             "--remote-debugging-port=0", f"http://127.0.0.1:{server.server_port}/probe"],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        server.done.wait(LONGEST_S)
        browser.terminate()
        browser.wait()
        server.shutdown()
        return server.found


def main():
    parser = argparse.ArgumentParser(description="Finds pages that scroll sideways on a phone.")
    parser.add_argument("site", type=pathlib.Path, help="folder of the pages")
    parser.add_argument("pages", nargs="*", help="names of pages (all)")
    parser.add_argument("--width", type=int, default=390, help="pixels of the screen (390)")
    parser.add_argument("--chromium", default="chromium", help="the program")
    o = parser.parse_args()
    if shutil.which(o.chromium) is None or not (o.site / "index.html").is_file():
        print(f"check_widths.py: there is no program {o.chromium}, or no {o.site}/index.html", file=sys.stderr)
        return 2
    found = wide_pages(o.site.resolve(), o.width, o.chromium, o.pages)
    if found is None:
        print(f"check_widths.py: {o.chromium} gave no answer in {LONGEST_S} s", file=sys.stderr)
        return 2
    for page, width, elements in sorted(found):
        print(f"{page}: error: {width} pixels wide on a screen of {o.width}: {'; '.join(elements)}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
