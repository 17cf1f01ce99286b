"""The tables of OpenCV's predefined ArUco dictionaries, one code a line.

    python extract.py            writes 4x4.txt to 7x7.txt beside this script
    python extract.py --check    fails where they differ from those of the installed OpenCV

Bits are read row by row from the upper left, the first of them the most significant; 1 is white. The smaller
dictionaries of a size are the first codes of the largest. Those of AprilTag are AprilTag's, turned by 180°, and are not
written; DICT_ARUCO_ORIGINAL has markers that are others turned, so that it is no family. Needs OpenCV.
"""

import pathlib
import sys

import cv2

FOLDER = pathlib.Path(__file__).parent


def codes(name):
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    size = dictionary.markerSize
    for index in range(len(dictionary.bytesList)):
        code = dictionary.bytesList[index : index + 1]
        bits = cv2.aruco.Dictionary.getBitsFromByteList(code, size)
        yield int("".join(str(int(bit)) for bit in bits.ravel()), 2)


for size in (4, 5, 6, 7):
    table = list(codes(f"DICT_{size}X{size}_1000"))
    for count in (50, 100, 250):
        assert list(codes(f"DICT_{size}X{size}_{count}")) == table[:count], (size, count)
    digits = (size * size + 3) // 4
    text = "".join(f"{code:0{digits}x}\n" for code in table)
    path = FOLDER / f"{size}x{size}.txt"
    if "--check" not in sys.argv:
        path.write_text(text)
    elif path.read_text() != text:
        sys.exit(f"{path.name}: differs from OpenCV {cv2.__version__}")
print(f"OpenCV {cv2.__version__}: the tables of its dictionaries")
