//! Puts together a start for each channel from starts for all channels.
//!
//! The search tries each value of a shape in all channels at once. If the shape may differ between channels, the value
//! that is right for one can be wrong for another. But the channels are almost independent, so each can take the best
//! value that was seen anywhere.

use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::model::Role;
use crate::parameters::{ParameterRow, ParameterTable, Status};
use nalgebra::DVector;
use rayon::prelude::*;

/// A gain below this share of the whole cost is ignored.
const GAIN: f64 = 1e-6;

/// A set of parameters and the cost of each channel there.
struct Place<'t> {
    table: &'t ParameterTable,
    costs: Vec<f64>,
}

impl Place<'_> {
    /// The cost of all channels.
    fn cost(&self) -> f64 {
        self.costs.iter().sum()
    }
}

/// Takes the parameters of each channel from the place where its cost is lowest, and the shared ones from the best
/// place. `None` if the result is the best place itself, or if the model has no shape that is searched for in each
/// channel separately. `problem` builds the problem at a place.
pub(super) fn recombined<'t, 'p>(
    places: &[&'t ParameterTable],
    problem: impl Fn(&ParameterTable) -> ReflectanceProblem<'p> + Sync,
) -> Option<ParameterTable> {
    if !has_shapes_apart(places.first()?) {
        return None;
    }

    // The cost of each channel at each place.
    let evaluate = |table: &&'t ParameterTable| {
        let costs = problem(table).channel_costs(&DVector::from_vec(table.coordinates()));
        Place { table, costs }
    };
    let places: Vec<Place<'t>> = places.par_iter().map(evaluate).collect();
    let best = places.iter().min_by(|a, b| a.cost().total_cmp(&b.cost()))?;

    // Take over the parameters of channels that cost less at another place.
    let mut table = best.table.clone();
    let mut any = false;
    for channel in 0..best.costs.len() {
        let cheaper = |least, place| if costs_less(place, least, channel) { place } else { least };
        let better: &Place<'t> = places.iter().fold(best, cheaper);
        if better.costs[channel] >= best.costs[channel] - GAIN * best.cost() {
            continue;
        }
        any = true;
        for (index, row) in better.table.rows().iter().enumerate() {
            if is_apart(row) && row.channel == Some(channel) {
                table.set_value(index, row.value);
            }
        }
    }
    table.start_here();
    any.then_some(table)
}

/// Whether the cost of a channel is lower at one place than at another.
fn costs_less(place: &Place<'_>, other: &Place<'_>, channel: usize) -> bool {
    place.costs[channel].total_cmp(&other.costs[channel]).is_lt()
}

/// Whether any scanned shape is fitted in each channel separately.
fn has_shapes_apart(table: &ParameterTable) -> bool {
    table.rows().iter().any(|row| is_apart(row) && row.spec.role == Role::Shape && row.spec.scanned)
}

/// Whether a parameter is fitted in each channel separately.
fn is_apart(row: &ParameterRow) -> bool {
    row.status == Status::Free && row.channel.is_some()
}
