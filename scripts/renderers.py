"""What renderers make of a material file: their own complaints about it, and its f at pairs of directions.

`CLIENTS` has one entry per target of `brdfit export`. To add one: write its two functions, and the line in `CLIENTS`.

Conventions
    f in 1/sr, without the cosine, linear Rec.709, as an array (n, 3). wi to the light and wo to the viewer: unit vectors
    (n, 3) in the local frame, n = +z and the tangent +x.

Sources
    Mitsuba 3.9: documentation of `eval` of a BSDF. MaterialX 1.39 and USD 26.11 (Storm): the GLSL that they come with, or
    generate. Radiance 6: the manual pages of rtrace and oconv. glTF 2.0: appendix B of the specification, and
    KHR_materials_{ior, specular, anisotropy, clearcoat}. pbrt-v4: src/pbrt/materials.cpp and util/scattering.h.
    Blender 5.0: its Python interface.
"""

from __future__ import annotations

import importlib
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

Array = np.ndarray
PI = math.pi
# Largest angle from the normal, in degrees. Nearer to grazing, h is a small difference of numbers in single precision.
LIMIT = 89.5


class Missing(Exception):
    """A client is not installed; the message says which."""


class PartMissing(Exception):
    """A client can do only a part of its work, because of what the message says."""


def module(name: str):
    """A module of a client's package."""
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise Missing(f"{name}: {error}") from error


def run(command: list, **options) -> bytes:
    """What a client's program prints."""
    done = subprocess.run([str(word) for word in command], capture_output=True, timeout=300, **options)
    if done.returncode:
        raise RuntimeError(f"{command[0]} exited {done.returncode}: {done.stderr.decode(errors='replace').strip()[-2000:]}")
    return done.stdout


def normalised(v: Array) -> Array:
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def dots(a: Array, b: Array) -> Array:
    return np.sum(a * b, axis=1)


def turned(up: Array, beside: Array) -> Callable[[Array], Array]:
    """The rotation of each pair that takes `up` to +z and `beside`, perpendicular to it, to +x."""
    rows = np.stack([beside, np.cross(up, beside), up], axis=1)
    return lambda v: np.einsum("nij,nj->ni", rows, np.broadcast_to(v, up.shape))


def lit_from_above(wi: Array) -> Callable[[Array], Array]:
    """Local frames turned so that the light is at +z, and the tangent is +x as projected onto the surface."""
    # What becomes +x is perpendicular to wi and to the local y.
    return turned(wi, normalised(np.stack([wi[:, 2], np.zeros(len(wi)), -wi[:, 0]], axis=1)))


X, Z = np.eye(3)[0], np.eye(3)[2]


# ------------------------------------------------------------------------------------------------------ Mitsuba


def xml_problems(path: Path) -> list[str]:
    """Mitsuba and MaterialX take files that a strict reader does not."""
    try:
        ElementTree.parse(path)
    except ElementTree.ParseError as error:
        return [f"not well-formed XML: {error}"]
    return []


def mitsuba_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    mi = module("mitsuba")
    mi.set_variant("scalar_rgb")
    # A scene shows only the materials of its shapes.
    user = f'<scene version="3.0.0"><include filename="{path}"/><shape type="sphere"><ref id="brdfit"/></shape></scene>'
    bsdf = mi.load_string(user).shapes()[0].bsdf()
    context, point = mi.BSDFContext(), mi.SurfaceInteraction3f()
    out = np.empty((len(wi), 3))
    # Mitsuba's wi is the side of the viewer.
    for row, (light, viewer) in enumerate(zip(wi.tolist(), wo.tolist())):
        point.wi = viewer
        out[row] = bsdf.eval(context, point, light)
    return out / wi[:, 2:]


# ------------------------------------------------------------------------------- GLSL, for MaterialX and for Storm


@cache
def gl_context():
    """OpenGL without a display; Mesa's software renderer will do."""
    try:
        return module("moderngl").create_context(standalone=True, backend="egl", require=450)
    except Exception as error:  # moderngl raises a plain one without EGL
        raise PartMissing(f"OpenGL: {error}") from error


def drawn(vertex: str, fragment: str, attributes: dict[str, Array], uniforms: dict) -> Array:
    """The colour of one point per row of the attributes, which the shaders place at `i_pixel`."""
    gl, moderngl = gl_context(), module("moderngl")
    n = len(next(iter(attributes.values())))
    side = math.ceil(math.sqrt(n))
    row, column = np.divmod(np.arange(n), side)
    attributes = {**attributes, "i_pixel": (np.stack([column, row], axis=1) + 0.5) / side * 2 - 1}
    program = gl.program(vertex_shader=vertex, fragment_shader=fragment)
    for name, value in uniforms.items():
        if name in program:
            program[name].value = value
    content = [
        (gl.buffer(np.ascontiguousarray(v, dtype="f4").tobytes()), f"{v.shape[1]}f", name)
        for name, v in attributes.items()
        if name in program
    ]
    target = gl.framebuffer([gl.texture((side, side), 4, dtype="f4")])
    target.use()
    target.clear()
    gl.vertex_array(program, content).render(moderngl.POINTS, n)
    return np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(-1, 4)[:n, :3].astype(float)


def materialx_document(path: Path):
    mx = module("MaterialX")
    library, document = mx.createDocument(), mx.createDocument()
    mx.loadLibraries(mx.getDefaultDataLibraryFolders(), mx.getDefaultDataSearchPath(), library)
    mx.readFromXmlFile(document, str(path))
    document.setDataLibrary(library)
    return document, library


def materialx_problems(path: Path) -> list[str]:
    """Those of `validate`, and what it leaves out: unknown nodes, and values outside their range."""
    mx = module("MaterialX")
    try:
        document, _ = materialx_document(path)
    except Exception as error:  # its classes have no ancestor in common
        return [f"cannot be read: {error}"]
    valid, message = document.validate()
    problems = xml_problems(path) + ([] if valid else message.strip().splitlines())
    if document.getColorSpace() != "lin_rec709":
        problems.append(f"expected the colour space lin_rec709, found {document.getColorSpace()!r}")
    if not any(mx.getShaderNodes(material) for material in document.getMaterialNodes()):
        problems.append("no material with a surface shader")
    for node in document.getNodes():
        definition = node.getNodeDef()
        if definition is None:
            problems.append(f"{node.getName()}: no such node as {node.getCategory()}")
            continue
        for given in node.getInputs():
            known = definition.getActiveInput(given.getName())
            if known is None or not given.hasValueString():
                continue
            value = numbers_of(given.getValueString())
            low, high = (numbers_of(known.getAttribute(end)) for end in ("uimin", "uimax"))
            outside = any(x < end for x, end in zip(value, low)) or any(x > end for x, end in zip(value, high))
            if outside or not np.all(np.isfinite(value)):
                problems.append(f"{node.getName()}: {given.getName()} = {given.getValueString()} is out of range")
    return problems


def numbers_of(text: str) -> list[float]:
    """The numbers in a text that has nothing but numbers; none in any other."""
    try:
        return [float(word) for word in text.split(",")] if text else []
    except ValueError:
        return []


def materialx_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """The GLSL that MaterialX generates, with one light and nothing around."""
    mx, gen, glsl = module("MaterialX"), module("MaterialX.PyMaterialXGenShader"), module("MaterialX.PyMaterialXGenGlsl")
    document, library = materialx_document(path)
    generator = glsl.GlslShaderGenerator.create()
    context = gen.GenContext(generator)
    for folder in mx.getDefaultDataSearchPath().asString().split(mx.PATH_LIST_SEPARATOR):
        context.registerSourceCodeSearchPath(folder)
        context.registerSourceCodeSearchPath(f"{folder}/libraries")
    options = context.getOptions()
    options.hwSpecularEnvironmentMethod = gen.HwSpecularEnvironmentMethod.SPECULAR_ENVIRONMENT_NONE
    options.hwMaxActiveLightSources = 1
    options.hwSrgbEncodeOutput = False
    gen.HwShaderGenerator.unbindLightShaders(context)
    gen.HwShaderGenerator.bindLightShader(library.getNodeDef("ND_directional_light"), 1, context)
    shader = generator.generate("brdfit", gen.findRenderableElements(document)[0], context)
    vertex, fragment = (shader.getSourceCode(stage) for stage in (gen.VERTEX_STAGE, gen.PIXEL_STAGE))
    vertex = re.sub(r"gl_Position = [^;]*;", "gl_Position = vec4(i_pixel, 0.0, 1.0); gl_PointSize = 1.0;", vertex)
    vertex = vertex.replace("void main()", "in vec2 i_pixel;\nvoid main()", 1)
    if "uniform bool u_refractionTwoSided" not in fragment:  # 1.39.5 uses it without a declaration
        fragment = re.sub(r"(#version[^\n]*\n)", r"\1uniform bool u_refractionTwoSided = false;\n", fragment, count=1)
    world = lit_from_above(wi)
    unit = tuple(np.eye(4).ravel())
    uniforms = {
        "u_viewPosition": (0.0, 0.0, 0.0), "u_worldMatrix": unit, "u_worldInverseTransposeMatrix": unit,
        "u_numActiveLightSources": 1, "u_lightData[0].type": 1, "u_lightData[0].direction": (0.0, 0.0, -1.0),
        "u_lightData[0].color": (1.0, 1.0, 1.0), "u_lightData[0].intensity": 1.0,
    }  # fmt: skip
    attributes = {"i_position": -world(wo), "i_normal": world(Z), "i_tangent": world(X)}
    return drawn(vertex, fragment, attributes, uniforms) / wi[:, 2:]


# ---------------------------------------------------------------------------------------------------------- USD


def usd_shader(stage):
    """The surface shader of the first material; None if none is connected."""
    UsdShade = module("pxr.UsdShade")
    materials = [UsdShade.Material(prim) for prim in stage.Traverse() if prim.IsA(UsdShade.Material)]
    source = materials[0].ComputeSurfaceSource() if materials else None
    shader = source[0] if isinstance(source, tuple) else source
    return shader if shader and shader.GetPrim().IsValid() else None


def usd_problems(path: Path) -> list[str]:
    """Those of USD's own validators, and what they leave out: unknown inputs, dangling connections, values out of range."""
    Usd, UsdValidation, Sdr, Tf = (module(f"pxr.{name}") for name in ("Usd", "UsdValidation", "Sdr", "Tf"))
    try:
        stage = Usd.Stage.Open(str(path))
    except Tf.ErrorException as error:
        return [f"cannot be read: {str(error).strip().splitlines()[-1].strip()}"]
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    problems = [error.GetErrorAsString() for error in UsdValidation.ValidationContext(validators).Validate(stage)]
    shader = usd_shader(stage)
    node = shader and Sdr.Registry().GetShaderNodeByIdentifier(shader.GetShaderId())
    if not node:
        return [*problems, "no material with a known surface shader"]
    known = node.GetShaderInputNames()
    for given in shader.GetInputs():
        value = np.ravel(given.Get())
        if given.GetBaseName() not in known:
            problems.append(f"{given.GetBaseName()}: no such input")
        elif not np.all(np.isfinite(value)) or given.GetBaseName() != "ior" and not np.all((0 <= value) & (value <= 1)):
            problems.append(f"{given.GetBaseName()} = {given.Get()} is out of range")
    for prim in stage.Traverse():
        targets = [target for relation in prim.GetRelationships() for target in relation.GetTargets()]
        targets += [target for attribute in prim.GetAttributes() for target in attribute.GetConnections()]
        problems += [f"{prim.GetPath()} refers to {target}, which is missing" for target in targets if not stage.GetObjectAtPath(target)]
    return problems


STORM_MAIN = """
in vec3 light, viewer;
out vec4 colour;
uniform vec3 diffuseColor, specularColor;
uniform int useSpecularWorkflow;
uniform float ior, metallic, roughness, clearcoat, clearcoatRoughness;
void main() {
    vec3 h = normalize(light + viewer);
    LightingContributions c = evaluateLight(
        diffuseColor, useSpecularWorkflow == 1, ior, metallic, 1.0, specularColor, roughness, clearcoat, vec3(1.0), clearcoatRoughness,
        1.0, light.z, viewer.z, h.z, dot(viewer, h), vec3(1.0), vec3(1.0));
    colour = vec4(c.diffuse + c.specular, 1.0);
}
"""
STORM_VERTEX = """
#version 450
in vec3 i_light, i_viewer;
in vec2 i_pixel;
out vec3 light, viewer;
void main() { light = i_light; viewer = i_viewer; gl_Position = vec4(i_pixel, 0.0, 1.0); gl_PointSize = 1.0; }
"""
# The defaults of the specification, version 2.6.
PREVIEW_DEFAULTS = {
    "diffuseColor": (0.18, 0.18, 0.18), "specularColor": (0.0, 0.0, 0.0), "useSpecularWorkflow": 0, "ior": 1.5, "metallic": 0.0,
    "roughness": 0.5, "clearcoat": 0.0, "clearcoatRoughness": 0.01,
}  # fmt: skip


def usd_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """The GLSL of USD's own renderer, Storm, without the 0.001 that it adds here and there against divisions by 0."""
    Usd, pxr = module("pxr.Usd"), module("pxr")
    source = Path(pxr.__file__).parent / "pluginfo/usdShaders/resources/shaders/previewSurface.glslfx"
    sections = re.split(r"^-- glsl (\S+)$", source.read_text(), flags=re.M)
    text = dict(zip(sections[1::2], sections[2::2]))
    lighting, count = re.subn(r"#define EPSILON 0\.001\b", "#define EPSILON 0.0", text["Preview.Lighting"])
    if count != 1:
        raise RuntimeError(f"{source}: expected one definition of EPSILON as 0.001, found {count}")
    fragment = f"#version 450\n#define PI {PI}\n{text['Preview.LightStructures']}{lighting}{STORM_MAIN}"
    stage = Usd.Stage.Open(str(path))  # a shader lives no longer than its stage
    given = {one.GetBaseName(): one.Get() for one in usd_shader(stage).GetInputs()}
    values = {name: tuple(given.get(name, x)) if isinstance(x, tuple) else given.get(name, x) for name, x in PREVIEW_DEFAULTS.items()}
    return drawn(STORM_VERTEX, fragment, {"i_light": wi, "i_viewer": wo}, values) / wi[:, 2:]


# ----------------------------------------------------------------------------------------------------- Radiance


def radiance_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """A sphere lit by one small distant light, one ray per pair, against the same rays on a white sphere.

    A sphere, since on flat surfaces Radiance widens the lobe by the size of the light.
    """
    root = Path(module("pyradiance").__file__).parent
    environment = {**os.environ, "PATH": f"{root / 'bin'}{os.pathsep}{os.environ['PATH']}", "RAYPATH": f".{os.pathsep}{root / 'lib'}"}
    world = lit_from_above(wi)
    normal, view = world(Z), world(wo)
    rays = np.concatenate([normal + 3.0 * view, -view], axis=1).astype("<f8").tobytes()
    # No light but the direct one.
    command = ["rtrace", "-h", "-w", "-fdd", "-ab", "0", "-lr", "0", "-dj", "0", "-ds", "0", "-dt", "0", "-st", "1"]
    white = "void plastic brdfit\n0\n0\n5 1 1 1 0 0\n"
    seen = []
    with tempfile.TemporaryDirectory() as folder:
        octree = Path(folder, "scene.oct")
        for material in (path.read_text(), white):
            scene = f"{material}\nvoid light sun\n0\n0\n3 1e6 1e6 1e6\nsun source sky\n0\n0\n4 0 0 1 0.01\n"
            scene += "brdfit sphere ball\n0\n0\n4 0 0 0 1\n"
            octree.write_bytes(run(["oconv", "-w", "-"], input=scene.encode(), env=environment))
            seen.append(np.frombuffer(run([*command, octree], input=rays, env=environment), "<f8").reshape(-1, 3))
    return seen[0] / seen[1] / PI


# -------------------------------------------------------------------------------- formulas, for glTF and for pbrt


def lobe(wi: Array, wo: Array, mx: float, my: float) -> Array:
    """D G/(4 ci co): GGX and height-correlated Smith. A column, as all below."""
    h = normalised(wi + wo)
    density = 1 / (PI * mx * my * ((h[:, 0] / mx) ** 2 + (h[:, 1] / my) ** 2 + h[:, 2] ** 2) ** 2)
    hidden = [0.5 * (np.sqrt(1 + ((mx * v[:, 0]) ** 2 + (my * v[:, 1]) ** 2) / v[:, 2] ** 2) - 1) for v in (wi, wo)]
    return (density / (4 * wi[:, 2] * wo[:, 2] * (1 + hidden[0] + hidden[1])))[:, None]


def schlick(c: Array, f0, f90=1.0) -> Array:
    return f0 + (f90 - f0) * (1 - c) ** 5


def conductor(c: Array, eta: Array, k: Array) -> Array:
    """Exact reflectance of a metal in vacuum, of complex amplitudes."""
    index = eta + 1j * k
    inside = np.sqrt(1 - (1 - c * c) / index**2)
    amplitudes = (c - index * inside) / (c + index * inside), (index * c - inside) / (index * c + inside)
    return sum(np.abs(r) ** 2 for r in amplitudes) / 2


def cosine_to_half(wi: Array, wo: Array) -> Array:
    return dots(wi, normalised(wi + wo))[:, None]


# --------------------------------------------------------------------------------------------------------- glTF


GLTF_PROGRAM = """
const { validateBytes } = require('gltf-validator');
const bytes = new Uint8Array(require('fs').readFileSync(process.argv[1]));
validateBytes(bytes, { format: 'gltf', maxIssues: 0, writeTimestamp: false }).then((report) => console.log(JSON.stringify(report)));
"""


def gltf_problems(path: Path) -> list[str]:
    """Errors and warnings of Khronos' validator, of the npm package gltf-validator."""
    folder = os.environ.get("BRDFIT_NODE_MODULES", os.getcwd())
    if not shutil.which("node"):
        raise PartMissing("node is not installed")
    if not Path(folder, "node_modules/gltf-validator").is_dir():
        raise PartMissing("gltf-validator is not in node_modules of the current folder, nor of BRDFIT_NODE_MODULES")
    report = json.loads(run(["node", "-e", GLTF_PROGRAM, path.resolve()], cwd=folder))
    severe = [message for message in report["issues"]["messages"] if message["severity"] < 2]
    return [f"{message['code']} {message.get('pointer', '')}: {message['message']}" for message in severe]


def gltf_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """The formulas of the specification, with the correlated shadowing that it has since its pull request 2541."""
    material = json.loads(path.read_text())["materials"][0]
    surface, extensions = material["pbrMetallicRoughness"], material.get("extensions", {})
    if "KHR_materials_sheen" in extensions:
        raise PartMissing("the specification gives no numbers for the albedo of sheen; scripts/reference/targets.py has it")
    of = lambda extension, name, default: extensions.get(f"KHR_materials_{extension}", {}).get(name, default)
    base = np.array(surface.get("baseColorFactor", [1.0] * 4))[:3]
    ior = of("ior", "ior", 1.5)
    weight = of("specular", "specularFactor", 1.0)
    tint = np.array(of("specular", "specularColorFactor", [1.0] * 3))
    alpha = surface.get("roughnessFactor", 1.0) ** 2
    along = alpha + (1 - alpha) * of("anisotropy", "anisotropyStrength", 0.0) ** 2
    mu = cosine_to_half(wi, wo)
    reflection = lobe(wi, wo, along, alpha)
    fresnel = schlick(mu, weight * np.minimum(((ior - 1) / (ior + 1)) ** 2 * tint, 1), weight)
    dielectric = fresnel * reflection + (1 - fresnel) * base / PI
    metallic = surface.get("metallicFactor", 1.0)
    below = (1 - metallic) * dielectric + metallic * schlick(mu, base) * reflection
    coated = of("clearcoat", "clearcoatFactor", 0.0) * schlick(wo[:, 2:], 0.04)
    above = of("clearcoat", "clearcoatRoughnessFactor", 0.0) ** 2
    return below if not np.any(coated) else (1 - coated) * below + coated * lobe(wi, wo, above, above)


# --------------------------------------------------------------------------------------------------------- pbrt

# The types of the parameters that pbrt takes; it stops at any other.
PBRT = {
    "diffuse": {"reflectance": "rgb"},
    "conductor": {"eta": "rgb", "k": "rgb", "uroughness": "float", "vroughness": "float", "remaproughness": "bool"},
    "mix": {"materials": "string", "amount": "float"},
}


def pbrt_materials(text: str) -> dict[str, dict]:
    """Parameters of each named material as {name: (type, values)}; ValueError if the text is anything else."""
    text = re.sub(r"#[^\n]*", "", text)
    value = r'(?:"[^"\n]*"|\[[^\]]*\]|[^\s"\[\]]+)'
    statement = re.compile(rf'\s*MakeNamedMaterial\s+"([^"\n]+)"((?:\s+"\w+ \w+"\s+{value})*)\s*')
    found, at = {}, 0
    while at < len(text.rstrip()):
        match = statement.match(text, at)
        if not match or match[1] in found:
            raise ValueError(f"expected a new named material at {text[at : at + 40]!r}")
        parameters = {}
        for kind, name, given in re.findall(rf'"(\w+) (\w+)"\s+({value})', match[2]):
            words = re.findall(r'"[^"\n]*"|[^\s"\[\]]+', given)
            read = {"float": float, "rgb": float, "bool": ["false", "true"].index}.get(kind, lambda word: word.strip('"'))
            if name in parameters:
                raise ValueError(f"{match[1]}: {name} twice")
            parameters[name] = kind, [read(word) for word in words]
        found[match[1]], at = parameters, match.end()
    return found


def pbrt_problems(path: Path) -> list[str]:
    """What would stop pbrt, or make it take another roughness, as far as its source tells: no program reads the file."""
    try:
        materials = pbrt_materials(path.read_text())
    except ValueError as error:
        return [str(error)]
    problems = [] if "brdfit" in materials else ["no material brdfit"]
    for number, (name, parameters) in enumerate(materials.items()):
        kind = parameters.pop("type", ("", ["without a type"]))[1][0]
        known = PBRT.get(kind, {})
        earlier = list(materials)[:number]
        for parameter, (written, values) in parameters.items():
            if known.get(parameter) != written:
                problems.append(f"{name}: {kind} has no {written} {parameter}")
            elif written == "rgb" and (len(values) != 3 or not np.all(np.isfinite(values)) or min(values) < 0):
                problems.append(f"{name}: {parameter} = {values} is no colour")
            elif parameter == "reflectance" and max(values) > 1 or parameter == "amount" and not 0 <= values[0] <= 1:
                problems.append(f"{name}: {parameter} = {values} is out of range")
            elif parameter == "materials" and not set(values) <= set(earlier):
                problems.append(f"{name}: {values} are not all defined before")
        if set(known) != set(parameters):
            problems.append(f"{name}: expected {', '.join(known)} of {kind}, found {', '.join(parameters)}")
        if kind == "conductor" and parameters.get("remaproughness", ("", [1]))[1] != [0]:
            problems.append(f"{name}: pbrt would map its roughness")
    return problems


def pbrt_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """pbrt's formulas at the values in the file, RGB by RGB."""
    materials = pbrt_materials(path.read_text())

    def of(name):
        values = {key: np.array(words) for key, (_, words) in materials[name].items()}
        if values["type"] == "mix":
            first, second = map(of, values["materials"])
            return (1 - values["amount"]) * first + values["amount"] * second
        if values["type"] == "diffuse":
            return np.broadcast_to(values["reflectance"] / PI, (len(wi), 3))
        reflection = lobe(wi, wo, values["uroughness"], values["vroughness"])
        return reflection * conductor(cosine_to_half(wi, wo), values["eta"], values["k"])

    return of("brdfit")


# ------------------------------------------------------------------------------------------------------ Blender

# Side of a picture, in pixels. Its camera and its sun do not move, so that its pairs have one angle between wi and wo.
SIDE = 32


def blender_pairs(count: int, seed: int) -> tuple[Array, Array]:
    """Random pairs, picture after picture, from the view along the light to grazing."""
    random = np.random.default_rng(seed)
    pictures = max(2, round(count / SIDE**2))
    wi, wo = [], []
    for angle in np.radians(np.linspace(2, 175, pictures)):
        light = np.array([math.sin(angle), 0.0, math.cos(angle)])
        half = (light + Z) / np.linalg.norm(light + Z)
        # Half of them near the mirror direction; both angles below the limit.
        spread = 10 ** random.uniform(-3, 0, (100_000, 1))
        spread[::2] = 1e3
        normal = normalised(half + spread * normalised(random.normal(size=spread.shape[:1] + (3,))))
        seen = normal[np.minimum(normal @ Z, normal @ light) > math.cos(math.radians(LIMIT))][: SIDE**2]
        tangent = normalised(np.cross(seen, random.normal(size=seen.shape)))
        world = np.stack([tangent, np.cross(seen, tangent), seen], axis=1)
        wi.append(world @ light)
        wo.append(world @ Z)
    return np.concatenate(wi), np.concatenate(wo)


def blender_python() -> str:
    return os.environ.get("BRDFIT_BLENDER_PYTHON", sys.executable)


def blender_evaluate(path: Path, wi: Array, wo: Array) -> Array:
    """Pictures of Cycles, in a process of its own; of a Python script or of a glTF file."""
    # The viewer at +z, and the light in the plane of x and z.
    world = turned(wo, normalised(wi - dots(wi, wo)[:, None] * wo))
    shape = (-1, SIDE**2, 3)
    job = {"normals": world(Z).reshape(shape), "tangents": world(X).reshape(shape), "lights": world(wi).reshape(shape).mean(axis=1)}
    with tempfile.TemporaryDirectory() as folder:
        np.savez(Path(folder, "job.npz"), **job)
        python = blender_python()
        if subprocess.run([python, "-c", "import bpy"], capture_output=True).returncode:
            raise Missing(f"bpy: {python} cannot import it (BRDFIT_BLENDER_PYTHON names another Python)")
        run([python, __file__, path.resolve(), folder])
        return np.load(Path(folder, "f.npy"))


def blender_render(path: str, folder: str):
    """Runs in Blender: renders the pictures of job.npz with the material of the file and with a white one."""
    import bpy
    from mathutils import Vector

    bpy.ops.wm.read_factory_settings(use_empty=True)
    if path.endswith(".gltf"):
        bpy.ops.import_scene.gltf(filepath=path)
        # The importer leaves the distribution that adds light of later bounces.
        for node in bpy.data.materials["brdfit"].node_tree.nodes:
            if node.bl_idname == "ShaderNodeBsdfPrincipled":
                node.distribution = "GGX"
        for one in list(bpy.data.objects):
            bpy.data.objects.remove(one)
    else:
        exec(compile(Path(path).read_text(), path, "exec"), {"__name__": "__main__"})
    white = bpy.data.materials.new("white")
    if bpy.app.version < (5, 0, 0):
        white.use_nodes = True
    tree = white.node_tree
    tree.nodes.clear()
    diffuse = tree.nodes.new("ShaderNodeBsdfDiffuse")
    diffuse.inputs["Color"].default_value = 1, 1, 1, 1
    tree.links.new(diffuse.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])

    scene = bpy.context.scene
    settings = {
        scene.render: {
            "engine": "CYCLES", "threads_mode": "FIXED", "threads": 1, "resolution_x": SIDE, "resolution_y": SIDE,
            "resolution_percentage": 100, "dither_intensity": 0.0, "filepath": f"{folder}/picture.exr",
        },
        scene.render.image_settings: {"file_format": "OPEN_EXR", "color_depth": "32"},
        scene.view_settings: {"view_transform": "Raw"},
    }  # fmt: skip
    for owner, values in settings.items():
        for name, value in values.items():
            setattr(owner, name, value)
    # One sample, of the sun alone, as it is.
    cycles = {
        "device": "CPU", "samples": 1, "use_adaptive_sampling": False, "use_denoising": False, "max_bounces": 0,
        "pixel_filter_type": "BOX", "sample_clamp_direct": 0.0, "sample_clamp_indirect": 0.0, "use_light_tree": False,
        "light_sampling_threshold": 0.0,
    }  # fmt: skip
    for name, value in cycles.items():
        setattr(scene.cycles, name, value)
    lens = bpy.data.cameras.new("camera")
    lens.type, lens.ortho_scale, lens.clip_end = "ORTHO", SIDE, 1e4
    camera = bpy.data.objects.new("camera", lens)
    camera.location = 0, 0, 500
    lamp = bpy.data.lights.new("sun", "SUN")
    lamp.angle, lamp.energy, lamp.use_shadow = 0.0, 1.0, False
    sun = bpy.data.objects.new("sun", lamp)
    sun.rotation_mode = "QUATERNION"
    for one in (camera, sun):
        scene.collection.objects.link(one)
    scene.camera = camera

    def facets(normals, tangents, material):
        """One facet per pixel, which it covers; the texture's u along the tangent."""
        corners, uv = [], []
        for index, (normal, tangent) in enumerate(zip(normals, tangents)):
            row, column = divmod(index, SIDE)
            beside = np.cross(normal, tangent)
            for x, y in ((-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)):
                z = -(normal[0] * x + normal[1] * y) / normal[2]
                corners.append((column - SIDE / 2 + 0.5 + x, row - SIDE / 2 + 0.5 + y, z))
                uv.append(((x, y, z) @ tangent, (x, y, z) @ beside))
        mesh = bpy.data.meshes.new("facets")
        mesh.from_pydata(corners, [], np.arange(len(corners)).reshape(-1, 4).tolist())
        mesh.uv_layers.new(name="UVMap").data.foreach_set("uv", np.ravel(uv).astype(np.float32))
        mesh.materials.append(material)
        made = bpy.data.objects.new("facets", mesh)
        scene.collection.objects.link(made)
        return made

    def picture(normals, tangents, material):
        made = facets(normals, tangents, material)
        bpy.ops.render.render(write_still=True)
        bpy.data.objects.remove(made)
        image = bpy.data.images.load(scene.render.filepath)
        image.colorspace_settings.name = "Non-Color"
        pixels = np.empty(SIDE * SIDE * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(-1, 4)[:, :3].astype(float)

    job = np.load(Path(folder, "job.npz"))
    seen = []
    for light, normals, tangents in zip(job["lights"], job["normals"], job["tangents"]):
        sun.rotation_quaternion = (-Vector(light)).to_track_quat("-Z", "Y")
        ours, bright = (picture(normals, tangents, material) for material in (bpy.data.materials["brdfit"], white))
        seen.append(ours / bright / PI)
    np.save(Path(folder, "f.npy"), np.concatenate(seen))


# ------------------------------------------------------------------------------------------------------ clients


def random_pairs(count: int, seed: int) -> tuple[Array, Array]:
    """A third anywhere, a third near the mirror direction, a third with both directions near grazing."""
    random = np.random.default_rng(seed)
    kind = np.arange(count) % 3
    limit = math.radians(LIMIT)

    def direction(theta, phi):
        return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=1)

    anywhere = np.arccos(random.uniform(math.cos(limit), 1, (count, 2)))
    theta = np.where(kind[:, None] == 2, random.uniform(math.radians(80), limit, (count, 2)), anywhere)
    phi = random.uniform(-PI, PI, (count, 2))
    wi, wo = direction(theta[:, 0], phi[:, 0]), direction(theta[:, 1], phi[:, 1])
    mirrored = wi * (-1, -1, 1) + 10 ** random.uniform(-4, -0.5, (count, 1)) * normalised(random.normal(size=(count, 3)))
    near = (kind == 1) & (mirrored[:, 2] > math.cos(limit) * np.linalg.norm(mirrored, axis=1))
    wo[near] = normalised(mirrored[near])
    # Most clients have single precision; rounded to it, the vectors remain as they are.
    return tuple(normalised(v.astype(np.float32).astype(float)) for v in (wi, wo))


@dataclass(frozen=True)
class Client:
    """What reads the files of one target."""

    # As the option --to has it, and the ending of its files.
    target: str
    extension: str
    # What evaluates, and the packages whose versions belong to that.
    evaluator: str
    packages: tuple[str, ...]
    evaluate: Callable[[Path, Array, Array], Array]
    # Relative differences that count as rounding: of most values, and of all, beyond an absolute one.
    tolerance: float
    largest: float
    floor: float = 1e-9
    # The complaints about a file; a client that only loads files has none.
    problems: Callable[[Path], list[str]] = lambda path: []
    pairs: Callable[[int, int], tuple[Array, Array]] = random_pairs
    # Whether it takes part if no client is named.
    default: bool = True

    def description(self) -> str:
        return self.evaluator + "".join(f", {package} {version(package)}" for package in self.packages)


def version(package: str) -> str:
    """The version of a package of this Python, or of Blender's."""
    python = blender_python() if package == "bpy" else sys.executable
    try:
        return run([python, "-c", f"import importlib.metadata as m; print(m.version('{package}'))"]).decode().strip()
    except RuntimeError:
        return "of unknown version"


# Single precision, in which near grazing h is a small sum of large numbers, and D of a sharp lobe a small difference of such.
SINGLE = 5e-5, 3e-4
# Double precision.
DOUBLE = 1e-12, 1e-11, 1e-15
CLIENTS = {
    "mitsuba": Client("mitsuba", "xml", "Mitsuba", ("mitsuba",), mitsuba_evaluate, *SINGLE, problems=xml_problems),
    "pbrt": Client("pbrt", "pbrt", "not run in pbrt; its syntax and formulas, here", (), pbrt_evaluate, *DOUBLE, pbrt_problems),
    "gltf": Client(
        "gltf", "gltf", "the validator of Khronos, and the formulas of the specification, here", (), gltf_evaluate, *DOUBLE, gltf_problems
    ),
    "materialx": Client(
        "materialx", "mtlx", "the validator of MaterialX, and the GLSL that it generates", ("materialx", "moderngl"),
        materialx_evaluate, *SINGLE, problems=materialx_problems,
    ),
    "usd": Client(
        "usd", "usda", "the validators of USD, and the GLSL of its renderer Storm", ("usd-core", "moderngl"), usd_evaluate, *SINGLE,
        problems=usd_problems,
    ),
    # It leaves out lobes below 1e-6.
    "radiance": Client("radiance", "rad", "Radiance", ("pyradiance",), radiance_evaluate, 1e-6, 1e-5, 2e-6),
    # The normals of the facets are rounded as well.
    "blender": Client("blender", "py", "Cycles", ("bpy",), blender_evaluate, 2e-4, 5e-4, pairs=blender_pairs, default=False),
    "blender-gltf": Client(
        "gltf", "gltf", "Cycles, after the import of glTF, with its distribution set to GGX", ("bpy",), blender_evaluate, 2e-4, 5e-4,
        pairs=blender_pairs, default=False,
    ),
}  # fmt: skip

if __name__ == "__main__":
    blender_render(*sys.argv[1:])
