"""The same ChArUco board from several generators: does the page have the stated size, and are its corners in place?

    python prints.py path/to/deltille FOLDER    # writes FOLDER/prints.json

Each page is drawn by two programs at 600 dpi where its format allows it. OpenCV finds the corners on the page; a similarity with
separate scales along both axes is fitted to their nominal positions, and what remains are errors of single corners. An image
without a format for printing is measured at the resolution for which it was requested. The detector of the same project reads
each page, reduced to 75 dpi. A 3MF file for printers with two colours is drawn as seen from above its face, and the corners of
its AprilTags are where lines fitted to their edges meet.
"""

import json
import pathlib
import shutil
import subprocess
import sys

import cv2
import numpy as np

import detectors
import meshes
import protocol
import public

DPI = 600
IMAGE_DPI = 300
COLUMNS, ROWS, SQUARE_MM, MARKER_MM = 12, 9, 20.0, 15.0


def pages_of_deltille(deltille, folder):
    command = [deltille, *protocol.BOARDS["charuco"].split(), "--pdf", "--svg", "--name", "ours", "-o", folder, "--force"]
    subprocess.run([str(part) for part in command], check=True, capture_output=True)
    yield "PDF, poppler", *by_poppler(folder / "ours.pdf")
    yield "PDF, pdfium", *by_pdfium(folder / "ours.pdf")
    yield from drawn(folder / "ours.svg")


def pages_of_opencv(_, folder):
    board = board_of_opencv()
    size = [round(count * SQUARE_MM * IMAGE_DPI / 25.4) for count in (COLUMNS, ROWS)]
    yield f"image, {IMAGE_DPI} dpi", board.generateImage(size, marginSize=0), IMAGE_DPI


def pages_of_calib_targets(_, folder):
    import calib_targets as ct

    page = ct.PageSpec(size=ct.PageSize.custom(width_mm=297.0, height_mm=210.0), margin_mm=10.0)
    document = ct.charuco_document(
        rows=ROWS, cols=COLUMNS, square_size_mm=SQUARE_MM, marker_size_rel=MARKER_MM / SQUARE_MM, dictionary="DICT_4X4_100",
        page=page, render=ct.RenderOptions(png_dpi=IMAGE_DPI),
    )
    written = ct.write_target_bundle(document, str(folder / "calib-targets"))
    yield from drawn(pathlib.Path(written.svg_path))
    yield f"image, {IMAGE_DPI} dpi", cv2.imread(str(written.png_path), cv2.IMREAD_GRAYSCALE), IMAGE_DPI


def pages_of_pattern_tools(_, folder):
    """OpenCV's script generate_pattern.py, formerly gen_pattern.py, which only the sources contain."""
    archive = public.fetched(folder.parent / "archives", "opencv")
    if archive is None:
        return
    tools = folder / "pattern_tools"
    public.extract(archive, "*/pattern-tools/*", tools)
    path = folder / "pattern.svg"
    board = ["--columns", COLUMNS, "--rows", ROWS, "--square_size", SQUARE_MM, "--marker_size", MARKER_MM, "-w", 297, "-h", 210]
    board += ["-T", "charuco_board", "-f", tools / "DICT_4X4_100.json.gz", "-o", path]
    command = [sys.executable, tools / "generate_pattern.py", *board]
    subprocess.run([str(part) for part in command], check=True)
    yield from drawn(path)


# The pages, and the detector of the same project.
GENERATORS = {
    "deltille": (pages_of_deltille, detectors.Deltille),
    "OpenCV CharucoBoard": (pages_of_opencv, detectors.OpenCvCharuco),
    "OpenCV generate_pattern.py": (pages_of_pattern_tools, detectors.OpenCvCharuco),
    "calib-targets": (pages_of_calib_targets, detectors.CalibTargets),
}


def mesh_of_deltille(deltille, folder):
    options = "aprilgrid --tags 2x2 --edge 30mm --gap 0.3 --tag-border 1 --3mf --force".split()
    subprocess.run([str(deltille), *options, "-o", str(folder)], check=True, capture_output=True)
    panel = json.loads((folder / "aprilgrid.json").read_text())["panels"][0]
    places = {(of["row"], of["col"]): of["target_mm"][:2] for of in panel["corners"]}
    # As detectors.CW_FROM_LOWER_RIGHT.
    order = [(0, 1), (0, 0), (1, 0), (1, 1)]
    stated = {of["id"]: [places[of["row"] + up, of["col"] + right] for up, right in order] for of in panel["tags"]}
    return folder / "aprilgrid.3mf", stated, lambda image: len(detectors.Deltille("aprilgrid", folder)(image))


def mesh_of_aprilcube(_, folder):
    import aprilcube

    made = folder / "aprilcube"
    options = ["--grid", "2x2x1", "--dict", "apriltag_36h11", "--tag-size", "30"]
    subprocess.run([sys.executable, "-m", "aprilcube.cli", "generate", *options, "-o", made], check=True, capture_output=True)
    config, faces = aprilcube.load_cube_config(str(made / "config.json"))
    of_cube = aprilcube.build_tag_corner_map(config)
    # Finding tags needs no camera.
    detect = aprilcube.detector(made, np.eye(3)).detect_markers
    return made / "cube.3mf", {tag: of_cube[tag][:, :2] for tag in faces["+Z"]}, lambda image: 4 * len(detect(image).corners)


# The 3MF file, the corners of each tag on its upper face in OpenCV's order, and how many corners the project's detector finds.
MESHES = {"deltille": mesh_of_deltille, "aprilcube": mesh_of_aprilcube}


def by_poppler(path):
    drawn = path.with_suffix("")
    # pdftoppm would move edges to a grid of a quarter of a pixel.
    subprocess.run(["pdftocairo", "-r", str(DPI), "-gray", "-png", "-singlefile", path, drawn], check=True)
    return cv2.imread(f"{drawn}.png", cv2.IMREAD_GRAYSCALE), DPI


def by_pdfium(path):
    import pypdfium2

    page = pypdfium2.PdfDocument(str(path))[0]
    return page.render(scale=DPI / 72, grayscale=True).to_numpy().squeeze(), DPI


def by_cairo(path):
    import cairosvg

    png = path.with_suffix(".cairo.png")
    # Lengths in mm become pixels at 96 dpi, which are then scaled.
    cairosvg.svg2png(url=str(path), write_to=str(png), scale=DPI / 96, background_color="white")
    return cv2.imread(str(png), cv2.IMREAD_GRAYSCALE), DPI


def by_chromium(path):
    """The page as Chromium prints it to PDF, drawn by poppler."""
    pdf = path.with_suffix(".chromium.pdf")
    text = path.read_text()
    page = path.with_suffix(".html")
    style = "@page { size: 297mm 210mm; margin: 0 } body { margin: 0 } svg { display: block }"
    page.write_text(f"<style>{style}</style>{text[text.index('<svg'):]}")
    flags = ["--headless", "--no-sandbox", "--disable-gpu", "--no-pdf-header-footer", f"--print-to-pdf={pdf}"]
    subprocess.run(["chromium", *flags, page.as_uri()], check=True, capture_output=True)
    return by_poppler(pdf)


RENDERERS = {"cairo": by_cairo} | ({"Chromium": by_chromium} if shutil.which("chromium") else {})


def drawn(path):
    """An SVG as drawn by each program that is installed."""
    for way, draw in RENDERERS.items():
        yield f"SVG, {way}", *draw(path)


def board_of_opencv():
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_100)
    return cv2.aruco.CharucoBoard((COLUMNS, ROWS), SQUARE_MM, MARKER_MM, dictionary)


def measured(image, dpi):
    """Scales along both axes (ppm from 1), RMS and largest error of corners (µm), and the numbers of corners and markers."""
    board = board_of_opencv()
    parameters = cv2.aruco.DetectorParameters()
    parameters.adaptiveThreshWinSizeMax = 153
    # Markers are several hundred pixels wide.
    padded = cv2.copyMakeBorder(image, 100, 100, 100, 100, cv2.BORDER_CONSTANT, value=255)
    corners, ids, _, markers = cv2.aruco.CharucoDetector(board, cv2.aruco.CharucoParameters(), parameters).detectBoard(padded)
    if ids is None:
        return {"corners": 0, "markers": 0}
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 100, 1e-5)
    places = cv2.cornerSubPix(padded, corners.astype(np.float32), (15, 15), (-1, -1), criteria).reshape(-1, 2) - 100
    page_mm = (places + 0.5) * 25.4 / dpi
    nominal = np.array(board.getChessboardCorners())[np.ravel(ids), :2]
    return errors(page_mm, nominal) | {"corners": len(ids), "markers": len(markers)}


def errors(page_mm, nominal):
    design = np.c_[nominal, np.ones(len(nominal))]
    fit, *_ = np.linalg.lstsq(design, page_mm, rcond=None)
    scales = np.linalg.norm(fit[:2], axis=1)
    off = 1e3 * (page_mm - design @ fit)
    return {
        "scale_ppm": [float(1e6 * (scale - 1)) for scale in scales],
        "rms_um": float(np.sqrt(np.mean(off**2))), "largest_um": float(np.hypot(*off.T).max()),
    }


def measured_mesh(path, stated, count, draw):
    """The same for the tags of a 3MF file, whether their cells are exact, and whether its bodies are closed."""
    bodies = meshes.bodies(path)
    face = path.with_suffix(".face.svg")
    meshes.write_face(bodies, face)
    image, dpi = draw(face)
    found = meshes.tags(image, dpi)
    read = [tag for tag in stated if tag in found]
    row = {"corners": 4 * len(read), "markers": len(read)}
    if read:
        places = np.vstack([found[tag][0] for tag in read])
        row |= errors((places + 0.5) * 25.4 / dpi, np.vstack([stated[tag] for tag in read]))
    return row | {
        "tags_exact": len(read) == len(stated) and all(found[tag][1] for tag in read),
        "closed": all(meshes.is_closed(triangles) for _, triangles, _ in bodies),
        "by_own_detector": count(reduced(image, dpi)),
    }


def reduced(image, dpi):
    """The page as a photograph would show it."""
    scale = 75 / dpi
    seen = cv2.copyMakeBorder(image, *[dpi // 2] * 4, cv2.BORDER_CONSTANT, value=255)
    return cv2.resize(seen, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)


def main(deltille, folder):
    made = folder / "prints"
    made.mkdir(parents=True, exist_ok=True)
    table = {}
    for name, (pages, own) in GENERATORS.items():
        detect = own("charuco", folder / "boards")
        for way, image, dpi in pages(deltille, made):
            table[f"{name}: {way}"] = measured(image, dpi) | {"by_own_detector": len(detect(reduced(image, dpi)))}
            print(name, way, table[f"{name}: {way}"], flush=True)
    for name, mesh in MESHES.items():
        try:
            path, stated, count = mesh(deltille, made)
        except ImportError as error:
            print(f"{name}: 3MF skipped, {error}")
            continue
        for way, draw in RENDERERS.items():
            table[f"{name}: 3MF, {way}"] = measured_mesh(path, stated, count, draw)
            print(name, "3MF", way, table[f"{name}: 3MF, {way}"], flush=True)
    (folder / "prints.json").write_text(json.dumps(table))


if __name__ == "__main__":
    main(*(pathlib.Path(path).resolve() for path in sys.argv[1:3]))
