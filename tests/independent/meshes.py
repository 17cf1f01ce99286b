"""Reads the meshes and outlines of an icosahedron with trimesh and ezdxf: meshes.py FOLDER."""

import math
import sys

import ezdxf
import trimesh

for name, metre in (("icosahedron.glb", 1.0), ("icosahedron.obj", 1000.0)):
    mesh = trimesh.load(f"{sys.argv[1]}/{name}", force="mesh")
    volume = 5 * (3 + 5**0.5) / 12 * (0.15 * metre) ** 3
    bare = trimesh.Trimesh(mesh.vertices, mesh.faces)
    bare.merge_vertices()
    assert bare.is_watertight and len(bare.faces) == 20 and len(bare.vertices) == 12, name
    assert abs(bare.volume / volume - 1) < 1e-5, (name, bare.volume, volume)
    assert mesh.visual.uv is not None and len(mesh.visual.uv) == len(mesh.vertices), name
    print(f"trimesh: {name} is closed, right-handed and of the right volume")
solid = trimesh.load(f"{sys.argv[1]}/icosahedron.stl")
frame = trimesh.load(f"{sys.argv[1]}/icosahedron-skeleton.stl")
for name, mesh in (("solid", solid), ("skeleton", frame)):
    assert mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0, name
assert abs(solid.volume / (5 * (3 + 5**0.5) / 12 * 150**3) - 1) < 1e-5, solid.volume
# A frame with a window in each face is a ball with that many holes less one.
assert frame.euler_number == 2 - 2 * 19, frame.euler_number
assert 0.01 < frame.volume / solid.volume < 0.1, frame.volume / solid.volume
print(f"trimesh: the skeleton is closed, {frame.volume / solid.volume:.1%} of the solid")
drawing = ezdxf.readfile(f"{sys.argv[1]}/icosahedron-panels.dxf")
assert not drawing.audit().errors
panels = [e for e in drawing.modelspace() if e.dxftype() == "POLYLINE" and e.dxf.layer == "CUT"]
assert len(panels) == 20 and all(panel.is_closed for panel in panels)
inset = 3 / math.tan(math.acos(-(5**0.5) / 3) / 2) + 0.8 + 0.15
for panel in panels:
    points = [vertex.dxf.location for vertex in panel.vertices]
    sides = [points[i].distance(points[i - 1]) for i in range(3)]
    assert len(points) == 3 and all(abs(s - (150 - 12**0.5 * inset)) < 1e-4 for s in sides), sides
net = ezdxf.readfile(f"{sys.argv[1]}/icosahedron-net.dxf")
assert not net.audit().errors
outlines = [e for e in net.modelspace() if e.dxftype() == "POLYLINE" and e.dxf.layer == "CUT"]
assert len(outlines) == 1 and outlines[0].is_closed
print("ezdxf: 20 closed outlines of the size of the seats, and one of the net")
