"""Boards for lasers, glass and print shops, read by other programs: finishes.py DELTILLE FOLDER.

Lasers: ezdxf audits the DXF without an error, and lxml reads the SVG of the same board; shapely converts their closed
outlines to polygons, which must be valid and must not overlap. Without a kerf, they must cover the dark area of the
printed page. With a kerf, they must equal that area after shapely's inward offset with mitred corners, and the cut
outline must be larger by the same offset. The drawings of solids must have the area of their printed faces.

Glass: a mirrored page, rendered by poppler, gets no labels from `deltille detect` as printed, and all labels after
numpy mirrors it back.

Print shops: pikepdf finds the separations, their alternates and the overprint in the PDF; poppler and pdfium render it
like a PDF in plain black.

Needs ezdxf, shapely, lxml, pikepdf, numpy, Pillow, and pdftoppm; pypdfium2 if it is installed.
"""

import json
import pathlib
import re
import subprocess
import sys

import ezdxf
import numpy as np
import pikepdf
from lxml import etree
from PIL import Image
from shapely import affinity
from shapely.geometry import Polygon
from shapely.ops import unary_union

BOARDS = {
    "tagged": "board --rows 7 --cols 9 --edge 20mm",
    "inverted": "board --rows 5 --cols 6 --edge 20mm --invert",
    "plain": "board --rows 5 --cols 6 --edge 20mm --untagged",
    "dense": "board --rows 7 --cols 9 --edge 20mm --dense",
    "squares": "checkerboard --rows 5 --cols 6 --edge 30mm --tags t25h9",
    "white-squares": "checkerboard --rows 5 --cols 6 --edge 30mm --tags t36h11 --tags-in white",
    "black-squares": "checkerboard --rows 5 --cols 6 --edge 30mm --invert",
    "charuco": "charuco --squares 7x5 --edge 30mm",
    "aprilgrid": "aprilgrid --tags 4x4 --edge 25mm",
    "circles": "circles --circles 7x5 --spacing 25mm",
    "holes": "board --rows 5 --cols 6 --edge 30mm --family {families}/holed.json --hole 1.2mm",
}
SOLIDS = {
    "tetrahedron": "tetrahedron --edge 90mm --skeleton",
    "octahedron": "octahedron --edge 90mm",
    "cuboid": "cuboid --size 120x90x60mm",
}
KERFS_MM = (0.0, 0.1, 0.15)


def run(*words):
    subprocess.run([str(word) for word in words], check=True, stdout=subprocess.DEVNULL)


def even_odd(loops):
    shown = Polygon()
    for loop in loops:
        shown = shown.symmetric_difference(Polygon(loop))
    return shown


def printed(svgs):
    """The dark areas of the tiles and fields of each page, as polygons."""
    shapes = []
    for svg in svgs:
        height = float(etree.parse(svg).getroot().get("height").removesuffix("mm"))
        for data in re.findall(r'<path d="([^"]*)" id="(?:tile|field)-', svg.read_text()):
            shapes.append(even_odd([points(loop, height) for loop in data.split("Z") if loop]))
    return shapes


def points(loop, height):
    """The points of a loop of path data, y up; curves become polylines with many segments."""
    found = []
    for letter, words in re.findall(r"([MLC])([^MLCZ]*)", loop):
        numbers = np.array([float(word) for word in words.split()]).reshape(-1, 2) * (1, -1) + (0, height)
        if letter == "C":
            t = np.linspace(0, 1, 101)[1:, None]
            a, (b, c, d) = found[-1], numbers
            found.extend((1 - t) ** 3 * a + 3 * (1 - t) ** 2 * t * b + 3 * (1 - t) * t**2 * c + t**3 * d)
        else:
            found.append(numbers[0])
    return found


def of_dxf(path):
    """Outlines by layer."""
    drawing = ezdxf.readfile(path)
    assert not drawing.audit().errors and not drawing.audit().fixes, path
    assert drawing.units == ezdxf.units.MM, drawing.units
    outlines = {"CUT": [], "ENGRAVE": []}
    for entity in drawing.modelspace():
        assert entity.dxftype() == "POLYLINE" and entity.is_closed, entity
        outlines[entity.dxf.layer].append([tuple(v.dxf.location)[:2] for v in entity.vertices])
    return outlines


def of_svg(path):
    root = etree.parse(path).getroot()
    height = float(root.get("height").removesuffix("mm"))
    assert [float(end) for end in root.get("viewBox").split()][3] == height
    outlines = {}
    for path in root.iter("{*}path"):
        loops = [points(loop, height) for loop in path.get("d").split("Z") if loop]
        outlines[{"engrave": "ENGRAVE", "cut": "CUT"}[path.get("id")]] = loops
    return outlines


def regions(loops):
    """Polygons from loops: each counter-clockwise loop with the clockwise loops inside it as holes."""
    rings = [Polygon(loop) for loop in loops]
    assert all(ring.is_valid for ring in rings)
    outer = [ring for ring in rings if ring.exterior.is_ccw]
    holes = [ring for ring in rings if not ring.exterior.is_ccw]
    inside = {id(ring): [] for ring in outer}
    for hole in holes:
        at = hole.representative_point()
        # The point may lie in an island within the hole.
        around = [ring for ring in outer if ring.area > hole.area and ring.contains(at)]
        inside[id(min(around, key=lambda ring: ring.area))].append(hole.exterior.coords)
    made = [Polygon(ring.exterior.coords, inside[id(ring)]) for ring in outer]
    assert all(polygon.is_valid for polygon in made)
    return made


def eroded(shape, kerf):
    return shape.buffer(-kerf / 2, join_style="mitre", mitre_limit=10) if kerf else shape


def corner(shape):
    return np.array(shape.bounds[:2])


def check_laser(program, folder, name, command, is_solid):
    made = [program, *command.split(), "--name", name, "-o", folder, "--force"]
    run(*made, "--svg", *(["--per-face"] if is_solid else []), "--no-verify")
    shapes = printed(sorted(folder.glob(f"{name}.svg")) + sorted(folder.glob(f"{name}-[0-9]*.svg")))
    told = []
    for kerf in KERFS_MM:
        run(*made, "--laser", "dxf,svg", "--kerf", f"{kerf}mm")
        stated = [eroded(shape, kerf) for shape in shapes]
        area = sum(shape.area for shape in stated)
        for read, ending in ((of_dxf, "dxf"), (of_svg, "svg")):
            outlines = read(folder / f"{name}-laser.{ending}")
            polygons = regions(outlines["ENGRAVE"])
            found, together = sum(p.area for p in polygons), unary_union(polygons)
            assert abs(together.area / found - 1) < 1e-9, (name, "outlines overlap")
            # SVG coordinates have four decimals; a circle is drawn as a polygon with 360 sides.
            slack = 1e-4 if name == "circles" else 3e-5
            assert abs(found / area - 1) < slack, (name, kerf, ending, found, area)
            if is_solid:
                continue
            page = unary_union(stated)
            page = affinity.translate(page, *(corner(together) - corner(page)))
            beside = together.symmetric_difference(page).area
            assert beside / found < 2 * slack, (name, kerf, ending, beside)
            *holes, plate_loop = outlines["CUT"]
            cut, panel = Polygon(plate_loop), json.loads((folder / f"{name}.json").read_text())["panels"][0]
            width = panel.get("hole_mm", 0.0)
            assert len(holes) == (len(panel["tags"]) if width else 0), (name, len(holes))
            for hole in map(Polygon, holes):
                assert abs(hole.area / (np.pi / 4 * (width - kerf) ** 2) - 1) < 1e-3, (name, kerf, hole.area)
                assert hole.buffer(kerf / 2).intersection(together).area < 1e-3, (name, kerf)
            quiet = max(5.0, panel["edge_mm"] / 4) if not panel["inverted"] else 0.0
            plate = np.array(together.bounds) + np.array([-1, -1, 1, 1]) * (quiet + kerf)
            # Mitred tips of shrunken tiles end short of the original tips.
            tips = 0.6 * kerf if panel["kind"] == "deltille" else 0.0
            assert np.abs(np.array(cut.bounds) - plate).max() < 2e-4 + tips, (name, cut.bounds, plate)
        told.append(f"{found / 100:.3f}")
    print(f"{name}: {len(polygons)} regions, valid and apart; {' / '.join(told)} cm2 for kerfs of {KERFS_MM} mm")


def drawn(pdf, out, dpi=200):
    run("pdftoppm", "-r", dpi, "-gray", "-png", "-singlefile", pdf, out.with_suffix(""))
    return np.asarray(Image.open(out).convert("L"))


def labelled(program, picture, target, folder):
    path = folder / "seen.png"
    Image.fromarray(np.pad(picture, 40, constant_values=255)).save(path)
    detect = [program, "detect", path, "--target", target, "-o", folder / "found", "--force"]
    # The exit code is 1 if nothing is labelled.
    assert subprocess.run(detect, capture_output=True).returncode in (0, 1)
    grids = json.loads((folder / "found" / "seen.json").read_text())["grids"]
    return sum(corner.get("id") is not None for grid in grids for corner in grid["corners"])


def check_mirrored(program, folder):
    for name, command in BOARDS.items():
        # Untagged boards equal their mirror image, and this detector does not support circles.
        if name in ("circles", "plain", "black-squares"):
            continue
        run(program, *command.split(), "--name", "back", "--pdf", "--mirrored", "-o", folder, "--force")
        back = drawn(folder / "back.pdf", folder / "back.png")
        description = json.loads((folder / "back.json").read_text())
        assert description["finish"] == {"mirrored": True}
        count = sum(len(panel["corners"]) for panel in description["panels"])
        found = labelled(program, back[:, ::-1], folder / "back.json", folder)
        assert found == count, (name, found, count)
        assert labelled(program, back, folder / "back.json", folder) == 0, name
        print(f"{name}: {found} of {count} corners are labelled through the glass, none from the side of the print")


def check_spots(program, folder):
    contour, white = ["--contour", "CutContour"], ["--white", "RDG_WHITE"]
    pdfs = {}
    for kind, options in (("black", []), ("line", contour), ("spots", contour + white)):
        # The labels on the sheet contain the name of the board.
        run(program, *BOARDS["tagged"].split(), "--name", "plate", *options, "--pdf", "-o", folder / kind)
        pdfs[kind] = folder / kind / "plate.pdf"
    with pikepdf.open(pdfs["spots"]) as pdf:
        (page,) = pdf.pages
        found = {}
        for space in page.Resources.ColorSpace.values():
            kind, name, alternate, tint = space
            assert (kind, alternate) == ("/Separation", "/DeviceCMYK"), space
            found[str(name)] = [float(part) for part in tint.C1]
        assert found == {"/RDG_WHITE": [0, 0, 0, 0], "/CutContour": [0, 0, 0, 1]}, found
        (state,) = page.Resources.ExtGState.values()
        assert state.OP and state.op and int(state.OPM) == 1
        words = [str(operator) for _, operator in pikepdf.parse_content_stream(page)]
        # White is drawn first, and four lines have the contour colour.
        assert words[:9] == ["gs", "cs", "scn", "m", "l", "l", "l", "h", "f*"], words[:9]
        assert words.count("CS") == words.count("S") == 4
    with pikepdf.open(pdfs["black"]) as pdf:
        assert "/ColorSpace" not in pdf.pages[0].Resources
    viewers = {"poppler": lambda pdf: drawn(pdf, folder / "page.png", 300)}
    try:
        import pypdfium2

        viewers["pdfium"] = lambda pdf: np.asarray(pypdfium2.PdfDocument(pdf)[0].render(scale=2).to_pil().convert("L"))
    except ImportError:
        print("pdfium: not here, left out")
    for viewer, draw in viewers.items():
        line, spots = (draw(pdfs[kind]).astype(int) for kind in ("line", "spots"))
        # Pixels at edges are rounded on white and on bare paper.
        apart = np.abs(line - spots)
        assert apart.max() <= 4 and (apart > 0).mean() < 1e-3, (viewer, apart.max(), (apart > 0).sum())
    names = ", ".join(sorted(found))
    print(f"spot colours: {names} are separations, all overprints; {', '.join(viewers)} show what they show without")


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    # A family with room for a hole in the middle of its tags.
    search = "gen-family d16h5 --free centre --method lexicode --name holed --force -o"
    run(pathlib.Path(program).with_name("deltag"), *search.split(), folder)
    BOARDS["holes"] = BOARDS["holes"].format(families=folder)
    for name, command in BOARDS.items():
        check_laser(program, folder, name, command, False)
    for name, command in SOLIDS.items():
        check_laser(program, folder, name, command, True)
    check_mirrored(program, folder)
    check_spots(program, folder)


main()
