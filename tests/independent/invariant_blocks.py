#!/usr/bin/env python3
"""Do the blocks of docs/families/invariant_bound.py have the eigenvalues of the whole matrix?

    python tests/independent/invariant_blocks.py 9 3
    python tests/independent/invariant_blocks.py 10 3

For a few cells the graph of all tags is small. A random matrix with one value for each variable of the program is built
in full from words and their distances, and its eigenvalues are compared with those of the blocks. Conflicts are
compared, too. Ten cells do not form a tag, but they give three cycles and a centre. Needs numpy, scipy, clarabel.
"""
import pathlib
import sys

import numpy as np
import scipy.linalg

script = pathlib.Path(__file__).parents[2] / "docs/families/invariant_bound.py"
text = script.read_text()
program = {"__name__": "program"}
exec(text[:text.index("# maximise sum c x")], program)
m, h, least, variables, blocks, number, class_of = (
    program[k] for k in ("m", "h", "least", "variables", "blocks", "number", "class_of"))


def cycles(word):
    return [word >> 3 * c & 7 for c in range(m)]


def turned(word):
    turns = sum(program["turn"](v) << 3 * c for c, v in enumerate(cycles(word)))
    return turns | word >> 3 * m << 3 * m


tags = []
for word in range(1 << program["bits"]):
    orbit = word, turned(word), turned(turned(word))
    if word == min(orbit) and sum(v not in (0, 7) for v in cycles(word)) >= least:
        tags.append(orbit)

value = np.random.default_rng(1).normal(size=len(variables))
place = {(c, differs): i for i, (c, differs, _, _) in enumerate(variables)}
whole = np.zeros((len(tags), len(tags)))
for i, a in enumerate(tags):
    for j, b in enumerate(tags):
        kinds = tuple(sorted(number[x, y] for x, y in zip(cycles(a[0]), cycles(b[0]))))
        variable = place.get((class_of[kinds], (a[0] ^ b[0]) >> 3 * m))
        near = min(bin(a[0] ^ word).count("1") for word in b)
        assert (variable is None) == (i != j and near < h), "conflicts differ"
        whole[i, j] = 0 if variable is None else value[variable]

of_blocks = []
diagonal = [i for i, v in enumerate(variables) if v[3]]
for size, matrix in blocks:
    block, unit = np.zeros((size, size)), np.zeros((size, size))
    for (r, s), entries in matrix.items():
        block[r, s] = block[s, r] = entries @ value
        unit[r, s] = unit[s, r] = entries[diagonal].sum()
    of_blocks.extend(scipy.linalg.eigvalsh(block, unit))
of_whole, of_blocks = np.linalg.eigvalsh(whole), np.array(of_blocks)
there = np.abs(of_whole[:, None] - of_blocks[None, :])
worst = max(there.min(axis=0).max(), there.min(axis=1).max())
print(f"{len(tags)} tags; eigenvalues differ by {worst:.1e} at most")
sys.exit(int(worst > 1e-9))
