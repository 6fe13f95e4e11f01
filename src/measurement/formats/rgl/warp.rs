//! Bilinear tables on the unit square that depend on the direction of incidence, and the warp that makes their density uniform.
//!
//! The formulas are those of the inversion method for a piecewise bilinear density: the marginal distribution over rows, then the
//! conditional distribution within a row, each the antiderivative of a linear function (Dupuy and Jakob 2018, section 3.4).

#![allow(
    clippy::indexing_slicing,
    reason = "sizes are checked when a file is read; an index beyond the end is a mistake in the program"
)]

/// The tables between which one direction of incidence lies, and their weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slices {
    indices: [usize; 4],
    weights: [f64; 4],
}

impl Slices {
    /// The tables for an azimuth and a polar angle of incidence, stored by azimuth, then polar angle. Beyond the first and the last angle
    /// the tables of that angle hold.
    pub(super) fn at(phi_i: &[f64], theta_i: &[f64], phi: f64, theta: f64) -> Self {
        let (k, v) = interval(phi_i, phi);
        let (j, w) = interval(theta_i, theta);
        let below = k * theta_i.len() + j;
        let next_j = usize::from(theta_i.len() > 1);
        let next_k = if phi_i.len() > 1 { theta_i.len() } else { 0 };
        Self {
            indices: [below, below + next_j, below + next_k, below + next_k + next_j],
            weights: [(1.0 - v) * (1.0 - w), (1.0 - v) * w, v * (1.0 - w), v * w],
        }
    }

    /// The one table with this index.
    pub(super) fn only(index: usize) -> Self {
        Self { indices: [index; 4], weights: [1.0, 0.0, 0.0, 0.0] }
    }

    /// A number of tables of `size` numbers each, interpolated.
    fn number(&self, data: &[f32], size: usize, at: usize) -> f64 {
        self.sum(|slice| f64::from(data[slice * size + at]))
    }

    /// The weighted sum of what the tables hold.
    pub(super) fn sum(&self, value: impl Fn(usize) -> f64) -> f64 {
        let pairs = self.indices.iter().zip(self.weights);
        pairs.filter(|(_, weight)| *weight != 0.0).map(|(slice, weight)| weight * value(*slice)).sum()
    }
}

/// The interval of increasing numbers in which `x` lies, and the part of it that lies below `x`, 0 to 1.
fn interval(numbers: &[f64], x: f64) -> (usize, f64) {
    if numbers.len() < 2 {
        return (0, 0.0);
    }
    let index = numbers.partition_point(|number| *number <= x).clamp(1, numbers.len() - 1) - 1;
    let (low, high) = (numbers[index], numbers[index + 1]);
    (index, ((x - low) / (high - low)).clamp(0.0, 1.0))
}

/// A place between the nodes of a table with `width` x `height` nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    column: usize,
    row: usize,
    /// The place within the cell, 0 to 1.
    x: f64,
    y: f64,
}

impl Place {
    /// The cell in which a point of the unit square lies.
    pub(super) fn new([x, y]: [f64; 2], width: usize, height: usize) -> Self {
        let (column, x) = cell(x, width);
        let (row, y) = cell(y, height);
        Self { column, row, x, y }
    }

    /// Interpolates between the four nodes around the place; `node` returns the value of a node by its index in a table of that width.
    pub(super) fn bilinear(&self, width: usize, node: impl Fn(usize) -> f64) -> f64 {
        let at = self.row * width + self.column;
        let row = |at| (1.0 - self.x) * node(at) + self.x * node(at + 1);
        (1.0 - self.y) * row(at) + self.y * row(at + width)
    }
}

/// The cell between `nodes` nodes from 0 to 1 in which `x` lies, and the place within it.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    reason = "between 0 and the number of cells, which is far below 2^52"
)]
fn cell(x: f64, nodes: usize) -> (usize, f64) {
    let cells = nodes - 1;
    let scaled = x.clamp(0.0, 1.0) * cells as f64;
    let cell = (scaled as usize).min(cells - 1);
    (cell, scaled - cell as f64)
}

/// A bilinear table that does not depend on the direction of incidence.
#[derive(Clone, Debug)]
pub(super) struct Table {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) data: Vec<f32>,
}

impl Table {
    /// Its value at a point of the unit square.
    pub(super) fn at(&self, point: [f64; 2]) -> f64 {
        let place = Place::new(point, self.width, self.height);
        place.bilinear(self.width, |node| f64::from(self.data[node]))
    }
}

/// Densities on the unit square, one per tabulated direction of incidence, with their distribution functions.
#[derive(Clone, Debug)]
pub(super) struct Warp {
    width: usize,
    height: usize,
    /// The densities in units of one per cell.
    density: Vec<f32>,
    /// Within a row, the part of the density to the left of each node, the whole being the row's own density.
    conditional: Vec<f32>,
    /// The part of the density below each row.
    marginal: Vec<f32>,
}

impl Warp {
    /// The warps of tables of `width` x `height` nodes that follow each other; the index of the first table whose density is not
    /// positive as a whole is returned as an error.
    #[expect(
        clippy::cast_possible_truncation,
        reason = "kept in the precision of the file, as whoever wrote it expects them to be"
    )]
    pub(super) fn new(width: usize, height: usize, mut density: Vec<f32>) -> Result<Self, usize> {
        let mut conditional = vec![0.0_f32; density.len()];
        let mut marginal = Vec::with_capacity(density.len() / width);
        let (mut within, mut rows) = (vec![0.0; width * height], vec![0.0; height]);
        for (index, table) in density.chunks_exact_mut(width * height).enumerate() {
            for (row, sums) in table.chunks_exact(width).zip(within.chunks_exact_mut(width)) {
                let mut sum = 0.0;
                for x in 1..width {
                    sum += 0.5 * (f64::from(row[x - 1]) + f64::from(row[x]));
                    sums[x] = sum;
                }
            }
            for y in 1..height {
                rows[y] = rows[y - 1] + 0.5 * (within[y * width - 1] + within[(y + 1) * width - 1]);
            }
            let total: f64 = rows[height - 1];
            // A total so small that its inverse is infinite is none.
            let scale = 1.0 / total;
            if !(total > 0.0 && scale.is_finite()) {
                return Err(index);
            }
            marginal.extend(rows.iter().map(|sum| (sum * scale) as f32));
            let kept = conditional[index * width * height..].iter_mut();
            kept.zip(&within).for_each(|(kept, sum)| *kept = (sum * scale) as f32);
            table.iter_mut().for_each(|value| *value = (f64::from(*value) * scale) as f32);
        }
        Ok(Self { width, height, density, conditional, marginal })
    }

    fn size(&self) -> usize {
        self.width * self.height
    }

    /// Where uniform density has the point at which this density has `point`.
    pub(super) fn invert(&self, point: [f64; 2], slices: &Slices) -> [f64; 2] {
        let Place { column, row, x, y } = Place::new(point, self.width, self.height);
        let at = row * self.width + column;
        let density = |at| slices.number(&self.density, self.size(), at);
        let conditional = |at| slices.number(&self.conditional, self.size(), at);
        let mix = |a: f64, b: f64| (1.0 - y) * a + y * b;
        let left = mix(density(at), density(at + self.width));
        let right = mix(density(at + 1), density(at + self.width + 1));
        let before = mix(conditional(at), conditional(at + self.width));
        let (first, second) = self.rows(row, slices);
        let whole = mix(first, second);
        let u = before + x * (left + 0.5 * x * (right - left));
        let v = slices.number(&self.marginal, self.height, row) + y * (first + 0.5 * y * (second - first));
        // Where there is no density at all, every point is as good.
        [if whole > 0.0 { u / whole } else { 0.0 }, v]
    }

    /// The density of a row and of the next one.
    fn rows(&self, row: usize, slices: &Slices) -> (f64, f64) {
        let end = |row: usize| slices.number(&self.conditional, self.size(), (row + 1) * self.width - 1);
        (end(row), end(row + 1))
    }

    /// The inverse of [`invert`](Self::invert).
    #[expect(clippy::cast_precision_loss, reason = "numbers of nodes")]
    pub(super) fn sample(&self, [u, v]: [f64; 2], slices: &Slices) -> [f64; 2] {
        let marginal = |row: usize| slices.number(&self.marginal, self.height, row);
        let row = last_below(self.height, v, marginal);
        let (first, second) = self.rows(row, slices);
        let y = solved(v - marginal(row), first, second);
        let mix = |a: f64, b: f64| (1.0 - y) * a + y * b;
        let target = u * mix(first, second);
        let conditional = |column: usize| {
            let at = row * self.width + column;
            let value = |at| slices.number(&self.conditional, self.size(), at);
            mix(value(at), value(at + self.width))
        };
        let column = last_below(self.width, target, conditional);
        let density = |column: usize| {
            let at = row * self.width + column;
            let value = |at| slices.number(&self.density, self.size(), at);
            mix(value(at), value(at + self.width))
        };
        let x = solved(target - conditional(column), density(column), density(column + 1));
        let place = |cell: usize, within: f64, nodes: usize| (cell as f64 + within) / (nodes - 1) as f64;
        [place(column, x, self.width), place(row, y, self.height)]
    }
}

/// The last of all nodes but one whose value is below `x`, by bisection; the first if none is.
fn last_below(nodes: usize, x: f64, value: impl Fn(usize) -> f64) -> usize {
    let (mut low, mut high) = (0, nodes - 1);
    while high - low > 1 {
        let middle = low.midpoint(high);
        if value(middle) < x { low = middle } else { high = middle }
    }
    low
}

/// How far one must go along a density that runs from `left` to `right` between 0 and 1 to pass `part` of it.
fn solved(part: f64, left: f64, right: f64) -> f64 {
    let part = part.max(0.0);
    // part = left t + (right - left) t^2/2, solved without cancellation.
    let root = (left * left + 2.0 * part * (right - left)).max(0.0).sqrt();
    let sum = left + root;
    if sum > 0.0 { (2.0 * part / sum).clamp(0.0, 1.0) } else { 0.0 }
}
