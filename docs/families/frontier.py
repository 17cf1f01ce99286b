"""The plot in docs/families.md of what rules for complexity cost and save.

    frontier.py DELTAG            writes frontier.svg beside this script
    frontier.py DELTAG --check    fails where it is not that of the program

A curve for each number of corrected cells: codes that satisfy the rule, and natural false positives.
"""

import json
import math
import pathlib
import subprocess
import sys

FAMILY, SHIPPED, ACCEPTED = "d36h9", 19, 1e-4
WIDTH, HEIGHT = 760, 460
LEFT, RIGHT, TOP, BOTTOM = 80, 130, 24, 56
CODES, RATES = (0, 24_000), (1e-10, 1e-1)
# Rules that leave fewer codes are not drawn.
FEWEST = 500
COLOURS = ["#0b3c5d", "#1d7874", "#679436", "#c98a00", "#b3261e"]
# Thresholds that are written beside the points of the curve in the middle.
WRITTEN = (17, 19, 20, 21, 23, 25, 27)


def x(codes):
    return LEFT + (codes - CODES[0]) / (CODES[1] - CODES[0]) * (WIDTH - LEFT - RIGHT)


def y(rate):
    low, high = (math.log10(end) for end in RATES)
    return HEIGHT - BOTTOM - (math.log10(rate) - low) / (high - low) * (HEIGHT - TOP - BOTTOM)


def line(x1, y1, x2, y2, style):
    return f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" {style}/>'


def text(at_x, at_y, said, style=""):
    return f'<text x="{at_x:.1f}" y="{at_y:.1f}" {style}>{said}</text>'


def main():
    told = json.loads(subprocess.run([sys.argv[1], "frontier", FAMILY, "--json"], check=True, capture_output=True).stdout)
    choices = [choice for choice in told["choices"] if choice["codes"] >= FEWEST]
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" font-family="sans-serif" font-size="13" fill="#222">',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#fff"/>',
    ]
    grid = 'stroke="#ddd"'
    for power in range(round(math.log10(RATES[0])), round(math.log10(RATES[1])) + 1, 2):
        parts.append(line(LEFT, y(10**power), WIDTH - RIGHT, y(10**power), grid))
        parts.append(text(LEFT - 8, y(10**power) + 4, f'10<tspan font-size="10" dy="-5">−{-power}</tspan>', 'text-anchor="end"'))
    for codes in range(0, CODES[1] + 1, 4000):
        parts.append(line(x(codes), TOP, x(codes), HEIGHT - BOTTOM, grid))
        parts.append(text(x(codes), HEIGHT - BOTTOM + 18, f"{codes:,}", 'text-anchor="middle"'))
    middle = (LEFT + WIDTH - RIGHT) / 2
    parts.append(text(middle, HEIGHT - 12, f"codes of {FAMILY} that satisfy the rule", 'text-anchor="middle"'))
    turned = f'text-anchor="middle" transform="rotate(-90 20 {HEIGHT / 2})"'
    parts.append(text(20, HEIGHT / 2, "natural false positives of a triangle with a border", turned))
    dashed = 'stroke="#b3261e" stroke-dasharray="5 4"'
    parts.append(line(LEFT, y(ACCEPTED), WIDTH - RIGHT, y(ACCEPTED), dashed))
    shipped = next(choice for choice in choices if choice["min_pairs"] == SHIPPED)
    parts.append(line(x(shipped["codes"]), TOP, x(shipped["codes"]), HEIGHT - BOTTOM, 'stroke="#888" stroke-dasharray="2 3"'))
    parts.append(text(x(shipped["codes"]) - 6, TOP + 16, f"shipped: {SHIPPED} of 45 pairs", 'text-anchor="end" fill="#555"'))
    for corrected, colour in enumerate(COLOURS):
        points = [(choice, x(choice["codes"]), y(choice["natural_false_positive_rate"][corrected])) for choice in choices]
        points = [point for point in points if TOP <= point[2] <= HEIGHT - BOTTOM]
        path = " ".join(f"{px:.1f},{py:.1f}" for _, px, py in points)
        parts.append(f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="1.6"/>')
        parts += [f'<circle cx="{px:.1f}" cy="{py:.1f}" r="2.6" fill="{colour}"/>' for _, px, py in points]
        _, px, py = points[0]
        said = ["nothing corrected", "1 cell", "2 cells", "3 cells", "4 cells"][corrected]
        parts.append(text(WIDTH - RIGHT + 6, py + 4, said, f'fill="{colour}"'))
        if corrected == 2:
            for choice, px, py in points:
                if choice["min_pairs"] in WRITTEN:
                    parts.append(text(px, py + 17, choice["min_pairs"], 'text-anchor="middle" font-size="11" fill="#555"'))
    parts.append("</svg>")
    path, drawn = pathlib.Path(__file__).with_name("frontier.svg"), "\n".join(parts) + "\n"
    if "--check" not in sys.argv:
        path.write_text(drawn)
    elif path.read_text() != drawn:
        sys.exit(f"{path.name} is not what {FAMILY} gives: run this without --check")


if __name__ == "__main__":
    main()
