//! The reflection of a rough surface of perfect mirrors, traced ray by ray: a measurement that does not come from any
//! formula of this program.
//!
//! The surfaces are a Gaussian random surface (`gaussian`) and V-grooves (`grooves`). Light falls evenly on the whole
//! surface, from one polar angle and all azimuths. A ray is reflected where it first meets the surface, by a facet that
//! reflects everything, and counts if it then escapes. If it meets the surface again it is lost, as in the microfacet
//! models, which have only single reflections. `bins` turns counts into f.
//!
//! The slopes of both surfaces are distributed as P22 = exp(-slope^2/m^2)/(pi m^2), Beckmann's D =
//! P22/cos^4(theta_h): each component has the variance m^2/2, and m is the rms slope. Grooves can have GGX facets instead.

mod bins;
mod gaussian;
mod grooves;
mod surface;

pub use grooves::Facets;

use crate::error::{Error, OptionName};
use crate::geometry::Directions;
use crate::math::count;
use crate::measurement::{Channel, Measurement, Source};
use bins::Counts;
use gaussian::Tile;
use glam::DVec2;
use grooves::Grooves;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use std::sync::atomic::{AtomicUsize, Ordering};
use surface::{Fate, RoughSurface};

/// The kind of surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Normally distributed heights with a Gaussian autocorrelation, on square tiles.
    Gaussian {
        /// Number of correlation lengths along a side, within [`TILES`].
        tile: usize,
    },
    /// V-grooves.
    VGroove(Facets),
}

/// A surface, and how it is illuminated and measured.
#[derive(Clone, Debug)]
pub struct Simulation {
    /// The surface.
    pub kind: Kind,
    /// Roughness, within [`ROUGHNESS`].
    pub m: f64,
    /// Angles of incidence, degrees, from 0 to less than 90.
    pub theta_i_deg: Vec<f64>,
    /// Number of rays for each of them, within [`RAYS`]; rounded up to a multiple of [`BATCH`].
    pub rays: usize,
    /// Largest angle of viewing, degrees.
    pub max_theta_deg: f64,
    /// Seed of surfaces and rays.
    pub seed: u64,
}

/// Possible sides of a tile in correlation lengths. Smaller tiles hold too few waves for their sum to be normally
/// distributed, larger ones take too much memory.
pub const TILES: RangeInclusive<usize> = 16..=128;
/// Possible roughness of a surface.
pub const ROUGHNESS: RangeInclusive<f64> = 0.01..=1.0;
/// Possible number of rays for each angle of incidence; many more would overflow the counts.
pub const RAYS: RangeInclusive<usize> = 1..=1_000_000_000;
/// Number of rays for each angle of incidence that share a stream of random numbers and, on a Gaussian surface, a tile.
/// Many more on one tile would meet the same slopes repeatedly, so they would vary more than their counts suggest.
pub const BATCH: usize = ROWS * ROWS;
/// Number of rows of rays in a batch, and of rays in a row.
const ROWS: usize = 80;

/// The fate of the light from one angle of incidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Balance {
    /// Number of rays.
    pub rays: usize,
    /// Number of rays that escaped after one reflection.
    pub escaped: usize,
    /// Number of rays that met the surface again.
    pub shadowed: usize,
}

/// The simulated measurement.
#[derive(Clone, Debug)]
pub struct Simulated {
    /// f, with its standard error from the counts.
    pub measurement: Measurement,
    /// The fate of the light, for each angle of incidence.
    pub balance: Vec<Balance>,
}

/// Number that separates this random stream from others with the same seed.
const STREAM: u64 = 0x6865_6967_6874;

/// Counts and balance for each angle of incidence.
type Tally = Vec<(Counts, Balance)>;

impl Simulation {
    /// Traces the rays. `progress` is called with the number of parts done and the number of all parts.
    ///
    /// # Errors
    /// [`Error::Invalid`] if a number is out of range, or if no bin can be measured.
    pub fn run(&self, progress: &(impl Fn(usize, usize) + Sync)) -> Result<Simulated, Error> {
        self.check()?;
        let mut rng = Pcg64Mcg::seed_from_u64(self.seed ^ STREAM);
        let seeds: Vec<u64> = (0..self.rays.div_ceil(BATCH)).map(|_| rng.random()).collect();
        let done = AtomicUsize::new(0);
        let batch = |seed: &u64| {
            let tally = self.batch(&mut Pcg64Mcg::seed_from_u64(*seed));
            progress(done.fetch_add(1, Ordering::Relaxed) + 1, seeds.len());
            tally
        };
        // Sums of counts do not depend on their order.
        let total = seeds.par_iter().map(batch).reduce(|| self.empty(), merge);
        self.measured(&total)
    }

    /// Checks that every number is in range.
    ///
    /// # Errors
    /// [`Error::Invalid`] for the first that is not.
    pub fn check(&self) -> Result<(), Error> {
        let range = |what: &str, ok: bool, range: &str, found: &dyn std::fmt::Display| {
            if ok { Ok(()) } else { Err(Error::invalid(what, range, found.to_string())) }
        };
        let (low, high) = (ROUGHNESS.start(), ROUGHNESS.end());
        range("m", ROUGHNESS.contains(&self.m), &format!("{low}..{high}"), &self.m)?;
        let (low, high) = (RAYS.start(), RAYS.end());
        range("rays", RAYS.contains(&self.rays), &format!("{low}..{high}"), &self.rays)?;
        if let Kind::Gaussian { tile } = self.kind {
            let (low, high) = (TILES.start(), TILES.end());
            range("tile", TILES.contains(&tile), &format!("{low}..{high} correlation lengths"), &tile)?;
        }
        for theta in &self.theta_i_deg {
            range(
                "angle of incidence",
                (0.0..90.0).contains(theta),
                "0 or more and less than 90 degrees",
                theta,
            )?;
        }
        Ok(())
    }

    fn empty(&self) -> Tally {
        self.theta_i_deg.iter().map(|_| (Counts::new(self.m), Balance::default())).collect()
    }

    /// Traces one batch of rays for every angle of incidence.
    fn batch(&self, rng: &mut Pcg64Mcg) -> Tally {
        match self.kind {
            Kind::Gaussian { tile } => {
                let tile = Tile::new(self.m, tile, rng);
                self.trace(&tile, rng)
            }
            Kind::VGroove(facets) => self.trace(&Grooves { facets, m: self.m }, rng),
        }
    }

    fn trace(&self, surface: &impl RoughSurface, rng: &mut Pcg64Mcg) -> Tally {
        let mut tally = self.empty();
        for ((counts, balance), theta_i) in tally.iter_mut().zip(&self.theta_i_deg) {
            let (sin_i, cos_i) = theta_i.to_radians().sin_cos();
            for (row, column) in (0..BATCH).map(|ray| (ray / ROWS, ray % ROWS)) {
                // One ray starts at random in each of ROWS x ROWS equal squares. Its azimuth is random, which makes no
                // difference on average, but makes one surface as good as many.
                let corner = DVec2::new(count(column), count(row));
                let place = (corner + DVec2::new(rng.random(), rng.random())) / count(ROWS);
                let azimuth = DVec2::from_angle(TAU * rng.random::<f64>());
                balance.rays += 1;
                match surface.reflect(place, (azimuth * sin_i).extend(cos_i)) {
                    Fate::Escaped(slope) => {
                        balance.escaped += 1;
                        // The slope in the frame where the light is at azimuth 0.
                        counts.add(azimuth.dot(slope), azimuth.perp_dot(slope));
                    }
                    Fate::Shadowed => balance.shadowed += 1,
                    Fate::Lost => {}
                }
            }
        }
        tally
    }

    fn measured(&self, total: &Tally) -> Result<Simulated, Error> {
        let samples: Vec<_> = total
            .iter()
            .zip(&self.theta_i_deg)
            .flat_map(|((counts, balance), theta_i)| {
                counts.samples(theta_i.to_radians(), self.max_theta_deg.to_radians(), balance.rays)
            })
            .collect();
        if samples.is_empty() {
            return Err(Error::invalid(
                OptionName::MaxTheta,
                "directions of viewing within it that reflect the light of these angles of incidence",
                format!("none within {} degrees", self.max_theta_deg),
            ));
        }
        let measurement = Measurement {
            source: Source { format: "synthetic", ..Source::default() },
            sigma: Some(vec![samples.iter().map(|sample| sample.sigma).collect()]),
            ..Measurement::of(
                vec![Channel::named("f")],
                Directions::Scattered(samples.iter().map(|sample| sample.pair).collect()),
                vec![samples.iter().map(|sample| sample.value).collect()],
            )
        };
        Ok(Simulated { measurement, balance: total.iter().map(|(_, balance)| *balance).collect() })
    }
}

fn merge(mut sum: Tally, more: Tally) -> Tally {
    for ((counts, balance), (others, part)) in sum.iter_mut().zip(&more) {
        counts.merge(others);
        balance.rays += part.rays;
        balance.escaped += part.escaped;
        balance.shadowed += part.shadowed;
    }
    sum
}
