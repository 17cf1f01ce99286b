"""The same pages drawn by other programs.

    python viewers.py path/to/deltille path/to/deltag FOLDER

writes boards, a net and a sheet of tags to FOLDER as PDF, SVG and PNG. It renders the PDF with poppler and pdfium (the
engine of Chromium's viewer, through pypdfium2) and the SVG with Chromium, and compares every pixel with the PNG. Needs
numpy and Pillow; programs that are not installed are reported and skipped.
"""

import math
import pathlib
import shutil
import subprocess
import sys

import numpy as np
from PIL import Image

Image.MAX_IMAGE_PIXELS = None

DPI = 300

# Programs compute the coverage of a pixel on an edge differently: with 16 or 256 samples, or by area. Single pixels
# within EDGE_PX of an edge are therefore not compared. Instead, the mean over a square of that radius may differ by the
# effect of an edge displaced by the allowed number of pixels. Cairo, the renderer of poppler, draws at the exact page
# size. Chromium lays the page out in whole pixels of 1/96 inch and stretches it by less than one of them. Pdfium
# extends rectangles outwards to whole pixels. All other pixels are paper or ink, and may differ only by rounding.
EDGE_PX = 2
MAX_AT_EDGES = {name: px / (2 * EDGE_PX + 1) for name, px in (("poppler", 0.2), ("chromium", 0.67), ("pdfium", 2.0))}
MAX_ELSEWHERE = 2 / 255

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")

TARGETS = {
    "board": "board --rows 10 --cols 11 --edge 20mm",
    "boards": "board --rows 4 --cols 5 --edge 20mm --boards 2",
    "inverted": "board --rows 6 --cols 7 --edge 20mm --invert",
    "checker": "checkerboard --rows 5 --cols 8 --edge 25mm --tags aprilTag36h11 --tags-in white",
    "net": "tetrahedron --edge 90mm --paper A4",
}


def read(path):
    """Ink of an image, from 0 (paper) to 1: the darkest pixel counts as full ink, because pure K is not quite black on
    screen."""
    grey = np.asarray(Image.open(path).convert("L"), dtype=np.float32)
    return (grey.max() - grey) / max(float(grey.max() - grey.min()), 1.0)


def around(picture, combine):
    """Combines each pixel with those within EDGE_PX."""
    for axis in (0, 1):
        padded = np.pad(picture, [(EDGE_PX, EDGE_PX) if a == axis else (0, 0) for a in (0, 1)], "edge")
        size = picture.shape[axis]
        shifted = (padded.take(range(i, i + size), axis) for i in range(2 * EDGE_PX + 1))
        total = next(shifted).copy()
        for other in shifted:
            combine(total, other, out=total)
        picture = total
    return picture


def compare(ours, theirs, most_at_edges):
    """The largest differences away from edges and at edges, as fractions of the tolerances."""
    assert ours.shape == theirs.shape, f"{theirs.shape} px instead of {ours.shape}"
    least, most = around(ours, np.minimum), around(ours, np.maximum)
    flat = most - least < MAX_ELSEWHERE
    difference = theirs - ours
    elsewhere = float(np.abs(difference[flat]).max(initial=0.0))
    at_edges = float(np.abs(around(difference, np.add)).max()) / (2 * EDGE_PX + 1) ** 2
    return elsewhere / MAX_ELSEWHERE, at_edges / most_at_edges


def run(*command):
    subprocess.run([str(word) for word in command], check=True, capture_output=True)


def poppler(pdf, page, size, dpi, out):
    run("pdftocairo", "-f", page, "-l", page, "-r", dpi, "-antialias", "best", "-gray", "-png", "-singlefile",
        pdf, out.with_suffix(""))
    whole(Image.open(out), size).save(out)


def pdfium(pdf, page, size, dpi, out):
    import pypdfium2

    bitmap = pypdfium2.PdfDocument(pdf)[page - 1].render(scale=dpi / 72)
    whole(bitmap.to_pil().convert("L"), size).save(out)


def whole(picture, size):
    """The page from its upper left corner, padded with paper: programs round its size up or down."""
    page = Image.new("L", size, 255)
    page.paste(picture, (0, 0))
    return page


def chromium(svg, size, dpi, out):
    # Lengths in mm are laid out at 96 pixels per inch, and rendered at this multiple of that resolution.
    scale = dpi / 96
    window = [math.ceil(side / scale) + 1 for side in size]
    program = next(filter(shutil.which, CHROMIUM))
    run(program, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-dev-shm-usage",
        f"--force-device-scale-factor={scale!r}", f"--user-data-dir={out.parent / 'profile'}",
        f"--window-size={window[0]},{window[1]}", f"--screenshot={out}", svg.resolve().as_uri())
    whole(Image.open(out).convert("L"), size).save(out)


def viewers():
    """The installed viewers by name, with the format and the function that renders it."""
    found = {}
    if shutil.which("pdftocairo"):
        found["poppler"] = ("pdf", poppler)
    try:
        import pypdfium2  # noqa: F401

        found["pdfium"] = ("pdf", pdfium)
    except ImportError:
        pass
    if any(map(shutil.which, CHROMIUM)):
        found["chromium"] = ("svg", chromium)
    for name in {"poppler", "pdfium", "chromium"} - set(found):
        print(f"{name}: not here, left out")
    return found


def main(deltille, deltag, folder):
    folder = pathlib.Path(folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    formats = ["--pdf", "--svg", "--png", "--dpi", DPI, "--no-verify", "-o", folder]
    for name, options in TARGETS.items():
        run(deltille, *options.split(), "--name", name, *formats)
    run(deltag, "sheet", "d25h7", "--ids", "0-29", "--edge", "30mm", "--name", "tags", *formats)
    names = [*TARGETS, "tags"]
    here, failed = viewers(), 0
    for name in names:
        pages = sorted(folder.glob(f"{name}.png")) + sorted(folder.glob(f"{name}-[0-9].png"))
        assert pages, name
        worst = {}
        for number, png in enumerate(pages, 1):
            ours = read(png)
            size, dpi = ours.shape[::-1], Image.open(png).info["dpi"][0]
            for viewer, (kind, draw) in here.items():
                out = folder / f"{png.stem}.{viewer}.png"
                source = [folder / f"{name}.pdf", number] if kind == "pdf" else [png.with_suffix(".svg")]
                draw(*source, size, dpi, out)
                both = compare(ours, read(out), MAX_AT_EDGES[viewer])
                worst[viewer] = tuple(map(max, worst.get(viewer, (0, 0)), both))
        for viewer, (elsewhere, at_edges) in worst.items():
            good = max(elsewhere, at_edges) <= 1
            failed += not good
            print(f"{name}, {len(pages)} pages, {viewer}: {'agrees' if good else 'DIFFERS'}, "
                  f"elsewhere {elsewhere:.2f}, at edges {at_edges:.2f} of what is allowed")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) != 4:
        sys.exit(__doc__)
    sys.exit(main(*sys.argv[1:]))
