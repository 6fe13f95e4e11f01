//! The samples that a fit uses, and their weights.

use super::Measurement;
use crate::error::Error;
use crate::geometry::{Directions, Geometry};
use crate::math::count;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::collections::BTreeMap;

/// How samples are weighted against each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weighting {
    /// By the solid angle that a grid cell stands for.
    SolidAngle,
    /// All alike.
    Uniform,
    /// By the standard deviation that the file gives for each value.
    Sigma,
}

impl Weighting {
    /// Name on the command line and in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SolidAngle => "solid-angle",
            Self::Uniform => "uniform",
            Self::Sigma => "sigma",
        }
    }
}

/// Which samples count, and how much.
#[derive(Clone, Debug)]
pub struct Filters {
    /// Largest angle of incidence and of viewing, degrees, inclusive.
    pub max_theta_deg: f64,
    /// Weights; by default solid-angle on grids and uniform elsewhere.
    pub weighting: Option<Weighting>,
    /// Use only so many samples, drawn evenly over the measure; all if none.
    pub samples: Option<usize>,
    /// Seed of the draw.
    pub seed: u64,
}

impl Default for Filters {
    fn default() -> Self {
        Self { max_theta_deg: 80.0, weighting: None, samples: None, seed: 0 }
    }
}

/// The samples of a measurement that passed the filters.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Directions per sample.
    pub directions: Directions,
    /// f per channel, per sample, 1/sr.
    pub values: Vec<Vec<f64>>,
    /// Standard deviation of f, where weights are by sigma.
    pub sigma: Option<Vec<Vec<f64>>>,
    /// Weight per sample, beside any from `sigma`; 1 on average.
    pub weights: Vec<f64>,
    /// How the weights came about.
    pub weighting: Weighting,
    /// Samples left out, by reason, in reading or here.
    pub dropped: BTreeMap<&'static str, usize>,
}

/// Room for the rounding of angles that files give in radians or with few digits.
const ANGLE_TOLERANCE_DEG: f64 = 1e-9;

impl Samples {
    /// The samples of `measurement` that pass `filters`.
    ///
    /// # Errors
    /// [`Error::NoSamples`] if none does; [`Error::Usage`] for weights that the data cannot give.
    pub fn select(measurement: &Measurement, filters: &Filters) -> Result<Self, Error> {
        let grid = measurement.directions.is_grid();
        let weighting =
            filters.weighting.unwrap_or(if grid { Weighting::SolidAngle } else { Weighting::Uniform });
        let mut dropped = measurement.dropped.clone();
        let cos_limit = (filters.max_theta_deg + ANGLE_TOLERANCE_DEG).to_radians().cos();
        let within = |cos: f64, sin2: f64| {
            // The cosine settles all but the directions at the limit, where acos has no digits to spare.
            let slack = 1e-6;
            (cos > cos_limit + slack)
                || (cos > cos_limit - slack
                    && sin2.sqrt().atan2(cos).to_degrees() <= filters.max_theta_deg + ANGLE_TOLERANCE_DEG)
        };
        let keep = |g: &Geometry<f64>| within(g.cos_i(), g.sin2_i()) && within(g.cos_o(), g.sin2_o());
        let mut kept = Vec::with_capacity(measurement.directions.len());
        kept.extend(measurement.directions.iter().enumerate().filter(|(_, g)| keep(g)).map(|(i, _)| i));
        let beyond = measurement.directions.len() - kept.len();
        if beyond > 0 {
            *dropped.entry("beyond-max-theta").or_default() += beyond;
        }
        if let Some(wanted) = filters.samples.filter(|wanted| *wanted < kept.len()) {
            *dropped.entry("not-sampled").or_default() += kept.len() - wanted;
            kept = stratified(&kept, wanted, filters.seed);
        }
        if kept.is_empty() {
            return Err(Error::no_samples(&measurement.source.path, &dropped));
        }

        let directions = measurement.directions.select(&kept);
        let gather = |rows: &Vec<Vec<f64>>| -> Vec<Vec<f64>> {
            rows.iter().map(|row| crate::geometry::gather(row, &kept)).collect()
        };
        let sigma = match weighting {
            Weighting::Sigma => Some(gather(usable_sigma(measurement)?)),
            Weighting::SolidAngle | Weighting::Uniform => None,
        };
        let mut weights = match (weighting, &directions) {
            (Weighting::SolidAngle, Directions::Grid { grid, cells }) => {
                cells.iter().map(|&cell| grid.weight(cell)).collect()
            }
            (Weighting::SolidAngle, Directions::Scattered(_)) => {
                return Err(Error::Usage(format!(
                    "{}: --weights solid-angle needs a half/difference grid; scattered directions cover no \
                     known solid angles: use uniform or sigma",
                    measurement.source.path.display()
                )));
            }
            _ => vec![1.0; kept.len()],
        };
        let mean = weights.iter().sum::<f64>() / count(weights.len());
        weights.iter_mut().for_each(|w| *w /= mean);
        Ok(Self { values: gather(&measurement.values), directions, sigma, weights, weighting, dropped })
    }

    /// How many samples there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.directions.len()
    }

    /// Whether there is no sample.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.directions.is_empty()
    }

    /// About `wanted` of the samples, weighted to stand for all of them; all if there are no more.
    ///
    /// Sorted by the half vector's angle to the normal, they are divided into stretches that grow with
    /// that angle, and one is drawn from each with the weight of the stretch: a sharp peak, which may be
    /// a handful of samples among thousands, keeps all of them.
    #[must_use]
    pub fn subset(&self, wanted: usize, seed: u64) -> Self {
        if wanted >= self.len() {
            return self.clone();
        }
        let mut order: Vec<usize> = (0..self.len()).collect();
        // Cells are numbered by theta_h to begin with.
        if !self.directions.is_grid() {
            let sines: Vec<f64> = self.directions.iter().map(|g| g.sin2_h()).collect();
            let sine = |i: &usize| sines.get(*i).copied().unwrap_or(f64::INFINITY);
            order.sort_by(|a, b| sine(a).total_cmp(&sine(b)));
        }
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        // The end of stretch k, n ((k + 1)/wanted)^2, in whole numbers.
        let square = |k: usize| (self.len() as u128 * (k as u128).pow(2)) / (wanted as u128).pow(2);
        let end = |k: usize| usize::try_from(square(k)).unwrap_or(usize::MAX);
        let mut chosen: Vec<(usize, usize)> = Vec::with_capacity(wanted);
        let mut start = 0;
        for stretch in 1..=wanted {
            let end = end(stretch).max(start);
            if end > start
                && let Some(index) = order.get(rng.random_range(start..end))
            {
                chosen.push((*index, end - start));
                start = end;
            }
        }
        chosen.sort_unstable();
        let indices: Vec<usize> = chosen.iter().map(|(index, _)| *index).collect();
        let mut subset = self.at(&indices);
        for (weight, (_, stands_for)) in subset.weights.iter_mut().zip(&chosen) {
            *weight *= count(*stands_for);
        }
        subset
    }

    /// The samples at `indices`.
    pub(crate) fn at(&self, indices: &[usize]) -> Self {
        let gather =
            |rows: &Vec<Vec<f64>>| rows.iter().map(|row| crate::geometry::gather(row, indices)).collect();
        Self {
            directions: self.directions.select(indices),
            values: gather(&self.values),
            sigma: self.sigma.as_ref().map(gather),
            weights: crate::geometry::gather(&self.weights, indices),
            weighting: self.weighting,
            dropped: self.dropped.clone(),
        }
    }
}

/// `wanted` of `from`, one drawn from each of as many equal stretches: neighbours in a file are
/// neighbours in direction, so every region keeps its share.
///
/// Files that list their samples in a regular pattern cannot alias with the stretches, because the draw
/// within each is random; scattered files are shuffled by their author or not, and lose nothing.
fn stratified(from: &[usize], wanted: usize, seed: u64) -> Vec<usize> {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut chosen: Vec<usize> = (0..wanted)
        .filter_map(|stratum| {
            let start = stratum * from.len() / wanted;
            let end = (stratum + 1) * from.len() / wanted;
            from.get(rng.random_range(start..end.max(start + 1))).copied()
        })
        .collect();
    chosen.dedup();
    chosen
}

/// The standard deviations of a file that gives positive ones.
fn usable_sigma(measurement: &Measurement) -> Result<&Vec<Vec<f64>>, Error> {
    let path = measurement.source.path.display();
    let Some(sigma) = &measurement.sigma else {
        return Err(Error::Usage(format!(
            "{path}: --weights sigma needs a column 'sigma' or 'sigma_<channel>' in the file"
        )));
    };
    for (row, channel) in sigma.iter().zip(&measurement.channels) {
        if let Some((index, value)) = row.iter().enumerate().find(|(_, s)| **s <= 0.0) {
            return Err(Error::Usage(format!(
                "{path}: --weights sigma needs positive standard deviations, found {value} for channel {} of \
                 sample {}",
                channel.name,
                index + 1
            )));
        }
    }
    Ok(sigma)
}
