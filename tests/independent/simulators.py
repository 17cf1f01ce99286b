"""Models for simulators, opened by the simulators: simulators.py DELTILLE FOLDER.

Makes boards, one with two sides, a ChArUco board, an AprilGrid, an icosahedron, a cube, a cuboid, a cuboctahedron of triangles and squares, and a ball of 320 faces
with four textures in FOLDER, and then

- MuJoCo renders each model from a ring of cameras, and `deltille detect` reads the images. The corners must be at the
  positions to which MuJoCo's camera projects those of the description: at least 95 % of the corners on faces seen
  within 60°;
- trimesh loads the OBJ and the glTF with all their materials, usd-core the USD with the subsets of its faces; corners of the description must lie on
  their surfaces within 0.05 mm, and be corners of the texture there, as OpenCV refines them, within 0.05 mm or 0.15 px;
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
# Images of the ball; each shows half of its 320 faces.
LARGE = 2600
VIEWS = 8
SEEN_DEG, SHARE, PLACE_MM = 60.0, 0.95, 0.05
# Corners of a texture with fewer px/mm than this may be off by 0.15 px.
COARSE = 3.0


def corners_of(target):
    """Positions and normals of all corners, mm, by panel and id."""
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


def rendered(folder, name, target, corners, width, height):
    """Images by MuJoCo, and for each image the pixels of the clearly visible corners."""
    spec = mujoco.MjSpec.from_file(str(folder / f"{name}.xml"))
    spec.visual.global_.offwidth, spec.visual.global_.offheight = width, height
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
            # In front of the front side, which is at −z in OpenCV's frame, or every second time in front of the back.
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
    renderer = mujoco.Renderer(model, height, width)
    focal = height / 2 / np.tan(np.radians(FIELD_DEG) / 2)
    shown = []
    for k, (eye, axes) in enumerate(cameras):
        renderer.update_scene(data, camera=f"c{k}")
        Image.fromarray(renderer.render()).convert("L").save(folder / f"{name}-mujoco-{k}.png")
        pixels = {}
        for key, (place, normal) in corners.items():
            seen = axes.T @ (place / 1e3 - eye)
            sight = (eye - place / 1e3) / np.linalg.norm(eye - place / 1e3)
            pixel = np.array([seen[0], -seen[1]]) / -seen[2] * focal + [(width - 1) / 2, (height - 1) / 2]
            is_inside = (pixel > 10).all() and (pixel < [width - 11, height - 11]).all()
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
    # MuJoCo does not anti-alias edges: along rows and columns of pixels, each edge is off by up to half a pixel.
    assert found >= SHARE * wanted and off.max() < np.sqrt(0.5)


def on_surface(name, what, vertices, faces, uv, of_texture, textures, corners):
    """Distances of corners from a mesh, mm, and from the corners of its textures; each face has one texture."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    places = np.array([place for place, _ in corners.values()])
    nearest, apart, triangle = trimesh.proximity.closest_point_naive(mesh, places)
    weights = trimesh.triangles.points_to_barycentric(mesh.triangles[triangle], nearest)
    on = np.asarray(of_texture)[triangle]
    size = np.array([texture.shape[::-1] for texture in textures])[on][:, None]
    corners_uv = np.stack([uv[faces[triangle]][..., 0], 1 - uv[faces[triangle]][..., 1]], -1) * size - 0.5
    pixels = (weights[..., None] * corners_uv).sum(1)
    # Texels per mm, by the longest side of the triangle.
    side = np.linalg.norm(corners_uv[:, 1] - corners_uv[:, 0], axis=1)
    per_mm = side / np.linalg.norm(mesh.triangles[triangle][:, 1] - mesh.triangles[triangle][:, 0], axis=1)
    refined = np.empty_like(pixels)
    for index, texture in enumerate(textures):
        first = pixels[on == index].astype(np.float32).reshape(-1, 1, 2)
        refined[on == index] = cv2.cornerSubPix(texture, first, (3, 3), (-1, -1),
                                                (cv2.TERM_CRITERIA_MAX_ITER | cv2.TERM_CRITERIA_EPS, 50, 1e-4)).reshape(-1, 2)
    off = np.linalg.norm(refined - pixels, axis=1) / per_mm
    print(f"{name}: {what}: {len(places)} corners within {apart.max():.6f} mm of the surface; those of the texture are off "
          f"by {np.median(off):.4f} mm in the median, {off.max():.4f} at most")
    assert apart.max() < PLACE_MM and np.median(off * np.minimum(1, per_mm / COARSE)) < PLACE_MM


def texture_names(name, count):
    return [f"{name}-texture.png"] if count == 1 else [f"{name}-texture-{i + 1}.png" for i in range(count)]


def by_material(folder, name, ending, count):
    """The parts of a mesh as trimesh loads them, by their material; the images of the materials must be those of the
    files."""
    scene = trimesh.load(folder / f"{name}.{ending}", process=False, force="scene")
    parts = {part.visual.material.name: part for part in scene.geometry.values()}
    names = ["print"] if count == 1 else [f"print-{i + 1}" for i in range(count)]
    assert sorted(parts) == sorted(names), list(parts)
    parts = [parts[material] for material in names]
    for part, file in zip(parts, texture_names(name, count)):
        material = part.visual.material
        picture = getattr(material, "image", None) or material.baseColorTexture
        assert np.array_equal(np.asarray(picture.convert("L")), np.asarray(Image.open(folder / file).convert("L"))), file
    vertices = np.concatenate([part.vertices for part in parts])
    uv = np.concatenate([part.visual.uv for part in parts])
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    faces = np.concatenate([part.faces + start for part, start in zip(parts, starts)])
    of_texture = np.repeat(np.arange(count), [len(part.faces) for part in parts])
    welded = trimesh.Trimesh(vertices, faces, process=True)
    assert welded.is_watertight and welded.volume > 0
    return vertices, faces, uv, of_texture


def glb(folder, name, count):
    vertices, faces, uv, of_texture = by_material(folder, name, "glb", count)
    return vertices * 1e3, faces, uv, of_texture


def usd(folder, name, count):
    stage = Usd.Stage.Open(str(folder / f"{name}.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Z"
    [mesh] = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    scale = UsdGeom.GetStageMetersPerUnit(stage) * 1e3
    vertices = np.array(mesh.GetPointsAttr().Get()) * scale
    assert set(mesh.GetFaceVertexCountsAttr().Get()) == {3}
    faces = np.array(mesh.GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)
    uv = np.array(UsdGeom.PrimvarsAPI(mesh).GetPrimvar("st").Get())
    of_texture = np.zeros(len(faces), int)
    subsets = UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsets()
    assert len(subsets) == (count if count > 1 else 0)
    if subsets:
        # Every face is in one of them.
        valid, reason = UsdGeom.Subset.ValidateFamily(mesh, UsdGeom.Tokens.face, UsdShade.Tokens.materialBind)
        assert valid, reason
        assert UsdGeom.Subset.GetFamilyType(mesh, UsdShade.Tokens.materialBind) == UsdGeom.Tokens.partition
    for index, (part, file) in enumerate(zip(subsets or [mesh], texture_names(name, count))):
        if subsets:
            of_texture[np.array(part.GetIndicesAttr().Get())] = index
        material, _ = UsdShade.MaterialBindingAPI(part.GetPrim()).ComputeBoundMaterial()
        surface, _, _ = material.ComputeSurfaceSource()
        [texture] = surface.GetInput("diffuseColor").GetConnectedSources()[0]
        asset = UsdShade.Shader(texture.source.GetPrim()).GetInput("file").Get()
        assert pathlib.Path(asset.resolvedPath).name == file
    return vertices, faces, uv, of_texture


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
    formats = ["--gltf", "--obj", "--sdf", "--urdf", "--mjcf", "--usd"]
    folder.mkdir(parents=True, exist_ok=True)
    mesh = folder / "cuboctahedron-mesh.obj"
    mesh.write_text(cuboctahedron(120))
    sphere = trimesh.creation.icosphere(subdivisions=2, radius=600)
    ball = folder / "ball-mesh.obj"
    lines = [f"v {x:.9f} {y:.9f} {z:.9f}" for x, y, z in sphere.vertices]
    ball.write_text("\n".join(lines + [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in sphere.faces]) + "\n")
    small, large = ["--texture", "2048"], ["--texture", "4096"]
    for name, command in {
        "desk": ["board", "--rows", "7", "--cols", "9", "--edge", "30mm", "--name", "desk", *small],
        "squares": ["checkerboard", "--rows", "7", "--cols", "9", "--edge", "30mm", "--name", "squares", *small],
        "door": ["board", "--rows", "6", "--cols", "7", "--edge", "30mm", "--two-sided", "4mm", "--name", "door", *small, "--textures", "2"],
        "charuco": ["charuco", "--squares", "8x6", "--edge", "30mm", *small],
        "aprilgrid": ["aprilgrid", "--tags", "5x4", "--edge", "30mm", *small],
        "icosahedron": ["icosahedron", *small],
        "cube": ["cube", *large],
        "cuboid": ["cuboid", "--size", "200x150x120mm", "--tiles", "6", *large],
        "cuboctahedron": ["solid", "--mesh", mesh, "--tiles", "6", "--name", "cuboctahedron", "--texture", "8192"],
        "ball": ["solid", "--mesh", ball, "--tiles", "6", "--family", "d25h7", "--tag-spacing", "2", "--tag-border", "0.9",
                 "--face-margin", "0.5mm", "--name", "ball", *small, "--textures", "4"],
    }.items():
        subprocess.run([program, *command, *formats, "-o", folder, "--force"], check=True, stdout=subprocess.DEVNULL)
        target = json.loads((folder / f"{name}.json").read_text())
        corners = corners_of(target)
        count = int(command[command.index("--textures") + 1]) if "--textures" in command else 1
        textures = [np.asarray(Image.open(folder / file).convert("L")) for file in texture_names(name, count)]
        assert max(side for texture in textures for side in texture.shape) <= int(command[command.index("--texture") + 1])
        loaded = by_material(folder, name, "obj", count)
        on_surface(name, "trimesh, OBJ", *loaded, textures, corners)
        on_surface(name, "trimesh, glTF", *glb(folder, name, count), textures, corners)
        on_surface(name, "usd-core", *usd(folder, name, count), textures, corners)
        robot = yourdfpy.URDF.load(str(folder / f"{name}.urdf"), build_scene_graph=True, load_meshes=True)
        bounds = robot.scene.bounds
        assert np.allclose(np.ptp(bounds, 0) * 1e3, np.ptp(loaded[0], 0), atol=1e-3), bounds
        sdf = ElementTree.parse(folder / f"{name}.sdf").getroot()
        assert {uri.text for uri in sdf.iter("uri")} == {f"{name}.obj"}
        assert {scale.text for scale in sdf.iter("scale")} == {"0.001 0.001 0.001"}
        size = (LARGE, LARGE) if name == "ball" else (WIDTH, HEIGHT)
        detected(program, folder, name, rendered(folder, name, target, corners, *size))


if __name__ == "__main__":
    main()
