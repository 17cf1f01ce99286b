"""Models for simulators, opened by what simulates: simulators.py DELTILLE FOLDER.

Makes boards, one with two sides, a ChArUco board, an AprilGrid, an icosahedron, a cube, a cuboid, and a cuboctahedron of triangles and squares in FOLDER, and then

- MuJoCo renders each from a ring of cameras, `deltille detect` reads the pictures, and the corners must be where MuJoCo's
  camera puts those of the description: of those on faces that are seen within 60° at least 95 %;
- trimesh loads the OBJ, usd-core the USD; corners of the description must lie on their surfaces within 0.05 mm, and be
  corners of the texture there, as OpenCV refines them;
- yourdfpy loads the URDF, and the elements of the SDF are read by Python.

Needs mujoco, usd-core, trimesh, yourdfpy, opencv-python-headless and pillow; MUJOCO_GL=osmesa or egl without a screen.
"""

import json
import pathlib
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import cv2
import mujoco
import numpy as np
import trimesh
import yourdfpy
from PIL import Image
from pxr import Usd, UsdGeom, UsdShade

WIDTH, HEIGHT, FIELD_DEG = 1600, 1200, 40.0
VIEWS = 8
SEEN_DEG, SHARE, PLACE_MM = 60.0, 0.95, 0.05


def corners_of(target):
    """Places and normals of all corners, mm, by panel and id."""
    found = {}
    for panel in target["panels"]:
        normal = np.array(panel["pose"]["rotation"]).reshape(3, 3)[:, 2]
        for corner in panel["corners"]:
            found[panel["id"], corner["id"]] = (np.array(corner["target_mm"]), normal)
    return found


def looking(eye, at):
    """Axes of MuJoCo's camera, which looks along its −z with y up, as columns."""
    back = (eye - at) / np.linalg.norm(eye - at)
    right = np.cross([0.3, 0.2, 1.0], back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], 1)


def rendered(folder, name, target, corners):
    """Pictures by MuJoCo, and for each the pixels of the corners that are seen well."""
    spec = mujoco.MjSpec.from_file(str(folder / f"{name}.xml"))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = WIDTH, HEIGHT
    spec.visual.headlight.ambient = [0.5] * 3
    spec.visual.headlight.diffuse = [0.4] * 3
    spec.visual.map.znear = 0.01
    places = np.array([place for place, _ in corners.values()]) / 1e3
    middle, size = places.mean(0), np.ptp(places, 0).max()
    sides = len(target["panels"])
    fronts = [panel["pose"]["rotation"][8] for panel in target["panels"]]
    cameras = []
    for k in range(VIEWS):
        angle = 2 * np.pi * k / VIEWS
        if sides <= 2:
            tilt = np.radians(12 + 6 * k)
            aside = [np.sin(tilt) * np.cos(angle), np.sin(tilt) * np.sin(angle), np.cos(tilt)]
            # Before the front, which OpenCV has at −z, or every second time before the back.
            aside[2] *= fronts[k % sides]
        else:
            aside = [np.cos(angle), np.sin(angle), 0.8 * np.sin(2 * angle)]
        eye = middle + 2.0 * size * np.array(aside) / np.linalg.norm(aside)
        axes = looking(eye, middle)
        spec.worldbody.add_camera(name=f"c{k}", pos=eye, xyaxes=[*axes[:, 0], *axes[:, 1]], fovy=FIELD_DEG)
        cameras.append((eye, axes))
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, HEIGHT, WIDTH)
    focal = HEIGHT / 2 / np.tan(np.radians(FIELD_DEG) / 2)
    shown = []
    for k, (eye, axes) in enumerate(cameras):
        renderer.update_scene(data, camera=f"c{k}")
        Image.fromarray(renderer.render()).convert("L").save(folder / f"{name}-mujoco-{k}.png")
        pixels = {}
        for key, (place, normal) in corners.items():
            seen = axes.T @ (place / 1e3 - eye)
            sight = (eye - place / 1e3) / np.linalg.norm(eye - place / 1e3)
            pixel = np.array([seen[0], -seen[1]]) / -seen[2] * focal + [(WIDTH - 1) / 2, (HEIGHT - 1) / 2]
            is_inside = (pixel > 10).all() and (pixel < [WIDTH - 11, HEIGHT - 11]).all()
            if is_inside and sight @ normal > np.cos(np.radians(SEEN_DEG)):
                pixels[key] = pixel
        shown.append(pixels)
    return shown


def detected(program, folder, name, shown):
    out = folder / f"{name}-found"
    pictures = sorted(folder.glob(f"{name}-mujoco-*.png"))
    subprocess.run([program, "detect", *pictures, "--target", folder / f"{name}.json", "-o", out],
                   check=True, stdout=subprocess.DEVNULL)
    wanted = found = 0
    off = []
    for picture, pixels in zip(pictures, shown):
        grids = json.loads((out / f"{picture.stem}.json").read_text())["grids"]
        read = {(grid["panel"], corner["id"]): np.array([corner["x"], corner["y"]])
                for grid in grids for corner in grid["corners"]}
        wanted += len(pixels)
        both = [key for key in pixels if key in read]
        found += len(both)
        off += [np.linalg.norm(read[key] - pixels[key]) for key in both]
    off = np.array(off)
    print(f"{name}: MuJoCo: {found} of {wanted} corners seen within {SEEN_DEG:.0f}°, off by {np.median(off):.3f} px in the "
          f"median, {off.max():.3f} at most")
    # MuJoCo does not smooth edges: along rows and columns of pixels they are off by up to half a pixel each.
    assert found >= SHARE * wanted and off.max() < np.sqrt(0.5)


def on_surface(name, what, vertices, faces, uv, texture, corners):
    """How far corners are from a mesh, mm, and from the corners of its texture."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    places = np.array([place for place, _ in corners.values()])
    nearest, apart, triangle = trimesh.proximity.closest_point_naive(mesh, places)
    weights = trimesh.triangles.points_to_barycentric(mesh.triangles[triangle], nearest)
    size = np.array(texture.shape[::-1])
    to_pixel = lambda uv: np.stack([uv[..., 0] * size[0], (1 - uv[..., 1]) * size[1]], -1) - 0.5
    corners_uv = to_pixel(uv[faces[triangle]])
    pixels = (weights[..., None] * corners_uv).sum(1)
    # Texels per mm, by the longest side of the triangle.
    side = np.linalg.norm(corners_uv[:, 1] - corners_uv[:, 0], axis=1)
    per_mm = side / np.linalg.norm(mesh.triangles[triangle][:, 1] - mesh.triangles[triangle][:, 0], axis=1)
    refined = cv2.cornerSubPix(texture, pixels.astype(np.float32).reshape(-1, 1, 2), (3, 3), (-1, -1),
                               (cv2.TERM_CRITERIA_MAX_ITER | cv2.TERM_CRITERIA_EPS, 50, 1e-4)).reshape(-1, 2)
    off = np.linalg.norm(refined - pixels, axis=1) / per_mm
    print(f"{name}: {what}: {len(places)} corners within {apart.max():.6f} mm of the surface; those of the texture are off "
          f"by {np.median(off):.4f} mm in the median, {off.max():.4f} at most")
    assert apart.max() < PLACE_MM and np.median(off) < PLACE_MM


def obj(folder, name):
    vertices, uvs, faces, of_uv = [], [], [], []
    for line in (folder / f"{name}.obj").read_text().splitlines():
        word, *values = line.split()
        if word == "v":
            vertices.append([float(value) for value in values])
        elif word == "vt":
            uvs.append([float(value) for value in values])
        elif word == "f":
            faces.append([int(value.split("/")[0]) - 1 for value in values])
            of_uv.append([int(value.split("/")[1]) - 1 for value in values])
    assert faces == of_uv
    loaded = trimesh.load(folder / f"{name}.obj", process=False, force="mesh")
    assert np.allclose(np.sort(loaded.triangles.reshape(-1, 9), 0), np.sort(np.array(vertices)[faces].reshape(-1, 9), 0))
    welded = trimesh.Trimesh(vertices, faces, process=True)
    assert welded.is_watertight and welded.volume > 0
    return np.array(vertices), np.array(faces), np.array(uvs)


def usd(folder, name):
    stage = Usd.Stage.Open(str(folder / f"{name}.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    [mesh] = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    scale = UsdGeom.GetStageMetersPerUnit(stage) * 1e3
    vertices = np.array(mesh.GetPointsAttr().Get()) * scale
    assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
    faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    uv = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get())
    material, _ = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()
    surface, _, _ = material.ComputeSurfaceSource()
    [texture] = surface.GetInput("diffuseColor").GetConnectedSources()[0]
    asset = UsdShade.Shader(texture.source.GetPrim()).GetInput("file").Get()
    assert pathlib.Path(asset.resolvedPath).name == f"{name}-texture.png"
    return vertices, faces, uv


def cuboctahedron(edge):
    """An OBJ of eight triangles and six squares, mm."""
    size = edge / np.sqrt(2)
    axes = np.eye(3)
    vertices = [list(size * (a * axes[i] + b * axes[j])) for i, j in [(0, 1), (1, 2), (2, 0)] for a in (1, -1) for b in (1, -1)]
    vertices = np.array(vertices)
    faces = []
    signs = [np.array([x, y, z]) for x in (1, -1) for y in (1, -1) for z in (1, -1)]
    for normal in [*signs, *axes, *-axes]:
        # The vertices farthest along a normal, counter-clockwise about it.
        along = vertices @ normal
        around = np.flatnonzero(along > along.max() - 1e-6)
        right = vertices[around[0]] - vertices[around].mean(0)
        up = np.cross(normal, right)
        angles = np.arctan2(vertices[around] @ up / (up @ up), vertices[around] @ right / (right @ right))
        faces.append(around[np.argsort(angles)])
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in vertices]
    lines += ["f " + " ".join(str(index + 1) for index in face) for face in faces]
    return "\n".join(lines) + "\n"


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    formats = ["--obj", "--sdf", "--urdf", "--mjcf", "--usd"]
    folder.mkdir(parents=True, exist_ok=True)
    mesh = folder / "cuboctahedron-mesh.obj"
    mesh.write_text(cuboctahedron(120))
    small, large = ["--texture", "2048"], ["--texture", "4096"]
    for name, command in {
        "desk": ["board", "--rows", "7", "--cols", "9", "--edge", "30mm", "--name", "desk", *small],
        "squares": ["checkerboard", "--rows", "7", "--cols", "9", "--edge", "30mm", "--name", "squares", *small],
        "door": ["board", "--rows", "6", "--cols", "7", "--edge", "30mm", "--two-sided", "4mm", "--name", "door", *small],
        "charuco": ["charuco", "--squares", "8x6", "--edge", "30mm", *small],
        "aprilgrid": ["aprilgrid", "--tags", "5x4", "--edge", "30mm", *small],
        "icosahedron": ["icosahedron", *small],
        "cube": ["cube", *large],
        "cuboid": ["cuboid", "--size", "200x150x120mm", "--tiles", "6", *large],
        "cuboctahedron": ["solid", "--mesh", mesh, "--tiles", "6", "--name", "cuboctahedron", "--texture", "8192"],
    }.items():
        subprocess.run([program, *command, *formats, "-o", folder, "--force"], check=True, stdout=subprocess.DEVNULL)
        target = json.loads((folder / f"{name}.json").read_text())
        corners = corners_of(target)
        texture = np.asarray(Image.open(folder / f"{name}-texture.png").convert("L"))
        on_surface(name, "trimesh", *obj(folder, name), texture, corners)
        on_surface(name, "usd-core", *usd(folder, name), texture, corners)
        robot = yourdfpy.URDF.load(str(folder / f"{name}.urdf"), build_scene_graph=True, load_meshes=True)
        bounds = robot.scene.bounds
        assert np.allclose(np.ptp(bounds, 0) * 1e3, np.ptp(obj(folder, name)[0], 0), atol=1e-3), bounds
        sdf = ElementTree.parse(folder / f"{name}.sdf").getroot()
        assert {uri.text for uri in sdf.iter("uri")} == {f"{name}.obj"}
        assert {scale.text for scale in sdf.iter("scale")} == {"0.001 0.001 0.001"}
        detected(program, folder, name, rendered(folder, name, target, corners))


if __name__ == "__main__":
    main()
