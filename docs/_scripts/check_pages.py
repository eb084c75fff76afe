"""Open every built page in Chromium without a network, and say what a reader would stumble over.

    python docs/_scripts/check_pages.py [docs/_build/html] [--pictures FOLDER] [--only PART]

At 1440 and 820 px: a request to the outside, an error on the console, an equation that is not drawn,
a picture that is not there, a page wider than its window. One line each; exit code 1 where there is
any. ``--pictures`` keeps a picture of every page that is not of the API.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

from playwright.sync_api import Page, Route, sync_playwright

WIDTHS = (1440, 820)

BROWSERS = 2
"""At once: most of the time of a page is its script, on one processor."""

FOUND_ON_PAGE = r"""async () => {
  const said = [];
  if (window.MathJax && MathJax.startup) await MathJax.startup.promise;
  const equations = document.querySelectorAll(".math");
  const bare = [...equations].filter((e) => !e.querySelector("mjx-container svg"));
  if (bare.length) said.push(`${bare.length} equations are not drawn: ${bare[0].textContent}`);
  const wrong = document.querySelectorAll('[data-mml-node="merror"], mjx-merror');
  if (wrong.length) said.push(`TeX cannot be read: ${wrong[0].textContent}`);
  const walker = document.createTreeWalker(document.querySelector("article") || document.body,
                                           NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    if (node.parentElement.closest("pre, code, script, style, mjx-container")) continue;
    if (/\$[^$]+\$|\\\(|\\\[/.test(node.textContent)) said.push(`bare TeX: ${node.textContent.trim()}`);
  }
  for (const image of document.images) {
    if (image.getClientRects().length && image.complete && !image.naturalWidth) {
      said.push(`no picture: ${image.getAttribute("src")}`);
    }
  }
  const wide = document.documentElement.scrollWidth - window.innerWidth;
  if (wide > 0) {
    const culprit = [...document.querySelectorAll("article *")].find(
      (e) => e.getBoundingClientRect().right > window.innerWidth + 1);
    said.push(`${wide} px wider than the window: ${culprit ? culprit.outerHTML.slice(0, 120) : ""}`);
  }
  return said;
}"""
"""What a reader sees, from inside the page."""


def browser_program() -> str:
    """Path of the Chromium that is installed."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        if found := shutil.which(name):
            return found
    raise SystemExit("no Chromium here (Debian: apt-get install chromium): pages are not opened")


def stumbles(page: Page, path: Path, picture: Path | None) -> list[str]:
    """What is wrong with one page at any width; pictures of it where they are wanted."""
    said: list[str] = []

    def gate(route: Route) -> None:
        address = route.request.url
        if address.startswith(("file:", "data:", "blob:")):
            route.continue_()
        else:
            said.append(f"asks the network for {address}")
            route.abort()

    def heard(message) -> None:
        if message.type == "error":
            said.append(f"console: {message.text}")

    def thrown(error) -> None:
        said.append(f"script: {error}")

    page.route("**/*", gate)
    page.on("console", heard)
    page.on("pageerror", thrown)
    page.set_viewport_size({"width": WIDTHS[0], "height": 1000})
    page.goto(path.as_uri(), wait_until="load")
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": 1000})
        said += [f"at {width} px: {line}" for line in page.evaluate(FOUND_ON_PAGE)]
        if picture:
            page.screenshot(path=f"{picture}-{width}.png", full_page=True)
    page.remove_listener("console", heard)
    page.remove_listener("pageerror", thrown)
    page.unroute("**/*")
    return said


def faults(root: Path, pictures: Path | None, pages: list[Path]) -> list[str]:
    """What is wrong with pages, in a browser of their own."""
    said = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(
            executable_path=browser_program(), args=["--no-sandbox"]
        )
        page = browser.new_context(offline=True).new_page()
        for path in pages:
            name = path.relative_to(root)
            kept = pictures and name.parts[0] != "api"
            picture = pictures / "-".join(name.with_suffix("").parts) if kept else None
            said += [f"{name}: {line}" for line in stumbles(page, path, picture)]
        browser.close()
    return said


def main() -> None:
    """Open all pages, print what is wrong, and end with 1 where there is anything."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("docs/_build/html"))
    parser.add_argument("--pictures", type=Path, help="Folder for a picture of every page.")
    parser.add_argument("--only", default="", help="Pages whose path contains this.")
    wanted = parser.parse_args()
    root = wanted.folder.resolve()
    pages = [p for p in sorted(root.rglob("*.html")) if wanted.only in str(p.relative_to(root))]
    if not pages:
        raise SystemExit(f"{root}: no page; build them with make docs")
    shares = [share for i in range(BROWSERS) if (share := pages[i::BROWSERS])]
    with ThreadPoolExecutor(len(shares)) as pool:
        found = list(pool.map(partial(faults, root, wanted.pictures), shares))
    said = sorted(line for some in found for line in some)
    print("\n".join([*said, ""]), end="")
    print(f"{len(pages)} pages at {len(WIDTHS)} widths without a network: {len(said)} faults")
    sys.exit(1 if said else 0)


if __name__ == "__main__":
    main()
