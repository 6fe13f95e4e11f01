//! Every error of docs/conventions.md, whichever was fitted.

use super::metric::Metric;
use super::parameters::ParameterTable;
use super::problem::add_scaled;
use crate::geometry::{BLOCK, Block};
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{BasisBlock, Expression};
use rayon::prelude::*;

/// The errors between model and measurement. docs/conventions.md defines each.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Root mean square of x - x*, x = f cos(theta_i).
    pub l2: f64,
    /// The same of ln(1 + x).
    pub log: f64,
    /// The same of cbrt(x).
    pub cbrt: f64,
    /// Mean |ln((F q + e)/(F* q + e))|, F = max(f, 0), q = max(cos_i cos_o, e), e = 1e-3.
    pub log_ratio: f64,
    /// Sum |x - x*| / sum x*; none where the denominator is not positive.
    pub relative: Option<f64>,
}

/// Errors of all channels together and of each.
#[derive(Clone, Debug)]
pub struct ErrorTable {
    /// All channels together.
    pub all: Errors,
    /// Per channel.
    pub by_channel: Vec<Errors>,
}

/// The offset of the logarithms' arguments in `log_ratio`.
const LOG_RATIO_OFFSET: f64 = 1e-3;

/// Weighted sums over samples, of one channel.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: [f64; 3],
    log_ratio: f64,
    difference: f64,
    measured: f64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        for (sum, part) in self.squares.iter_mut().zip(other.squares) {
            *sum += part;
        }
        self.log_ratio += other.log_ratio;
        self.difference += other.difference;
        self.measured += other.measured;
    }

    fn errors(&self, weight: f64) -> Errors {
        let [l2, log, cbrt] = self.squares.map(|sum| (sum / weight).sqrt());
        Errors {
            l2,
            log,
            cbrt,
            log_ratio: self.log_ratio / weight,
            relative: (self.measured > 0.0).then(|| self.difference / self.measured),
        }
    }
}

/// Compares the model at the values in `table` with the samples.
#[must_use]
pub fn score(expression: &Expression, samples: &Samples, table: &ParameterTable) -> ErrorTable {
    let channels = samples.values.len();
    let all_values: Vec<_> = (0..channels).map(|channel| table.formula_values(channel)).collect();
    let ranges: Vec<_> = samples.directions.blocks().collect();
    // Groups of blocks in a fixed division, summed in order.
    let partial: Vec<Vec<Sums>> = ranges
        .par_chunks(64)
        .map(|ranges| {
            let mut sums = vec![Sums::default(); channels];
            let mut block = Block::new();
            let mut bases = vec![BasisBlock::default(); expression.lobes().len()];
            let mut f = Vec::with_capacity(BLOCK);
            for range in ranges {
                samples.directions.fill(range.clone(), &mut block);
                for ((channel, values), measured) in all_values.iter().enumerate().zip(&samples.values) {
                    f.clear();
                    f.resize(block.len(), 0.0);
                    let lobes = expression.lobes().iter().zip(values).zip(&mut bases).enumerate();
                    for (index, ((lobe, (shapes, amplitudes)), basis)) in lobes {
                        // Channels with the same shapes share the basis of the one before.
                        let before = channel.checked_sub(1).and_then(|c| all_values.get(c)?.get(index));
                        if before.is_none_or(|(earlier, _)| earlier != shapes) {
                            lobe.model.evaluate(&block, shapes, basis);
                        }
                        let coefficients = lobe.model.coefficients(amplitudes).values;
                        for (row, coefficient) in basis.values.iter().zip(coefficients) {
                            add_scaled(&mut f, row, coefficient);
                        }
                    }
                    let Some(sum) = sums.get_mut(channel) else { continue };
                    let weights = samples.weights.get(range.clone()).unwrap_or_default();
                    let measured = measured.get(range.clone()).unwrap_or_default();
                    for (((g, f), measured), w) in block.samples().iter().zip(&f).zip(measured).zip(weights) {
                        accumulate(sum, *w, g.cos_i(), g.cos_o(), *f, *measured);
                    }
                }
            }
            sums
        })
        .collect();
    let mut sums = vec![Sums::default(); channels];
    for part in &partial {
        sums.iter_mut().zip(part).for_each(|(sum, part)| sum.add(part));
    }
    let weight: f64 = samples.weights.iter().sum();
    let mut all = Sums::default();
    sums.iter().for_each(|sum| all.add(sum));
    ErrorTable {
        all: all.errors(weight * count(channels)),
        by_channel: sums.iter().map(|sum| sum.errors(weight)).collect(),
    }
}

fn accumulate(sums: &mut Sums, weight: f64, cos_i: f64, cos_o: f64, f: f64, measured: f64) {
    let (x, target) = (f * cos_i, measured * cos_i);
    for (sum, metric) in sums.squares.iter_mut().zip(Metric::ALL) {
        let difference = metric.exact(x) - metric.exact(metric.measured(target));
        *sum += weight * difference * difference;
    }
    let q = (cos_i * cos_o).max(LOG_RATIO_OFFSET);
    let argument = |f: f64| f.max(0.0) * q + LOG_RATIO_OFFSET;
    sums.log_ratio += weight * (argument(f) / argument(measured)).ln().abs();
    sums.difference += weight * (x - target).abs();
    sums.measured += weight * target;
}
