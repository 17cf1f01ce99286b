"""Every shipped family, or families in files, verified from the file alone: families.py DELTAG [--hidden] [FAMILY …].

Shares no code with the generator. Cells are triangles and squares in the plane; rotations, reflections and neighbours
follow from the positions of their centres. The distance, distance histogram, rules, false-positive rates for random
cells and the fingerprint are compared with the file, as are the fingerprints from before it was extended. The distance
and the distance to mirrored tags are compared with the output of `deltag verify-family`. With --hidden, and for every
family that claims one, the distance is also computed with hidden cells, at every position: a corner, the cells along an
edge, or a triangle of four cells. It must equal the output of `deltag info` and be at least the claim of the file. If a
family lists part of a linear code by a stride, the whole code is checked: its invariance under rotations, its distance
from the weights of its dual code, and its number of tags. Needs numpy.
"""

import hashlib
import itertools
import json
import math
import pathlib
import subprocess
import sys

import numpy as np

FOLDER = pathlib.Path(__file__).parents[2] / "families"
# Number of words compared at a time.
CHUNK = 1 << 24


def middles(kind, rows):
    """Centre of the cell of each bit, relative to the centre of the tag; cell edges have length 1."""
    places = {}
    for row in range(rows):
        if kind == "checker":
            for k in range(rows):
                places[row * rows + rows - 1 - k] = complex(k + 0.5, row + 0.5)
            continue
        for k in range(2 * (rows - row) - 1):
            # The lower left corner of an upright cell. Its centre is a third of the height above; the centre of an
            # inverted cell is half an edge to the right and two thirds of the height above.
            left, height = k // 2 + row / 2, math.sqrt(3) / 2
            middle = complex(left + 0.5, (row + 1 / 3) * height) if k % 2 == 0 else complex(left + 1, (row + 2 / 3) * height)
            places[rows**2 - 1 - (rows - 1 - row) ** 2 - k] = middle
    found = np.array([places[bit] for bit in range(rows**2)])
    return found - found.mean()


def moved(places, onto):
    """For each bit, the bit whose cell is mapped onto its cell."""
    apart = np.abs(places[:, None] - onto[None])
    assert (apart.min(1) < 1e-9).all()
    return apart.argmin(1)


def permuted(words, sources):
    result = np.zeros_like(words)
    for bit, source in enumerate(sources):
        result |= (words >> np.uint64(source) & np.uint64(1)) << np.uint64(bit)
    return result


def distances(words, others):
    """Number of pairs at each distance."""
    counts = np.zeros(65, np.int64)
    step = max(1, CHUNK // len(others))
    for i in range(0, len(words), step):
        apart = np.bitwise_count(words[i : i + step, None] ^ others[None])
        counts += np.bincount(apart.ravel(), minlength=65)
    return counts


def left_of(words, turned, hidden):
    """Minimum distance between the given words and all other words, counted in the cells that are not hidden."""
    seen = np.uint64(sum(1 << int(bit) for bit in np.nonzero(~hidden)[0]))
    counts = distances(words & seen, turned & seen)
    counts[0] -= len(words)
    return int(np.nonzero(counts)[0][0])


def with_hidden_cells(codes, turned, places):
    """Minimum distances with hidden cells: the four cells of a corner, all cells along an edge, and a triangle of four
    cells."""
    height = places.imag
    rows = math.isqrt(len(places))
    # A corner of four cells consists of the uppermost two rows; the cells along the lower edge have a side or a vertex
    # on it. All rotations of all words are included, so one corner and one edge represent all three.
    corner = height > np.sort(height)[-4] - 1e-6
    edge = height < height.min() + math.sqrt(3) / 6 + 1e-6
    assert (corner.sum(), edge.sum()) == (4, 2 * rows - 1)
    # A triangle of four cells is a cell with its three neighbours.
    beside = abs(abs(places[:, None] - places[None]) - 1 / math.sqrt(3)) < 1e-6
    tiles = [row | (np.arange(len(places)) == cell) for cell, row in enumerate(beside) if row.sum() == 3]
    assert len(tiles) == rows * (rows - 1) // 2 + (rows - 3) * (rows - 2) // 2 and corner.tolist() in [tile.tolist() for tile in tiles]
    tile = min(left_of(codes, turned, tile) for tile in tiles)
    return {"apex": left_of(turned, turned, corner), "edge": left_of(turned, turned, edge), "tile": tile}


def reduced(words):
    """A basis in which each leading bit occurs in only one word."""
    basis = {}
    for word in words:
        for lead, row in basis.items():
            word ^= row * (word >> lead & 1)
        if word:
            lead = word.bit_length() - 1
            basis = {other: row ^ word * (row >> lead & 1) for other, row in basis.items()} | {lead: word}
    return basis


def linear_code(construction, bits, turn):
    """Basis of the linear code on the tag, and the word that is added to its words."""
    # A rotation moves the content of a cell to the cell that has it as its source.
    circles = [(bit, turn[turn[bit]], turn[bit]) for bit in range(bits) if bit == min(bit, turn[bit], turn[turn[bit]]) != turn[bit]]
    arrangement, centre = construction["arrangement"], [bit for bit in range(bits) if turn[bit] == bit]
    cells = [int(circles[place][(j + start) % 3]) for place, start in zip(arrangement["places"], arrangement["starts"]) for j in range(3)] + centre
    assert sorted(cells) == list(range(bits))
    on_tag = lambda word: sum((word >> i & 1) << cell for i, cell in enumerate(cells))
    inverted = sum((0b111 if 3 * c < bits - len(centre) else 1) << 3 * c for c in range(bits // 3 + 1) if arrangement["inverted"] >> c & 1)
    assert [int(word, 16) for word in construction["cosets"]] == [0] and not construction["exchanged"]
    return reduced(on_tag(int(word, 16)) for word in construction["basis"]), on_tag(inverted)


def sums(words):
    found = np.zeros(1, np.uint64)
    for word in words:
        found = np.concatenate([found, found ^ np.uint64(word)])
    return found


def prove(name, text, codes, turn, program):
    """Checks the linear code that contains the codes of a family."""
    bits, distance = text["bits"], text["distance"]
    basis, added = linear_code(text["construction"], bits, turn)
    rows = np.array(list(basis.values()), np.uint64)
    assert len(reduced([*basis.values(), *map(int, permuted(rows, turn))])) == len(basis), "a turn changes the linear code"
    # Words that are orthogonal to the whole code: each has one free bit, and the leading bits of the rows that contain
    # it.
    dual = [1 << bit | sum(1 << lead for lead, row in basis.items() if row >> bit & 1) for bit in range(bits) if bit not in basis]
    assert not any((np.bitwise_count(rows & np.uint64(word)) & 1).any() for word in dual)
    assert not any((np.bitwise_count((codes ^ np.uint64(added)) & np.uint64(word)) & 1).any() for word in dual), "a code is not of the linear code"
    listed, weights = sums(dual[:20]), [0] * (bits + 1)
    for high in sums(dual[20:]):
        for weight, count in enumerate(np.bincount(np.bitwise_count(listed ^ high), minlength=bits + 1)):
            weights[weight] += int(count)
    krawtchouk = lambda i, j: sum((-1) ** k * math.comb(j, k) * math.comb(bits - j, i - k) for k in range(i + 1))
    of_code = [sum(count * krawtchouk(i, j) for j, count in enumerate(weights)) >> len(dual) for i in range(bits + 1)]
    assert of_code[0] == 1 and sum(of_code) == 2 ** len(basis) and min(of_code) == 0
    least = next(weight for weight in range(1, bits + 1) if of_code[weight])
    assert least >= distance, (least, distance)
    # A word is invariant if its sum with its rotation is 0; the number of invariant words follows from the rank of
    # these sums.
    fixed = 2 ** (len(basis) - len(reduced(map(int, rows ^ permuted(rows, turn)))))
    tags = (2 ** len(basis) - fixed) // 3
    told = json.loads(subprocess.run([program, "bounds", f"d{bits}h{distance}", "--json"], check=True, capture_output=True).stdout)
    assert tags in [shipped["by_rank_before_rules"] for shipped in told["shipped"]], (tags, told)
    print(f"{name}: part of a linear code of {len(basis)} dimensions, distance {least}, {of_code[least]} words of that weight, {tags} tags")


def check(path, program, hidden):
    text = json.loads(path.read_text())
    kind, bits, distance = text.get("kind", "deltille"), text["bits"], text["distance"]
    rows, codes = math.isqrt(bits), np.array([int(code, 16) for code in text["codes"]], np.uint64)
    places = middles(kind, rows)
    turns, edge = (4, 1.0) if kind == "checker" else (3, 1 / math.sqrt(3))
    turn = moved(places, places * np.exp(2j * np.pi / turns))
    # Any reflection suffices, because all rotations are tested: here the reflection about the vertical axis of the tag.
    mirror = moved(places, -places.conjugate())

    turned = [codes]
    while len(turned) < turns:
        turned.append(permuted(turned[-1], turn))
    assert (permuted(turned[-1], turn) == codes).all(), "that many turns are none"
    turned = np.concatenate(turned)
    pairs = distances(codes, turned)
    assert pairs[0] == len(codes), "no word is there twice"
    pairs[0] = 0
    least = int(np.nonzero(pairs)[0][0])
    assert least >= distance, (least, distance)
    histogram = {str(d): turns * int(n) // 2 for d, n in enumerate(pairs) if n}
    assert histogram == text["distance_histogram"], "distance_histogram"

    rules = text["rules"]
    # The free cells in the centre: one cell, or the six cells around a vertex.
    within = 1e-6 if abs(places).min() < 1e-6 else 1 / math.sqrt(3) + 1e-6
    free = abs(places) < within if rules.get("free") == "centre" else np.zeros(bits, bool)
    assert not any((codes >> np.uint64(bit) & np.uint64(1)).any() for bit in np.nonzero(free)[0]), "free cells are used"
    used = bits - int(free.sum())
    beside = [(a, b) for a, b in itertools.combinations(range(bits), 2) if abs(abs(places[a] - places[b]) - edge) < 1e-6 and not (free[a] or free[b])]
    differing = sum((codes >> np.uint64(a) ^ codes >> np.uint64(b)) & np.uint64(1) for a, b in beside)
    white = np.bitwise_count(codes)
    assert differing.min() >= rules["min_complexity"] * len(beside) - 1e-6
    assert white.min() >= rules["black_distance"] and used - white.max() >= rules["white_distance"]

    rates = [turns * len(codes) * sum(math.comb(used, i) for i in range(t + 1)) / 2**used for t in range((distance - 1) // 2 + 1)]
    assert np.allclose(rates, text["false_positive_rate"], rtol=1e-9)
    digits = -(-bits // 4)
    head = ["deltille/family"] + (["kind checker"] if kind == "checker" else []) + [f"bits {bits}", f"distance {distance}"]
    head += [f"free {rules['free']}"] if free.any() else []
    lines = head + [f"0x{int(code):0{digits}x}" for code in codes]
    assert hashlib.sha256("".join(line + "\n" for line in lines).encode()).hexdigest()[:16] == text["fingerprint"]

    for before in text.get("beginnings", []):
        first = "".join(line + "\n" for line in lines[: len(head) + before["codes"]])
        assert hashlib.sha256(first.encode()).hexdigest()[:16] == before["fingerprint"] and before["codes"] < len(codes)

    in_mirror = int(np.nonzero(distances(permuted(codes, mirror), turned))[0][0])
    told = json.loads(subprocess.run([program, "verify-family", path, "--json"], check=True, capture_output=True).stdout)[0]
    assert (told["valid"], told["distance"], told["mirror_distance"]) == (True, least, in_mirror), told
    if "stride" in text["construction"]:
        prove(path.stem, text, codes, turn, program)
    print(f"{path.stem}: {len(codes)} codes of {bits} bits, distance {least}, in a mirror {in_mirror}, {differing.min()} of {len(beside)} pairs differ")
    robust = rules.get("robust", [])
    if (hidden or robust) and kind != "checker":
        left = with_hidden_cells(codes, turned, places)
        assert all(left[rule["to"]] >= rule["distance"] for rule in robust), (left, robust)
        info = json.loads(subprocess.run([program, "info", path, "--json"], check=True, capture_output=True).stdout)
        assert info["distance_without"] == left, (info["distance_without"], left)
        told = f"a corner of 4 cells hidden {left['apex']}, with an edge of {2 * rows - 1} hidden {left['edge']}, with a triangle of 4 hidden {left['tile']}"
        print(f"{path.stem}: with {told}; claimed {robust}", flush=True)


def main():
    program, names = sys.argv[1], [name for name in sys.argv[2:] if name != "--hidden"]
    named = [pathlib.Path(name) if name.endswith(".json") else FOLDER / f"{name}.json" for name in names]
    paths = named or sorted(FOLDER.glob("*.json"))
    # Position codes are not a family of individual tags; tests/independent/dense.py checks them.
    paths = [path for path in paths if path.stem != "dense9"]
    for path in paths:
        check(path, program, "--hidden" in sys.argv)
    print(f"{len(paths)} families hold, by cells in the plane")


if __name__ == "__main__":
    main()
