"""Compares logos on pages with their SVG: logos.py DELTILLE FOLDER [SVG...].

Chromium renders each SVG, and pixels that are not white count as ink. Poppler renders the page of a board with the logo
at 1200 dpi. At the stated position of the logo, both must show the same ink: their intersection is at least 0.98 of
their union. The same must apply to a logo rotated in a strip along the right margin, and to a mirrored logo. The tiles
of the page must be byte-identical to those of the page without a logo.

Needs chromium ($CHROMIUM), pdftoppm, numpy, Pillow.
"""

import json
import math
import os
import pathlib
import re
import subprocess
import sys

import numpy as np
from PIL import Image

Image.MAX_IMAGE_PIXELS = None
DPI = 1200
LEAST = 0.98
HEAD = '<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 200 100">'
LOGOS = {
    "strokes": """<g fill="none" stroke="#036" stroke-width="9"><path d="M10 90L40 10L70 90"/>
        <path d="M80 20H120V80H80" stroke-linejoin="round" stroke-linecap="round"/>
        <path d="M135 20H185V80H135Z" stroke-linejoin="bevel" stroke-dasharray="14 6"/></g>""",
    "holes": """<path fill-rule="evenodd" fill="#c30" d="M10 10H90V90H10ZM30 30H70V70H30ZM40 40H60V60H40Z"/>
        <circle cx="140" cy="50" r="45"/><path fill="white" d="M140 20L166 65H114Z"/><circle cx="140" cy="50" r="6" fill="#777"/>""",
    "over-each-other": """<style>.w { fill: #ffffff }</style><rect x="5" y="5" width="90" height="90" rx="20"/>
        <ellipse cx="90" cy="50" rx="60" ry="30" fill="blue"/><rect class="w" x="60" y="40" width="80" height="10"/>
        <path d="M20 20L180 80L180 90L20 30Z"/>""",
    "clips-and-copies": """<defs><path id="t" d="M0 0L20 35L-20 35Z"/><clipPath id="c"><circle cx="100" cy="50" r="45"/></clipPath></defs>
        <g clip-path="url(#c)"><use xlink:href="#t" x="60" y="10"/><use xlink:href="#t" x="100" y="10" transform="rotate(15 100 30)"/>
        <use href="#t" transform="translate(140 10) scale(1 1.5)"/><rect x="20" y="70" width="160" height="40"/></g>
        <path d="M5 50C5 20 40 5 50 30S70 90 30 95 5 80 5 50Z"/>""",
    "arcs": """<path d="M20 80A60 40 20 1 1 120 70A30 30 0 0 0 90 40Q60 10 40 60T20 80Z" transform="skewX(-15) translate(30 0)"/>""",
}
BOARDS = {
    "strip": "board --rows 6 --cols 7 --edge 20mm",
    "large": "board --rows 6 --cols 7 --edge 20mm --paper A3 --logo-height 25mm",
    "turned": "board --rows 10 --cols 11 --edge 20mm --paper A4",
    "mirrored": "checkerboard --rows 5 --cols 7 --mirrored",
}


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def drawn_by_chromium(svg, folder):
    """The ink of an SVG, cut to its bounds."""
    text = svg.read_text()
    picture, page = folder / "reference.png", folder / "reference.html"
    text = re.sub(r"<\?xml[^>]*\?>|<!DOCTYPE[^>]*>", "", text)
    page.write_text(
        "<body style='margin:0;background:#fff'><style>svg{position:absolute;left:100px;top:100px;width:2400px;"
        f"height:1200px;overflow:visible}}</style>{text}</body>"
    )
    chromium = os.environ.get("CHROMIUM", "chromium")
    run(chromium, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--window-size=2600,1400",
        f"--screenshot={picture}", page.resolve().as_uri())
    ink = np.asarray(Image.open(picture).convert("RGB")).min(axis=2) < 250
    edge = np.asarray(Image.open(picture).convert("RGB")).min(axis=2) < 128
    assert ink.any(), svg
    return cut(edge | shrunk(ink))


def shrunk(ink):
    """Pixels with ink 2 px away on all four sides, which excludes edge pixels that are light but not white."""
    inside = ink.copy()
    for axis in (0, 1):
        for way in (-2, 2):
            inside &= np.roll(ink, way, axis)
    return inside


def cut(ink):
    rows, columns = (np.flatnonzero(ink.any(axis=axis)) for axis in (1, 0))
    return ink[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]


def printed(pdf, sheet, place, width_mm, is_mirrored, folder):
    """The ink of a page at the position of the logo, upright."""
    scale = DPI / 25.4
    turn = place["angle_rad"]
    x, y = place["at_mm"]
    along = np.array([math.cos(turn), math.sin(turn)])
    inwards = np.array([-along[1], along[0]])
    height = place["height_mm"]
    corners = np.array([[x, y] + a * along + b * inwards for a in (0, width_mm) for b in (0, height)])
    (left, lower), (right, upper) = corners.min(axis=0), corners.max(axis=0)
    if is_mirrored:
        left, right = sheet["width_mm"] - right, sheet["width_mm"] - left
    columns = [round(value * scale) for value in (left, right)]
    rows = [round((sheet["height_mm"] - value) * scale) for value in (upper, lower)]
    part = ["-x", columns[0], "-y", rows[0], "-W", columns[1] - columns[0], "-H", rows[1] - rows[0]]
    run("pdftoppm", "-r", DPI, *part, "-gray", "-png", "-singlefile", pdf, folder / "logo")
    ink = np.asarray(Image.open(folder / "logo.png").convert("L")) < 128
    ink = ink[:, ::-1] if is_mirrored else ink
    return np.rot90(ink, -round(turn / (math.pi / 2)))


def tiles(svg):
    return re.findall(r'<path d="[^"]*" id="tile-[^>]*>', svg.read_text())


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    svgs = []
    for name, body in LOGOS.items():
        svgs.append(folder / f"{name}.svg")
        svgs[-1].write_text(f"{HEAD}{body}</svg>")
    svgs.append(pathlib.Path(__file__).parents[2] / "docs/gallery/logo.svg")
    svgs += map(pathlib.Path, sys.argv[3:])
    worst = 1.0
    for svg in svgs:
        reference = drawn_by_chromium(svg, folder)
        for board, words in BOARDS.items():
            out = folder / f"{svg.stem}-{board}"
            command = [*words.split(), "--pdf", "--svg", "--force", "-o", out]
            run(program, *command, "--logo", svg)
            kind = words.split()[0]
            target = json.loads((out / f"{kind}.json").read_text())
            sheet = target["sheets"][0]
            (place,) = sheet["logos"]
            numbers = [int(n) for n in re.findall(r"[ML](\d+) ", target["logo"])]
            width_mm = max(numbers) / 10_000 * place["height_mm"]
            ink = printed(out / f"{kind}.pdf", sheet, place, width_mm, "mirrored" in words, folder)
            same = np.asarray(Image.fromarray(reference).resize(ink.shape[::-1], Image.Resampling.BOX))
            ratio = (ink & same).sum() / (ink | same).sum()
            worst = min(worst, ratio)
            words = [word for word in words.split() if word not in ("--logo-height", "25mm")]
            run(program, *words, "--svg", "--force", "--no-verify", "-o", folder / "plain")
            is_same = tiles(out / f"{kind}.svg") == tiles(folder / "plain" / f"{kind}.svg")
            print(f"{svg.stem} {board}: {ratio:.4f} of {ink.shape[1]} x {ink.shape[0]} px")
            assert ratio >= LEAST and is_same, (svg, board, is_same)
    print(f"{len(svgs)} logos on {len(BOARDS)} boards each: at least {worst:.4f}")


main()
