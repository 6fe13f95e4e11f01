//! Reads meshes in Wavefront OBJ: `v`, `vn`, `vt` and `f`; other statements are ignored.

use super::mesh::{Mesh, Triangle};
use crate::error::{Error, Place, excerpt};
use glam::{DVec2, DVec3};
use std::path::Path;

/// Largest size of a file, bytes.
pub(super) const MOST_BYTES: u64 = 64 << 20;
/// Largest number of triangles.
const MOST_TRIANGLES: usize = 500_000;

/// Reads the mesh in the bytes of an OBJ file. No coordinate may exceed `largest` in size.
pub(super) fn mesh(bytes: &[u8], path: &Path, largest: f64) -> Result<Mesh, Error> {
    let mut parser = Parser {
        path,
        largest,
        line: 0,
        points: vec![],
        normals: vec![],
        textures: vec![],
        triangles: vec![],
    };
    for line in bytes.split(|&byte| byte == b'\n') {
        parser.line += 1;
        let Ok(text) = std::str::from_utf8(line) else {
            return Err(parser.wrong("text", "bytes that are not UTF-8"));
        };
        parser.statement(text.split('#').next().unwrap_or_default())?;
    }
    if parser.triangles.is_empty() {
        return Err(Error::malformed(path, Place::File, "a mesh with a face (f) of nonzero area", "none"));
    }
    Ok(Mesh::new(parser.triangles))
}

struct Parser<'a> {
    path: &'a Path,
    largest: f64,
    line: u64,
    points: Vec<DVec3>,
    normals: Vec<DVec3>,
    textures: Vec<DVec2>,
    triangles: Vec<Triangle>,
}

/// A corner of a face.
#[derive(Clone, Copy)]
struct Corner {
    point: DVec3,
    normal: Option<DVec3>,
    texture: Option<DVec2>,
}

impl Parser<'_> {
    fn wrong(&self, expected: impl Into<String>, found: impl Into<String>) -> Error {
        Error::malformed(self.path, Place::Line(self.line), expected, found)
    }

    fn statement(&mut self, text: &str) -> Result<(), Error> {
        let mut words = text.split_ascii_whitespace();
        match words.next() {
            // A fourth number, the weight, and colours after it are ignored.
            Some("v") => {
                let point = DVec3::from_array(self.numbers(text, words)?);
                if point.abs().max_element() > self.largest {
                    let expected = format!("coordinates up to {:e} m", self.largest);
                    return Err(self.wrong(expected, excerpt(text.trim())));
                }
                self.points.push(point);
            }
            Some("vn") => {
                let normal = DVec3::from_array(self.numbers(text, words)?);
                let Some(normal) = normal.try_normalize() else {
                    return Err(self.wrong("a normal of nonzero length", excerpt(text.trim())));
                };
                self.normals.push(normal);
            }
            Some("vt") => {
                let texture = DVec2::from_array(self.numbers(text, words)?);
                self.textures.push(texture);
            }
            Some("f") => self.face(words)?,
            _ => {}
        }
        Ok(())
    }

    fn numbers<'w, const N: usize>(
        &self,
        text: &str,
        mut words: impl Iterator<Item = &'w str>,
    ) -> Result<[f64; N], Error> {
        let mut found = [0.0; N];
        for slot in &mut found {
            let number =
                words.next().and_then(|word| word.parse().ok()).filter(|number: &f64| number.is_finite());
            *slot = number.ok_or_else(|| self.wrong(format!("{N} finite numbers"), excerpt(text.trim())))?;
        }
        Ok(found)
    }

    /// Adds a polygon as a fan of triangles about its first corner.
    fn face<'w>(&mut self, words: impl Iterator<Item = &'w str>) -> Result<(), Error> {
        let corners: Vec<Corner> = words.map(|word| self.corner(word)).collect::<Result<_, _>>()?;
        let (Some(first), true) = (corners.first(), corners.len() >= 3) else {
            return Err(self.wrong("a face of at least 3 corners", format!("{}", corners.len())));
        };
        for pair in corners.get(1..).unwrap_or_default().windows(2) {
            let [second, third] = pair else { continue };
            self.triangles.extend(triangle([first, second, third]));
        }
        if self.triangles.len() > MOST_TRIANGLES {
            return Err(self.wrong(format!("at most {MOST_TRIANGLES} triangles"), "more"));
        }
        Ok(())
    }

    /// Parses `v`, `v/vt`, `v//vn` or `v/vt/vn`; a negative number counts back from the latest statement.
    fn corner(&self, word: &str) -> Result<Corner, Error> {
        let mut parts = word.split('/');
        let mut part = |len: usize| {
            let Some(text) = parts.next().filter(|text| !text.is_empty()) else { return Ok(None) };
            let number: Option<i64> = text.parse().ok();
            let index = number.and_then(|number| {
                let from = if number < 0 { i64::try_from(len).ok()? } else { -1 };
                usize::try_from(from.checked_add(number)?).ok().filter(|index| *index < len)
            });
            index.map(Some).ok_or_else(|| match len {
                0 => "a statement (v, vt, vn) above the corner that names it".to_owned(),
                _ => format!("a corner with an index of 1 to {len}, or -1 to -{len}"),
            })
        };
        let indices = (part(self.points.len()), part(self.textures.len()), part(self.normals.len()));
        let more = parts.next().is_some();
        let (Ok(point), Ok(texture), Ok(normal)) = &indices else {
            let (point, texture, normal) = indices;
            let expected = point.err().or(texture.err()).or(normal.err()).unwrap_or_default();
            return Err(self.wrong(expected, excerpt(word)));
        };
        let point = point.and_then(|point| self.points.get(point)).filter(|_| !more);
        let Some(&point) = point else {
            return Err(self.wrong("a corner as v, v/vt, v//vn or v/vt/vn", excerpt(word)));
        };
        Ok(Corner {
            point,
            normal: normal.and_then(|normal| self.normals.get(normal)).copied(),
            texture: texture.and_then(|texture| self.textures.get(texture)).copied(),
        })
    }
}

/// The triangle with three corners. `None` if it has no area.
fn triangle(corners: [&Corner; 3]) -> Option<Triangle> {
    let [a, b, c] = corners;
    let edges = [b.point - a.point, c.point - a.point];
    let mut geometric = edges[0].cross(edges[1]).try_normalize()?;
    let mut normals = [geometric; 3];
    if let (Some(na), Some(nb), Some(nc)) = (a.normal, b.normal, c.normal) {
        normals = [na, nb, nc];
        // If normals are given, they determine the outside; otherwise the order of the corners does.
        if (na + nb + nc).dot(geometric) < 0.0 {
            geometric = -geometric;
        }
    }
    let tangent = match (a.texture, b.texture, c.texture) {
        (Some(ta), Some(tb), Some(tc)) => {
            // e1 = u1 dp/du + v1 dp/dv, e2 = u2 dp/du + v2 dp/dv, solved for dp/du.
            let (one, two) = (tb - ta, tc - ta);
            let determinant = one.x * two.y - two.x * one.y;
            ((edges[0] * two.y - edges[1] * one.y) * determinant.signum())
                .try_normalize()
                .filter(|_| determinant != 0.0)
        }
        _ => None,
    };
    Some(Triangle { corner: a.point, edges, geometric, normals, tangent })
}
