//! Computes every error of docs/use/conventions.md, whichever of them was fitted.

use crate::fit::problem::formula::{Term, reflectance};
use crate::fit::problem::kernels::sum;
use crate::fit::problem::metric::{Metric, Transform, Wanted};
use crate::fit::problem::observed::row;
use crate::geometry::{Block, Row};
use crate::math::{Real, Scalar};
use crate::measurement::Samples;
use crate::model::{BasisBlock, Derivatives, Expression};
use crate::parameters::ParameterTable;
use crate::solver::triangle::dot;
use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

/// The errors between model and measurement, as docs/use/conventions.md defines them.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Root mean square of x - x*, x = f cos(theta_i).
    pub l2: f64,
    /// Root mean square of the differences of ln(1 + x).
    pub log: f64,
    /// Root mean square of the differences of cbrt(x).
    pub cbrt: f64,
    /// The root mean square of what `unbiased-cbrt` minimises.
    pub unbiased_cbrt: f64,
    /// Mean |ln((F q + e)/(F* q + e))|, F = max(f, 0), q = max(cos_i cos_o, e), e = 1e-3.
    pub log_ratio: f64,
    /// Sum |x - x*| / sum x*; `None` if the denominator is not positive.
    pub relative: Option<f64>,
}

impl Errors {
    /// The error that a fit in `metric` minimises.
    #[must_use]
    pub fn in_metric(&self, metric: Metric) -> f64 {
        match metric {
            Metric::L2 => self.l2,
            Metric::Log => self.log,
            Metric::Cbrt => self.cbrt,
            Metric::UnbiasedCbrt => self.unbiased_cbrt,
        }
    }
}

/// The errors of all channels together and of each channel.
#[derive(Clone, Debug)]
pub struct ErrorTable {
    /// The errors of all channels together, apart from dead ones.
    pub all: Errors,
    /// The errors of each channel; NaN if none of its values was measured at the samples compared.
    pub by_channel: Vec<Errors>,
}

/// The offset of the logarithms' arguments in `log_ratio`.
const LOG_RATIO_OFFSET: f64 = 1e-3;

/// Weighted sums over the samples of one channel.
#[derive(Clone, Copy, Default)]
struct Sums {
    squares: [f64; 4],
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
        let [l2, log, cbrt, unbiased_cbrt] = self.squares.map(|sum| (sum / weight).sqrt());
        Errors {
            l2,
            log,
            cbrt,
            unbiased_cbrt,
            log_ratio: self.log_ratio / weight,
            relative: (self.measured > 0.0).then(|| self.difference / self.measured),
        }
    }
}

/// What errors are computed from, so that those on several sets of samples can be put together.
#[derive(Clone, Copy, Default)]
pub(super) struct Tally {
    sums: Sums,
    weight: f64,
}

impl Tally {
    /// Compares the model at the values in `table` with the samples, all channels together apart from dead ones.
    pub(super) fn new(expression: &Expression, samples: &Samples, table: &ParameterTable) -> Self {
        Self::of_live(&by_channel(expression, samples, table, None), samples)
    }

    fn of_live(sums: &[Sums], samples: &Samples) -> Self {
        let live: Vec<usize> = (0..sums.len()).filter(|channel| !samples.dead[*channel]).collect();
        let mut all = Sums::default();
        live.iter().for_each(|channel| all.add(&sums[*channel]));
        Self { sums: all, weight: samples.weight_of(&live) }
    }

    /// Adds other samples.
    pub(super) fn add(&mut self, other: &Self) {
        self.sums.add(&other.sums);
        self.weight += other.weight;
    }

    /// The errors on all samples added; NaN if there are none.
    pub(super) fn errors(&self) -> Errors {
        self.sums.errors(self.weight)
    }
}

/// Compares the model at the values in `table` with the samples.
#[must_use]
pub fn score(expression: &Expression, samples: &Samples, table: &ParameterTable) -> ErrorTable {
    score_but(expression, samples, table, None)
}

/// The same, where `known` has the mean square in `unbiased-cbrt` of each channel, over all its values, if that is known.
pub(super) fn score_but(
    expression: &Expression,
    samples: &Samples,
    table: &ParameterTable,
    known: Option<&[f64]>,
) -> ErrorTable {
    let sums = by_channel(expression, samples, table, known);
    let weights = samples.weights_by_channel();
    ErrorTable {
        all: Tally::of_live(&sums, samples).errors(),
        by_channel: sums.iter().zip(weights).map(|(sum, weight)| sum.errors(weight)).collect(),
    }
}

/// The sums of each channel, for [`score_but`].
fn by_channel(
    expression: &Expression,
    samples: &Samples,
    table: &ParameterTable,
    known: Option<&[f64]>,
) -> Vec<Sums> {
    let channels = samples.values.len();
    assert_eq!(samples.predicted.values.len(), channels, "predictions of every channel");
    let all_values: Vec<_> = (0..channels).map(|channel| table.formula_values(channel)).collect();
    let terms: Vec<Vec<Term>> = all_values
        .iter()
        .map(|values| {
            let lobes = expression.lobes().iter().zip(values);
            let coefficients = lobes.map(|(lobe, values)| lobe.coefficients(&values.amplitudes));
            reflectance(&coefficients.collect::<Vec<_>>())
        })
        .collect();
    let ranges: Vec<_> = samples.directions.blocks().collect();
    let mut prepared = Vec::new();
    expression.prepare(&all_values, |_| Derivatives::None, &mut prepared);
    let arch = Arch::new();
    // Blocks are grouped in a fixed way and the groups are summed in order, so that the result does not depend on the
    // threads.
    let partial: Vec<Vec<Sums>> = ranges
        .par_chunks(BLOCKS_PER_GROUP)
        .map(|ranges| {
            let mut sums = vec![Sums::default(); channels];
            let mut block = Block::new();
            let mut bases = prepared.clone();
            for range in ranges {
                samples.directions.fill(range.clone(), &mut block);
                bases.iter_mut().for_each(BasisBlock::forget);
                let weights = row(&samples.weights[range.clone()], 0.0);
                let predicted = samples.predicted.values.iter().zip(&samples.predicted.noise_floors);
                let of_channels =
                    all_values.iter().zip(&terms).zip(&samples.values).zip(predicted).zip(&mut sums);
                for (channel, ((((values, terms), measured), (predicted, noise_floor)), sums)) in
                    of_channels.enumerate()
                {
                    for ((lobe, values), basis) in expression.lobes().iter().zip(values).zip(&mut bases) {
                        lobe.model.evaluate(&block, &values.shapes, Derivatives::None, basis);
                    }
                    let mut measured = row(&measured[range.clone()], 0.0);
                    let mut predicted = row(&predicted[range.clone()], 0.0);
                    let mut own_weights = weights;
                    if samples.missing[channel] > 0 {
                        leave_out_missing(&mut measured, [&mut predicted, &mut own_weights]);
                    }
                    let transform = Metric::UnbiasedCbrt.transform(0.0, *noise_floor);
                    let part = Comparison {
                        block: &block,
                        bases: &bases,
                        terms,
                        measured: &measured,
                        unbiased: known.is_none().then_some((&predicted, transform)),
                        weights: &own_weights,
                    };
                    sums.add(&arch.dispatch(part));
                }
            }
            sums
        })
        .collect();
    let mut sums = vec![Sums::default(); channels];
    for part in &partial {
        sums.iter_mut().zip(part).for_each(|(sum, part)| sum.add(part));
    }
    if let Some(known) = known {
        for ((sums, known), weight) in sums.iter_mut().zip(known).zip(samples.weights_by_channel()) {
            sums.squares[3] = known * weight;
        }
    }
    sums
}

/// Puts 0 in the place of measured values that are missing, and of what belongs to them.
fn leave_out_missing(measured: &mut Row, [predicted, weights]: [&mut Row; 2]) {
    for ((measured, predicted), weight) in measured.iter_mut().zip(predicted).zip(weights) {
        if measured.is_nan() {
            (*measured, *predicted, *weight) = (0.0, 0.0, 0.0);
        }
    }
}

/// Number of blocks that one thread sums at a time.
const BLOCKS_PER_GROUP: usize = 64;

/// One channel of one block of samples.
struct Comparison<'a> {
    block: &'a Block,
    bases: &'a [BasisBlock],
    terms: &'a [Term],
    measured: &'a Row,
    /// The predicted f and the transform of `unbiased-cbrt`; `None` if its error is known.
    unbiased: Option<(&'a Row, Transform)>,
    /// The weights; 0 if there is no sample, or no value of it in the channel.
    weights: &'a Row,
}

impl WithSimd for Comparison<'_> {
    type Output = Sums;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Sums {
        let Self { block, bases, terms, measured, weights, unbiased } = self;
        let (mut f, mut x, mut target) = (Row::filled(0.0), Row::filled(0.0), Row::filled(0.0));
        sum(bases, terms, &mut f);
        let samples = x.iter_mut().zip(&mut target).zip(&f).zip(measured).zip(block.cos_i());
        for ((((x, target), f), measured), cos_i) in samples {
            *x = f * cos_i;
            *target = measured * cos_i;
        }
        let mut squares = [0.0; 4];
        for (sum, metric) in squares.iter_mut().zip([Metric::L2, Metric::Log, Metric::Cbrt]) {
            let (mut model, mut wanted) = (x, Row::filled(0.0));
            for (wanted, target) in wanted.iter_mut().zip(&target) {
                *wanted = metric.measured(*target);
            }
            metric.apply_exactly(&mut model);
            metric.apply_exactly(&mut wanted);
            for (model, wanted) in model.iter_mut().zip(&wanted) {
                *model = (*model - wanted) * (*model - wanted);
            }
            *sum = dot(&model, weights);
        }
        if let Some((predicted, transform)) = unbiased {
            let mut predicted_x = Row::filled(0.0);
            for ((x, f), cos_i) in predicted_x.iter_mut().zip(predicted).zip(block.cos_i()) {
                *x = f * cos_i;
            }
            let mut measured_x = target;
            transform.apply_to(&mut predicted_x);
            transform.apply_to(&mut measured_x);
            let wanted = Wanted { measured: &measured_x, predicted: &predicted_x };
            let mut costs = Row::filled(0.0);
            transform.differences(&x, wanted, &mut Row::filled(0.0), &mut Row::filled(0.0), Some(&mut costs));
            squares[3] = dot(&costs, weights);
        }

        let (mut ratios, mut differences) = (Row::filled(0.0), Row::filled(0.0));
        let samples = ratios.iter_mut().zip(&f).zip(measured).zip(block.cos_i()).zip(block.cos_o());
        for ((((ratio, f), measured), cos_i), cos_o) in samples {
            let q = (cos_i * cos_o).greater(LOG_RATIO_OFFSET);
            let (modelled, measured) = (f.greater(0.0) * q, measured.greater(0.0) * q);
            *ratio = Scalar::ln((modelled + LOG_RATIO_OFFSET) / (measured + LOG_RATIO_OFFSET)).abs();
        }
        for ((difference, x), target) in differences.iter_mut().zip(&x).zip(&target) {
            *difference = (x - target).abs();
        }
        Sums {
            squares,
            log_ratio: dot(&ratios, weights),
            difference: dot(&differences, weights),
            measured: dot(&target, weights),
        }
    }
}
