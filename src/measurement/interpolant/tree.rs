//! A k-d tree that finds the nearest of many points, always in the same order.

/// Coordinates of a point. Unused ones are 0 for all points.
pub(super) type Point = [f64; 5];

/// A point of the tree that is near the one searched for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    /// Squared distance.
    pub square: f64,
    /// The point itself.
    pub point: Point,
    /// The sample that the point belongs to.
    pub sample: usize,
}

/// The points, in leaves of at most [`LEAF`], divided in half along the widest axis.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    points: Vec<(Point, usize)>,
    nodes: Vec<Node>,
    /// The smallest and the largest coordinate of all points, along each axis.
    ends: [(f64, f64); 5],
}

#[derive(Clone, Debug)]
enum Node {
    Leaf(std::ops::Range<usize>),
    /// Points below `at` are in the next node, the others in node `right`.
    Split {
        axis: usize,
        at: f64,
        right: usize,
    },
}

/// Largest number of points in a leaf.
const LEAF: usize = 8;
/// Room for roundings: a part of the tree is passed over only if it is farther away than this, in units of the farthest point found.
const BEYOND: f64 = 1.0 + 1e-12;

/// How far a part of the tree is away from the point searched for, at least.
#[derive(Clone, Copy)]
struct Apart {
    /// Along each axis.
    along: Point,
    /// The sum of their squares.
    square: f64,
}

impl Apart {
    fn new(along: Point) -> Self {
        Self { along, square: along.iter().map(|x| x * x).sum() }
    }

    /// The same, but for one axis.
    fn with(mut self, axis: usize, distance: f64) -> Self {
        if let Some(along) = self.along.get_mut(axis) {
            *along = distance;
        }
        Self::new(self.along)
    }
}

impl Tree {
    /// Builds the tree of these points, each with the sample that it belongs to.
    pub(super) fn new(mut points: Vec<(Point, usize)>) -> Self {
        let mut nodes = Vec::new();
        divide(&mut points, 0, &mut nodes);
        let mut ends = [(f64::INFINITY, f64::NEG_INFINITY); 5];
        for (point, _) in &points {
            for ((low, high), x) in ends.iter_mut().zip(point) {
                (*low, *high) = (low.min(*x), high.max(*x));
            }
        }
        Self { points, nodes, ends }
    }

    /// Writes the `k` points nearest to `to`, among those for which `admit` returns true, to `found`, nearest first.
    pub(super) fn nearest(&self, to: &Point, k: usize, admit: impl Fn(&Near) -> bool, found: &mut Vec<Near>) {
        found.clear();
        self.descend(0, self.apart(to), to, k, &admit, found);
    }

    /// Whether the squared distance of every point from `to` is larger than `square`, as far as the ends of the axes tell.
    pub(super) fn is_farther_than(&self, square: f64, to: &Point) -> bool {
        self.apart(to).square > square * BEYOND
    }

    /// How far the box around all points is from `to`.
    fn apart(&self, to: &Point) -> Apart {
        let mut along = [0.0; 5];
        for ((distance, x), (low, high)) in along.iter_mut().zip(to).zip(self.ends) {
            *distance = (low - x).max(x - high).max(0.0);
        }
        Apart::new(along)
    }

    /// Looks for points in the part of the tree below `node`, which is `apart` from `to`.
    fn descend(
        &self,
        node: usize,
        apart: Apart,
        to: &Point,
        k: usize,
        admit: &impl Fn(&Near) -> bool,
        found: &mut Vec<Near>,
    ) {
        match self.nodes.get(node) {
            Some(Node::Leaf(range)) => {
                for (point, sample) in self.points.get(range.clone()).unwrap_or_default() {
                    let near = Near { square: square(point, to), point: *point, sample: *sample };
                    if near.square < worst(found, k) && admit(&near) {
                        let place = found.partition_point(|other| other.square <= near.square);
                        found.truncate(k - 1);
                        found.insert(place, near);
                    }
                }
            }
            Some(&Node::Split { axis, at, right }) => {
                let beyond = to.get(axis).map_or(0.0, |x| x - at);
                let (first, second) = if beyond < 0.0 { (node + 1, right) } else { (right, node + 1) };
                self.descend(first, apart, to, k, admit, found);
                // Where all points lie off to one side, the distance along that axis counts as well.
                let farther = apart.with(axis, apart.along.get(axis).map_or(0.0, |x| x.max(beyond.abs())));
                if farther.square < worst(found, k) * BEYOND {
                    self.descend(second, farther, to, k, admit, found);
                }
            }
            None => {}
        }
    }
}

/// The squared distance below which another point is among the nearest.
fn worst(found: &[Near], k: usize) -> f64 {
    if found.len() < k { f64::INFINITY } else { found.last().map_or(f64::INFINITY, |near| near.square) }
}

/// The squared distance of two points.
pub(super) fn square(a: &Point, b: &Point) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b) * (a - b)).sum()
}

fn divide(points: &mut [(Point, usize)], start: usize, nodes: &mut Vec<Node>) {
    if points.len() <= LEAF {
        nodes.push(Node::Leaf(start..start + points.len()));
        return;
    }
    let coordinate = |(point, _): &(Point, usize), axis: usize| point.get(axis).copied().unwrap_or(0.0);
    let width = |axis: usize| {
        let along = || points.iter().map(|point| coordinate(point, axis));
        along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
    };
    let widths = [0, 1, 2, 3, 4].map(|axis| (width(axis), axis));
    let (_, axis) = widths.into_iter().fold((f64::NEG_INFINITY, 0), |a, b| if b.0 > a.0 { b } else { a });
    let half = points.len() / 2;
    // The index of the sample breaks ties.
    let (_, middle, _) = points.select_nth_unstable_by(half, |a, b| {
        coordinate(a, axis).total_cmp(&coordinate(b, axis)).then(a.1.cmp(&b.1))
    });
    let at = coordinate(middle, axis);
    let node = nodes.len();
    nodes.push(Node::Split { axis, at, right: 0 });
    let (low, high) = points.split_at_mut(half);
    divide(low, start, nodes);
    let next = nodes.len();
    if let Some(Node::Split { right, .. }) = nodes.get_mut(node) {
        *right = next;
    }
    divide(high, start + half, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};

    #[test]
    fn finds_what_a_search_through_all_finds() {
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(7);
        // Coordinates with few different values, so that there are ties, and one axis on which all points coincide.
        let mut point = || -> Point {
            let mut at = || (rng.random::<f64>() * 20.0).floor() / 20.0;
            [at(), at(), at(), at(), 0.0]
        };
        let points: Vec<(Point, usize)> = (0..3000).map(|i| (point(), i)).collect();
        let tree = Tree::new(points.clone());
        let mut found = Vec::new();
        for _ in 0..500 {
            let to = point();
            let odd = |near: &Near| near.sample % 2 == 1;
            tree.nearest(&to, 9, odd, &mut found);
            let mut all: Vec<f64> =
                points.iter().filter(|(_, i)| i % 2 == 1).map(|(p, _)| square(p, &to)).collect();
            all.sort_by(f64::total_cmp);
            assert_eq!(found.iter().map(|near| near.square).collect::<Vec<_>>(), all[..9]);
            assert!(found.iter().all(odd));
        }
        tree.nearest(&[0.5; 5], 4000, |_| true, &mut found);
        assert_eq!(found.len(), 3000);
    }
}
