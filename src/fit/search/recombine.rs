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

/// A place that was seen: parameters, and the cost of each channel there.
struct Seen<'t> {
    table: &'t ParameterTable,
    costs: Vec<f64>,
}

impl Seen<'_> {
    fn cost(&self) -> f64 {
        self.costs.iter().sum()
    }

    fn cost_of(&self, channel: usize) -> f64 {
        self.costs.get(channel).copied().unwrap_or(f64::INFINITY)
    }
}

/// Of every channel the place where it costs least, on the shared parameters of the best place; none if that is the
/// best place itself, or the model has no shape to search for in each channel. `problem` poses the problem at a place.
pub(super) fn recombined<'t, 'p>(
    places: &[&'t ParameterTable],
    problem: impl Fn(&ParameterTable) -> ReflectanceProblem<'p> + Sync,
) -> Option<ParameterTable> {
    if !has_shapes_apart(places.first()?) {
        return None;
    }
    let look = |table: &&'t ParameterTable| {
        let costs = problem(table).channel_costs(&DVector::from_vec(table.coordinates()));
        Seen { table, costs }
    };
    let seen: Vec<Seen<'t>> = places.par_iter().map(look).collect();
    let best = seen.iter().min_by(|a, b| a.cost().total_cmp(&b.cost()))?;
    let mut table = best.table.clone();
    let mut any = false;
    for channel in 0..best.costs.len() {
        let by_cost = |a: &&Seen<'_>, b: &&Seen<'_>| a.cost_of(channel).total_cmp(&b.cost_of(channel));
        let Some(better) = seen.iter().min_by(by_cost) else { continue };
        if better.cost_of(channel) >= best.cost_of(channel) - GAIN * best.cost() {
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

/// Whether channels have shapes of their own that are searched for.
fn has_shapes_apart(table: &ParameterTable) -> bool {
    table.rows().iter().any(|row| is_apart(row) && row.spec.role == Role::Shape && row.spec.scanned)
}

fn is_apart(row: &ParameterRow) -> bool {
    row.status == Status::Free && row.channel.is_some()
}
