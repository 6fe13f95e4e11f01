//! What scenes show: radiometry in closed form, surfaces against one another, and what is refused.
//!
//! The surface under the lights is Lambert's, f = kd/pi, so that every radiance has a closed form or a sum to compare with.

#![cfg(feature = "images")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![allow(clippy::print_stdout, clippy::cast_precision_loss, clippy::cast_sign_loss)]

use approx::assert_relative_eq;
use brdfit::Error;
use brdfit::scene::{SCHEMA, Scene, View, schema};
use exr::prelude::write_rgb_file;
use glam::DVec3;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::f64::consts::{FRAC_1_PI, PI, TAU};
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};
use tempfile::TempDir;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const KD: f64 = 0.6;

/// A folder for the files of a scene.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    fn read(&self, surface: &Value, camera: &Value, lights: &Value) -> Result<Scene, Error> {
        let path = self.0.path().join("scene.json");
        let scene = json!({"schema": SCHEMA, "surface": surface, "camera": camera, "lights": lights});
        fs::write(&path, scene.to_string()).unwrap();
        Scene::read(&path)
    }

    fn view(&self, surface: &Value, camera: &Value, lights: &Value) -> View {
        let view = self.read(surface, camera, lights).unwrap().view().unwrap();
        assert_sound(&view);
        view
    }

    fn write(&self, name: &str, text: &str) {
        fs::write(self.0.path().join(name), text).unwrap();
    }

    fn exr(&self, name: &str, width: usize, height: usize, pixel: impl Fn(usize, usize) -> [f32; 3] + Sync) {
        let pixel = |x, y| pixel(x, y).into();
        write_rgb_file(self.0.path().join(name), width, height, pixel).unwrap();
    }
}

fn view(surface: &Value, camera: &Value, lights: &Value) -> View {
    Folder::new().view(surface, camera, lights)
}

/// What holds of every view.
fn assert_sound(view: &View) {
    assert_eq!(view.covered.len(), (view.width * view.height) as usize);
    for seen in &view.samples {
        assert!(view.covered[seen.pixel as usize]);
        for v in [seen.pair.wi, seen.pair.wo] {
            assert_relative_eq!(v.length(), 1.0, epsilon = 1e-12);
            assert!(v.z > 0.0, "{v}");
        }
        assert!(seen.weight.iter().all(|w| w.is_finite() && *w >= 0.0) && seen.weight != [0.0; 3]);
    }
    assert!(view.samples.is_sorted_by_key(|seen| seen.pixel), "grouped by pixel, in order");
}

/// The image of Lambert's surface.
fn lambert(view: &View) -> Vec<[f64; 3]> {
    let f = vec![KD * FRAC_1_PI; view.samples.len()];
    view.image([&f, &f, &f])
}

fn plane(half: f64) -> Value {
    json!({"plane": {"center": [0, 0, 0], "normal": [0, 0, 1], "tangent": [1, 0, 0], "half_width": half, "half_height": half}})
}

fn sphere() -> Value {
    json!({"sphere": {"center": [0, 0, 0], "radius": 1}})
}

/// From above, with +y upward in the image; what it sees of the floor is 2 m high.
fn above(height: f64, pixels: u32) -> Value {
    let fov = 2.0 * (1.0 / height).atan().to_degrees();
    json!({"position": [0, 0, height], "look_at": [0, 0, 0], "up": [0, 1, 0], "vertical_fov_deg": fov, "width": pixels, "height": pixels})
}

/// Where the pixels of [`above`] see the floor.
fn floor(pixel: usize, pixels: u32) -> DVec3 {
    let n = f64::from(pixels);
    let (column, row) = ((pixel % pixels as usize) as f64, (pixel / pixels as usize) as f64);
    DVec3::new((2.0 * column + 1.0) / n - 1.0, 1.0 - (2.0 * row + 1.0) / n, 0.0)
}

fn aside(pixels: u32) -> Value {
    json!({"position": [1, -4, 1.5], "look_at": [0, 0, 0], "vertical_fov_deg": 32, "width": pixels, "height": pixels})
}

fn uniform(samples: u32) -> Value {
    json!([{"uniform": {"radiance_rgb": [1, 1, 1], "samples": samples}}])
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, f64::max)
}

/// The pixels of the finer view are some of the view's own, and nearer to the radiance under a panel that only ever finer cells tell.
#[test]
fn a_finer_view_is_nearer_to_the_truth() {
    let panel = json!({"area": {"center": [0.1, 0.2, 0.5], "half_u": [0.5, 0, 0], "half_v": [0, 0.4, 0],
        "radiance_rgb": [1, 1, 1], "samples": 12}});
    let mut fine = panel.clone();
    fine["area"]["samples"] = json!(10_000);
    let folder = Folder::new();
    let scene = folder.read(&plane(10.0), &above(3.0, 20), &json!([panel])).unwrap();
    let (view, finer) = (scene.view().unwrap(), scene.finer_view(50).unwrap());
    assert_sound(&finer);
    let truth = folder.view(&plane(10.0), &above(3.0, 20), &json!([fine]));
    let pixels: Vec<usize> = (0..400).filter(|pixel| finer.covered[*pixel]).collect();
    assert!(pixels.len() <= 50 && pixels.len() >= 25 && finer.samples.len() > 3 * 12 * pixels.len());
    let [coarse, finer, truth] = [&view, &finer, &truth].map(lambert);
    let off = |image: &[[f64; 3]]| largest(pixels.iter().map(|p| (image[*p][0] / truth[*p][0] - 1.0).abs()));
    // The error of midpoints falls with the size of the cells squared.
    assert!(off(&finer) < 0.4 * off(&coarse), "{} {}", off(&finer), off(&coarse));
}

#[test]
fn a_directional_light_gives_e_cos_kd_over_pi() {
    let lights = json!([{"directional": {"to_light": [1, 2, 2], "irradiance_rgb": [5, 3, 0]}}]);
    let view = view(&plane(10.0), &above(4.0, 9), &lights);
    assert_eq!(view.samples.len(), 81);
    for radiance in lambert(&view) {
        for (found, e) in radiance.into_iter().zip([5.0, 3.0, 0.0]) {
            assert_relative_eq!(found, e * (2.0 / 3.0) * KD * FRAC_1_PI, max_relative = 1e-14);
        }
    }
    // The tangent is +x, the normal +z: local and world agree.
    for seen in &view.samples {
        assert_relative_eq!(seen.pair.wi.x, 1.0 / 3.0, epsilon = 1e-14);
        assert_relative_eq!(seen.pair.wi.y, 2.0 / 3.0, epsilon = 1e-14);
        let viewer = DVec3::new(0.0, 0.0, 4.0) - floor(seen.pixel as usize, 9);
        assert!((seen.pair.wo - viewer.normalize()).length() < 1e-14);
    }
}

#[test]
fn a_point_light_falls_with_the_square_of_the_distance() {
    for (height, intensity) in [(1.0, 7.0), (2.5, 7.0), (1000.0, 1e6)] {
        let lights = json!([{"point": {"position": [0.3, 0, height], "intensity_rgb": [intensity, 0, 0]}}]);
        let view = view(&plane(10.0), &above(4.0, 16), &lights);
        for (pixel, radiance) in lambert(&view).into_iter().enumerate() {
            // I cos/d^2 with cos = height/d.
            let d = (DVec3::new(0.3, 0.0, height) - floor(pixel, 16)).length();
            let expected = intensity * height / d.powi(3) * KD * FRAC_1_PI;
            assert_relative_eq!(radiance[0], expected, max_relative = 1e-12);
        }
    }
}

/// Lambert's formula (1760): a polygon of radiance L gives L/2 sum of angle_i (n . unit normal of edge i's triangle with the point).
fn contour(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(a, b)| {
        let (a, b) = ((*a - point).normalize(), (*b - point).normalize());
        a.angle_between(b) * a.cross(b).normalize().dot(normal)
    });
    (edges.sum::<f64>() / 2.0).abs()
}

#[test]
fn an_area_light_gives_the_irradiance_of_lamberts_formula() {
    let (center, u, v) = (DVec3::new(0.4, -0.2, 1.5), DVec3::new(0.5, 0.0, 0.25), DVec3::new(0.0, 0.4, 0.0));
    let corners = [center + u + v, center - u + v, center - u - v, center + u - v];
    let mut errors = Vec::new();
    for samples in [16, 64, 256] {
        let lights = json!([{"area": {"center": center.to_array(), "half_u": u.to_array(), "half_v": v.to_array(), "radiance_rgb": [2, 1, 0.5], "samples": samples}}]);
        let view = view(&plane(10.0), &above(4.0, 12), &lights);
        let relative = lambert(&view).into_iter().enumerate().map(|(pixel, radiance)| {
            let e = contour(floor(pixel, 12), DVec3::Z, &corners);
            assert_relative_eq!(radiance[0], 2.0 * radiance[1], max_relative = 1e-14);
            (radiance[0] / (2.0 * e * KD * FRAC_1_PI) - 1.0).abs()
        });
        errors.push(largest(relative));
    }
    println!("relative errors at 16, 64, 256 samples: {errors:?}");
    // Midpoints are of second order: four times the cells, a quarter of the error.
    assert!(errors[1] < 2e-3 && errors[2] < 5e-4, "{errors:?}");
    assert!(errors[0] / errors[1] > 3.0 && errors[1] / errors[2] > 3.0, "{errors:?}");
}

/// Under light from everywhere a surface of albedo kd is as bright as kd times the light, whatever its shape.
#[test]
fn a_furnace_shows_the_albedo() {
    let cylinder = json!({"cylinder": {"center": [0, 0, 0], "axis": [1, 0, 2], "radius": 0.7, "height": 2}});
    for surface in [sphere(), plane(1.0), cylinder] {
        for (samples, tolerance) in [(256, 0.003), (4096, 1e-4)] {
            let view = view(&surface, &aside(24), &uniform(samples));
            let off = lambert(&view).into_iter().zip(&view.covered).filter(|(_, covered)| **covered);
            let off = largest(off.map(|(radiance, _)| (radiance[0] / KD - 1.0).abs()));
            println!("{samples}: {off:.1e}");
            assert!(off < tolerance, "{surface}: {off}");
        }
    }
}

#[test]
fn the_overcast_sky_has_its_irradiance() {
    let lights = json!([{"overcast": {"zenith_radiance_rgb": [1, 2, 3], "samples": 256}}]);
    let view = view(&plane(10.0), &above(4.0, 2), &lights);
    for radiance in lambert(&view) {
        // Integral of (1 + 2 cos)/3 cos over the hemisphere: 7 pi/9.
        assert_relative_eq!(radiance[0], KD * 7.0 / 9.0, max_relative = 1e-5);
        assert_relative_eq!(radiance[2], KD * 7.0 / 3.0, max_relative = 1e-5);
    }
}

#[test]
fn a_constant_environment_is_the_uniform_light() {
    let folder = Folder::new();
    folder.exr("constant.exr", 32, 16, |_, _| [0.25, 0.25, 0.25]);
    let environment = json!([{"environment": {"exr": "constant.exr", "scale": 4, "samples": 300}}]);
    let found = folder.view(&sphere(), &aside(24), &environment);
    let expected = folder.view(&sphere(), &aside(24), &uniform(300));
    assert_eq!(found.covered, expected.covered);
    for (found, expected) in found.samples.iter().zip(&expected.samples) {
        assert_eq!(found.pixel, expected.pixel);
        assert!((found.pair.wi - expected.pair.wi).length() < 1e-11);
        assert_relative_eq!(found.weight[1], expected.weight[1], max_relative = 1e-10);
    }
    assert_eq!(found.samples.len(), expected.samples.len());
}

/// A pixel of the map is where docs/scene.md says, and carries its solid angle.
#[test]
fn a_bright_pixel_is_a_small_light() {
    let folder = Folder::new();
    let (width, height) = (64, 32);
    for (column, row) in [(40, 5), (0, 15), (63, 0), (31, 10)] {
        let pixel = |x, y| if (x, y) == (column, row) { [3.0, 2.0, 1.0] } else { [0.0; 3] };
        folder.exr("bright.exr", width, height, pixel);
        let environment = json!([{"environment": {"exr": "bright.exr", "samples": 64}}]);
        let view = folder.view(&plane(10.0), &above(4.0, 1), &environment);
        let theta = |row: f64| PI * row / height as f64;
        let (low, high) = (theta(row as f64).cos(), theta(row as f64 + 1.0).cos());
        let phi = PI - TAU * (column as f64 + 0.5) / width as f64;
        let middle = brdfit::geometry::direction(theta(row as f64 + 0.5), phi);
        for seen in &view.samples {
            assert!(seen.pair.wi.angle_between(middle) < 0.08, "{} {middle}", seen.pair.wi);
        }
        // Integral of cos over the pixel: phi x (cos^2 low - cos^2 high)/2.
        let irradiance = TAU / width as f64 * (low * low - high * high) / 2.0;
        let radiance = lambert(&view)[0];
        assert_relative_eq!(radiance[0], 3.0 * irradiance * KD * FRAC_1_PI, max_relative = 1e-10);
        assert_relative_eq!(radiance[2], irradiance * KD * FRAC_1_PI, max_relative = 1e-10);
    }
}

/// A map with a soft sun and colours, against the sum over all of its pixels, finely divided.
#[test]
fn an_environment_lights_as_the_sum_of_its_pixels_does() {
    let folder = Folder::new();
    let (width, height) = (48, 24);
    let pixel = |x: usize, y: usize| {
        let (x, y) = (x as f32, y as f32);
        let sun = 40.0 * (-((x - 30.0).powi(2) + (y - 7.0).powi(2)) / 4.0).exp();
        [sun + 0.2 + 0.01 * x, sun + 0.5, 0.8 * sun + 1.0 + (y / 8.0).cos()]
    };
    folder.exr("sun.exr", width, height, pixel);
    let camera = aside(16);
    // Lambert's sphere of radius 1: the normal is the point, found here from what suns along the axes show.
    let normals = {
        let along = |axis: [i32; 3]| {
            let of = |axis: [i32; 3]| {
                let lights = json!([{"directional": {"to_light": axis, "irradiance_rgb": [PI, 0, 0]}}, {"directional": {"to_light": axis.map(|x| -x), "irradiance_rgb": [0, PI, 0]}}]);
                lambert(&view(&sphere(), &camera, &lights))
            };
            of(axis).into_iter().map(|l| (l[0] - l[1]) / KD).collect::<Vec<f64>>()
        };
        let (x, y, z) = (along([1, 0, 0]), along([0, 1, 0]), along([0, 0, 1]));
        x.into_iter().zip(y).zip(z).map(|((x, y), z)| DVec3::new(x, y, z)).collect::<Vec<_>>()
    };
    let exact = |normal: DVec3| {
        let mut sum = [0.0; 3];
        let fine = 8;
        for row in 0..height * fine {
            let theta = PI * (row as f64 + 0.5) / (height * fine) as f64;
            for column in 0..width * fine {
                let phi = PI - TAU * (column as f64 + 0.5) / (width * fine) as f64;
                let solid = theta.sin() * PI / (height * fine) as f64 * TAU / (width * fine) as f64;
                let cosine = brdfit::geometry::direction(theta, phi).dot(normal).max(0.0);
                for (sum, value) in sum.iter_mut().zip(pixel(column / fine, row / fine)) {
                    *sum += f64::from(value) * cosine * solid * KD * FRAC_1_PI;
                }
            }
        }
        sum
    };
    for (samples, tolerance) in [(256, 0.012), (4096, 0.001)] {
        let lights = json!([{"environment": {"exr": "sun.exr", "samples": samples}}]);
        let view = folder.view(&sphere(), &camera, &lights);
        let mut worst: f64 = 0.0;
        let mut brightest: f64 = 0.0;
        for (pixel, radiance) in lambert(&view).into_iter().enumerate().step_by(7) {
            if view.covered[pixel] {
                assert_relative_eq!(normals[pixel].length(), 1.0, epsilon = 1e-12);
                for (found, exact) in radiance.into_iter().zip(exact(normals[pixel])) {
                    worst = worst.max((found - exact).abs());
                    brightest = brightest.max(exact);
                }
            }
        }
        println!("{samples}: {:.1e} of the brightest", worst / brightest);
        assert!(worst < tolerance * brightest, "{samples}: {worst} of {brightest}");
    }
}

/// A sphere of radius 1 in rings and sectors, with or without its normals.
fn globe(rings: u32, sectors: u32, normals: bool) -> String {
    let mut obj = String::new();
    for ring in 0..=rings {
        for sector in 0..sectors {
            let theta = PI * f64::from(ring) / f64::from(rings);
            let p = brdfit::geometry::direction(theta, TAU * f64::from(sector) / f64::from(sectors));
            writeln!(obj, "v {} {} {}\nvn {} {} {}", p.x, p.y, p.z, p.x, p.y, p.z).unwrap();
        }
    }
    let corner = |ring: u32, sector: u32| {
        let index = ring * sectors + sector % sectors + 1;
        if normals { format!("{index}//{index}") } else { index.to_string() }
    };
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(r, s)| corner(ring + r, sector + s));
            writeln!(obj, "f {a} {b} {c} {d}").unwrap();
        }
    }
    obj
}

#[test]
fn a_fine_mesh_is_the_sphere() {
    let folder = Folder::new();
    let lights = json!([
        {"directional": {"to_light": [-1, -2, 2], "irradiance_rgb": [3, 2, 1]}},
        {"point": {"position": [3, -1, 1], "intensity_rgb": [5, 5, 5]}},
    ]);
    let expected = folder.view(&sphere(), &aside(48), &lights);
    for (normals, tolerance) in [(true, 0.004), (false, 0.03)] {
        folder.write("globe.obj", &globe(90, 180, normals));
        let found = folder.view(&json!({"mesh": {"obj": "globe.obj"}}), &aside(48), &lights);
        let differ = found.covered.iter().zip(&expected.covered).filter(|(a, b)| a != b).count();
        assert!(differ <= 4, "{differ} pixels at the rim");
        let worst = lambert(&found)
            .into_iter()
            .zip(lambert(&expected))
            .zip(found.covered.iter().zip(&expected.covered));
        let worst = worst.filter(|(_, (a, b))| **a && **b).map(|((a, b), _)| (a[0] - b[0]).abs());
        let worst = largest(worst);
        println!("normals {normals}: {worst:.1e}");
        assert!(worst < tolerance, "{worst}");
        // The same tangents, too: around the pole.
        let mut pairs = found.samples.iter().peekable();
        let mut off: f64 = 0.0;
        for seen in &expected.samples {
            while pairs.next_if(|other| other.pixel < seen.pixel).is_some() {}
            if let Some(other) =
                pairs.peek().filter(|other| other.pixel == seen.pixel && seen.pair.wo.z > 0.2)
            {
                let same = (other.pair.wo - seen.pair.wo).length();
                off = off.max(same);
            }
        }
        println!("largest difference of wo {off:.1e}");
        assert!(off < 0.05, "{off}");
    }
}

/// A roof of 1 m over a floor, in sunlight that comes at 45 degrees.
#[test]
fn a_mesh_casts_a_shadow() {
    let folder = Folder::new();
    let quad = |z: f64, half: f64| {
        format!(
            "v -{half} -{half} {z}\nv {half} -{half} {z}\nv {half} {half} {z}\nv -{half} {half} {z}\nf -4 -3 -2 -1\n"
        )
    };
    folder.write("roof.obj", &(quad(0.0, 3.0) + &quad(0.5, 0.25)));
    let mesh = json!({"mesh": {"obj": "roof.obj"}});
    let pixels = 64;
    let camera = above(1e4, pixels);
    let sun = json!([{"directional": {"to_light": [1, 0, 1], "irradiance_rgb": [1, 1, 1]}}]);
    // A lamp in place of the sun, on the same side: beyond the roof it casts a shadow, beneath it none.
    for (lights, lamp) in [
        (sun, None),
        (
            json!([{"point": {"position": [1, 0, 1], "intensity_rgb": [1, 1, 1]}}]),
            Some(DVec3::new(1.0, 0.0, 1.0)),
        ),
        (
            json!([{"point": {"position": [0.1, 0, 0.4], "intensity_rgb": [1, 1, 1]}}]),
            Some(DVec3::new(0.1, 0.0, 0.4)),
        ),
    ] {
        let view = folder.view(&mesh, &camera, &lights);
        let mut counts = [0; 3];
        for (pixel, radiance) in lambert(&view).into_iter().enumerate() {
            let p = floor(pixel, pixels);
            let inside = |q: DVec3, margin: f64| q.x.abs().max(q.y.abs()) < 0.25 + margin;
            // Where the way to the light is half a metre up; past a lamp that hangs lower there is no such place.
            let up = match lamp {
                None => Some(p + DVec3::new(0.5, 0.0, 0.5)),
                Some(lamp) => Some(p + (lamp - p) * (0.5 / lamp.z)).filter(|_| lamp.z > 0.5),
            };
            let expected = if inside(p, -1e-3) {
                // The roof itself, in the sun, or above the lamp.
                lamp.is_none_or(|lamp| lamp.z > 0.5)
            } else if up.is_some_and(|up| inside(up, -1e-3)) {
                false
            } else if inside(p, 1e-3) || up.is_some_and(|up| inside(up, 1e-3)) {
                continue;
            } else {
                true
            };
            counts[if inside(p, 0.0) { 2 } else { usize::from(expected) }] += 1;
            assert_eq!(radiance[0] > 0.0, expected, "at {p} under {lamp:?}");
        }
        println!("in shadow, lit, roof: {counts:?}");
        assert!(lamp.is_some_and(|lamp| lamp.z < 0.5) || counts[0] > 100);
    }
}

/// Whether rays meet what they would meet if all triangles were tried: a view of a heap of triangles has, in each pixel, the nearest.
#[test]
fn the_nearest_triangle_is_seen() {
    let folder = Folder::new();
    let mut state = 1_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as f64 / (1_u64 << 31) as f64
    };
    let mut obj = String::new();
    let mut triangles = Vec::new();
    for _ in 0..500 {
        let center = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 2.0;
        let corners: Vec<DVec3> =
            (0..3).map(|_| center + DVec3::new(random(), random(), random()) * 0.3).collect();
        corners.iter().for_each(|p| writeln!(obj, "v {} {} {}", p.x, p.y, p.z).unwrap());
        obj += "f -3 -2 -1\n";
        triangles.push(corners);
    }
    folder.write("heap.obj", &obj);
    let n = 64;
    let camera = above(1e3, n);
    let lights = json!([{"directional": {"to_light": [0, 0, 1], "irradiance_rgb": [PI, 0, 0]}}]);
    let view = folder.view(&json!({"mesh": {"obj": "heap.obj"}}), &camera, &lights);
    let image = lambert(&view);
    let eye = DVec3::new(0.0, 0.0, 1e3);
    for (pixel, radiance) in image.iter().enumerate() {
        let direction = (floor(pixel, n) - eye).normalize();
        // By the signs of volumes, unlike the library.
        let hits = triangles.iter().filter_map(|corners| {
            let [a, b, c] = [corners[0] - eye, corners[1] - eye, corners[2] - eye];
            let volumes = [direction.dot(a.cross(b)), direction.dot(b.cross(c)), direction.dot(c.cross(a))];
            let inside = volumes.iter().all(|v| *v > 0.0) || volumes.iter().all(|v| *v < 0.0);
            let normal = (b - a).cross(c - a).normalize();
            inside.then(|| (normal.dot(a) / normal.dot(direction), normal))
        });
        let nearest = hits.min_by(|a, b| a.0.total_cmp(&b.0));
        let expected = nearest.filter(|(_, normal)| normal.dot(direction) < 0.0);
        assert_eq!(view.covered[pixel], expected.is_some());
        let shade = expected.map_or(0.0, |(_, normal)| KD * normal.z);
        // The sun stands where the eye does, so nothing is in shadow, but for pixels at the edge of one.
        if radiance[0] != 0.0 {
            assert_relative_eq!(radiance[0], shade, max_relative = 1e-9);
        } else if shade > 0.0 {
            println!("dark at {pixel}");
        }
    }
    let dark = image.iter().zip(&view.covered).filter(|(l, covered)| **covered && l[0] == 0.0).count();
    assert!(dark <= 3, "{dark}");
    assert!(view.covered.iter().filter(|covered| **covered).count() > 1000);
}

/// From afar the silhouettes are a disc, and the rectangles of a plane and of a cylinder seen from the side; the ends of a cylinder hide
/// it, and are not seen.
#[test]
fn silhouettes_have_their_shape() {
    let folder = Folder::new();
    let sun = json!([{"directional": {"to_light": [0, 0, 1], "irradiance_rgb": [1, 1, 1]}}]);
    let cylinder = |axis: [i32; 3]| json!({"cylinder": {"center": [0.11, 0, 0], "axis": axis, "radius": 0.4, "height": 1.2}});
    let oblong = json!({"plane": {"center": [0.11, 0, 0], "normal": [0, 0, 1], "tangent": [0, 5, 0], "half_width": 0.4, "half_height": 0.6}});
    let beyond = |p: DVec3| p.x.abs() > 0.6 || p.y.abs() > 0.4;
    let ball = json!({"sphere": {"center": [0.11, 0, 0], "radius": 0.7}});
    let n = 50;
    for (surface, outside) in [
        (cylinder([2, 0, 0]), &beyond as &dyn Fn(DVec3) -> bool),
        (oblong, &beyond),
        (ball, &|p: DVec3| p.length() > 0.7),
    ] {
        let view = folder.view(&surface, &above(1e4, n), &sun);
        for (pixel, covered) in view.covered.iter().enumerate() {
            assert_eq!(*covered, !outside(floor(pixel, n) - DVec3::X * 0.11), "{surface} at {pixel}");
        }
    }
    let end = folder.read(&cylinder([0, 0, 1]), &above(1e4, n), &sun).unwrap().view().unwrap_err();
    assert!(end.to_string().contains("sees the outside of the surface"), "{end}");
}

#[test]
fn tangents_follow_the_surface() {
    let lights = json!([{"directional": {"to_light": [1, -1, 1], "irradiance_rgb": [1, 1, 1]}}]);
    let to_light = DVec3::new(1.0, -1.0, 1.0).normalize();
    let camera =
        json!({"position": [0, -5, 0], "look_at": [0, 0, 0], "vertical_fov_deg": 1, "width": 1, "height": 1});
    let seen = |surface: &Value| view(surface, &camera, &lights).samples[0].pair;
    // Seen from -y: the sphere's tangent runs east, +x, and y = z x x north, +z.
    let pair = seen(&sphere());
    assert!((pair.wi - DVec3::new(to_light.x, to_light.z, -to_light.y)).length() < 1e-12);
    assert!((pair.wo - DVec3::Z).length() < 1e-12);
    // With the pole along +x, east is -z: pole x normal.
    let pair = seen(&json!({"sphere": {"center": [0, 0, 0], "radius": 1, "pole": [1, 0, 0]}}));
    assert!((pair.wi - DVec3::new(-to_light.z, to_light.x, -to_light.y)).length() < 1e-12);
    // The cylinder's tangent is its axis.
    let pair = seen(&json!({"cylinder": {"center": [0, 0, 0], "axis": [0, 0, 3], "radius": 1, "height": 1}}));
    assert!((pair.wi - DVec3::new(to_light.z, -to_light.x, -to_light.y)).length() < 1e-12);
    // A plane's is made perpendicular to the normal.
    let pair = seen(
        &json!({"plane": {"center": [0, 0, 0], "normal": [0, -2, 0], "tangent": [0, 3, 5], "half_width": 1, "half_height": 1}}),
    );
    assert!((pair.wi - DVec3::new(to_light.z, -to_light.x, -to_light.y)).length() < 1e-12);
    // A mesh's is where its first texture coordinate grows; here downwards. A mirrored texture turns nothing but that.
    let folder = Folder::new();
    for (textures, x) in [
        ("vt 1 0\nvt 1 1\nvt 0 1\nvt 0 0\n", -1.0),
        ("vt 0 0\nvt 0 7\nvt 1 7\nvt 1 0\n", 1.0),
        ("vt 1 1\nvt 1 0\nvt 0 0\nvt 0 1\n", -1.0),
    ] {
        let quad = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\n".to_owned() + textures + "f 1/1 2/2 3/3 4/4\n";
        folder.write("quad.obj", &quad);
        let pair = folder.view(&json!({"mesh": {"obj": "quad.obj"}}), &camera, &lights).samples[0].pair;
        let expected = DVec3::new(x * to_light.z, -x * to_light.x, -to_light.y);
        assert!((pair.wi - expected).length() < 1e-12, "{} {expected}", pair.wi);
    }
}

/// The image is upright and not mirrored: a light from the right and above brightens the right and the upper half.
#[test]
fn left_is_left_and_up_is_up() {
    let camera = json!({"position": [0, -5, 0], "look_at": [0, 0, 0], "vertical_fov_deg": 30, "width": 33, "height": 21});
    for (to_light, side) in
        [([1, -1, 0], [1, 0]), ([-1, -1, 0], [-1, 0]), ([0, -1, 1], [0, -1]), ([0, -1, -1], [0, 1])]
    {
        let lights = json!([{"directional": {"to_light": to_light, "irradiance_rgb": [1, 1, 1]}}]);
        let image = lambert(&view(&sphere(), &camera, &lights));
        let at = |sign: i32| image[((10 + sign * side[1] * 4) * 33 + 16 + sign * side[0] * 4) as usize][0];
        assert!(at(1) > 1.5 * at(-1), "{to_light:?}: {} {}", at(1), at(-1));
    }
}

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let scene = Scene::read(&ready("overcast-sky")).unwrap();
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| scene.view().unwrap())
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

fn ready(name: &str) -> PathBuf {
    Path::new(ROOT).join("data/scenes").join(name).with_extension("json")
}

#[test]
fn the_ready_scenes_show_something() {
    let names = ["grazing-sun-floor", "interior-normal-incidence", "overcast-sky", "studio-sphere"];
    let found = fs::read_dir(Path::new(ROOT).join("data/scenes")).unwrap();
    let found: BTreeSet<PathBuf> = found.map(|entry| entry.unwrap().path()).collect();
    let expected = names.iter().map(|name| ready(name)).chain([ready("overcast").with_extension("exr")]);
    assert_eq!(found, expected.collect());
    let schema = serde_json::to_value(schema()).unwrap();
    let validator = jsonschema::validator_for(&schema).unwrap();
    for name in names {
        let json: Value = serde_json::from_slice(&fs::read(ready(name)).unwrap()).unwrap();
        assert!(validator.is_valid(&json), "{name}");
        for field in ["schema", "surface", "camera", "lights"] {
            let mut without = json.clone();
            without.as_object_mut().unwrap().remove(field);
            assert!(!validator.is_valid(&without), "{name} without {field}");
        }
        let mut more = json;
        more["more"] = Value::Null;
        assert!(!validator.is_valid(&more));
        let started = Instant::now();
        let scene = Scene::read(&ready(name)).unwrap();
        let read = started.elapsed();
        let view = scene.view().unwrap();
        let took = started.elapsed();
        assert_sound(&view);
        let covered = view.covered.iter().filter(|covered| **covered).count();
        let (width, height) = (view.width, view.height);
        println!(
            "{name}: {width} x {height}, {covered} covered, {} samples, {read:?} + {:?}",
            view.samples.len(),
            took - read
        );
        assert!(covered * 4 > view.covered.len() && took < Duration::from_secs(2));
        // Every pixel that sees the surface is lit.
        let dark =
            lambert(&view).into_iter().zip(&view.covered).filter(|(l, covered)| **covered && l[0] <= 0.0);
        assert_eq!(dark.count(), 0, "{name}");
        if name == "interior-normal-incidence" {
            let steepest = view.samples.iter().map(|s| s.pair.wi.z.min(s.pair.wo.z)).fold(1.0, f64::min);
            println!("largest angle to the normal {:.1} deg", steepest.acos().to_degrees());
            assert!(steepest > 35_f64.to_radians().cos());
        }
        if name == "grazing-sun-floor" {
            let steepest = largest(view.samples.iter().map(|s| s.pair.wo.z));
            println!("smallest angle to the normal {:.1} deg", steepest.acos().to_degrees());
            assert!(steepest < 65_f64.to_radians().cos());
        }
    }
}

#[test]
fn the_documented_example_is_a_scene() {
    let text = fs::read_to_string(Path::new(ROOT).join("docs/scene.md")).unwrap();
    let example = text.split("```json\n").nth(1).unwrap().split("```").next().unwrap();
    let folder = Folder::new();
    folder.write("example.json", example);
    assert_sound(&Scene::read(&folder.0.path().join("example.json")).unwrap().view().unwrap());
    let validator = jsonschema::validator_for(&serde_json::to_value(schema()).unwrap()).unwrap();
    assert!(validator.is_valid(&serde_json::from_str(example).unwrap()));
}

/// `BRDFIT_UPDATE=1 cargo test --test scene` writes the file anew.
#[test]
fn the_schema_file_is_up_to_date() {
    let path = Path::new(ROOT).join("docs/scene.schema.json");
    let generated = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        fs::write(&path, &generated).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default().replace("\r\n", "\n");
    assert!(found == generated, "docs/scene.schema.json is stale: BRDFIT_UPDATE=1 cargo test --test scene");
}

/// Every file of tests/corpus/scene, by tests/corpus/scene.txt.
#[test]
fn broken_scenes_are_refused_in_one_line() {
    let corpus = Path::new(ROOT).join("tests/corpus");
    let listed = fs::read_to_string(corpus.join("scene.txt")).unwrap();
    let mut names = BTreeSet::new();
    let mut wrong = String::new();
    for line in listed.lines().filter(|line| !line.starts_with('#')) {
        let mut words = line.split(" | ");
        let path = corpus.join(words.next().unwrap());
        let started = Instant::now();
        let error = Scene::read(&path).and_then(|scene| scene.view()).expect_err(line);
        let message = error.to_string();
        println!("{}", message.replace(corpus.to_str().unwrap(), ""));
        let short = !message.contains('\n') && message.len() < 500 + 2 * path.as_os_str().len();
        let kind = matches!(error, Error::Malformed { .. }) && message.contains(": expected ");
        if !(kind && short && words.all(|words| message.contains(words))) || started.elapsed().as_secs() > 2 {
            writeln!(wrong, "{line}\n    {message}").unwrap();
        }
        names.insert(path);
    }
    assert!(wrong.is_empty(), "{wrong}");
    let files = fs::read_dir(corpus.join("scene")).unwrap().map(|entry| entry.unwrap().path());
    assert_eq!(files.collect::<BTreeSet<_>>(), names);
    let missing = Scene::read(&corpus.join("nothing.json")).unwrap_err();
    assert!(matches!(missing, Error::Io { .. }), "{missing}");
}

/// Files without an end are not read to it.
#[cfg(target_os = "linux")]
#[test]
fn gigantic_files_are_refused() {
    let folder = Folder::new();
    let sparse = |name: &str, head: &str| {
        folder.write(name, head);
        let file = fs::File::options().write(true).open(folder.0.path().join(name)).unwrap();
        file.set_len(1 << 40).unwrap();
    };
    sparse("long.obj", "v 0 0 0\n");
    sparse("long.exr", "v/1");
    sparse("long.json", "{");
    let sun = json!([{"directional": {"to_light": [0, 0, 1], "irradiance_rgb": [1, 1, 1]}}]);
    let mesh = folder.read(&json!({"mesh": {"obj": "long.obj"}}), &aside(8), &sun);
    let environment = folder.read(&sphere(), &aside(8), &json!([{"environment": {"exr": "long.exr"}}]));
    let scene = Scene::read(&folder.0.path().join("long.json"));
    for (found, words) in
        [(mesh, "67108864 bytes"), (environment, "134217728 bytes"), (scene, "1048576 bytes")]
    {
        let message = found.unwrap_err().to_string();
        assert!(message.contains(&format!("expected at most {words}, found more")), "{message}");
    }
}

/// Values of a model at [`View::directions`] are those of the samples, one by one.
#[test]
fn directions_and_samples_are_in_the_same_order() {
    let view = view(&sphere(), &aside(8), &uniform(16));
    assert_eq!(view.directions().len(), view.samples.len());
    let brdfit::geometry::Directions::Scattered(pairs) = view.directions() else { panic!("scattered") };
    assert!(pairs.iter().zip(&view.samples).all(|(pair, seen)| *pair == seen.pair));
}
