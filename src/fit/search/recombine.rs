//! A start per channel, put together from starts for all channels.
//!
//! The search tries one value of a shape in all channels at a time. Where the shape may differ from channel to channel,
//! the value that is right for one can be wrong for another; but the channels hardly know of one another, and of each
//! the best that was seen anywhere can be taken.

use crate::fit::problem::reflectance::ReflectanceProblem;
use crate::model::Role;
use crate::parameters::{ParameterRow, ParameterTable, Status};
use nalgebra::DVector;
use rayon::prelude::*;

/// A gain below this share of the whole cost is none.
const GAIN: f64 = 1e-6;

/// A place and the cost of each channel there.
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

/// The parameters of each channel from the place where it costs least, the shared ones from the best place. `None` if that
/// is the best place itself, or the model has no shape to search for in each channel. `problem` poses the problem at a
/// place.
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

    // What channels gain elsewhere.
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

/// Whether a channel costs less at one place than at another.
fn costs_less(place: &Place<'_>, other: &Place<'_>, channel: usize) -> bool {
    place.costs[channel].total_cmp(&other.costs[channel]).is_lt()
}

/// Whether channels have shapes of their own that are searched for.
fn has_shapes_apart(table: &ParameterTable) -> bool {
    table.rows().iter().any(|row| is_apart(row) && row.spec.role == Role::Shape && row.spec.scanned)
}

/// Whether a parameter is fitted in each channel by itself.
fn is_apart(row: &ParameterRow) -> bool {
    row.status == Status::Free && row.channel.is_some()
}
