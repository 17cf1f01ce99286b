"""Photographs of printed pages, rendered by cairo and numpy, for tests of the detector that are independent of
deltille's code.

    page = Page("board.json")                      # board.pdf beside it, drawn by pdftocairo
    image, truth = photograph(page, Scene(tilt_deg=45, tone="srgb"), seed=3)

Only two outputs of deltille are used: the PDF, and the corner positions on the page that the target states. The page is
sampled through a pinhole at many points of every pixel, blurred at this higher resolution, and only then averaged over
pixels, because a blur of whole pixels would be a different blur.
"""

import hashlib
import json
import math
import pathlib
import re
import subprocess
import tempfile
import zlib
from dataclasses import dataclass

import os

os.environ.setdefault("OPENCV_IO_MAX_IMAGE_PIXELS", str(2**32))
import cv2
import numpy as np

cv2.setNumThreads(1)
DPI = 1200
PX_PER_MM = DPI / 25.4


class Page:
    """A page in grey, 0 to 1, and its corners in mm from its upper left corner, y down."""

    def __init__(self, target_json):
        path = pathlib.Path(target_json)
        target = json.loads(path.read_text())
        self.pdf = path.with_suffix(".pdf").read_bytes()
        self.edge_mm = target["panels"][0]["edge_mm"]
        self.reduced = {}
        sheet = target["sheets"][0]
        panels = {panel["id"]: panel for panel in target["panels"]}
        self.keys, places = [], []
        for placement in sheet["placements"]:
            (x0, y0), turn = placement["origin_mm"], placement["angle_rad"]
            for corner in panels[placement["panel"]]["corners"]:
                x, y = corner["panel_mm"][:2]
                page_x = x0 + math.cos(turn) * x - math.sin(turn) * y
                page_y = y0 + math.sin(turn) * x + math.cos(turn) * y
                self.keys.append((placement["panel"], corner["row"], corner["col"]))
                places.append((page_x, sheet["height_mm"] - page_y))
        self.corners_mm = np.array(places)

    def drawn(self, ink_um):
        pdf = with_ink(self.pdf, ink_um) if ink_um else self.pdf
        page = pathlib.Path(tempfile.gettempdir(), f"page-{hashlib.sha1(pdf).hexdigest()[:16]}-{DPI}")
        png, source = page.with_suffix(".png"), page.with_suffix(".pdf")
        if not png.exists():
            source.write_bytes(pdf)
            command = ["pdftocairo", "-q", "-r", str(DPI), "-gray", "-png", "-singlefile", source, page]
            subprocess.run(command, check=True)
        return cv2.imread(str(png), cv2.IMREAD_GRAYSCALE).astype(np.float32) / 255

    def reduced_by(self, n, ink_um=0.0):
        """The page with n × n pixels averaged into one, after dilating dark areas by this amount on every side."""
        if (n, ink_um) not in self.reduced:
            page = self.drawn(ink_um)
            height, width = (side // n for side in page.shape)
            blocks = page[: height * n, : width * n].reshape(height, n, width, n)
            self.reduced[n, ink_um] = blocks.mean((1, 3))
        return self.reduced[n, ink_um]


def with_ink(pdf, ink_um):
    """The bytes of a PDF with every dark path grown on all sides, by a stroke in its own colour; or shrunk by
    a white one. Its cross-reference table is not updated: readers rebuild it."""
    stroke = b"/Exact gs 0 0 0 %d K %.5f w 1 j\n" % (ink_um > 0, 2 * abs(ink_um) / 1000 * 72 / 25.4)
    # Otherwise, lines are snapped to whole pixels.
    resources = b"/Resources<</ExtGState<</Exact<</SA false>>>>>>"
    pdf = re.sub(rb"/Resources \d+ 0 R", resources, pdf)

    def inked(stream):
        content = zlib.decompress(stream[3])
        if b"f*" not in content:
            return stream[0]
        # Fills cover the gaps that the strokes leave.
        content = content.replace(b"0 0 0 1 K\n", b"")
        content = re.sub(rb"( [lc]\n)([-\d. ]+ m\n)", rb"\1h\n\2", content)
        content = zlib.compress(stroke + re.sub(rb"(?m)^f\*$", b"b*", content))
        return stream[1] + b"%d" % len(content) + stream[2] + content + b"\nendstream"

    pattern = rb"(/Length )\d+((?:(?!stream|endobj).)*FlateDecode.{0,20}?stream\r?\n)(.*?)\r?\nendstream"
    return re.sub(pattern, inked, pdf, flags=re.DOTALL)


@dataclass
class Scene:
    """The settings of a photograph. Light and noise are fractions of full scale."""

    width: int = 1280
    height: int = 960
    focal_px: float = 900.0
    tilt_deg: float = 30.0
    edge_px: float = 0.0  # of a tile in the middle before the tilt; 0: the board fills this part of the picture
    fill: float = 0.75
    blur_px: float = 0.7
    motion_px: float = 0.0
    black: float = 0.05
    white: float = 0.60
    light_ratio: float = 1.0  # across the board
    exposure: float = 1.0
    tone: str = "linear"  # or srgb, s-curve, or a gamma
    noise: float = 0.005
    mosaic: bool = False
    ink_um: float = 0.0  # growth of what is dark
    mirrored: bool = False


def tone_curve(name, light):
    """Grey values for linear light."""
    light = np.clip(light, 0, 1)
    if name == "linear":
        return light
    if name == "srgb":
        curved = 1.055 * np.power(light, 1 / 2.4) - 0.055
        return np.where(light <= 0.0031308, 12.92 * light, curved)
    if name == "s-curve":
        return light * light * (3 - 2 * light)
    return np.power(light, 1 / float(name))


class View:
    """A pinhole camera in front of the page, with a random rotation and the centre of the board near the image
    centre."""

    def __init__(self, page, scene, rng):
        self.scene, corners = scene, page.corners_mm
        self.centre = (corners.max(0) + corners.min(0)) / 2
        azimuth, roll = rng.uniform(0, 2 * np.pi), rng.uniform(-np.pi, np.pi)
        turn = lambda axis, angle: cv2.Rodrigues(np.eye(3)[axis] * angle)[0]
        tilt = turn(0, math.radians(scene.tilt_deg))
        self.rotation = turn(2, roll) @ turn(2, azimuth) @ tilt @ turn(2, -azimuth)
        picture = np.array([scene.width, scene.height])
        self.translation = np.array([0.0, 0.0, scene.focal_px * page.edge_mm / (scene.edge_px or 8)])
        aside = rng.uniform(-0.05, 0.05, 2) * picture
        for _ in range(40):
            seen = self.project(corners)
            low, high = seen.min(0), seen.max(0)
            if not scene.edge_px:
                self.translation[2] *= 1 + 0.5 * (((high - low) / (scene.fill * picture)).max() - 1)
            off = (picture - 1) / 2 + aside - (high + low) / 2
            self.translation[:2] += 0.9 * off * self.translation[2] / scene.focal_px
        self.px_per_mm = scene.focal_px / self.translation[2]

    def middle(self):
        return np.array([self.scene.width - 1, self.scene.height - 1]) / 2

    def project(self, page_mm):
        """Pixels of positions on the page."""
        flat = np.c_[page_mm - self.centre, np.zeros(len(page_mm))]
        at = flat @ self.rotation.T + self.translation
        return self.scene.focal_px * at[:, :2] / at[:, 2:] + self.middle()

    def page_mm(self, x, y):
        """The page positions of pixels; NaN behind the camera."""
        cx, cy = self.middle()
        ray = np.stack([(x - cx) / self.scene.focal_px, (y - cy) / self.scene.focal_px, np.ones_like(x)])
        ray = np.tensordot(self.rotation.T, ray, 1)
        eye = self.rotation.T @ self.translation
        depth = eye[2] / ray[2]
        depth[depth <= 0] = np.nan
        return [ray[k] * depth - eye[k] + self.centre[k] for k in (0, 1)]


def bilinear(image, x, y):
    """Bilinear samples of an image, and a flag for positions inside it."""
    height, width = image.shape
    inside = (x >= 0) & (y >= 0) & (x < width - 1) & (y < height - 1)
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    left, top = x.astype(np.int32), y.astype(np.int32)
    fx, fy = (x - left).astype(np.float32), (y - top).astype(np.float32)
    pixels, at = image.ravel(), top * width + left
    upper = pixels[at] * (1 - fx) + pixels[at + 1] * fx
    lower = pixels[at + width] * (1 - fx) + pixels[at + width + 1] * fx
    return upper * (1 - fy) + lower * fy, inside


def look(page, view, scene):
    """The blurred reflectance at each pixel; it is 0.25 outside the page."""
    steps = 4 if scene.tilt_deg <= 20 else 6 if scene.tilt_deg <= 50 else 9
    n = int(np.clip(round(PX_PER_MM / (view.px_per_mm * steps)), 1, 24))
    drawn = page.reduced_by(n, scene.ink_um)
    fine = np.empty((scene.height * steps, scene.width * steps), np.float32)
    y, x = np.mgrid[0 : scene.height, 0 : scene.width].astype(float)
    for j in range(steps):
        for i in range(steps):
            step = lambda k: (k + 0.5) / steps - 0.5
            at = view.page_mm(x + step(i), y + step(j))
            page_x, page_y = (place * PX_PER_MM / n - 0.5 for place in at)
            seen, inside = bilinear(drawn, page_x, page_y)
            paper = scene.black + (scene.white - scene.black) * seen
            fine[j::steps, i::steps] = np.where(inside, paper, 0.25)
    if scene.blur_px:
        fine = cv2.GaussianBlur(fine, (0, 0), scene.blur_px * steps, borderType=cv2.BORDER_REPLICATE)
    return fine.reshape(scene.height, steps, scene.width, steps).mean((1, 3))


def moved(image, length_px, angle):
    """The image with linear motion blur."""
    reach, fine = math.ceil(length_px / 2) + 1, 8
    side = (2 * reach + 1) * fine
    kernel = np.zeros((side, side))
    for way in np.linspace(-length_px / 2, length_px / 2, 1001):
        row, col = (int((reach + 0.5 + way * part) * fine) for part in (math.sin(angle), math.cos(angle)))
        kernel[row, col] += 1
    kernel = kernel.reshape(2 * reach + 1, fine, 2 * reach + 1, fine).sum((1, 3))
    kernel = (kernel + kernel[::-1, ::-1]) / (2 * kernel.sum())
    return cv2.filter2D(image, -1, kernel, borderType=cv2.BORDER_REPLICATE)


def coloured(light, noise, tone, rng, method=cv2.COLOR_BayerBG2BGR_EA):
    """A colour image from a Bayer sensor whose filters transmit different fractions of the light."""
    gains = np.array([0.7, 1.0, 0.6])
    raw = light.copy()
    raw[0::2, 0::2] *= gains[0]
    raw[1::2, 1::2] *= gains[2]
    raw = np.clip(raw + rng.normal(0, noise, raw.shape), 0, 1)
    bgr = cv2.demosaicing((raw * 65535).round().astype(np.uint16), method) / 65535
    return tone_curve(tone, bgr / gains[::-1])


def demosaiced(light, noise, tone, rng):
    """Grey values of the same sensor, with planes interpolated bilinearly."""
    return coloured(light, noise, tone, rng, cv2.COLOR_BayerBG2BGR) @ [0.114, 0.587, 0.299]


def lit(light, truth, ratio, rng):
    """Light that falls off across the board by a ratio."""
    height, width = light.shape
    angle = rng.uniform(0, 2 * np.pi)
    y, x = np.mgrid[0:height, 0:width]
    off = (x - width / 2) * math.cos(angle) + (y - height / 2) * math.sin(angle)
    return light * ratio ** -(off / np.ptp(truth, 0).max() + 0.5).clip(-0.3, 1.3)


def photograph(page, scene, seed):
    """An 8-bit image, and the positions of the page's corners in it."""
    rng = np.random.default_rng(seed)
    view = View(page, scene, rng)
    truth = view.project(page.corners_mm)
    light = look(page, view, scene)
    if scene.light_ratio != 1:
        light = lit(light, truth, scene.light_ratio, rng)
    if scene.motion_px:
        light = moved(light, scene.motion_px, rng.uniform(0, np.pi))
    light = light * scene.exposure
    if scene.mosaic:
        grey = demosaiced(light, scene.noise, scene.tone, rng)
    else:
        grey = tone_curve(scene.tone, light) + rng.normal(0, scene.noise, light.shape)
    image = np.clip(np.round(grey * 255), 0, 255).astype(np.uint8)
    if scene.mirrored:
        image = np.ascontiguousarray(image[:, ::-1])
        truth[:, 0] = scene.width - 1 - truth[:, 0]
    return image, dict(zip(page.keys, truth))
