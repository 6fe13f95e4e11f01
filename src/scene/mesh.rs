//! A mesh of triangles in a hierarchy of bounding boxes.
//!
//! The boxes are stored in depth-first order, and each knows which box comes next if the ray misses it. So the search is a
//! loop without a stack. Triangles are split at the median along the longest side of the box of their centroids.

use super::frame::{Frame, Hit, Ray};
use glam::DVec3;

/// Largest number of triangles in a box at the bottom of the hierarchy.
const LEAF: usize = 4;

#[derive(Clone, Debug)]
pub(super) struct Mesh {
    triangles: Vec<Triangle>,
    boxes: Vec<Node>,
    /// Distance from the surface at which shadow rays start, so that rounding does not make a facet hide itself: a millionth of
    /// the size of the mesh.
    lift: f64,
}

#[derive(Clone, Debug)]
pub(super) struct Triangle {
    pub corner: DVec3,
    /// Vectors from `corner` to the other two corners.
    pub edges: [DVec3; 2],
    /// The outward unit normal of the facet.
    pub geometric: DVec3,
    /// The shading normals at the corners, on the outward side.
    pub normals: [DVec3; 3],
    /// The direction in which the first texture coordinate increases. `None` without texture coordinates.
    pub tangent: Option<DVec3>,
}

#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Index of the box that follows if the ray misses this one, or when its contents have been searched.
    skip: usize,
    /// First of its own triangles; only boxes at the bottom have any.
    first: usize,
    count: usize,
}

impl Triangle {
    fn corners(&self) -> [DVec3; 3] {
        let [a, b] = self.edges;
        [self.corner, self.corner + a, self.corner + b]
    }

    fn centroid(&self) -> DVec3 {
        let [a, b] = self.edges;
        self.corner + (a + b) / 3.0
    }

    /// Where a ray meets the triangle, from either side: its distance, and the barycentric coordinates of the second and third
    /// corner. `None` if it misses. Moller and Trumbore 1997, doi:10.1080/10867651.1997.10487468.
    fn meet(&self, ray: &Ray) -> Option<(f64, f64, f64)> {
        let [a, b] = self.edges;
        let p = ray.direction.cross(b);
        let determinant = a.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let from = ray.origin - self.corner;
        let u = from.dot(p) / determinant;
        let q = from.cross(a);
        let v = ray.direction.dot(q) / determinant;
        let t = b.dot(q) / determinant;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t > 0.0).then_some((t, u, v))
    }
}

impl Mesh {
    /// Makes a mesh of one triangle or more.
    pub fn new(mut triangles: Vec<Triangle>) -> Self {
        let mut boxes = Vec::new();
        build(&mut triangles, 0, &mut boxes);
        let lift = boxes.first().map_or(0.0, |whole| 1e-6 * (whole.high - whole.low).length());
        Self { triangles, boxes, lift }
    }

    pub fn hit(&self, ray: &Ray) -> Option<Hit> {
        let mut nearest: Option<(&Triangle, f64, f64, f64)> = None;
        self.search(ray, |triangle, reach| {
            if let Some((t, u, v)) = triangle.meet(ray).filter(|(t, ..)| *t < *reach) {
                nearest = Some((triangle, t, u, v));
                *reach = t;
            }
            false
        });
        let (triangle, t, u, v) = nearest?;
        if triangle.geometric.dot(ray.direction) >= 0.0 {
            return None;
        }
        let [n0, n1, n2] = triangle.normals;
        let normal = (n0 * (1.0 - u - v) + n1 * u + n2 * v).try_normalize().unwrap_or(triangle.geometric);
        let frame = match triangle.tangent {
            Some(tangent) => Frame::new(normal, tangent),
            None => Frame::around(normal, DVec3::Z),
        };
        Some(Hit { point: ray.at(t), frame, geometric: triangle.geometric })
    }

    pub fn hides(&self, hit: &Hit, direction: DVec3, distance: f64) -> bool {
        // The direction is behind the facet, though above the horizon of the shading normal.
        if hit.geometric.dot(direction) <= 0.0 {
            return true;
        }
        let ray = Ray { origin: hit.point + hit.geometric * self.lift, direction };
        let mut hidden = false;
        self.search(&ray, |triangle, _| {
            hidden = triangle.meet(&ray).is_some_and(|(t, ..)| t < distance);
            hidden
        });
        hidden
    }

    /// Calls `visit` for the triangles in the boxes that the ray passes through. `visit` may shorten the distance to search,
    /// and ends the search by returning `true`.
    fn search<'a>(&'a self, ray: &Ray, mut visit: impl FnMut(&'a Triangle, &mut f64) -> bool) {
        // A zero component would give 0/0 for a ray within the face of a box.
        let apart = |x: f64| if x.abs() < 1e-300 { 1e300 } else { 1.0 / x };
        let inverse = DVec3::new(apart(ray.direction.x), apart(ray.direction.y), apart(ray.direction.z));
        let mut reach = f64::INFINITY;
        let mut next = 0;
        while let Some(node) = self.boxes.get(next) {
            let (a, b) = ((node.low - ray.origin) * inverse, (node.high - ray.origin) * inverse);
            let enter = a.min(b).max_element().max(0.0);
            // A small margin makes up for rounding, which could make the ray miss a flat box.
            let leave = a.max(b).min_element() * (1.0 + 1e-12) + f64::MIN_POSITIVE;
            if enter > leave || enter > reach {
                next = node.skip;
                continue;
            }
            for triangle in self.triangles.get(node.first..node.first + node.count).unwrap_or_default() {
                if visit(triangle, &mut reach) {
                    return;
                }
            }
            next += 1;
        }
    }
}

/// Appends the boxes of `triangles`, the first of which has the index `first`, and sorts the triangles in their order.
fn build(triangles: &mut [Triangle], first: usize, boxes: &mut Vec<Node>) {
    let bounds = |points: &mut dyn Iterator<Item = DVec3>| {
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)))
    };
    let (low, high) = bounds(&mut triangles.iter().flat_map(Triangle::corners));
    let here = boxes.len();
    let leaf = triangles.len() <= LEAF;
    boxes.push(Node { low, high, skip: 0, first, count: if leaf { triangles.len() } else { 0 } });
    if !leaf {
        let (low, high) = bounds(&mut triangles.iter().map(Triangle::centroid));
        let axis = (high - low).to_array();
        let longest = (0..3)
            .max_by(|&i, &j| axis.get(i).partial_cmp(&axis.get(j)).unwrap_or(std::cmp::Ordering::Equal));
        let along = |t: &Triangle| t.centroid().to_array().get(longest.unwrap_or(0)).copied().unwrap_or(0.0);
        let half = triangles.len() / 2;
        triangles.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)));
        let (left, right) = triangles.split_at_mut(half);
        build(left, first, boxes);
        build(right, first + half, boxes);
    }
    let end = boxes.len();
    if let Some(node) = boxes.get_mut(here) {
        node.skip = end;
    }
}
