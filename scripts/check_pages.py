#!/usr/bin/env python3
"""Opens pages of `brdfit report` in headless Chromium and checks what a reader would notice.

What it does
    Pages are made of a metal, a plastic, a fabric and a retro-reflector (those beside the checkout are left out where they
    are absent), of all of them together, and of a plastic whose file and channels have names that would do harm if they were
    not escaped. Each is opened at the width of a desk and of a phone, light and dark, and on paper. The script exits 1 if
      - the browser logs anything, shows a dialog, or asks for anything but the page itself;
      - a figure is missing, or one is blank: fewer than 8 colours, or more than 99.5 % of its pixels of one colour;
      - anything is wider than the window, or a link does not open what it leads to;
      - axe-core finds a fault that it calls serious or critical.

How to run it (packages come from scripts/requirements-browser.txt, the browser is Debian's package chromium)
    python scripts/check_pages.py --brdfit target/release/brdfit
    python scripts/check_pages.py --brdfit target/release/brdfit --keep folder     # keeps the pages, with a picture of each
"""

from __future__ import annotations

import argparse
import io
import json
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import axe_playwright_python
import numpy as np
from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

from common import SHARED_DATA, checked_brdfit

ROOT = Path(__file__).resolve().parents[1]
CHROMIUM = "/usr/bin/chromium"
AXE = (Path(axe_playwright_python.__file__).parent / "axe.min.js").read_text(encoding="utf-8")

# Name, measurement, and the options of its fits.
MATERIALS = [
    ("metal", SHARED_DATA / "mwir/mwir_metals_lacquers.csv", ["-m", "cook-torrance", "-m", "cook-torrance(f=conductor)"]),
    ("plastic", ROOT / "data/satin-red-paint.csv", ["-m", "lambert", "-m", "lambert + cook-torrance"]),
    ("fabric", SHARED_DATA / "merl-slices/red-fabric-slice.exr", ["-m", "disney-2012", "--samples", "20000"]),
    ("retro", SHARED_DATA / "cea-retro/retro-3M-yellow.dat", ["-m", "ashikhmin-shirley + retro"]),
]
# A file and channels that a page must only ever show. A name of a file cannot hold a slash.
HOSTILE_FILE = "<img src=x onerror=alert(1)>&quot;.csv"
HOSTILE_CHANNELS = ["</script><script>alert(2)</script>", "\"onload='alert(3)'", "b</style><b>&amp;"]

# Kinds of figures that pages have: of several models, and of one.
OF_SEVERAL = {"front": 2, "sphere": 1, "map": 1, "lobe": 1, "residuals": 1}
OF_ONE = {"sphere": 1, "map": 1, "lobe": 2, "residuals": 1, "profile": 1, "convergence": 1}

VIEWS = [
    ("desk", {"width": 1280, "height": 900}, "light"),
    ("dark", {"width": 1280, "height": 900}, "dark"),
    ("phone", {"width": 390, "height": 800}, "light"),
]

faults: list[str] = []


def fault(where: str, what: str) -> None:
    faults.append(f"{where}: {what}")
    print(f"  FAULT {where}: {what}")


def run(*words: str | Path) -> None:
    done = subprocess.run([str(word) for word in words], capture_output=True, text=True, check=False)
    # A fit that is not usable exits 1; its page says so.
    if done.returncode > 1:
        sys.exit(f"{' '.join(map(str, words))}\n{done.stderr}")


def is_blank(pixels: np.ndarray) -> bool:
    """Whether a picture, of rows of pixels, shows next to nothing."""
    colours = pixels.astype(np.uint32) @ np.array([1 << 16, 1 << 8, 1], dtype=np.uint32)
    counts = np.bincount(np.unique(colours, return_inverse=True)[1].ravel())
    return len(counts) < 8 or counts.max() > 0.995 * counts.sum()


def check_figures(page: Page, where: str, expected: dict[str, int]) -> None:
    for kind, least in expected.items():
        found = page.locator(f"figure.{kind}").count()
        if found < least:
            fault(where, f"{found} figures of the kind {kind}, at least {least} expected")
    whole = np.asarray(Image.open(io.BytesIO(page.screenshot(full_page=True))).convert("RGB"))
    drawings = page.evaluate(
        """() => [...document.querySelectorAll('figure svg, .materials img')]
            .filter(e => !e.closest('details:not([open])')).map(e => {
            const r = e.getBoundingClientRect();
            return [r.left + scrollX, r.top + scrollY, r.width, r.height, e.getAttribute('alt') ?? e.querySelector('desc').textContent];
        })"""
    )
    for left, top, width, height, name in drawings:
        part = whole[int(top) : int(top + height), int(left) : int(left + width)]
        if width < 100 or height < 50:
            fault(where, f"a figure without room, {width} x {height}: {name}")
        elif is_blank(part):
            fault(where, f"a blank figure: {name}")


def check_width(page: Page, where: str) -> None:
    wide = page.evaluate(
        """() => [...document.querySelectorAll('body *')]
            .filter(e => !e.closest('svg') || e.tagName === 'svg')
            .filter(e => { const r = e.getBoundingClientRect(); return r.width > 1 && (r.right > innerWidth + 0.5 || r.left < -0.5); })
            .map(e => e.tagName + '.' + e.getAttribute('class'))"""
    )
    if wide or page.evaluate("document.documentElement.scrollWidth > innerWidth"):
        fault(where, f"wider than the window: {sorted(set(wide))}")


def check_access(page: Page, where: str) -> None:
    page.evaluate(AXE)
    # The text of a figure is in its title and description; its shapes have nothing to find.
    found = page.evaluate(
        """() => axe.run({exclude: ['svg > :not(title, desc)']}, {resultTypes: ['violations']}).then(result => result.violations
            .filter(violation => ['serious', 'critical'].includes(violation.impact))
            .map(violation => `${violation.id}, ${violation.help}: ${violation.nodes[0].html.slice(0, 200)}`))"""
    )
    for violation in found:
        fault(where, f"axe-core: {violation}")


def check_links(browser: Browser, path: Path) -> None:
    """Every picture of the list opens its material."""
    page = browser.new_page()
    page.goto(path.as_uri())
    for link in page.locator(".materials a").all():
        link.click()
        target = link.get_attribute("href")
        if not page.locator(target).is_visible():
            fault("all", f"{target} stays folded")
    page.close()


def check(browser: Browser, name: str, path: Path, expected: dict[str, int], keep: Path | None) -> None:
    """Checks a page in every view. What is folded is unfolded, unless no figures are expected."""
    for view, size, scheme in VIEWS:
        where = f"{name}, {view}"
        context = browser.new_context(viewport=size, color_scheme=scheme)
        page = context.new_page()
        page.on("console", lambda message, where=where: fault(where, f"console: {message.text}"))
        page.on("pageerror", lambda error, where=where: fault(where, f"error: {error}"))

        def on_dialog(dialog, where=where):
            fault(where, f"dialog: {dialog.message}")
            dialog.dismiss()

        page.on("dialog", on_dialog)
        asked: list[str] = []
        page.on("request", lambda request, asked=asked: asked.append(request.url))
        page.goto(path.as_uri())
        if expected:
            page.evaluate("document.querySelectorAll('details').forEach(e => { e.open = true })")
        foreign = [url for url in asked if not url.startswith("data:") and url != path.as_uri()]
        if foreign:
            fault(where, f"requests: {foreign}")
        check_width(page, where)
        # Colours change in the dark, and places on a phone.
        if view != "phone":
            check_access(page, where)
        if view != "dark":
            check_figures(page, where, expected)
        if keep:
            page.screenshot(path=keep / f"{name}-{view}.png", full_page=True)
        context.close()


def hostile_measurement(folder: Path) -> Path:
    """The plastic, in a file and with channels whose names would do harm."""
    rows = (ROOT / "data/satin-red-paint.csv").read_text(encoding="utf-8").splitlines()
    rows = [row for row in rows if not row.startswith("#")]
    columns = rows[0].split(",")
    names = dict(zip(["r", "g", "b"], HOSTILE_CHANNELS, strict=True))
    keep = [k for k, column in enumerate(columns) if column in names or column.startswith(("theta", "phi"))]
    quoted = ['"' + names.get(columns[k], columns[k]).replace('"', '""') + '"' for k in keep]
    path = folder / HOSTILE_FILE
    lines = [",".join(quoted)] + [",".join(row.split(",")[k] for k in keep) for row in rows[1:]]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--brdfit", metavar="PATH", help="the program")
    parser.add_argument("--keep", metavar="FOLDER", type=Path, help="keep the pages here, with a picture of each")
    arguments = parser.parse_args()
    brdfit = checked_brdfit(parser, arguments.brdfit)
    if not shutil.which(CHROMIUM):
        sys.exit(f"{CHROMIUM}: not found; it is Debian's package chromium")
    if arguments.keep:
        arguments.keep.mkdir(parents=True, exist_ok=True)

    with tempfile.TemporaryDirectory() as temporary, sync_playwright() as playwright:
        folder = Path(temporary)
        materials = [(name, path, options) for name, path, options in MATERIALS if path.exists()]
        for name, path, _ in MATERIALS:
            if not path.exists():
                print(f"skipped: {name}, {path} is absent")
        materials.append(("hostile", hostile_measurement(folder), ["-m", "lambert + cook-torrance"]))
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        reports = []
        for name, path, options in materials:
            report, page = folder / f"{name}.json", folder / f"{name}.html"
            run(brdfit, "fit", path, *options, "-q", "-o", report)
            began = time.monotonic()
            run(brdfit, "report", report, "-o", page)
            took = time.monotonic() - began
            reports.append(report)
            several = len(json.loads(report.read_text(encoding="utf-8")).get("reports", [])) > 1
            print(f"{name}: {page.stat().st_size / 1e6:.2f} MB in {took:.1f} s")
            check(browser, name, page, OF_SEVERAL if several else OF_ONE, arguments.keep)
            text = page.read_text(encoding="utf-8")
            if str(path.parent) in text or "<script" in text:
                fault(name, "a folder's name or a script in the page")
            if arguments.keep:
                shutil.copy(page, arguments.keep)
        # Its parts are those of the pages above: what is new is the list that opens them.
        together = folder / "all.html"
        run(brdfit, "report", *reports[:-1], "-o", together)
        check(browser, "all", together, {}, arguments.keep)
        check_links(browser, together)
        browser.close()
    if faults:
        sys.exit(f"{len(faults)} faults")
    print("no faults")


if __name__ == "__main__":
    main()
