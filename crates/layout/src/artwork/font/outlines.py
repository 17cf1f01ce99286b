"""Writes `inter-outlines.txt`, the glyphs of `inter-subset.otf` as paths; needs fonttools.

    python crates/layout/src/artwork/font/outlines.py [--check]
"""

import sys
from pathlib import Path

from fontTools.pens.recordingPen import RecordingPen
from fontTools.ttLib import TTFont

LETTER = {"moveTo": "M", "lineTo": "L", "qCurveTo": "Q", "curveTo": "C", "closePath": "Z"}


def lines(font):
    yield f"# Inter Regular, {font['head'].unitsPerEm} units an em: character, advance, outline as an SVG path"
    glyphs = font.getGlyphSet()
    for code, name in sorted(font.getBestCmap().items()):
        pen = RecordingPen()
        glyphs[name].draw(pen)
        path = ""
        for command, points in pen.value:
            path += LETTER[command] + " ".join(f"{x},{y}" for x, y in points)
        yield f"{code:04x} {glyphs[name].width} {path}".rstrip()


here = Path(__file__).parent
text = "\n".join(lines(TTFont(here / "inter-subset.otf"))) + "\n"
file = here / "inter-outlines.txt"
if "--check" in sys.argv:
    sys.exit(None if file.read_text() == text else f"{file} is not what this program writes")
file.write_text(text)
