//! Samples as the residuals need them: transformed, weighted, in rows.

use super::kernels::ObservedBlock;
use super::loss::weighted_quantile;
use super::metric::{Metric, Transform};
use crate::geometry::{BLOCK, Block, Row};
use crate::math::count;
use crate::measurement::Samples;
use rayon::prelude::*;

/// Samples prepared for a metric. Fits of the same samples share them.
pub(super) struct Observed<'a> {
    samples: &'a Samples,
    /// Per channel.
    targets: Vec<Target>,
    /// Root of weight times normalisation, per block; zero beyond the last sample.
    roots: Vec<Row>,
    /// The geometry of each block, where there are few.
    blocks: Vec<Block>,
    /// Sum of the weighted squares of g(x*).
    magnitude2: f64,
}

/// What the model is compared with in one channel.
struct Target {
    transform: Transform,
    /// g(x*), per block.
    measured: Vec<Row>,
    /// 1/(sigma ci g'(x*)), per block, where weights are by sigma.
    precision: Option<Vec<Row>>,
}

/// The geometry of so few samples is kept: it takes 80 bytes for each.
const KEPT_SAMPLES: usize = 20_000;

impl<'a> Observed<'a> {
    pub(super) fn new(samples: &'a Samples, metric: Metric) -> Self {
        let channels = samples.values.len();
        let total: f64 = samples.weights.iter().sum();
        let normalisation = match samples.sigma {
            Some(_) => 1.0,
            None => 1.0 / (count(channels) * total),
        };
        let indices = 0..samples.len().div_ceil(BLOCK);
        let filled = |index: usize, block: &mut Block| samples.directions.fill(range(samples, index), block);
        let cosines: Vec<Row> = indices
            .clone()
            .into_par_iter()
            .map_init(Block::new, |block, index| {
                filled(index, block);
                *block.cos_i()
            })
            .collect();
        let blocks = if samples.len() <= KEPT_SAMPLES {
            let block = |index| {
                let mut block = Block::new();
                filled(index, &mut block);
                block
            };
            indices.map(block).collect()
        } else {
            Vec::new()
        };
        let roots: Vec<Row> = samples
            .weights
            .par_chunks(BLOCK)
            .map(|weights| row(weights, 0.0).map(|weight| (weight * normalisation).sqrt()))
            .collect();
        let targets: Vec<Target> =
            (0..channels).map(|channel| Target::new(samples, metric, &cosines, channel)).collect();
        let magnitude2 = targets.iter().map(|target| target.magnitude2(&roots)).sum();
        Self { samples, targets, roots, blocks, magnitude2 }
    }

    /// Number of samples.
    pub(super) fn len(&self) -> usize {
        self.samples.len()
    }

    pub(super) fn channels(&self) -> usize {
        self.targets.len()
    }

    /// Sum of the squares of the measured values, weighted and transformed like the residuals.
    pub(super) fn magnitude2(&self) -> f64 {
        self.magnitude2
    }

    /// The geometry of a block, in `space` where it is not kept.
    pub(super) fn block<'b>(&'b self, index: usize, space: &'b mut Block) -> &'b Block {
        if let Some(block) = self.blocks.get(index) {
            return block;
        }
        self.samples.directions.fill(range(self.samples, index), space);
        space
    }

    /// The weights of a block's samples.
    pub(super) fn weights(&self, index: usize) -> &[f64] {
        self.samples.weights.get(range(self.samples, index)).unwrap_or_default()
    }

    pub(super) fn channel_block(&self, channel: usize, index: usize) -> Option<ObservedBlock<'_>> {
        let target = self.targets.get(channel)?;
        Some(ObservedBlock {
            transform: target.transform,
            measured: target.measured.get(index)?,
            roots: self.roots.get(index)?,
            precision: match &target.precision {
                Some(rows) => Some(rows.get(index)?),
                None => None,
            },
        })
    }

    /// The magnitude below which a fraction of the measured values lie, in the units of a loss's scale;
    /// samples count alike, whatever their weight.
    pub(super) fn quantile(&self, fraction: f64) -> f64 {
        let of_target = |target: &Target| -> Vec<(f64, f64)> {
            let mut rows = target.measured.clone();
            if let Some(precision) = &target.precision {
                let scaled = rows.iter_mut().flatten().zip(precision.iter().flatten());
                scaled.for_each(|(value, precision)| *value *= precision);
            }
            rows.iter().flatten().take(self.len()).map(|value| (value.abs(), 1.0)).collect()
        };
        let mut values: Vec<(f64, f64)> = self.targets.iter().flat_map(of_target).collect();
        weighted_quantile(&mut values, fraction)
    }
}

impl Target {
    fn new(samples: &Samples, metric: Metric, cosines: &[Row], channel: usize) -> Self {
        let values = samples.values.get(channel).map_or(&[][..], Vec::as_slice);
        let projected = |(values, cosines): (&[f64], &Row)| {
            let mut x = row(values, 0.0);
            x.iter_mut().zip(cosines).for_each(|(x, cos)| *x = metric.measured(*x * cos));
            x
        };
        let mut measured: Vec<Row> = values.par_chunks(BLOCK).zip(cosines).map(projected).collect();
        // A row's sums are added up in order, so that the threads do not matter.
        let sums: Vec<(f64, f64)> = measured
            .par_iter()
            .zip(samples.weights.par_chunks(BLOCK))
            .map(|(x, weights)| {
                let terms = x.iter().zip(weights);
                terms.fold((0.0, 0.0), |(sum, total), (x, weight)| (sum + x.abs() * weight, total + weight))
            })
            .collect();
        let (sum, total) = sums.iter().fold((0.0, 0.0), |(sum, total), (s, t)| (sum + s, total + t));
        let transform = metric.transform(sum / total);
        let slopes: Vec<Row> = measured
            .par_iter_mut()
            .map(|x| {
                let (mut transformed, mut slope) = ([0.0; BLOCK], [0.0; BLOCK]);
                transform.differences(x, &[0.0; BLOCK], &mut transformed, &mut slope);
                *x = transformed;
                slope
            })
            .collect();
        let precision = samples.sigma.as_ref().and_then(|sigma| sigma.get(channel)).map(|sigma| {
            let factors = slopes.iter().zip(cosines).zip(sigma.chunks(BLOCK));
            let of_block = |((slopes, cosines), sigma): ((&Row, &Row), &[f64])| {
                let mut precision = row(sigma, 1.0);
                let entries = precision.iter_mut().zip(slopes).zip(cosines);
                entries.for_each(|((entry, slope), cos)| *entry = 1.0 / (*entry * cos * slope));
                precision
            };
            factors.map(of_block).collect()
        });
        Self { transform, measured, precision }
    }

    fn magnitude2(&self, roots: &[Row]) -> f64 {
        let of_block = |(index, (measured, roots)): (usize, (&Row, &Row))| {
            let precision = self.precision.as_ref().and_then(|rows| rows.get(index));
            let weighted = measured.iter().zip(roots).enumerate().map(|(i, (g, root))| {
                let precision = precision.and_then(|row| row.get(i)).copied().unwrap_or(1.0);
                (root * precision * g).powi(2)
            });
            weighted.sum::<f64>()
        };
        self.measured.iter().zip(roots).enumerate().map(of_block).sum()
    }
}

/// The samples of a block.
fn range(samples: &Samples, index: usize) -> std::ops::Range<usize> {
    index * BLOCK..samples.len().min((index + 1) * BLOCK)
}

/// Up to a row of values, filled up.
pub(super) fn row(values: &[f64], rest: f64) -> Row {
    let mut row = [rest; BLOCK];
    row.iter_mut().zip(values).for_each(|(entry, value)| *entry = *value);
    row
}
