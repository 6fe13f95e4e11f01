//! A block of geometry in structure-of-arrays form, on which models are evaluated.

use super::half_difference::Ring;
use super::{Geometry, HalfDifferenceGrid, Pair};
use pulp::{Arch, Simd, WithSimd};
use std::ops::{Deref, DerefMut};

/// Number of samples in a block: small enough for a block and its results to stay in the nearest caches, large enough
/// to make the work per block negligible.
pub const BLOCK: usize = 128;

/// One number per sample of a block.
///
/// Loops over a whole row have a length that is known at compile time, and are vectorised; rows are aligned so that
/// the widest instructions load them fastest.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Row([f64; BLOCK]);

impl Row {
    /// A row with the same number for every sample.
    #[must_use]
    pub const fn filled(value: f64) -> Self {
        Self([value; BLOCK])
    }
}

impl Deref for Row {
    type Target = [f64; BLOCK];

    #[inline(always)]
    fn deref(&self) -> &[f64; BLOCK] {
        &self.0
    }
}

impl DerefMut for Row {
    #[inline(always)]
    fn deref_mut(&mut self) -> &mut [f64; BLOCK] {
        &mut self.0
    }
}

impl AsRef<[f64]> for Row {
    #[inline(always)]
    fn as_ref(&self) -> &[f64] {
        &self.0
    }
}

impl AsMut<[f64]> for Row {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut [f64] {
        &mut self.0
    }
}

impl<'a> IntoIterator for &'a Row {
    type Item = &'a f64;
    type IntoIter = std::slice::Iter<'a, f64>;

    #[inline(always)]
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter()
    }
}

impl<'a> IntoIterator for &'a mut Row {
    type Item = &'a mut f64;
    type IntoIter = std::slice::IterMut<'a, f64>;

    #[inline(always)]
    fn into_iter(self) -> Self::IntoIter {
        self.0.iter_mut()
    }
}

/// Up to [`BLOCK`] pairs of directions, one row per coordinate.
///
/// Positions beyond the last sample repeat the last sample's directions, so that formulas stay finite there.
#[derive(Clone, Debug)]
pub struct Block {
    len: usize,
    wi: [Row; 3],
    wo: [Row; 3],
    h: [Row; 3],
    cos_d: Row,
    one_less_cos_d: Row,
    /// Indices at which samples begin that share the half vector and the difference angle; empty if that is not known.
    rings: Vec<usize>,
}

impl Default for Block {
    fn default() -> Self {
        Self::new()
    }
}

impl Block {
    /// An empty block, in which every position has both directions along the normal.
    #[must_use]
    pub const fn new() -> Self {
        const NORMAL: [Row; 3] = [Row::filled(0.0), Row::filled(0.0), Row::filled(1.0)];
        Self {
            len: 0,
            wi: NORMAL,
            wo: NORMAL,
            h: NORMAL,
            cos_d: Row::filled(1.0),
            one_less_cos_d: Row::filled(0.0),
            rings: Vec::new(),
        }
    }

    /// Replaces the content. Samples beyond [`BLOCK`] are ignored.
    pub fn fill(&mut self, samples: impl Iterator<Item = Geometry<f64>>) {
        self.len = 0;
        self.rings.clear();
        let mut last = None;
        for (place, geometry) in samples.take(BLOCK).enumerate() {
            self.set(place, &geometry);
            self.len = place + 1;
            last = Some(geometry);
        }
        if let Some(last) = last {
            (self.len..BLOCK).for_each(|place| self.set(place, &last));
        }
    }

    /// Replaces the content by pairs of directions. Pairs beyond [`BLOCK`] are ignored.
    pub fn fill_pairs(&mut self, pairs: &[Pair]) {
        self.len = pairs.len().min(BLOCK);
        self.rings.clear();
        let Some(last) = pairs.get(..BLOCK).unwrap_or(pairs).last() else { return };
        for (place, pair) in pairs.iter().chain(std::iter::repeat(last)).take(BLOCK).enumerate() {
            put(&mut self.wi, place, pair.wi.to_array());
            put(&mut self.wo, place, pair.wo.to_array());
        }
        Arch::new().dispatch(HalfVectors(self));
    }

    /// Replaces the content by cells of a grid. Cells beyond [`BLOCK`] are ignored.
    pub fn fill_cells(&mut self, grid: &HalfDifferenceGrid, cells: &[u32]) {
        let mut rest = cells.get(..BLOCK).unwrap_or(cells);
        self.len = rest.len();
        self.rings.clear();
        let arch = Arch::new();
        let mut start = 0;
        while let Some((ring, sin_p, cos_p)) = grid.first_ring(rest) {
            let count = sin_p.len();
            self.rings.push(start);
            arch.dispatch(RingCells { block: self, start, ring, sin_p, cos_p });
            start += count;
            rest = rest.get(count..).unwrap_or_default();
            if start < BLOCK && rest.is_empty() {
                // The remaining positions repeat the last cell.
                let (sin_p, cos_p) =
                    (sin_p.last().copied().unwrap_or(0.0), cos_p.last().copied().unwrap_or(1.0));
                let fill = ([sin_p; BLOCK], [cos_p; BLOCK]);
                arch.dispatch(RingCells { block: self, start, ring, sin_p: &fill.0, cos_p: &fill.1 });
            }
        }
    }

    /// The same pairs of directions with the light mirrored about the normal.
    #[must_use]
    pub fn with_light_mirrored(&self) -> Self {
        let mut mirrored = self.clone();
        // Samples that shared a half vector no longer share one.
        mirrored.rings.clear();
        let [x, y, _] = &mut mirrored.wi;
        x.iter_mut().chain(y.iter_mut()).for_each(|component| *component = -*component);
        Arch::new().dispatch(HalfVectors(&mut mirrored));
        mirrored
    }

    fn set(&mut self, place: usize, geometry: &Geometry<f64>) {
        put(&mut self.wi, place, geometry.wi);
        put(&mut self.wo, place, geometry.wo);
        put(&mut self.h, place, geometry.h);
        for (row, value) in
            [(&mut self.cos_d, geometry.cos_d), (&mut self.one_less_cos_d, geometry.one_less_cos_d)]
        {
            if let Some(entry) = row.get_mut(place) {
                *entry = value;
            }
        }
    }

    /// The geometry at a position, for loops over all positions.
    ///
    /// # Panics
    /// Panics for a position of [`BLOCK`] or more.
    #[inline(always)]
    #[must_use]
    #[expect(
        clippy::indexing_slicing,
        reason = "a loop over 0..BLOCK needs no check, and with one is not packed"
    )]
    pub fn at(&self, place: usize) -> Geometry<f64> {
        let vector = |[x, y, z]: &[Row; 3]| [x[place], y[place], z[place]];
        Geometry {
            wi: vector(&self.wi),
            wo: vector(&self.wo),
            h: vector(&self.h),
            cos_d: self.cos_d[place],
            one_less_cos_d: self.one_less_cos_d[place],
        }
    }

    /// The indices at which samples begin that share the half vector and the difference angle, as many samples of a
    /// grid do; empty if that is not known.
    #[must_use]
    pub fn rings(&self) -> &[usize] {
        &self.rings
    }

    /// Cosine of the angle of incidence of every sample.
    #[must_use]
    pub fn cos_i(&self) -> &Row {
        let [_, _, z] = &self.wi;
        z
    }

    /// Cosine of the viewing angle of every sample.
    #[must_use]
    pub fn cos_o(&self) -> &Row {
        let [_, _, z] = &self.wo;
        z
    }

    /// The number of samples in the block.
    #[must_use]
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether the block contains no samples.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }
}

fn put(rows: &mut [Row; 3], place: usize, vector: [f64; 3]) {
    for (row, value) in rows.iter_mut().zip(vector) {
        if let Some(entry) = row.get_mut(place) {
            *entry = value;
        }
    }
}

/// Computes the half vectors of a block from its directions.
struct HalfVectors<'a>(&'a mut Block);

impl WithSimd for HalfVectors<'_> {
    type Output = ();

    #[inline(always)]
    #[expect(
        clippy::indexing_slicing,
        reason = "a loop over 0..BLOCK needs no check, and with one is not packed"
    )]
    fn with_simd<S: Simd>(self, _: S) {
        let Block { wi, wo, h: [hx, hy, hz], cos_d, one_less_cos_d, .. } = self.0;
        let vector = |[x, y, z]: &[Row; 3], i: usize| [x[i], y[i], z[i]];
        for i in 0..BLOCK {
            let geometry = Geometry::new(vector(wi, i), vector(wo, i));
            [hx[i], hy[i], hz[i]] = geometry.h;
            cos_d[i] = geometry.cos_d;
            one_less_cos_d[i] = geometry.one_less_cos_d;
        }
    }
}

/// Writes cells of one ring to a block, from position `start` on.
struct RingCells<'a> {
    block: &'a mut Block,
    start: usize,
    ring: Ring,
    sin_p: &'a [f64],
    cos_p: &'a [f64],
}

impl WithSimd for RingCells<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { block, start, ring, sin_p, cos_p } = self;
        let Block { wi, wo, h, cos_d, one_less_cos_d, .. } = block;
        let count = sin_p.len().min(BLOCK - start.min(BLOCK));
        for (row, value) in h.iter_mut().zip(ring.h()) {
            part(row, start, count).fill(value);
        }
        part(cos_d, start, count).fill(ring.cos_d);
        part(one_less_cos_d, start, count).fill(ring.one_less_cos_d);
        let ([ix, iy, iz], [ox, oy, oz]) = (
            wi.each_mut().map(|row| part(row, start, count)),
            wo.each_mut().map(|row| part(row, start, count)),
        );
        let towards = ix.iter_mut().zip(iy).zip(iz).zip(ox).zip(oy).zip(oz);
        for ((((((ix, iy), iz), ox), oy), oz), (sin_p, cos_p)) in towards.zip(sin_p.iter().zip(cos_p)) {
            ([*ix, *iy, *iz], [*ox, *oy, *oz]) = ring.directions(*sin_p, *cos_p);
        }
    }
}

#[inline(always)]
fn part(row: &mut Row, start: usize, count: usize) -> &mut [f64] {
    row.get_mut(start..start + count).unwrap_or_default()
}
