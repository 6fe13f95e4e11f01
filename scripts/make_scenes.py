"""Makes the ready scenes of data/scenes: JSON files, and the sky that one of them needs.

    python3 scripts/make_scenes.py                # writes data/scenes
    python3 scripts/make_scenes.py --self-test    # compares what it would write with what is there, byte by byte

Needs nothing but Python 3. docs/use/scene.md describes the fields. Lengths are metres, +z is up.
"""

import json
import math
import struct
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "data" / "scenes"


def exr(width, height, pixel):
    """An OpenEXR image, RGB in half precision, lines of pixels without compression."""

    def attribute(name, kind, value):
        return name.encode() + b"\0" + kind.encode() + b"\0" + struct.pack("<i", len(value)) + value

    channels = "BGR"  # in alphabetical order, as the format wants them
    half, linear, every = 1, 0, 1
    listed = b"".join(
        name.encode() + b"\0" + struct.pack("<iB3xii", half, linear, every, every) for name in channels
    )
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    head = struct.pack("<ii", 20000630, 2)
    head += attribute("channels", "chlist", listed + b"\0")
    head += attribute("compression", "compression", b"\0")
    head += attribute("dataWindow", "box2i", window)
    head += attribute("displayWindow", "box2i", window)
    head += attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1))
    head += b"\0"
    lines = []
    for row in range(height):
        colours = [pixel(column, row) for column in range(width)]
        data = b"".join(struct.pack("<e", colour["RGB".index(name)]) for name in channels for colour in colours)
        lines.append(struct.pack("<ii", row, len(data)) + data)
    start = len(head) + 8 * height
    offsets = b"".join(struct.pack("<Q", start + row * len(lines[0])) for row in range(height))
    return head + offsets + b"".join(lines)


def overcast(width=64, height=32):
    """The overcast sky of the CIE over a ground that reflects a fifth of its light: Lz (1 + 2 cos theta)/3 above the horizon, and
    below it 0.2 E/pi, with E = 7 pi/9 Lz."""
    zenith = (0.94, 1.0, 1.08)

    def pixel(_, row):
        theta = math.pi * (row + 0.5) / height
        share = (1 + 2 * math.cos(theta)) / 3 if theta < math.pi / 2 else 0.2 * 7 / 9
        return [round(share * channel, 4) for channel in zenith]

    return exr(width, height, pixel)


def panel(center, half_u, half_v, radiance, samples):
    return {
        "area": {"center": center, "half_u": half_u, "half_v": half_v, "radiance_rgb": radiance, "samples": samples}
    }


def camera(position, look_at, fov, width, height):
    return {
        "position": position,
        "look_at": look_at,
        "vertical_fov_deg": fov,
        "width": width,
        "height": height,
    }


def scene(description, surface, camera, lights):
    return {
        "schema": "brdfit.scene/1",
        "description": description,
        "surface": surface,
        "camera": camera,
        "lights": lights,
    }


BALL = {"sphere": {"center": [0, 0, 0], "radius": 0.05}}

SCENES = {
    "studio-sphere": scene(
        "A ball of 10 cm between three softboxes: key from the upper left, fill from the right, rim from behind.",
        BALL,
        camera([0, -0.6, 0.1], [0, 0, 0], 11, 64, 64),
        [
            panel([-0.5, -0.6, 0.6], [0.18, -0.15, 0], [0.075, 0.09, 0.1375], [12, 12, 12], 225),
            panel([0.7, -0.5, 0.1], [0.15, 0.21, 0], [0, 0, 0.25], [2, 2.1, 2.3], 100),
            panel([0.3, 0.7, 0.4], [0.14, -0.06, 0], [0, 0, 0.2], [15, 14.5, 14], 100),
        ],
    ),
    "overcast-sky": scene(
        "A ball of 10 cm in the open on an overcast day, with light from the ground.",
        BALL,
        camera([0, -0.6, 0.1], [0, 0, 0], 11, 64, 64),
        [{"environment": {"exr": "overcast.exr", "scale": 1, "samples": 1024}}],
    ),
    "grazing-sun-floor": scene(
        "A floor of 4 m by 12 m seen 3 to 20 degrees above it, towards a sun 9 degrees above the horizon.",
        {
            "plane": {
                "center": [0, 6.5, 0],
                "normal": [0, 0, 1],
                "tangent": [1, 0, 0],
                "half_width": 2,
                "half_height": 6,
            }
        },
        camera([0, 0, 0.6], [0, 4, 0], 26, 96, 48),
        [
            {"directional": {"to_light": [0.15, 1, 0.16], "irradiance_rgb": [20, 17, 12]}},
            {"overcast": {"zenith_radiance_rgb": [0.5, 0.7, 1.1], "samples": 256}},
        ],
    ),
    "interior-normal-incidence": scene(
        "A piece of wall, 1.2 m by 0.8 m, seen straight on and lit by a panel above the camera.",
        {
            "plane": {
                "center": [0, 0, 1.5],
                "normal": [0, -1, 0],
                "tangent": [1, 0, 0],
                "half_width": 0.6,
                "half_height": 0.4,
            }
        },
        camera([0, -2, 1.5], [0, 0, 1.5], 22, 72, 48),
        [panel([0, -2, 2], [0.3, 0, 0], [0, 0, 0.15], [30, 28, 24], 200)],
    ),
}


def lines(value, indent=0):
    """JSON with short lists and objects in one line each."""
    short = json.dumps(value)
    if len(short) + indent <= 110 or not isinstance(value, (dict, list)):
        return short
    inner = " " * (indent + 2)
    if isinstance(value, dict):
        parts = [f"{inner}{json.dumps(key)}: {lines(part, indent + 2)}" for key, part in value.items()]
    else:
        parts = [inner + lines(part, indent + 2) for part in value]
    opening, closing = "{}" if isinstance(value, dict) else "[]"
    return opening + "\n" + ",\n".join(parts) + "\n" + " " * indent + closing


def main():
    files = {f"{name}.json": (lines(content) + "\n").encode() for name, content in SCENES.items()}
    files["overcast.exr"] = overcast()
    if sys.argv[1:] == ["--self-test"]:
        wrong = [name for name, content in files.items() if (FOLDER / name).read_bytes() != content]
        if wrong:
            sys.exit("differ from what this script makes: " + ", ".join(wrong))
        print(f"{len(files)} files, {sum(map(len, files.values()))} bytes, as in {FOLDER.name}")
        return
    if sys.argv[1:]:
        sys.exit(__doc__)
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        (FOLDER / name).write_bytes(content)


if __name__ == "__main__":
    main()
