//! The library's loops against a kernel written by hand in four lanes, as one would for this one model.
//!
//! The kernel computes what the library does: the two basis functions A (1 - s) and A s of Cook-Torrance with GGX,
//! height-correlated Smith and Schlick, where A = D G/(4 ci co) and s = (1 - cos_d)^5, and their derivatives with
//! respect to m, from one array per coordinate. It shares one division and two square roots per sample among all of
//! that, which the library, whose parts know nothing of each other, does not. It is compiled for the instruction set that
//! the whole build is for (SSE2 by default: two instructions for four lanes); `RUSTFLAGS="-C target-cpu=native"` gives
//! it whole AVX registers.

use super::evaluation::{blocks, evaluate};
use super::timing::{as_f64, median};
use super::{Setup, inputs, markdown};
use brdfit::geometry::{BLOCK, Block, Geometry, Row};
use brdfit::model::{BasisBlock, Derivatives, Expression};
use std::f64::consts::PI;
use std::hint::black_box;
use wide::f64x4;

/// Blocks that together fit into the second-level cache.
const BLOCKS: usize = 32;
const ROUGHNESS: f64 = 0.2;

pub fn table(setup: &Setup) -> String {
    let expression = Expression::parse("cook-torrance(d=ggx, g=smith, f=schlick)").unwrap();
    let model = &expression.lobes()[0].model;
    let blocks = blocks(&inputs::directions(BLOCKS * BLOCK));
    let coordinates: Vec<Coordinates> = blocks.iter().map(Coordinates::new).collect();
    let (mut basis, mut portable) = (BasisBlock::default(), BasisBlock::portable());
    let mut by_hand = Basis::default();
    for (block, coordinates) in blocks.iter().zip(&coordinates) {
        basis.forget();
        model.evaluate(block, &[ROUGHNESS], Derivatives::All, &mut basis);
        values_and_derivatives(coordinates, ROUGHNESS, &mut by_hand);
        agree(&by_hand.values, basis.values(), basis.values());
        // The derivative is a difference where it is near 0: its terms are of the size of the value.
        agree(&by_hand.derivatives, basis.partials(0), basis.values());
        by_hand.values = [Row::filled(0.0); 2];
        values(coordinates, ROUGHNESS, &mut by_hand);
        agree(&by_hand.values, basis.values(), basis.values());
    }

    let per_sample = |nanoseconds: f64| nanoseconds / as_f64(BLOCKS * BLOCK);
    let mut rows = Vec::new();
    let kernels: [(&str, Kernel); 2] =
        [("values", values), ("values and derivatives", values_and_derivatives)];
    for (derivatives, (name, kernel)) in [Derivatives::None, Derivatives::All].into_iter().zip(kernels) {
        // In turns, so that whatever else the machine does disturbs both.
        let (mut ours, mut plain, mut theirs) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..setup.effort.runs {
            let shapes = [black_box(ROUGHNESS)];
            let library = || evaluate(model, &blocks, &shapes, derivatives, &mut basis);
            ours.push(per_sample(setup.effort.nanoseconds(library)));
            let library = || evaluate(model, &blocks, &shapes, derivatives, &mut portable);
            plain.push(per_sample(setup.effort.nanoseconds(library)));
            theirs.push(per_sample(setup.effort.nanoseconds(|| {
                for coordinates in &coordinates {
                    kernel(black_box(coordinates), black_box(ROUGHNESS), &mut by_hand);
                    black_box(&mut by_hand);
                }
            })));
        }
        let ratio = median(ours.iter().zip(&theirs).map(|(ours, theirs)| ours / theirs));
        let portable_ratio = median(plain.iter().zip(&theirs).map(|(plain, theirs)| plain / theirs));
        let figures = [median(ours), median(theirs), ratio, median(plain), portable_ratio];
        let figures = figures.map(|figure| format!("{figure:.2}"));
        rows.push([vec![name.to_owned()], figures.to_vec()].concat());
    }
    let titles =
        ["", "library, ns", "by hand, ns", "ratio", "library on the baseline instructions, ns", "its ratio"];
    markdown(&titles, &rows)
}

type Kernel = fn(&Coordinates, f64, &mut Basis);

/// What the formulas need, one array per coordinate.
struct Coordinates {
    cos_i: Row,
    cos_o: Row,
    hx: Row,
    hy: Row,
    hz: Row,
    cos_d: Row,
}

impl Coordinates {
    fn new(block: &Block) -> Self {
        let row = |of: fn(Geometry<f64>) -> f64| {
            let mut row = Row::filled(0.0);
            row.iter_mut().enumerate().for_each(|(place, entry)| *entry = of(block.at(place)));
            row
        };
        Self {
            cos_i: row(|g| g.wi[2]),
            cos_o: row(|g| g.wo[2]),
            hx: row(|g| g.h[0]),
            hy: row(|g| g.h[1]),
            hz: row(|g| g.h[2]),
            cos_d: row(|g| g.cos_d),
        }
    }

    /// The coordinates of the samples 4 n to 4 n + 3.
    #[inline(always)]
    fn lanes(&self, n: usize) -> [f64x4; 6] {
        [
            lanes(&self.cos_i, n),
            lanes(&self.cos_o, n),
            lanes(&self.hx, n),
            lanes(&self.hy, n),
            lanes(&self.hz, n),
            lanes(&self.cos_d, n),
        ]
    }
}

#[inline(always)]
fn lanes(row: &Row, n: usize) -> f64x4 {
    f64x4::from(row.as_chunks::<4>().0[n])
}

#[inline(always)]
fn put(row: &mut Row, n: usize, value: f64x4) {
    row.as_chunks_mut::<4>().0[n] = value.to_array();
}

/// The basis functions and their derivatives with respect to m.
struct Basis {
    values: [Row; 2],
    derivatives: [Row; 2],
}

impl Default for Basis {
    fn default() -> Self {
        Self { values: [Row::filled(0.0); 2], derivatives: [Row::filled(0.0); 2] }
    }
}

#[inline(never)]
fn values(coordinates: &Coordinates, m: f64, out: &mut Basis) {
    let m2 = f64x4::splat(m * m);
    let scale = f64x4::splat(m * m / (2.0 * PI));
    let one = f64x4::ONE;
    let [first, second] = &mut out.values;
    for n in 0..BLOCK / 4 {
        let [ci, co, hx, hy, hz, cd] = coordinates.lanes(n);
        // D = m^2/(pi q^2)
        let q = m2 * hz * hz + (hx * hx + hy * hy);
        // G/(4 ci co) = 1/(2 w)
        let root_i = (ci * ci + m2 * (one - ci * ci)).sqrt();
        let root_o = (co * co + m2 * (one - co * co)).sqrt();
        let w = root_i * co + root_o * ci;
        let a = scale / (q * q * w);
        let a_s = a * schlick(cd);
        put(first, n, a - a_s);
        put(second, n, a_s);
    }
}

#[inline(never)]
fn values_and_derivatives(coordinates: &Coordinates, m: f64, out: &mut Basis) {
    let m2 = f64x4::splat(m * m);
    let scale = f64x4::splat(m * m / (2.0 * PI));
    let (minus_m, two_over_m) = (f64x4::splat(-m), f64x4::splat(2.0 / m));
    let (one, four) = (f64x4::ONE, f64x4::splat(4.0));
    let Basis { values: [first, second], derivatives: [first_slope, second_slope] } = out;
    for n in 0..BLOCK / 4 {
        let [ci, co, hx, hy, hz, cd] = coordinates.lanes(n);
        let hz2 = hz * hz;
        let q = m2 * hz2 + (hx * hx + hy * hy);
        let (sin2_i, sin2_o) = (one - ci * ci, one - co * co);
        let root_i = (ci * ci + m2 * sin2_i).sqrt();
        let root_o = (co * co + m2 * sin2_o).sqrt();
        let w = root_i * co + root_o * ci;
        // One division serves for 1/q, 1/w and the reciprocals of both roots.
        let (q2, roots) = (q * q, root_i * root_o);
        let inverse = one / (q2 * w * roots);
        let inverse_q2_w = inverse * roots;
        let a = scale * inverse_q2_w;
        // (ln A)' = 2/m - 4 m hz^2/q - w'/w,   w' = m (sin2_i co/root_i + sin2_o ci/root_o)
        let of_density = four * hz2 * (inverse_q2_w * q * w);
        let of_shadowing = inverse * q2 * (sin2_i * co * root_o + sin2_o * ci * root_i);
        let slope = a * (two_over_m + minus_m * (of_density + of_shadowing));
        let s = schlick(cd);
        let (a_s, slope_s) = (a * s, slope * s);
        put(first, n, a - a_s);
        put(second, n, a_s);
        put(first_slope, n, slope - slope_s);
        put(second_slope, n, slope_s);
    }
}

/// (1 - cos_d)^5, where rounding may have made cos_d exceed 1.
#[inline(always)]
fn schlick(cos_d: f64x4) -> f64x4 {
    let x = (f64x4::ONE - cos_d).fast_max(f64x4::ZERO);
    let x2 = x * x;
    x2 * x2 * x
}

/// Two ways to compute the same rows must agree but for rounding, relative to the size of their terms.
fn agree(by_hand: &[Row; 2], library: &[Row], terms: &[Row]) {
    for ((ours, theirs), terms) in library.iter().zip(by_hand).zip(terms) {
        for ((a, b), term) in ours.iter().zip(theirs).zip(terms) {
            assert!((a - b).abs() <= 1e-12 * (a.abs() + term.abs()), "the library's {a} and {b} by hand");
        }
    }
}
