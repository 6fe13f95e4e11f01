//! Energy: no surface reflects more light than it receives.

use crate::health::albedos_of_cells;
use crate::health::laws::hemisphere;
use crate::measurement::Measurement;

/// The largest share of light that a surface reflects at least.
#[derive(Clone, Copy, Debug)]
pub(super) struct Most {
    /// That share.
    pub at_least: f64,
    /// The smallest and the largest angle of incidence, degrees.
    pub theta_i_deg: [f64; 2],
}

/// Of a table's cells every so many are looked at: no divisor of the number of cells along its axes.
const STEP: usize = 13;

/// The largest of the lower bounds that the values give for albedos, of the channel that has it; `None` if the directions do not say.
pub(super) fn most(measurement: &Measurement) -> Option<Most> {
    let bounds = albedos_of_cells(measurement, STEP).unwrap_or_else(|| hemisphere::albedos(measurement));
    let bounds = bounds.into_iter().flatten();
    let most = bounds.max_by(|a, b| a.at_least.total_cmp(&b.at_least))?;
    Some(Most { at_least: most.at_least, theta_i_deg: most.theta_i_deg })
}
