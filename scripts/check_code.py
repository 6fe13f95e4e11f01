#!/usr/bin/env python3
"""Runs models that brdfit wrote as code, in every language, and compares them with brdfit itself.

What it does
    The example code_cases writes models as code, with f at 2000 pairs of directions (a quarter within a degree of grazing, a quarter
    mirror-like) in double and single precision, and the derivatives that a fit uses. This script runs the code:
      c             gcc, as a shared library
      javascript    Node.js, that of Playwright if there is no other
      python-numpy  NumPy
      jax           JAX in double precision: f, its forward derivatives, and the reverse derivatives of a weighted sum of all f
      glsl          WebGL 2 in headless Chromium
      wgsl          WebGPU in headless Chromium
      slang         looked at by the front end of Slang's compiler (package slangpy), where it is asked for
      osl           compiled by the OSL of Blender (package bpy, which needs CPython 3.11), where it is asked for
    and exits 1 if
      - a double-precision f is off by more than 1e-12 of itself or of 1e-9 of the model's peak, whichever is larger;
      - a derivative with respect to a parameter p is off by more than 1e-6 of itself, of f/p or of 1e-9 of the largest that p has,
        whichever is largest;
      - a single-precision f is off by more than 1e-5 of the peak, by more than ten times the largest error that brdfit has in
        single precision, and by more than the smallest number that such a float holds in full;
      - code does not compile.

How to run it (packages come from scripts/requirements-code.txt, the browser is Debian's package chromium)
    cargo run --release --example code_cases -- folder          # or: folder 25, for every 25th model
    python scripts/check_code.py folder
    python scripts/check_code.py folder --languages c,jax
"""

from __future__ import annotations

import argparse
import base64
import ctypes
import importlib.util
import json
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

CHROMIUM = "/usr/bin/chromium"
WAYS = ("fixed", "free")
DOUBLE = 1e-12
DERIVATIVE = 1e-6
SINGLE = 1e-5


class Case:
    """A model, and what brdfit computes for it."""

    def __init__(self, folder: Path, record: dict) -> None:
        self.folder = folder / f"{record['index']:04}"
        self.model = record["model"]
        self.names = ["".join(c if c.isascii() and c.isalnum() else "_" for c in name) for name in record["names"]]
        self.values = record["values"]
        self.double = np.fromfile(self.folder / "double.bin")
        self.single = np.fromfile(self.folder / "single.bin")
        self.derivatives = np.fromfile(self.folder / "derivatives.bin").reshape(len(self.double), -1)
        self.peak = np.abs(self.double).max()

    def files(self, stem: str):
        """The files of a language that were written, with the way of their parameters."""
        for way in WAYS:
            for file in self.folder.glob(f"{stem}_{way}.*"):
                yield way, file


class Results:
    """The worst of every language, and what is wrong."""

    def __init__(self) -> None:
        self.worst: dict[str, tuple[float, str]] = {}
        self.counts: dict[str, int] = {}
        self.faults: list[str] = []

    def fault(self, what: str, case: Case, why: str) -> None:
        self.faults.append(f"{what}: {case.model}: {why}")

    def note(self, what: str, case: Case, error: float) -> None:
        """Notes an error in units of what is allowed."""
        self.counts[what] = self.counts.get(what, 0) + 1
        if not error <= self.worst.get(what, (-1.0, ""))[0]:
            self.worst[what] = (error, case.model)
        if not error <= 1.0:
            self.fault(what, case, f"off by {error:.3g} times what is allowed")

    def compiled(self, what: str) -> None:
        self.counts[what] = self.counts.get(what, 0) + 1
        self.worst.setdefault(what, (0.0, "compiled only"))

    def double(self, what: str, case: Case, found: np.ndarray) -> None:
        allowed = DOUBLE * np.maximum(np.abs(case.double), 1e-9 * case.peak)
        self.note(what, case, float(np.max(np.abs(found - case.double) / allowed)))

    def derivative(self, what: str, case: Case, found: np.ndarray, expected: np.ndarray, size: np.ndarray) -> None:
        allowed = DERIVATIVE * np.maximum(size, 1e-9 * np.abs(size).max(axis=0)) + 1e-300
        self.note(what, case, float(np.max(np.abs(found - expected) / allowed)))

    def single(self, what: str, case: Case, found: np.ndarray) -> None:
        own = np.nanmax(np.abs(case.single - case.double))
        allowed = max(SINGLE * case.peak, 10.0 * own, float(np.finfo(np.float32).tiny))
        self.note(what, case, float(np.max(np.abs(found - case.double)) / allowed))


def module(path: Path):
    spec = importlib.util.spec_from_file_location(f"{path.parent.name}_{path.stem}", path)
    loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def check_c(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    loop = (
        "\nvoid all(int n, const double *pairs, double *out) {\n"
        "    for (int i = 0; i < n; i++) brdf(pairs + 6 * i, pairs + 6 * i + 3, brdf_parameter_defaults, out + i);\n}\n"
    )

    def built(job):
        case, way, file = job
        whole = scratch / f"{case.folder.name}_{way}.c"
        whole.write_text(file.read_text(encoding="utf-8") + loop, encoding="utf-8")
        library = whole.with_suffix(".so")
        words = ["gcc", "-std=c11", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", whole, "-o", library, "-lm"]
        done = subprocess.run(words, capture_output=True, text=True, check=False)
        return case, library, done

    jobs = [(case, way, file) for case in cases for way, file in case.files("c")]
    with ThreadPoolExecutor() as pool:
        for case, library, done in pool.map(built, jobs):
            if done.returncode:
                results.fault("c", case, done.stderr[:500])
                continue
            out = np.full(len(pairs), np.nan)
            pointer = ctypes.POINTER(ctypes.c_double)
            ctypes.CDLL(str(library)).all(
                len(pairs), np.ascontiguousarray(pairs).ctypes.data_as(pointer), out.ctypes.data_as(pointer)
            )
            results.double("c", case, out)


def node() -> str:
    """Node.js: the system's, or the one inside Playwright."""
    found = shutil.which("node")
    if found:
        return found
    import playwright

    return str(Path(playwright.__file__).parent / "driver/node")


def check_javascript(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    jobs = [(case, file) for case in cases for _, file in case.files("javascript")]
    listed = [[str(file), str(scratch / f"{number}.bin")] for number, (_, file) in enumerate(jobs)]
    (scratch / "jobs.json").write_text(json.dumps(listed), encoding="utf-8")
    pairs.tofile(scratch / "pairs.bin")
    (scratch / "run.mjs").write_text(
        """import { readFileSync, writeFileSync } from "node:fs";
const [folder] = process.argv.slice(2);
const bytes = readFileSync(`${folder}/pairs.bin`);
const pairs = new Float64Array(bytes.buffer, bytes.byteOffset, bytes.length / 8);
for (const [file, result] of JSON.parse(readFileSync(`${folder}/jobs.json`))) {
  const { brdf } = await import(file);
  const out = new Float64Array(pairs.length / 6);
  for (let i = 0; i < out.length; i++) [out[i]] = brdf(pairs.subarray(6 * i, 6 * i + 3), pairs.subarray(6 * i + 3, 6 * i + 6));
  writeFileSync(result, out);
}
""",
        encoding="utf-8",
    )
    subprocess.run([node(), scratch / "run.mjs", scratch], check=True)
    for (case, _), (_, result) in zip(jobs, listed, strict=True):
        results.double("javascript", case, np.fromfile(result))


def check_numpy(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    for case in cases:
        for _, file in case.files("python_numpy"):
            results.double("python-numpy", case, module(file).f(pairs[:, :3], pairs[:, 3:])[:, 0])


def check_jax(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    import jax
    import jax.numpy as jnp

    jax.config.update("jax_enable_x64", True)
    wi, wo = jnp.asarray(pairs[:, :3]), jnp.asarray(pairs[:, 3:])
    weights = jnp.asarray(np.linspace(0.5, 1.5, len(pairs)))
    for case in cases:
        for way, file in case.files("jax"):
            f = module(file).f
            if way == "fixed":
                results.double("jax", case, np.asarray(jax.jit(f)(wi, wo)[:, 0]))
                continue
            values = dict(zip(case.names, case.values, strict=True))
            results.double("jax", case, np.asarray(jax.jit(f)(wi, wo, **values)[:, 0]))
            of = lambda p: f(wi, wo, **p)[:, 0]  # noqa: E731
            # Without jit, whose compiler takes minutes for derivatives of a distribution that is normalised by a long sum.
            forward = jax.jacfwd(of)(values)
            found = np.stack([np.asarray(forward[name]) for name in case.names], axis=-1)
            per_parameter = np.abs(case.double[:, None] / np.array(case.values))
            size = np.maximum(np.abs(case.derivatives), per_parameter)
            results.derivative("jax, forward derivatives", case, found, case.derivatives, size)
            reverse = jax.grad(lambda p: jnp.sum(weights * of(p)))(values)
            found = np.array([float(reverse[name]) for name in case.names])
            w = np.asarray(weights)[:, None]
            expected, size = (w * case.derivatives).sum(axis=0), (w * np.abs(case.derivatives)).sum(axis=0)
            results.derivative("jax, reverse derivatives", case, found[None], expected[None], size[None])
        jax.clear_caches()


WEBGL = """
async ([source, call, pairs]) => {
  const height = 40, width = pairs.length / 6 / height;
  const canvas = window.brdfCanvas ??= new OffscreenCanvas(width, height);
  const gl = window.brdfContext ??= canvas.getContext("webgl2");
  if (!gl || !gl.getExtension("EXT_color_buffer_float")) return { error: "no WebGL 2 with float targets" };
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, text);
    gl.compileShader(made);
    if (!gl.getShaderParameter(made, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(made));
    return made;
  };
  const texture = (data) => {
    const made = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, made);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, data);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    return made;
  };
  try {
    const program = gl.createProgram();
    gl.attachShader(program, shader(gl.VERTEX_SHADER, `#version 300 es
void main() { gl_Position = vec4(vec2[3](vec2(-1, -1), vec2(3, -1), vec2(-1, 3))[gl_VertexID], 0, 1); }`));
    gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `#version 300 es
precision highp float;
uniform sampler2D lights, viewers;
out vec4 color;
${source}
void main() {
  ivec2 place = ivec2(gl_FragCoord.xy);
  vec3 wi = texelFetch(lights, place, 0).xyz, wo = texelFetch(viewers, place, 0).xyz;
  color = vec4(${call}, 0, 0, 1);
}`));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    const data = [0, 1].map((side) => {
      const values = new Float32Array(4 * width * height);
      for (let i = 0; i < width * height; i++) for (let k = 0; k < 3; k++) values[4 * i + k] = pairs[6 * i + 3 * side + k];
      return values;
    });
    const inputs = data.map(texture);
    const target = texture(null);
    const frame = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, target, 0);
    gl.viewport(0, 0, width, height);
    ["lights", "viewers"].forEach((name, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, inputs[unit]);
      gl.uniform1i(gl.getUniformLocation(program, name), unit);
    });
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    const pixels = new Float32Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.FLOAT, pixels);
    const values = [];
    for (let i = 0; i < width * height; i++) values.push(pixels[4 * i]);
    [...inputs, target].forEach((made) => gl.deleteTexture(made));
    gl.deleteFramebuffer(frame);
    gl.deleteProgram(program);
    return { values: values.map((value) => Number.isFinite(value) ? value : null) };
  } catch (error) {
    return { error: String(error) };
  }
}
"""


WEBGPU = """
async ([source, call, pairs]) => {
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) return { error: "no WebGPU" };
  const device = window.brdfDevice ??= await adapter.requestDevice();
  const count = pairs.length / 6;
  const code = `${source}
@group(0) @binding(0) var<storage, read> given: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> found: array<f32>;
@compute @workgroup_size(64) fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x >= ${count}u) { return; }
    let wi = given[2u * id.x].xyz;
    let wo = given[2u * id.x + 1u].xyz;
    found[id.x] = ${call};
}`;
  const module = device.createShaderModule({ code });
  const faults = (await module.getCompilationInfo()).messages.filter((message) => message.type === "error");
  if (faults.length) return { error: faults.map((fault) => `${fault.lineNum}: ${fault.message}`).join("; ") };
  const pipeline = device.createComputePipeline({ layout: "auto", compute: { module, entryPoint: "main" } });
  const values = new Float32Array(8 * count);
  for (let i = 0; i < 2 * count; i++) for (let k = 0; k < 3; k++) values[4 * i + k] = pairs[3 * i + k];
  const buffer = (size, usage) => device.createBuffer({ size, usage });
  const given = buffer(values.byteLength, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_DST);
  const result = buffer(4 * count, GPUBufferUsage.STORAGE | GPUBufferUsage.COPY_SRC);
  const read = buffer(4 * count, GPUBufferUsage.MAP_READ | GPUBufferUsage.COPY_DST);
  device.queue.writeBuffer(given, 0, values);
  const entries = [given, result].map((buffer, binding) => ({ binding, resource: { buffer } }));
  const group = device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries });
  const encoder = device.createCommandEncoder();
  const pass = encoder.beginComputePass();
  pass.setPipeline(pipeline);
  pass.setBindGroup(0, group);
  pass.dispatchWorkgroups(Math.ceil(count / 64));
  pass.end();
  encoder.copyBufferToBuffer(result, 0, read, 0, 4 * count);
  device.queue.submit([encoder.finish()]);
  await read.mapAsync(GPUMapMode.READ);
  const found = Array.from(new Float32Array(read.getMappedRange().slice(0)));
  [given, result, read].forEach((buffer) => buffer.destroy());
  return { values: found.map((value) => Number.isFinite(value) ? value : null) };
}
"""


def in_browser(page_code: str, stem: str, flags: list[str], cases: list[Case], pairs: np.ndarray, results: Results) -> None:
    """Runs the files of a shading language in headless Chromium, by a function of the page that gets source, call and pairs."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox", *flags])
        page = browser.new_page()
        # WebGPU needs a page with an address.
        empty = Path(folder, "empty.html")
        empty.write_text("<!doctype html>", encoding="utf-8")
        page.goto(empty.as_uri())
        for case in cases:
            for way, file in case.files(stem):
                call = "brdf(wi, wo)" if way == "fixed" or not case.names else "brdf(wi, wo, brdf_defaults)"
                found = page.evaluate(page_code, [file.read_text(encoding="utf-8"), call, pairs.ravel().tolist()])
                if "error" in found:
                    results.fault(stem, case, found["error"])
                else:
                    results.single(stem, case, np.array(found["values"], dtype=float))
        browser.close()


def check_glsl(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    flags = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"]
    in_browser(WEBGL, "glsl", flags, cases, pairs, results)


def check_wgsl(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    flags = ["--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader"]
    in_browser(WEBGPU, "wgsl", flags, cases, pairs, results)


def check_slang(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    import slangpy

    device = slangpy.create_device(type=slangpy.DeviceType.cpu)
    for case in cases:
        for way, file in case.files("slang"):
            try:
                device.load_module_from_source(f"case_{case.folder.name}_{way}", file.read_text(encoding="utf-8"))
                results.compiled("slang")
            except Exception as error:  # slangpy raises plain ones
                results.fault("slang", case, str(error)[:500])


def check_osl(cases: list[Case], pairs: np.ndarray, results: Results, scratch: Path) -> None:
    import bpy  # noqa: F401  (it makes the next import possible)
    import _cycles

    for case in cases:
        for way, file in case.files("osl"):
            compiled = scratch / f"{case.folder.name}_{way}.oso"
            if _cycles.osl_compile(str(file), str(compiled)) and compiled.is_file():
                results.compiled("osl")
            else:
                results.fault("osl", case, "does not compile")


CHECKS = {
    "c": check_c,
    "javascript": check_javascript,
    "python-numpy": check_numpy,
    "jax": check_jax,
    "glsl": check_glsl,
    "wgsl": check_wgsl,
    "slang": check_slang,
    "osl": check_osl,
}
# Run unless others are named: all but those whose compilers are large packages.
DEFAULT = [name for name in CHECKS if name not in ("slang", "osl")]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, help="what the example code_cases wrote")
    parser.add_argument("--languages", default=",".join(DEFAULT), help="run these only")
    arguments = parser.parse_args()
    pairs = np.fromfile(arguments.folder / "pairs.bin").reshape(-1, 6)
    cases = [Case(arguments.folder, record) for record in json.loads((arguments.folder / "cases.json").read_text())]
    results = Results()
    for language in arguments.languages.split(","):
        if language not in CHECKS:
            parser.error(f"{language}: expected some of {', '.join(CHECKS)}")
        with tempfile.TemporaryDirectory() as scratch:
            CHECKS[language](cases, pairs, results, Path(scratch))
    print(f"{len(cases)} models, {len(pairs)} pairs of directions; errors in units of what is allowed")
    for what, (error, model) in results.worst.items():
        print(f"  {what}: {results.counts[what]} programs, at most {error:.3g} ({model})")
    for fault in results.faults:
        print(f"FAULT {fault}")
    sys.exit(bool(results.faults))


if __name__ == "__main__":
    main()
