//! Samples prepared for computing residuals: transformed, weighted and arranged in rows.
//!
//! What was not measured has the weight 0 in its channel. A number stands in its place that any model may be compared with.

use super::kernels::ObservedBlock;
use super::loss::weighted_quantile;
use super::metric::{Metric, Transform, Wanted};
use crate::geometry::{BLOCK, Block, Row};
use crate::measurement::Samples;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// The fraction of the measured values that is trusted. Outliers are assumed to be fewer than the remaining 5 %.
pub(in crate::fit) const BULK_OF_DATA: f64 = 0.95;

/// Samples prepared for a metric. Fits of the same samples share one instance.
pub(in crate::fit) struct Observed<'a> {
    samples: &'a Samples,
    /// The values that the model is compared with, by channel; `None` for channels that do not count.
    targets: Vec<Option<Target>>,
    /// Square root of weight times normalisation, by block, for the channels that have all values; 0 beyond the last sample.
    roots: Vec<Row>,
    /// The geometry of each block; empty if there are too many samples to keep it.
    blocks: Vec<Block>,
    /// Sum of the weighted squares of g(x*).
    magnitude2: f64,
}

/// The values that the model is compared with in one channel.
struct Target {
    transform: Transform,
    /// The roots of a channel in which values are missing, 0 in their places; `None` for the roots of all channels.
    roots: Option<Vec<Row>>,
    /// g(x*), by block.
    measured: Vec<Row>,
    /// g of what the neighbours predict, by block; `None` if the metric makes no use of it.
    predicted: Option<Vec<Row>>,
    /// 1/(sigma ci g'(x*)), by block; `None` unless weights are by sigma.
    precision: Option<Vec<Row>>,
    /// The given standard deviations over the predicted ones, times 1/g' at the prediction; `None` if none are predicted.
    noise: Option<Vec<Row>>,
}

/// Largest number of samples whose geometry is kept: it takes 80 bytes per sample.
const KEPT_SAMPLES: usize = 20_000;

impl<'a> Observed<'a> {
    /// Prepares the samples in all channels that are not dead.
    pub(in crate::fit) fn new(samples: &'a Samples, metric: Metric) -> Self {
        Self::with_channels(samples, metric, |channel| !samples.dead[channel])
    }

    /// Prepares the samples in the channels that are dead.
    pub(in crate::fit) fn of_dead_channels(samples: &'a Samples, metric: Metric) -> Self {
        Self::with_channels(samples, metric, |channel| samples.dead[channel])
    }

    /// Prepares the samples in at most `most` channels, spread evenly over those that are not dead.
    pub(in crate::fit) fn with_some_channels(samples: &'a Samples, metric: Metric, most: usize) -> Self {
        let live: Vec<usize> = (0..samples.values.len()).filter(|channel| !samples.dead[*channel]).collect();
        let all = live.len();
        // The first and the last channel, and evenly spaced ones between them.
        let chosen: Vec<usize> = if all <= most {
            live
        } else {
            (0..most).map(|index| live[index * (all - 1) / (most - 1).max(1)]).collect()
        };
        Self::with_channels(samples, metric, |channel| chosen.contains(&channel))
    }

    fn with_channels(samples: &'a Samples, metric: Metric, counts: impl Fn(usize) -> bool) -> Self {
        let channels: Vec<usize> = (0..samples.values.len()).filter(|channel| counts(*channel)).collect();
        let total = samples.weight_of(&channels);
        let normalisation = match samples.sigma {
            None if total > 0.0 => 1.0 / total,
            // None of a few samples may have a value in these channels.
            _ => 1.0,
        };
        let roots: Vec<Row> = samples
            .weights
            .par_chunks(BLOCK)
            .map(|weights| {
                let mut roots = row(weights, 0.0);
                roots.iter_mut().for_each(|root| *root = (*root * normalisation).sqrt());
                roots
            })
            .collect();
        let mut observed = Self { samples, targets: Vec::new(), roots, blocks: Vec::new(), magnitude2: 0.0 };
        if samples.len() <= KEPT_SAMPLES {
            let block = |index| observed.block(index, &mut Block::new()).clone();
            observed.blocks = (0..observed.roots.len()).map(block).collect();
        }
        // The geometry of many samples is not kept, but their cosines are needed for every channel.
        let cosines: Vec<Row> = (0..observed.roots.len())
            .into_par_iter()
            .map_init(Block::new, |space, index| *observed.block(index, space).cos_i())
            .collect();
        let target = |channel| counts(channel).then(|| observed.target(metric, channel, &cosines));
        observed.targets = (0..samples.values.len()).map(target).collect();
        observed.magnitude2 =
            observed.targets.iter().flatten().map(|target| target.magnitude2(&observed.roots)).sum();
        observed
    }

    /// The values that the model is compared with in a channel.
    fn target(&self, metric: Metric, channel: usize, cosines: &[Row]) -> Target {
        let samples = self.samples;
        let gaps = samples.missing[channel] > 0;
        let values = samples.filled(channel, &samples.values[channel], 0.0);
        let weights = gaps.then(|| samples.filled(channel, &samples.weights, 0.0));
        let weights = weights.as_deref().unwrap_or(&samples.weights);
        let (mut measured, sums): (Vec<Row>, Vec<(f64, f64)>) = values
            .par_chunks(BLOCK)
            .zip(weights.par_chunks(BLOCK))
            .zip(cosines)
            .map(|((values, weights), cosines)| {
                let mut x = row(values, 0.0);
                for (x, cos) in x.iter_mut().zip(cosines) {
                    *x = metric.measured(*x * cos);
                }
                let terms = x.iter().zip(weights);
                (
                    x,
                    terms.fold((0.0, 0.0), |(sum, total), (x, weight)| {
                        (sum + x.abs() * weight, total + weight)
                    }),
                )
            })
            .unzip();
        // The sums are added in order, so that the result does not depend on the threads.
        let (sum, total) = sums.iter().fold((0.0, 0.0), |(sum, total), (s, t)| (sum + s, total + t));
        let noise_floor = samples.predicted.noise_floor(channel);
        let transform = metric.transform(sum / total, noise_floor);
        let arch = Arch::new();
        let predicted = (metric == Metric::UnbiasedCbrt).then(|| {
            let of_block = |(values, cosines): (&[f64], &Row)| {
                let mut x = row(values, 0.0);
                x.iter_mut().zip(cosines).for_each(|(x, cos)| *x *= cos);
                arch.dispatch(Transformed { transform, x: &mut x });
                x
            };
            let values = samples.filled(channel, &samples.predicted.values[channel], 0.0);
            values.par_chunks(BLOCK).zip(cosines).map(of_block).collect::<Vec<Row>>()
        });
        let precision = samples.sigma.as_ref().map(|sigma| {
            let sigma = match &samples.predicted.sigma {
                Some(predicted) if metric == Metric::UnbiasedCbrt => &predicted[channel],
                _ => &sigma[channel],
            };
            let sigma = samples.filled(channel, sigma, 1.0);
            let of_block = |(index, ((x, sigma), cosines)): (usize, ((&Row, &[f64]), &Row))| {
                let (mut transformed, mut slopes) = (Row::filled(0.0), Row::filled(0.0));
                match &predicted {
                    Some(rows) => slopes
                        .iter_mut()
                        .zip(&rows[index])
                        .for_each(|(slope, p)| *slope = 1.0 / (3.0 * p * p)),
                    None => {
                        let zero = Row::filled(0.0);
                        let wanted = Wanted { measured: &zero, predicted: &zero };
                        transform.differences(x, wanted, &mut transformed, &mut slopes, None);
                    }
                }
                let mut precision = row(sigma, 1.0);
                let entries = precision.iter_mut().zip(&slopes).zip(cosines);
                entries.for_each(|((entry, slope), cos)| *entry = 1.0 / (*entry * cos * slope));
                precision
            };
            measured.par_iter().zip(sigma.par_chunks(BLOCK)).zip(cosines).enumerate().map(of_block).collect()
        });
        let noise = match (&samples.sigma, &samples.predicted.sigma, &predicted) {
            (Some(given), Some(foreseen), Some(rows)) => {
                let [given, foreseen] =
                    [given, foreseen].map(|sigma| samples.filled(channel, &sigma[channel], 1.0));
                let blocks = given.chunks(BLOCK).zip(foreseen.chunks(BLOCK)).zip(rows);
                let of_block = |((given, foreseen), p): ((&[f64], &[f64]), &Row)| {
                    let (mut noise, foreseen) = (row(given, 0.0), row(foreseen, 1.0));
                    for ((noise, foreseen), p) in noise.iter_mut().zip(&foreseen).zip(p) {
                        *noise *= 3.0 * p * p / foreseen;
                    }
                    noise
                };
                Some(blocks.map(of_block).collect())
            }
            _ => None,
        };
        measured.par_iter_mut().for_each(|x| arch.dispatch(Transformed { transform, x }));
        let roots = gaps.then(|| self.roots_with_gaps(channel));
        Target { transform, roots, measured, predicted, precision, noise }
    }

    /// The roots of a channel in which values are missing.
    fn roots_with_gaps(&self, channel: usize) -> Vec<Row> {
        let of_block = |(values, roots): (&[f64], &Row)| {
            let mut own = *roots;
            let missing = own.iter_mut().zip(values).filter(|(_, value)| value.is_nan());
            missing.for_each(|(root, _)| *root = 0.0);
            own
        };
        self.samples.values[channel].chunks(BLOCK).zip(&self.roots).map(of_block).collect()
    }

    /// Whether weights follow from other standard deviations than those given.
    pub(in crate::fit) fn has_noise(&self) -> bool {
        self.targets.iter().flatten().any(|target| target.noise.is_some())
    }

    /// Number of samples.
    pub(in crate::fit) fn len(&self) -> usize {
        self.samples.len()
    }

    /// Number of channels, including those that do not count.
    pub(in crate::fit) fn channels(&self) -> usize {
        self.targets.len()
    }

    /// Whether a channel counts.
    pub(in crate::fit) fn counts(&self, channel: usize) -> bool {
        self.targets[channel].is_some()
    }

    /// Number of residuals: one for each value that was measured.
    pub(in crate::fit) fn residuals(&self) -> usize {
        let of_channel = |(target, missing): (&Option<Target>, &usize)| {
            target.as_ref().map_or(0, |_| self.len() - missing)
        };
        self.targets.iter().zip(&self.samples.missing).map(of_channel).sum()
    }

    /// Whether each value of a block of a channel was measured.
    pub(in crate::fit) fn measured(&self, channel: usize, index: usize) -> impl Iterator<Item = bool> {
        self.samples.values[channel][range(self.samples, index)].iter().map(|value| !value.is_nan())
    }

    /// Sum of the squares of the measured values, weighted and transformed like the residuals.
    pub(in crate::fit) fn magnitude2(&self) -> f64 {
        self.magnitude2
    }

    /// The geometry of a block; computed in `space` if it is not kept.
    pub(in crate::fit) fn block<'b>(&'b self, index: usize, space: &'b mut Block) -> &'b Block {
        if !self.blocks.is_empty() {
            return &self.blocks[index];
        }
        self.samples.directions.fill(range(self.samples, index), space);
        space
    }

    /// The weights of a block's samples.
    pub(in crate::fit) fn weights(&self, index: usize) -> &[f64] {
        &self.samples.weights[range(self.samples, index)]
    }

    /// The measured values of a channel of a block; `None` if the channel does not count.
    pub(super) fn channel_block(&self, channel: usize, index: usize) -> Option<ObservedBlock<'_>> {
        self.targets[channel].as_ref().map(|target| ObservedBlock {
            transform: target.transform,
            wanted: Wanted {
                measured: &target.measured[index],
                predicted: target.predicted.as_ref().map_or(&target.measured[index], |rows| &rows[index]),
            },
            roots: &target.roots.as_ref().unwrap_or(&self.roots)[index],
            precision: target.precision.as_ref().map(|rows| &rows[index]),
            noise: target.noise.as_ref().map(|rows| &rows[index]),
        })
    }

    /// The magnitude below which `fraction` of the measured values lie, in the units of a loss's scale. All values
    /// count equally, whatever their weights.
    pub(in crate::fit) fn quantile(&self, fraction: f64) -> f64 {
        let of_target = |(target, values): (&Option<Target>, &Vec<f64>)| -> Vec<(f64, f64)> {
            let Some(target) = target else { return Vec::new() };
            let mut rows = target.measured.clone();
            if let Some(precision) = &target.precision {
                let scaled = rows.iter_mut().flatten().zip(precision.iter().flatten());
                scaled.for_each(|(value, precision)| *value *= precision);
            }
            let measured = rows.iter().flatten().zip(values).filter(|(_, value)| !value.is_nan());
            measured.map(|(g, _)| (g.abs(), 1.0)).collect()
        };
        let mut values: Vec<(f64, f64)> =
            self.targets.iter().zip(&self.samples.values).flat_map(of_target).collect();
        weighted_quantile(&mut values, fraction)
    }
}

impl Target {
    /// Sum of the squares of the measured values, weighted and transformed like the residuals.
    fn magnitude2(&self, roots: &[Row]) -> f64 {
        let roots = self.roots.as_deref().unwrap_or(roots);
        assert_eq!(roots.len(), self.measured.len(), "number of blocks");
        let of_block = |(index, (measured, roots)): (usize, (&Row, &Row))| {
            let precision = self.precision.as_ref().map(|rows| &rows[index]);
            let weighted = measured.iter().zip(roots).enumerate().map(|(i, (g, root))| {
                let precision = precision.map_or(1.0, |row| row[i]);
                (root * precision * g).powi(2)
            });
            weighted.sum::<f64>()
        };
        self.measured.iter().zip(roots).enumerate().map(of_block).sum()
    }
}

/// Replaces measured values x* by g(x*).
struct Transformed<'a> {
    transform: Transform,
    x: &'a mut Row,
}

impl WithSimd for Transformed<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.transform.apply_to(self.x);
    }
}

/// The indices of the samples of a block.
fn range(samples: &Samples, index: usize) -> std::ops::Range<usize> {
    index * BLOCK..samples.len().min((index + 1) * BLOCK)
}

/// A row that begins with `values` and is filled with `rest`.
pub(in crate::fit) fn row(values: &[f64], rest: f64) -> Row {
    assert!(values.len() <= BLOCK, "{} values for a row", values.len());
    let mut row = Row::filled(rest);
    row.iter_mut().zip(values).for_each(|(entry, value)| *entry = *value);
    row
}
