#!/usr/bin/env python3
"""Write the corners that `deltille detect` found in a recording as `foxglove.ImageAnnotations`, to show over its images.

    deltille detect --target desk/desk.json run.mcap --topic /front/image_raw -o corners
    python3 foxglove_annotations.py corners corners.mcap

Open `run.mcap` and `corners.mcap` together in Foxglove, and select the topic `/deltille/corners` in the settings of the
image panel. Labelled corners are green with their ids, others orange. Needs `pip install mcap`.
"""

import json
import pathlib
import sys

from mcap.writer import Writer

TOPIC = "/deltille/corners"
LABELLED = {"r": 0.1, "g": 0.9, "b": 0.2, "a": 1.0}
UNLABELLED = {"r": 1.0, "g": 0.6, "b": 0.0, "a": 1.0}
#: Detections have the centre of the first pixel at (0, 0), Foxglove its corner.
SHIFT_PX = 0.5
POINTS = 1


def numbers(*names: str) -> dict:
    return {"type": "object", "properties": {name: {"type": "number"} for name in names}}


def array(**properties: dict) -> dict:
    return {"type": "array", "items": {"type": "object", "properties": {"timestamp": TIME, **properties}}}


TIME = {"type": "object", "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}}}
COLOUR, POINT, NUMBER = numbers("r", "g", "b", "a"), numbers("x", "y"), {"type": "number"}
SCHEMA = {
    "title": "foxglove.ImageAnnotations",
    "type": "object",
    "properties": {
        "circles": array(position=POINT, diameter=NUMBER, thickness=NUMBER, fill_color=COLOUR, outline_color=COLOUR),
        "points": array(
            type={"type": "integer"}, points={"type": "array", "items": POINT}, outline_color=COLOUR,
            outline_colors={"type": "array", "items": COLOUR}, fill_color=COLOUR, thickness=NUMBER,
        ),
        "texts": array(
            position=POINT, text={"type": "string"}, font_size=NUMBER, text_color=COLOUR, background_color=COLOUR
        ),
    },
}  # fmt: skip


def annotations(detection: dict) -> dict:
    """The corners of a detection, one group for each grid."""
    time_ns = detection["time_ns"]
    time = {"sec": time_ns // 10**9, "nsec": time_ns % 10**9}
    points, texts = [], []
    for grid in detection["grids"]:
        colour = UNLABELLED if grid["panel"] is None else LABELLED
        places = [{"x": corner["x"] + SHIFT_PX, "y": corner["y"] + SHIFT_PX} for corner in grid["corners"]]
        of_grid = {"timestamp": time, "type": POINTS, "points": places, "outline_colors": [], "thickness": 4.0}
        points.append({**of_grid, "outline_color": colour, "fill_color": colour})
        for corner, place in zip(grid["corners"], places):
            if corner.get("id") is not None:
                background = {**colour, "a": 0.0}
                text = {"timestamp": time, "position": place, "text": f"{corner['id']}", "font_size": 10.0}
                texts.append({**text, "text_color": colour, "background_color": background})
    return {"circles": [], "points": points, "texts": texts}


def main(corners: str, output: str) -> None:
    detections = [json.loads(path.read_text(encoding="utf-8")) for path in pathlib.Path(corners).glob("*.json")]
    timed = [found for found in detections if found.get("time_ns") is not None]
    if not timed:
        sys.exit(f"{corners}: no detection has a time stamp; detect in a recording first")
    with open(output, "wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(SCHEMA["title"], "jsonschema", json.dumps(SCHEMA).encode())
        channel = writer.register_channel(TOPIC, "json", schema)
        for found in sorted(timed, key=lambda found: found["time_ns"]):
            data = json.dumps(annotations(found)).encode()
            writer.add_message(channel, log_time=found["time_ns"], publish_time=found["time_ns"], data=data)
        writer.finish()
    print(f"wrote {output}: {len(timed)} images")


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__)
    main(*sys.argv[1:])
