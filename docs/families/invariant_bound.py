#!/usr/bin/env python3
"""Upper bounds for binary codes that a turn of order three leaves invariant, by semidefinite programming.

    python docs/families/invariant_bound.py 16 5

A tag is an orbit {x, sx, ssx} of words; s turns m cycles of three cells at once. Two orbits conflict where words of them differ in
fewer than h cells. The theta' number of this graph (Lovasz; Schrijver) bounds the number of tags that do not conflict.

Its matrices may be taken invariant under the group G of the words that s fixes, as translations, the single turns and the
permutations of cycles, and the mirror. In a cycle a pair of words is one of twelve types up to complement and turn of both, so an
orbital of G is a multiset of m types, and the centre; classes of these, up to a turn of either word, transposition and
mirror, are the variables. G is a wreath product, so its blocks are products of symmetric powers of 2 x 2 matrices (see docs/families.md).

The program is solved in floating point. Its dual solution is then rounded and checked with integers and fractions alone, so that
the bound that is printed does not rest on the solver.

Needs numpy, scipy, clarabel.
"""
import itertools
import math
import sys
from fractions import Fraction

import clarabel
import numpy as np
from scipy import sparse

bits, h = int(sys.argv[1]), int(sys.argv[2])
m, centre = bits // 3, bits % 3 == 1


def turn(w):
    return (w << 1 | w >> 2) & 7


def mirror(w):
    return (w & 1) | (w & 2) << 1 | (w & 4) >> 1


# Types: orbits of pairs of three-bit words under complement and turn of both.
number, types = {}, []
for x, y in itertools.product(range(8), repeat=2):
    if (x, y) not in number:
        orbit = set()
        for flip in (0, 7):
            a, b = x ^ flip, y ^ flip
            for _ in range(3):
                orbit.add((a, b))
                a, b = turn(a), turn(b)
        for pair in orbit:
            number[pair] = len(types)
        types.append(sorted(orbit))
T = len(types)
first = [t[0] for t in types]
size = [len(t) for t in types]
distance = [bin(x ^ y).count("1") for x, y in first]
moved = [(x not in (0, 7), y not in (0, 7)) for x, y in first]
turned = [number[x, turn(y)] for x, y in first]
mirrored = [number[mirror(x), mirror(y)] for x, y in first]
swapped = [number[y, x] for x, y in first]

# Monomials of each degree in the types, and what multiplying by a type does to their numbers.
monomials = [list(itertools.combinations_with_replacement(range(T), d)) for d in range(m + 1)]
index = [{mono: i for i, mono in enumerate(list_)} for list_ in monomials]
times = [[np.array([index[d + 1][tuple(sorted(mono + (t,)))] for mono in monomials[d]]) for t in range(T)] for d in range(m)]


def multiply(poly, degree, form):
    """A polynomial times a linear form."""
    out = np.zeros(len(monomials[degree + 1]), dtype=poly.dtype)
    for t in np.nonzero(form)[0]:
        out[times[degree][t]] += form[t] * poly
    return out


def product(forms):
    poly = np.ones(1, dtype=complex)
    for degree, form in enumerate(forms):
        poly = multiply(poly, degree, form)
    return poly


# Local forms v* A_t w for the vectors of a sign under complement and a character under the turn.
w3 = np.exp(2j * np.pi / 3)
sign_forms = {}
for sign in (1, -1):
    def vector(entries):
        v = np.zeros(8, dtype=complex)
        for word, value in entries:
            v[word] += value
            v[word ^ 7] += sign * value
        return v
    const = vector([(0, 1)])
    chars = [vector([(1, 1), (2, z), (4, z * z)]) for z in (1, w3, w3 * w3)]
    def form(v, w):
        return np.array([sum(np.conj(v[x]) * w[y] for x, y in t) for t in types])
    sign_forms[sign] = (
        [[form(const, const), form(const, chars[0])], [form(chars[0], const), form(chars[0], chars[0])]],
        form(chars[1], chars[1]), form(chars[2], chars[2]))

# Variables: classes of multisets, beside the centre (equal or not).
def images(mono):
    todo, seen = [mono], {mono}
    while todo:
        now = todo.pop()
        for table in (turned, mirrored, swapped):
            image = tuple(sorted(table[t] for t in now))
            if image not in seen:
                seen.add(image)
                todo.append(image)
    return seen

least = (h + 1) // 2
full = math.factorial
class_of, classes = {}, []
for mono in monomials[m]:
    if mono in class_of:
        continue
    if min(sum(moved[t][k] for t in mono) for k in (0, 1)) < least:
        continue
    members = images(mono)
    for member in members:
        class_of[member] = len(classes)
    pairs = 0
    for member in members:
        count = full(m)
        for t in set(member):
            count //= full(member.count(t))
        pairs += count * math.prod(size[t] for t in member)
    near = min(sum(distance[t] for t in member) for member in members)
    # The least number of moved cycles of the two words.
    classes.append((pairs, near, [sum(moved[t][k] for t in mono) for k in (0, 1)]))
if not classes:
    sys.exit("no word is so far from its own turns: no tags")
variables = []  # class, centre differs, pairs of words, is diagonal
for c, (pairs, near, _) in enumerate(classes):
    for differs in ((0, 1) if centre else (0,)):
        diagonal = near == 0 and not differs
        if diagonal or near + differs >= h:
            variables.append((c, differs, pairs * (2 if centre else 1), diagonal))
n = len(variables)
print(f"{len(monomials[m])} multisets, {len(classes)} classes, {n} variables", flush=True)
columns = np.full(len(monomials[m]), -1)
for mono, c in class_of.items():
    columns[index[m][mono]] = c

# Blocks: for every variable an integer matrix.
def symmetric_power(forms, p, k):
    """All (i, j, list of (coefficient, forms)) of the p-th symmetric power, times the k-th power of the determinant."""
    (a, b), (c, d) = forms
    det = [(math.comb(k, r) * (-1) ** r, [a] * (k - r) + [d] * (k - r) + [b] * r + [c] * r) for r in range(k + 1)]
    out = {}
    for n22 in range(p + 1):
        for n21 in range(p + 1 - n22):
            for n12 in range(p + 1 - n22 - n21):
                n11 = p - n22 - n21 - n12
                many = full(p) // (full(n11) * full(n12) * full(n21) * full(n22))
                powers = [a] * n11 + [b] * n12 + [c] * n21 + [d] * n22
                out.setdefault((n21 + n22, n12 + n22), []).extend((many * q, powers + f) for q, f in det)
    return out

blocks = []
for counts in itertools.product(range(m + 1), repeat=6):
    if sum(counts) != m:
        continue
    plus, pw, pv, minus, mw, mv = counts
    if (pw + mw - pv - mv) % 3 or (pw, mw) < (pv, mv):
        continue  # not invariant under the turn, or the mirror of another
    scalars = [sign_forms[1][1]] * pw + [sign_forms[1][2]] * pv + [sign_forms[-1][1]] * mw + [sign_forms[-1][2]] * mv
    for kp in range(plus // 2 + 1):
        for km in range(minus // 2 + 1):
            left = symmetric_power(sign_forms[1][0], plus - 2 * kp, kp)
            right = symmetric_power(sign_forms[-1][0], minus - 2 * km, km)
            rows = [(i, j) for i in range(plus - 2 * kp + 1) for j in range(minus - 2 * km + 1)
                    if i + kp + j + km + pw + pv + mw + mv >= least]
            if not rows:
                continue
            entries = {}
            for r, (i, j) in enumerate(rows):
                for s, (k, l) in enumerate(rows[:r + 1]):
                    poly = 0
                    for (c1, f1), (c2, f2) in itertools.product(left[i, k], right[j, l]):
                        poly = poly + c1 * c2 * product(f1 + f2 + scalars)
                    by_class = np.zeros(len(classes))
                    keep = columns >= 0
                    np.add.at(by_class, columns[keep], 2 * poly[keep].real)
                    exact = np.rint(by_class)
                    assert np.abs(by_class - exact).max() < 1e-3 and np.abs(exact).max() < 2 ** 50
                    entries[r, s] = exact
            # Symmetric in the classes already; the two orders of an entry agree.
            for sign in ((1, -1) if centre else (1,)):
                matrix = {rs: np.array([e[c] * (sign if differs else 1) for c, differs, *_ in variables]) for rs, e in entries.items()}
                blocks.append((len(rows), matrix))
print(f"{len(blocks)} blocks, the largest {max(b for b, _ in blocks)}", flush=True)

# maximise sum c x, with trace a x = 1, x >= 0, blocks positive; x is scaled by the number of pairs of its class.
pairs = np.array([float(v[2]) for v in variables])
c = np.full(n, 1 / 9)
diagonal = np.array([v[3] for v in variables])
# A diagonal class holds the pairs (x, x), (x, sx), (x, ssx): a third of its pairs is the trace over words, of which a third counts.
a = np.where(diagonal, 1 / 9, 0.0)
rows_, right = [sparse.csr_matrix(a)], [1.0]
cones = [clarabel.ZeroConeT(1)]
rows_.append(-sparse.identity(n, format="csr"))
right += [0.0] * n
cones.append(clarabel.NonnegativeConeT(n))
scales = []
for k, matrix in blocks:
    scale = [1 / math.sqrt(max(np.abs(matrix[r, r] / pairs).max(), 1e-300)) for r in range(k)]
    scales.append(scale)
    data = []
    # Upper triangle by columns.
    for col in range(k):
        for row in range(col + 1):
            factor = scale[row] * scale[col] * (1 if row == col else math.sqrt(2))
            data.append(-matrix[col, row] / pairs * factor)
    rows_.append(sparse.csr_matrix(np.array(data)))
    right += [0.0] * len(data)
    cones.append(clarabel.PSDTriangleConeT(k))
settings = clarabel.DefaultSettings()
settings.verbose = "-v" in sys.argv
settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-11
solver = clarabel.DefaultSolver(sparse.csc_matrix((n, n)), -c, sparse.vstack(rows_, format="csc"), np.array(right), cones, settings)
solution = solver.solve()
print(f"{solution.status}: {-solution.obj_val:.6f}", flush=True)

# The dual: Y = L L' per block with L rounded, so positive whatever the rounding. Then for every variable
# c + <Y, B> <= lambda a, but for a small excess off the diagonal.
z = np.array(solution.z)[1 + n:]
total = [Fraction(1, 9) for _ in variables]
at = 0
for (k, matrix), scale in zip(blocks, scales):
    y = np.zeros((k, k))
    for col in range(k):
        for row in range(col + 1):
            y[row, col] = y[col, row] = z[at] * (1 if row == col else 1 / math.sqrt(2)) * scale[row] * scale[col]
            at += 1
    values, vectors = np.linalg.eigh(y / np.outer(scale, scale))
    root = (vectors * np.sqrt(np.maximum(values, 0))) * np.array(scale)[:, None]
    root = [[Fraction(float(v)) for v in row] for row in root]
    for row in range(k):
        for col in range(row + 1):
            weight = sum(p * q for p, q in zip(root[row], root[col])) * (1 if row == col else 2)
            if weight:
                for i, value in enumerate(matrix[row, col]):
                    if value:
                        total[i] += weight * int(value) / variables[i][2]
trace = [t / Fraction(1, 9) for t, d in zip(total, diagonal) if d]
# An entry of a positive matrix is at most the root of the product of its two diagonal entries, and with trace 3 those of an orbit
# of n words are at most 3/n: so a scaled variable is at most 3 pairs / sqrt(n n').
def orbit(t):
    return math.comb(m, t) * 6 ** t * 2 ** (m - t) * (2 if centre else 1)

cost = 0
for t, (c_, _, pairs_, diagonal_) in zip(total, variables):
    if t > 0 and not diagonal_:
        cost += t * Fraction(3 * pairs_, math.isqrt(orbit(classes[c_][2][0]) * orbit(classes[c_][2][1])))
bound = max(trace) + cost
print(f"checked: at most {math.floor(bound)} tags ({float(max(trace)):.6f}, rounding {float(cost):.2e})")
