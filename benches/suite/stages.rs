//! Where the time of a fit to a full table goes on one thread, and what each stage would take at the limits of the
//! machine (a roofline: Williams, Waterman and Patterson 2009, doi:10.1145/1498765.1498785).
//!
//! A stage can be no faster than its traffic with the memory, its divisions and square roots, or its other
//! arithmetic allow, whichever takes longest. The three limits are measured here, on this machine; what a stage does
//! per sample is counted by hand from its formulas, and is to be counted again when they change.

use super::inputs::{self, ONE_LOBE, load, parameters};
use super::timing::{as_f64, with_threads};
use super::{Setup, markdown};
use brdfit::fit::{Metric, ReflectanceProblem};
use brdfit::geometry::{Azimuths, BLOCK, Block, Row};
use brdfit::measurement::{Filters, Measurement, Samples};
use brdfit::model::{BasisBlock, Derivatives, Expression};
use brdfit::solver::LeastSquares;
use nalgebra::DVector;
use pulp::{Arch, Simd, WithSimd};
use sha2::{Digest, Sha256};
use std::hint::black_box;

/// What a stage does, per sample.
#[derive(Clone, Copy, Default)]
struct Work {
    /// From and to memory; what stays in the caches does not count.
    bytes: f64,
    divisions: f64,
    roots: f64,
    /// Additions, multiplications, comparisons and choices.
    operations: f64,
}

/// Directions of cells of one ring: sines and cosines of the ring and the azimuth are at hand.
const GEOMETRY: Work = Work { bytes: 4.0, divisions: 0.0, roots: 0.0, operations: 10.0 };

/// The basis of [`ONE_LOBE`] with the derivatives with respect to m: the visibility takes 31 operations, a root for each
/// direction, a division for their slopes and one for both, the products 8; the density and Schlick's factors are
/// evaluated once per ring, Lambert's factor is constant.
const BASIS: Work = Work { bytes: 0.0, divisions: 2.0, roots: 2.0, operations: 39.0 };

/// Per channel: reflectance and residual 10, weighted slopes 2, three columns of the Jacobian 8, reflections of
/// four columns 32 (an inner product, and for each later column another and a subtraction). It reads the measured value
/// and a third of the weight.
const CHANNEL: Work = Work { bytes: 8.0 + 8.0 / 3.0, divisions: 0.0, roots: 0.0, operations: 52.0 };

/// What a metric's transform and its slope add per channel. An inverse cube root takes 26 operations, ln(1 + x) about
/// 30 and two divisions.
fn transform(metric: Metric) -> Work {
    match metric {
        Metric::L2 => Work::default(),
        Metric::Log => Work { divisions: 3.0, operations: 31.0, ..Work::default() },
        Metric::Cbrt => Work { operations: 34.0, ..Work::default() },
        _ => unreachable!("{metric:?} is not counted"),
    }
}

impl Work {
    fn and(self, other: Self) -> Self {
        Self {
            bytes: self.bytes + other.bytes,
            divisions: self.divisions + other.divisions,
            roots: self.roots + other.roots,
            operations: self.operations + other.operations,
        }
    }

    fn times(self, n: f64) -> Self {
        Self {
            bytes: self.bytes * n,
            divisions: self.divisions * n,
            roots: self.roots * n,
            operations: self.operations * n,
        }
    }
}

/// What one thread of the machine can do, in nanoseconds.
struct Limits {
    byte: f64,
    division: f64,
    root: f64,
    operation: f64,
}

impl Limits {
    /// The least time that the work takes. Divisions and roots share a unit, apart from those of other operations.
    fn least(&self, work: Work) -> f64 {
        let divider = work.divisions * self.division + work.roots * self.root;
        (work.bytes * self.byte).max(divider).max(work.operations * self.operation)
    }
}

pub fn table(setup: &Setup) -> String {
    with_threads(1, || one_thread(setup))
}

fn one_thread(setup: &Setup) -> String {
    let effort = setup.effort;
    let limits = measure_limits(setup);
    let path = setup.inputs.table();
    let bytes = std::fs::read(path).unwrap();
    let measurement = load(path);
    let samples = Samples::select(&measurement, &Filters::default()).unwrap();
    let n = as_f64(samples.len());
    let channels = as_f64(samples.values.len());

    let mut rows = Vec::new();
    let mut add = |stage: &str, nanoseconds: f64, work: Option<Work>| {
        let mut row = vec![stage.to_owned(), format!("{:.2}", nanoseconds / n)];
        row.extend(match work {
            Some(work) => {
                let least = limits.least(work);
                let counts = [work.bytes, work.divisions, work.roots, work.operations];
                let counts = counts.into_iter().map(|count| format!("{count:.0}"));
                counts
                    .chain([format!("{least:.2}"), format!("{:.1}", nanoseconds / n / least)])
                    .collect::<Vec<_>>()
            }
            None => vec![String::new(); 6],
        });
        rows.push(row);
    };

    let cell = |measurement: &Measurement| 4.0 + 8.0 * as_f64(measurement.values.len());
    let held = as_f64(measurement.directions.len()) * cell(&measurement);
    let read = Work { bytes: (as_f64(bytes.len()) + held) / n, ..Work::default() };
    add("reading the file, once", effort.nanoseconds(|| load(path)), Some(read));
    add("of that, its hash", effort.nanoseconds(|| Sha256::digest(&bytes)), None);
    let selected = Work { bytes: held / n + cell(&measurement) + 8.0, ..Work::default() };
    let selecting = effort.nanoseconds(|| Samples::select(&measurement, &Filters::default()).unwrap());
    add("selecting the samples, once", selecting, Some(selected));
    drop((measurement, bytes));

    // The stages of a pass are inside each other: each adds to the one before.
    let geometry = effort.nanoseconds(|| in_blocks(&samples, |_| ()));
    add("geometry", geometry, Some(GEOMETRY));
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let table = parameters(&expression, samples.values.len(), samples.directions.azimuths());
    let values = table.formula_values(0);
    let mut bases = vec![BasisBlock::default(); values.len()];
    let with_basis = effort.nanoseconds(|| {
        in_blocks(&samples, |block| {
            for ((lobe, values), basis) in expression.lobes().iter().zip(&values).zip(&mut bases) {
                basis.forget();
                lobe.model.evaluate(block, &values.shapes, Derivatives::All, basis);
            }
            black_box(&mut bases);
        });
    });
    add("basis and its derivatives", with_basis - geometry, Some(BASIS));
    let x = DVector::from_vec(table.coordinates());
    for metric in Metric::ALL {
        let problem = ReflectanceProblem::new(&expression, &samples, table.clone(), metric);
        let pass = effort.nanoseconds(|| problem.linearise(&x));
        let work = CHANNEL.and(transform(metric)).times(channels);
        add(&format!("three channels, {}", metric.name()), pass - with_basis, Some(work));
    }
    add("setting up and merging, once per pass", beside_the_samples(setup), None);

    let head = [
        "stage",
        "ns per sample",
        "bytes",
        "divisions",
        "roots",
        "other operations",
        "least ns",
        "times the least",
    ];
    format!(
        "{} samples of {} used, `{ONE_LOBE}`, one thread. The machine's limits, measured: {:.1} GB/s from memory; \
         {:.2} ns for a division, {:.2} ns for a square root, {:.3} ns for another operation on one number \
         of a row.\n\n{}",
        samples.len(),
        inputs::name(path),
        1.0 / limits.byte,
        limits.division,
        limits.root,
        limits.operation,
        markdown(&head, &rows)
    )
}

/// Fills one block after another.
fn in_blocks(samples: &Samples, mut work: impl FnMut(&Block)) {
    let mut block = Block::new();
    for range in samples.directions.blocks() {
        samples.directions.fill(range, &mut block);
        work(black_box(&block));
    }
}

/// Nanoseconds of a pass that do not grow with the samples: what is left of passes over two sizes, extrapolated
/// to none. Both sizes are divided among as many threads' work as a full table is.
fn beside_the_samples(setup: &Setup) -> f64 {
    let expression = Expression::parse(ONE_LOBE).unwrap();
    let pass = |samples: usize| {
        let measurement = inputs::scattered(&expression, samples, 3);
        let samples = Samples::select(&measurement, &Filters::default()).unwrap();
        let table = parameters(&expression, 3, Azimuths::Several);
        let x = DVector::from_vec(table.coordinates());
        let problem = ReflectanceProblem::new(&expression, &samples, table, Metric::L2);
        setup.effort.nanoseconds(|| problem.linearise(&x))
    };
    let (small, large) = (pass(1 << 15), pass(1 << 16));
    (2.0 * small - large).max(0.0)
}

fn measure_limits(setup: &Setup) -> Limits {
    /// Far beyond the last cache that a virtual machine may count on.
    const LARGE: usize = 32 << 20;
    let numbers = vec![1.0_f64; LARGE];
    let arch = Arch::new();
    let sum = setup.effort.nanoseconds(|| arch.dispatch(Sum(black_box(&numbers))));
    let mut row = Row::filled(1.5);
    let mut per_number = |kind: Kind, count: f64| {
        let all = setup.effort.nanoseconds(|| arch.dispatch(Repeated { kind, row: black_box(&mut row) }));
        all / (as_f64(BLOCK) * count)
    };
    Limits {
        byte: sum / as_f64(LARGE * size_of::<f64>()),
        division: per_number(Kind::Division, 1.0),
        root: per_number(Kind::Root, 1.0),
        operation: per_number(Kind::Polynomial, as_f64(2 * DEGREE)),
    }
}

/// The sum of numbers in strands that do not wait for each other.
struct Sum<'a>(&'a [f64]);

impl WithSimd for Sum<'_> {
    type Output = [f64; 64];

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> [f64; 64] {
        let mut strands = [0.0; 64];
        for chunk in self.0.as_chunks::<64>().0 {
            strands.iter_mut().zip(chunk).for_each(|(strand, value)| *strand += value);
        }
        strands
    }
}

#[derive(Clone, Copy)]
enum Kind {
    Division,
    Root,
    Polynomial,
}

/// Multiplications, and additions, of the polynomial.
const DEGREE: usize = 24;

/// The same operation on every number of a row.
struct Repeated<'a> {
    kind: Kind,
    row: &'a mut Row,
}

impl WithSimd for Repeated<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        match self.kind {
            Kind::Division => self.row.iter_mut().for_each(|x| *x = 2.0 / *x),
            Kind::Root => self.row.iter_mut().for_each(|x| *x = x.sqrt()),
            // Stays between 0.5 and 1 from there on.
            Kind::Polynomial => self.row.iter_mut().for_each(|x| {
                *x = (0..DEGREE).fold(0.5, |sum, _| sum * *x + 0.5);
            }),
        }
    }
}
