//! Finds what a user should know before relying on a fit. Each warning says what to do next.

use super::misfit::Misfit;
use super::result::Fit;
use super::warning::{AtBound, NotSeparated, Side, Warning};
use crate::fit::search::scan::Profile;
use crate::geometry::direction;
use crate::health::{Integral, Quadrature, directional_albedo};
use crate::math::count;
use crate::measurement::Samples;
use crate::model::{LobeValues, Role, Scale};
use crate::parameters::{ParameterRow, Product, Status, differ};
use std::collections::BTreeMap;

/// A correlation above this is worth a warning.
const STRONG_CORRELATION: f64 = 0.98;
/// The same limit for the two factors of a lobe's strength, which few data tell apart.
const STRONG_WITHIN_PRODUCT: f64 = 0.99;
/// Schlick's Fresnel term rises noticeably only beyond this angle, degrees (docs/use/fitting.md).
const FRESNEL_REACH_DEG: f64 = 70.0;
/// The same limit for a diffuse base and a lobe, which are alike when the lobe is rough.
const STRONG_WITH_BASE: f64 = 0.95;
/// Above this ratio of singular values, some combination of parameters is known far worse than the others.
const ILL_CONDITIONED: f64 = 1e3;
/// A relative difference in cost below this is not significant, however good the data are.
const COST_RESOLUTION: f64 = 1e-3;
/// At the end of a 95 % interval, twice the log-likelihood has fallen by this much.
const CHI2_95: f64 = 3.841;
/// A profile that is flat over more than this ratio of values does not determine the shape.
const FLAT_RATIO: f64 = 2.0;
/// The same limit as a fraction of the range, for shapes that are not fitted by their logarithm.
const FLAT_SHARE: f64 = 0.3;

/// The reduced chi-square has the standard deviation sqrt(2/dof) by chance; it is worth a warning beyond this many of them.
const CHI2_BY_CHANCE: f64 = 5.0;
/// And only if it is larger or smaller than 1 by this factor.
const CHI2_RATIO: f64 = 1.5;
/// By how much a strength or an albedo must exceed 1 to be worth a warning.
const ABOVE_ONE: f64 = 1e-3;
/// Angles of incidence at which the albedo of the fitted model is computed, degrees. Towards 90 the data say little.
const INCIDENCES_DEG: [f64; 2] = [0.0, 75.0];
/// The effort of that: first enough to see that most materials are far from it, then enough to tell an albedo above 1.
const EFFORTS: [Quadrature; 2] =
    [Quadrature { tolerance: 3e-2, most_cells: 100 }, Quadrature { tolerance: 1e-3, most_cells: 1000 }];

/// A parameter at a bound.
struct Bound {
    name: String,
    upper: bool,
    value: f64,
    channels: Vec<String>,
    /// Whether the bound is that of the model.
    of_model: bool,
    /// Whether it is only the reflectance at normal incidence, in a lobe that rises towards grazing.
    reflectance: bool,
}

/// One warning per parameter at a bound, for all its channels together.
pub(super) fn at_bounds(fit: &Fit) -> Vec<Warning> {
    let table = &fit.table;
    let mut groups: Vec<Bound> = Vec::new();
    for row in table.free_rows() {
        for (at, upper, value) in
            [(row.at_lower(), false, row.bounds.0), (row.at_upper(), true, row.bounds.1)]
        {
            if !at {
                continue;
            }
            let name = table.parameter_name(row);
            let channel = row.channel.map(|channel| table.channels()[channel].clone());
            match groups.iter_mut().find(|group| group.name == name && group.upper == upper) {
                Some(group) => group.channels.extend(channel),
                None => {
                    let is_factor =
                        |product: &Product| (product.lobe, product.second) == (row.lobe, row.parameter);
                    let reflectance =
                        row.spec.role == Role::Amplitude && table.products().iter().any(is_factor);
                    let channels = channel.into_iter().collect();
                    let limits = row.spec.bounds;
                    let of_model = value == if upper { limits.1 } else { limits.0 };
                    groups.push(Bound { name, upper, value, channels, of_model, reflectance });
                }
            }
        }
    }
    let warning = |Bound { name, upper, value, channels, of_model, reflectance }: Bound| Warning::AtBound {
        parameter: name,
        side: if upper { Side::Upper } else { Side::Lower },
        bound: value,
        channels,
        meaning: match (!upper && value == 0.0, reflectance) {
            (true, false) => AtBound::Absent,
            // A lobe whose reflectance is 0 at normal incidence is still there.
            (true, true) => AtBound::OnlyAtGrazing,
            _ if of_model => AtBound::LimitOfModel,
            _ => AtBound::Limit,
        },
    };
    let mut warnings: Vec<Warning> = groups.into_iter().map(warning).collect();
    warnings.extend(dependent(fit));
    warnings
}

/// Warns of a model that does not fit, and of standard deviations that do not suit the residuals.
pub(super) fn misfit(fit: &Fit) -> Vec<Warning> {
    let mut warnings = Vec::new();
    if let Some(misfit) = fit.misfit.filter(Misfit::is_significant) {
        warnings.push(Warning::Misfit(misfit));
    }
    if let (Some(reduced), Some(freedom)) = (fit.reduced_chi2, freedom(fit))
        && is_far_from_one(reduced, freedom)
    {
        warnings.push(Warning::ChiSquare { reduced });
    }
    warnings
}

/// Whether a reduced chi-square with `freedom` degrees of freedom says that the given standard deviations do not suit the residuals.
pub(super) fn is_far_from_one(reduced: f64, freedom: f64) -> bool {
    let by_chance = CHI2_BY_CHANCE * (2.0 / freedom).sqrt();
    let far = !(1.0 / CHI2_RATIO..=CHI2_RATIO).contains(&reduced);
    far && (reduced - 1.0).abs() > by_chance
}

/// The degrees of freedom; `None` if there are none.
fn freedom(fit: &Fit) -> Option<f64> {
    usize::try_from(fit.dof).ok().filter(|dof| *dof > 0).map(count)
}

/// Warns of lobes that are absent, and of lobes that reflect more than their facets receive.
pub(super) fn strengths(fit: &Fit) -> Vec<Warning> {
    let table = &fit.table;
    let mut warnings = Vec::new();
    // The rows of a parameter and their channels, where it exceeds 1.
    let above = |rows: Vec<&ParameterRow>| {
        let above: Vec<&ParameterRow> = rows.into_iter().filter(|row| row.value > 1.0 + ABOVE_ONE).collect();
        let channels = above.iter().filter_map(|row| table.channel_name(row)).map(str::to_owned).collect();
        let value = above.iter().map(|row| row.value).fold(1.0, f64::max);
        (!above.is_empty()).then_some((value, channels))
    };
    let mut albedos: BTreeMap<String, Vec<&ParameterRow>> = BTreeMap::new();
    for row in table.rows().iter().filter(|row| row.spec.is_albedo) {
        albedos.entry(table.parameter_name(row)).or_default().push(row);
    }
    for (parameter, rows) in albedos {
        let at_bound = rows.iter().any(|row| row.value >= row.spec.bounds.1);
        if let Some((value, channels)) = above(rows) {
            warnings.push(Warning::AlbedoAboveOne { parameter, value, channels, at_bound });
        }
    }
    for (index, lobe) in table.lobes().iter().enumerate() {
        let scales: Vec<&ParameterRow> =
            table.scales(index).into_iter().map(|row| &table.rows()[row]).collect();
        let Some(first) = scales.first() else { continue };
        let parameter = table.parameter_name(first);
        if table.is_absent(index) {
            warnings.push(Warning::LobeAbsent { parameter, lobe: lobe.clone() });
            continue;
        }
        if let Some((value, channels)) = above(scales) {
            warnings.push(Warning::StrengthAboveOne { parameter, value, channels });
        }
    }
    warnings
}

impl Fit {
    /// A warning if the fitted model reflects more light than arrives. It is an integration, too slow to be part of every fit, and left
    /// out for a lobe alone whose variant reflects at most what it receives.
    #[must_use]
    pub fn energy_warning(&self) -> Option<Warning> {
        let channels = self.table.channels();
        let values: Vec<_> = (0..channels.len()).map(|channel| self.table.formula_values(channel)).collect();
        let at_most_one =
            values.iter().flatten().flat_map(|lobe| &lobe.amplitudes).all(|amplitude| *amplitude <= 1.0);
        let conserves = matches!(self.model.lobes(), [lobe] if !lobe.may_gain_energy()) && at_most_one;
        if conserves || self.unusable.is_some() {
            return None;
        }
        // The brightest channel gains first.
        let total = |values: &[LobeValues]| values.iter().flat_map(|lobe| &lobe.amplitudes).sum::<f64>();
        let (channel, values) = (0..).zip(&values).max_by(|(_, a), (_, b)| total(a).total_cmp(&total(b)))?;
        let values = [values.clone()];
        let at = |theta_i_deg: f64| {
            let wi = direction(theta_i_deg.to_radians(), 0.0);
            let mut surely = 0.0;
            for effort in &EFFORTS {
                let albedos = directional_albedo(&self.model, &values, wi, false, effort);
                let Some(Integral { value, error }) = albedos.first() else { break };
                surely = value - error;
                if value + error < 1.0 {
                    break;
                }
            }
            (surely, theta_i_deg)
        };
        let (albedo, theta_i_deg) =
            INCIDENCES_DEG.map(at).into_iter().max_by(|(a, _), (b, _)| a.total_cmp(b))?;
        let channel = channels.get::<usize>(channel)?.clone();
        (albedo > 1.0 + ABOVE_ONE).then_some(Warning::GainsEnergy { channel, albedo, theta_i_deg })
    }
}

/// Warns of parameters whose standard error depends on others staying at their bounds.
fn dependent(fit: &Fit) -> Option<Warning> {
    let parameters = some_names_of(fit, &fit.covariance.as_ref()?.dependent)?;
    Some(Warning::RestsOnBound { parameters })
}

/// Warns of parameters that the data do not tell apart.
pub(super) fn identifiability(fit: &Fit, samples: &Samples, profiles: &[Profile]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    warnings.extend(undetermined(fit));
    warnings.extend(products(fit, samples));
    warnings.extend(correlated(fit));
    warnings.extend(flat(fit, profiles));
    if warnings.is_empty() {
        warnings.extend(ill_conditioned(fit));
    }
    warnings
}

/// The full names of rows of the parameter table.
fn names_of(fit: &Fit, rows: &[usize]) -> Vec<String> {
    rows.iter().map(|row| fit.table.name(*row)).collect()
}

/// The full names of rows of the parameter table; `None` if there are no rows.
fn some_names_of(fit: &Fit, rows: &[usize]) -> Option<Vec<String>> {
    (!rows.is_empty()).then(|| names_of(fit, rows))
}

fn undetermined(fit: &Fit) -> Option<Warning> {
    let parameters = some_names_of(fit, &fit.covariance.as_ref()?.undetermined)?;
    Some(Warning::NotDetermined { parameters })
}

/// Warns of factors of a lobe's strength that are both free and that the data hardly tell apart.
fn products(fit: &Fit, samples: &Samples) -> Vec<Warning> {
    let table = &fit.table;
    let mut warnings = Vec::new();
    let mut reach = None;
    for Product { lobe, first, second } in table.products() {
        let free = |row: usize| table.rows()[row].status == Status::Free;
        let mut strongest: f64 = 0.0;
        let mut both_free = false;
        for channel in 0..table.channels().len() {
            let (a, b) = (table.place(*lobe, *first, channel), table.place(*lobe, *second, channel));
            if !free(a) || !free(b) {
                continue;
            }
            both_free = true;
            let correlation = fit.covariance.as_ref().and_then(|c| c.correlation(a, b));
            strongest = strongest.max(correlation.map_or(0.0, f64::abs));
        }
        if !both_free {
            continue;
        }
        let reach = *reach.get_or_insert_with(|| largest_angle_deg(samples));
        let weak = reach < FRESNEL_REACH_DEG;
        if !weak && strongest <= STRONG_WITHIN_PRODUCT {
            continue;
        }
        let name = |parameter: usize| {
            let row = &table.rows()[table.places(*lobe, parameter)[0]];
            (row.spec.name, table.parameter_name(row))
        };
        let ((first, parameter), (second, _)) = (name(*first), name(*second));
        let reason = if weak {
            NotSeparated::Reach { largest_deg: reach, wanted_deg: FRESNEL_REACH_DEG }
        } else {
            NotSeparated::Correlation(strongest)
        };
        warnings.push(Warning::NotSeparated { parameter, factors: [first, second], reason });
    }
    warnings
}

/// The largest angle of incidence or viewing, in degrees.
fn largest_angle_deg(samples: &Samples) -> f64 {
    let smallest_cosine =
        samples.directions.iter().map(|g| g.cos_i().min(g.cos_o())).fold(f64::INFINITY, f64::min);
    smallest_cosine.clamp(-1.0, 1.0).acos().to_degrees()
}

/// Warns of the strongest correlation overall, and of the strongest between a diffuse base and a lobe.
fn correlated(fit: &Fit) -> Vec<Warning> {
    let Some(covariance) = &fit.covariance else { return Vec::new() };
    let table = &fit.table;
    let lobe_of = |row: usize| table.rows()[row].lobe;
    let is_base = |row: usize| !table.has_width(lobe_of(row));
    let is_amplitude = |row: usize| table.rows()[row].spec.role == Role::Amplitude;
    let in_product = |a: usize, b: usize| {
        let place = |row: usize| (lobe_of(row), table.rows()[row].parameter);
        table.products().iter().any(|Product { lobe, first, second }| {
            let factors = ((*lobe, *first), (*lobe, *second));
            (place(a), place(b)) == factors || (place(b), place(a)) == factors
        })
    };
    let mut strongest: Option<(f64, usize, usize)> = None;
    let mut with_base: Option<(f64, usize, usize)> = None;
    for (c, a, b) in covariance.correlated_pairs(STRONG_WITH_BASE.min(STRONG_CORRELATION)) {
        // The base first, then the lobe.
        let pair = if is_base(a) { (a, b) } else { (b, a) };
        let (group, limit) = if in_product(a, b) {
            continue;
        } else if is_base(pair.0) && !is_base(pair.1) && is_amplitude(pair.0) {
            (&mut with_base, STRONG_WITH_BASE)
        } else {
            (&mut strongest, STRONG_CORRELATION)
        };
        if c.abs() > limit && group.is_none_or(|(s, ..)| c.abs() > s.abs()) {
            *group = Some((c, pair.0, pair.1));
        }
    }
    let mut warnings = Vec::new();
    if let Some((correlation, base, other)) = with_base {
        warnings.push(Warning::BaseLikeLobe {
            parameter: table.name(base),
            other: table.name(other),
            lobe: table.lobes()[lobe_of(other)].clone(),
            correlation,
        });
    }
    if let Some((correlation, a, b)) = strongest {
        warnings.push(Warning::Correlated { parameter: table.name(a), other: table.name(b), correlation });
    }
    warnings
}

/// Warns of shapes on which the error hardly depends.
fn flat(fit: &Fit, profiles: &[Profile]) -> Vec<Warning> {
    let Some(freedom) = freedom(fit) else { return Vec::new() };
    let threshold = (CHI2_95 / freedom).exp_m1().max(COST_RESOLUTION);
    let mut warnings = Vec::new();
    for profile in profiles {
        let row = &fit.table.rows()[profile.row];
        let lowest = profile.points.iter().map(|(_, cost)| *cost).fold(f64::INFINITY, f64::min);
        let level: Vec<f64> = profile
            .points
            .iter()
            .filter(|(_, cost)| *cost <= lowest * (1.0 + threshold))
            .map(|(value, _)| *value)
            .collect();
        // If no cost is a number, no point is level.
        let ends = (profile.points.first(), profile.points.last());
        let (Some(&low), Some(&high), (Some((start, _)), Some((end, _)))) =
            (level.first(), level.last(), ends)
        else {
            continue;
        };
        let wide = match row.spec.scale {
            Scale::Log => high > FLAT_RATIO * low,
            Scale::Linear | Scale::Square => high - low > FLAT_SHARE * (end - start),
        };
        if !wide {
            continue;
        }
        warnings.push(Warning::FlatProfile {
            parameter: fit.table.parameter_name(row),
            lobe: fit.table.lobes()[row.lobe].clone(),
            range: [low, high],
            within: threshold,
        });
    }
    warnings
}

/// Warns of a combination of several parameters that is known far worse than the others.
fn ill_conditioned(fit: &Fit) -> Option<Warning> {
    let covariance = fit.covariance.as_ref().filter(|c| c.condition > ILL_CONDITIONED)?;
    let parameters = some_names_of(fit, &covariance.weakest)?;
    Some(Warning::IllConditioned { parameters, condition: covariance.condition })
}

/// Warns of parameters whose samples the loss discards.
pub(super) fn discarded(fit: &Fit) -> Option<Warning> {
    let parameters = some_names_of(fit, &fit.covariance.as_ref()?.discarded)?;
    Some(Warning::LossDiscards { parameters })
}

/// Warns if another start ended as well as the best one, with other shapes.
pub(super) fn ties(fit: &Fit) -> Option<Warning> {
    let best = fit.starts.iter().min_by(|a, b| a.cost.total_cmp(&b.cost))?;
    let table = &fit.table;
    // A shape that the data do not determine may end anywhere, so it does not count.
    let known = |row: usize| fit.covariance.as_ref().is_some_and(|c| c.std_error(row).is_some());
    let differing = |reached: &[(usize, f64)]| {
        let pairs = reached.iter().zip(&best.reached);
        let found = pairs.filter(|((row, value), (_, of_best))| {
            known(*row) && differ(&table.rows()[*row], *of_best, *value)
        });
        found.map(|((row, value), (_, of_best))| (*row, *value, *of_best)).next()
    };
    let rival = fit
        .starts
        .iter()
        .filter(|start| start.cost <= best.cost * (1.0 + COST_RESOLUTION) && start.termination.converged())
        .find_map(|start| differing(&start.reached).map(|found| (start.cost, found)));
    let (cost, (row, value, of_best)) = rival?;
    Some(Warning::TiedStarts {
        parameter: table.name(row),
        values: [of_best, value],
        excess: cost / best.cost - 1.0,
    })
}
