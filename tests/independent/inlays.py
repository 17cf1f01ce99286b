"""Boards and solids as two bodies (3MF), read by other programs: inlays.py DELTILLE FOLDER.

lib3mf, the reader of the 3MF consortium, must read each file in strict mode without a warning, and find both bodies
manifold and oriented, with their names and colours. According to trimesh, both must be closed. The volume of the black
body must be the dark area of the SVG of the same target (its loops, combined by shapely) times the depth. The total
volume must be that of the plate or solid. Every corner of the description must be a vertex of the black body. A
skeleton must be one closed body. A second run must write the same file.

Needs lib3mf, trimesh, lxml, networkx and shapely.
"""

import json
import math
import pathlib
import re
import subprocess
import sys

import lib3mf
import numpy as np
import trimesh
from shapely.geometry import Polygon

PLATE_MM, INLAY_MM = 3.0, 0.4
BOARDS = {
    "tagged": "board --rows 7 --cols 9 --edge 20mm",
    "inverted": "board --rows 5 --cols 6 --edge 20mm --invert",
    "plain": "board --rows 5 --cols 6 --edge 20mm --untagged",
    "dense": "board --rows 7 --cols 9 --edge 20mm --dense",
    "squares": "checkerboard --rows 5 --cols 6 --edge 30mm --tags t25h9",
    "black-squares": "checkerboard --rows 5 --cols 6 --edge 30mm --invert",
}
EDGE_MM = 90.0
SOLIDS = {
    "tetrahedron": math.sqrt(2) / 12,
    "octahedron": math.sqrt(2) / 3,
    "icosahedron": 5 * (3 + math.sqrt(5)) / 12,
}


def dark_mm2(svgs):
    """The dark area of the tiles and fields of the pages, by the even-odd rule."""
    area = 0.0
    for svg in svgs:
        for path in re.findall(r'<path d="([^"]*)" id="(?:tile|field)-', svg.read_text()):
            shown = Polygon()
            for loop in path.split("Z"):
                numbers = [float(number) for number in re.findall(r"-?[\d.]+", loop)]
                if numbers:
                    shown = shown.symmetric_difference(Polygon(np.reshape(numbers, (-1, 2))))
            area += shown.area
    return area


def read_by_lib3mf(path):
    """Names and colours of the bodies, which must be closed."""
    model = lib3mf.get_wrapper().CreateModel()
    reader = model.QueryReader("3mf")
    reader.SetStrictModeActive(True)
    reader.ReadFromFile(str(path))
    assert reader.GetWarningCount() == 0, path
    groups = model.GetBaseMaterialGroups()
    assert groups.MoveNext()
    group = groups.GetCurrentBaseMaterialGroup()
    found = {}
    meshes = model.GetMeshObjects()
    while meshes.MoveNext():
        mesh = meshes.GetCurrentMeshObject()
        assert mesh.IsManifoldAndOriented(), (path, mesh.GetName())
        _, material, has_material = mesh.GetObjectLevelProperty()
        assert has_material, path
        found[mesh.GetName()] = group.GetDisplayColor(material).Red
    assert found == {"white": 255, "black": 0}, (path, found)
    components = model.GetComponentsObjects()
    assert components.MoveNext()
    assert components.GetCurrentComponentsObject().GetComponentCount() == 2, path


def check(program, folder, name, command, whole_mm3):
    plate = [] if whole_mm3 else ["--plate", f"{PLATE_MM}mm"]
    made = [program, *command.split(), "--name", name, "--3mf", "--inlay", f"{INLAY_MM}mm", *plate]
    subprocess.run([*made, "--svg", "-o", folder], check=True, stdout=subprocess.DEVNULL)
    path = folder / f"{name}.3mf"
    subprocess.run([*made, "-o", folder / "again"], check=True, stdout=subprocess.DEVNULL)
    assert path.read_bytes() == (folder / "again" / path.name).read_bytes(), "not the same again"
    read_by_lib3mf(path)
    scene = trimesh.load(path, process=False)
    assert scene.units == "millimeter" and np.allclose(scene.bounds[0], 0.0, atol=1e-8), scene.bounds
    white, black = (scene.geometry[colour] for colour in ("white", "black"))
    for body in (white, black):
        assert body.is_watertight and body.is_winding_consistent, path
    dark = dark_mm2(sorted(folder.glob(f"{name}.svg")) + sorted(folder.glob(f"{name}-[0-9]*.svg")))
    # The SVG coordinates have four decimals.
    assert abs(black.volume / (dark * INLAY_MM) - 1) < 2e-5, (name, black.volume, dark * INLAY_MM)
    width, height, thickness = scene.extents
    whole = whole_mm3 or width * height * PLATE_MM
    assert whole_mm3 or abs(thickness - PLATE_MM) < 1e-8, thickness
    assert abs((white.volume + black.volume) / whole - 1) < 1e-8, (name, white.volume, whole)
    panels = json.loads((folder / f"{name}.json").read_text())["panels"]
    corners = np.array([corner["target_mm"] for panel in panels for corner in panel["corners"]])
    away = np.array([np.linalg.norm(black.vertices - corner, axis=1).min() for corner in corners])
    assert away.max() < 1e-6, (name, away.max())
    print(
        f"{name}: {len(white.faces)} + {len(black.faces)} triangles, closed; {black.volume / 1e3:.3f} cm3 black "
        f"in {white.volume / 1e3:.3f} white; {len(corners)} corners within {away.max():.1e} mm"
    )


def check_skeleton(program, folder):
    """Checks that the frame in the 3MF is closed, and equals that of the STL."""
    command = [program, "octahedron", "--edge", "100mm", "--name", "frame", "--skeleton", "--3mf", "-o", folder]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    body = trimesh.load(folder / "frame-skeleton.3mf", process=False).geometry["skeleton"]
    same = trimesh.load(folder / "frame-skeleton.stl")
    assert body.is_watertight and body.is_winding_consistent
    assert abs(body.volume / same.volume - 1) < 1e-4, (body.volume, same.volume)
    print(f"skeleton: {len(body.faces)} triangles, closed; {body.volume / 1e3:.3f} cm3")


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    for name, command in BOARDS.items():
        check(program, folder, name, command, None)
    for name, factor in SOLIDS.items():
        check(program, folder, name, f"{name} --edge {EDGE_MM}mm", factor * EDGE_MM**3)
    check_skeleton(program, folder)


main()
