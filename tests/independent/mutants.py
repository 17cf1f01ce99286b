"""Damaged artifacts, read by other programs: mutants.py DELTILLE FOLDER [MUTANTS [SEED]].

Makes a board, a ChArUco board and a tetrahedron in FOLDER in all formats that are or contain text. Then, MUTANTS times
for each file (60 by default), it deletes, doubles, moves or replaces a token: a bracket, quote, comma, tag, word,
number or line end. `deltille verify` must reject the mutant, or an independent reader must read the same content from
it as from the original: the same structure, and numbers within the tolerance that docs/formats.md states.

- XML (SVG, SDF, URDF, MuJoCo, 3MF): lxml, in canonical form without comments;
- USDA: usd-core, by exporting the opened file; OBJ and MTL: trimesh; glTF: json without duplicate keys;
- DXF: ezdxf; STL: trimesh; .dsc: its lines.

Ends with an error at the first mutant that satisfies neither condition, or if a verification needs more than 5 s of CPU
time or 1 GB. Needs usd-core, trimesh, lxml, ezdxf and pillow.
"""

import collections
import io
import json
import os
import pathlib
import random
import re
import resource
import struct
import subprocess
import sys
import zipfile

import ezdxf
import trimesh
from lxml import etree
from pxr import Tf, Usd

TOKENS = re.compile(r'[-+]?\d+(?:\.\d+)?|\w+|</?|/?>|\s+|.', re.S)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?$")
# Positions may be off by 0.05 mm, which is 5e-5 in files in metres.
MM, METRES = 0.06, 6e-5
MAX_SECONDS, MAX_KB = 5.0, 1_000_000

MADE = [
    ("b", "board --rows 4 --cols 5 --edge 20mm --texture 1000 --svg --gltf --obj --sdf --urdf --mjcf --usd --3mf --dsc "
     "--laser dxf,svg"),
    ("c", "charuco --squares 5x4 --edge 30mm --marker 22mm --gltf --usd --3mf"),
    ("t", "tetrahedron --tiles 7 --edge 60mm --textures 2 --gltf --usd --mjcf --stl --dxf --dsc"),
]


def mutant(text, pick):
    """The text with one token changed."""
    tokens = TOKENS.findall(text)
    # Rare kinds of tokens are chosen as often as numbers, the most frequent kind.
    kinds = collections.defaultdict(list)
    for index, token in enumerate(tokens):
        kinds["n" if NUMBER.match(token) else "w" if token.isalpha() else token.strip() or " "].append(index)
    at = pick.choice(kinds[pick.choice(sorted(kinds))])
    other = pick.randrange(len(tokens))
    how = pick.choice(["delete", "double", "move", "swap", "replace", "insert"])
    match how:
        case "delete":
            del tokens[at]
        case "double":
            tokens.insert(at, tokens[at])
        case "move":
            tokens.insert(other, tokens.pop(at))
        case "swap":
            tokens[at], tokens[other] = tokens[other], tokens[at]
        case "replace":
            tokens[at] = pick.choice(tokens)
        case "insert":
            tokens.insert(at, pick.choice(["(", ")", "[", "]", "<", ">", '"', "'", ",", "/", "\\", "\t", "\f", "\v", "0", "#", "&"]))
    return f"{how} {tokens[at] if at < len(tokens) else ''!r}", "".join(tokens)


def canonical(text):
    parser = etree.XMLParser(resolve_entities=False, remove_comments=True)
    root = etree.fromstring(text.encode(), parser)
    return re.sub(r">\s+<", "><", etree.tostring(root, method="c14n").decode())


def usd(path):
    stage = Usd.Stage.Open(str(path))
    return stage.ExportToString(addSourceFileComment=False)


def mesh(path):
    # Without merging vertices, because merging depends on rounding.
    scene = trimesh.load(path, force="scene", process=False)
    parts = [(m.vertices.tolist(), m.faces.tolist(), m.visual.uv.tolist()) for m in scene.geometry.values()]
    images = [m.visual.material.image for m in scene.geometry.values()]
    return str(parts) + str([image.tobytes().__hash__() for image in images])


def gltf(data):
    def once(pairs):
        keys = [key for key, _ in pairs]
        assert len(set(keys)) == len(keys), "a key twice"
        return dict(pairs)

    length = struct.unpack("<I", data[12:16])[0]
    return json.dumps(json.loads(data[20 : 20 + length].decode(), object_pairs_hook=once), sort_keys=True)


def drawing(text):
    entities = ezdxf.read(io.StringIO(text)).modelspace()
    points = lambda e: [list(v.dxf.location) for v in e.vertices] if e.dxftype() == "POLYLINE" else [list(e.dxf.start), list(e.dxf.end)]
    return str([(e.dxftype(), e.dxf.layer, points(e)) for e in entities])


def same(one, other, tolerance):
    """Whether two texts have the same words, and numbers within the tolerance; the version of the program and the ids
    of paths in an SVG are ignored."""
    free = lambda text: re.sub(r'deltille [\d.]+|<path[^>]* id="[^"]*"', lambda found: re.sub(r'deltille [\d.]+| id="[^"]*"', "", found[0]), text)
    split = lambda text: re.findall(r"[-+]?\d+\.?\d*(?:e[-+]?\d+)?|[^\s\d]+", free(text))
    one, other = split(one), split(other)
    near = lambda a, b: a == b or NUMBER.match(a) and NUMBER.match(b) and abs(float(a) - float(b)) <= tolerance
    return len(one) == len(other) and all(map(near, one, other))


def repacked(parts):
    """A ZIP of parts, without dates."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as file:
        for name, text in parts:
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            file.writestr(entry, text, zipfile.ZIP_DEFLATED)
    return out.getvalue()


class Format:
    """The functions that unpack a file, pack it, and read it with another program."""

    def __init__(self, path):
        self.path, self.data = path, path.read_bytes()
        self.kind = path.suffix
        self.tolerance = METRES if self.kind in (".glb", ".usda") else MM
        if self.kind == ".3mf":
            with zipfile.ZipFile(path) as file:
                self.parts = [(name, file.read(name).decode()) for name in file.namelist()]
        elif self.kind == ".glb":
            self.length = struct.unpack("<I", self.data[12:16])[0]

    def text(self):
        match self.kind:
            case ".3mf":
                return self.parts[2][1]
            case ".glb":
                return self.data[20 : 20 + self.length].decode()
            case ".stl":
                return self.data.decode("latin-1")
        return self.data.decode()

    def built(self, text):
        match self.kind:
            case ".3mf":
                return repacked([*self.parts[:2], (self.parts[2][0], text)])
            case ".glb":
                text = text.encode()
                text += b" " * (-len(text) % 4)
                rest = self.data[20 + self.length :]
                return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest
            case ".stl":
                return text.encode("latin-1", "replace")
        return text.encode()

    def read(self, data):
        match self.kind:
            case ".3mf":
                with zipfile.ZipFile(io.BytesIO(data)) as file:
                    return canonical(file.read(self.parts[2][0]).decode())
            case ".glb":
                return gltf(data)
            case ".usda":
                return usd(self.path)
            case ".obj" | ".mtl":
                return mesh(self.path.with_suffix(".obj"))
            case ".stl":
                found = trimesh.load(io.BytesIO(data), file_type="stl", process=False)
                return str((found.vertices.tolist(), found.faces.tolist()))
            case ".dxf":
                return drawing(data.decode())
            case ".dsc":
                return "\n".join(",".join(re.split(r"[,\s]+", line.strip())) for line in data.decode().splitlines())
        return canonical(data.decode())


def main():
    program, folder = os.path.abspath(sys.argv[1]), pathlib.Path(sys.argv[2])
    count = int(sys.argv[3]) if len(sys.argv) > 3 else 60
    seed = int(sys.argv[4]) if len(sys.argv) > 4 else 1
    folder.mkdir(parents=True, exist_ok=True)
    for name, command in MADE:
        subprocess.run([program, *command.split(), "--name", name, "-o", folder, "--no-verify"], check=True, stdout=subprocess.DEVNULL)
    kinds = {".svg", ".glb", ".obj", ".mtl", ".sdf", ".urdf", ".xml", ".usda", ".3mf", ".stl", ".dsc", ".dxf"}
    wrong, slowest, totals = [], (0, ""), collections.Counter()
    for path in sorted(path for path in folder.iterdir() if path.suffix in kinds and not re.search(r"-\d\.obj", path.name)):
        file, pick = Format(path), random.Random(f"{seed} {path.name}")
        told = path.with_suffix(".obj") if path.suffix == ".mtl" else path
        description = folder / f"{re.match('[a-z]', path.name)[0]}.json"

        def verified(data):
            path.write_bytes(data)
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            done = subprocess.run([program, "verify", description, told], capture_output=True, text=True)
            return done, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before

        original = file.read(file.data)
        done, _ = verified(file.built(file.text()))
        assert done.returncode == 0, (path, done)
        passed = 0
        for _ in range(count):
            what, text = mutant(file.text(), pick)
            if text == file.text():
                continue
            data = file.built(text)
            done, seconds = verified(data)
            slowest = max(slowest, (seconds, f"{path.name}: {what}"))
            if done.returncode not in (0, 1, 2) or "panicked" in done.stderr or seconds > MAX_SECONDS:
                wrong.append((path.name, what, done, seconds))
            if done.returncode == 0:
                passed += 1
                try:
                    found = file.read(data)
                    if not same(found, original, file.tolerance):
                        wrong.append((path.name, what, "reads otherwise"))
                except (Exception, Tf.ErrorException) as error:
                    wrong.append((path.name, what, str(error)[:200]))
        path.write_bytes(file.data)
        totals += {"mutants": count, "pass": passed}
        print(f"{path.name}: {count} mutants, {passed} pass and read the same")
    most_kb = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    print(f"{totals['mutants']} mutants, {totals['pass']} pass; at most {slowest[0]:.1f} s ({slowest[1]}), {most_kb} kB")
    for each in wrong:
        print("WRONG:", *each)
    assert not wrong and most_kb < MAX_KB

if __name__ == "__main__":
    main()
