//! Fits K and S of each channel by least squares.

use super::closed_form::from_two_backings;
use super::table::{Patch, Series};
use super::{Drawdown, Surface};
use crate::error::Error;
use crate::math::{Dual, Scalar as _, count};
use crate::model::parts::paint_layers::{Film, opaque, saunderson, saunderson_inverse};
use crate::solver::{LeastSquares, Limits, Linearisation, Termination, Tolerances, minimise};
use nalgebra::{DMatrix, DVector};
use std::fmt;

/// A value with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quantity {
    /// The value.
    pub value: f64,
    /// Its standard error. `None` if the value is at a bound, or if there are no more reflectances than unknowns and no
    /// standard deviations.
    pub std_error: Option<f64>,
}

/// The result for one channel.
#[derive(Clone, Debug)]
pub struct Fitted {
    /// Index into the drawdown's series.
    pub series: usize,
    /// Absorption per unit of thickness. `None` if the reflectances do not determine it.
    pub k: Option<Quantity>,
    /// Scattering per unit of thickness. `None` likewise.
    pub s: Option<Quantity>,
    /// K/S. `None` if the reflectances do not determine it, or if S is 0.
    pub k_over_s: Option<Quantity>,
    /// Reflectance of an opaque layer of the same paint, without the surface. `None` likewise.
    pub r_inf: Option<Quantity>,
    /// Number of reflectances.
    pub n: usize,
    /// Degrees of freedom: the number of reflectances minus the number of unknowns.
    pub dof: usize,
    /// Root mean square of the reflectances' residuals.
    pub rms: f64,
    /// chi^2/dof. `None` unless every reflectance has a standard deviation.
    pub reduced_chi2: Option<f64>,
    /// `closed-form` or `least-squares`.
    pub method: &'static str,
    /// Why the fit stopped: `exact` for the closed form.
    pub reason: &'static str,
    /// Whether the result can be relied on.
    pub usable: bool,
    /// Warnings about the result.
    pub remarks: Vec<Remark>,
}

/// A warning about one channel. Its text says what to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Remark {
    /// The fit did not converge.
    NotConverged,
    /// One reflectance cannot determine two coefficients.
    OneReflectance,
    /// The reflectances do not tell K from S.
    NotSeparated,
    /// The film hides its backing, so only K/S is determined.
    Opaque,
    /// K ended at 0.
    NoAbsorption,
    /// S ended at 0.
    NoScattering,
    /// K/S ended at its largest value.
    Black,
    /// There are as many unknowns as reflectances, and no standard deviations.
    NoErrors,
}

impl Remark {
    /// Its kind, as reports name it.
    #[must_use]
    pub fn kind(self) -> &'static str {
        match self {
            Self::NotConverged | Self::OneReflectance | Self::NotSeparated => "not-usable",
            Self::Opaque => "opaque",
            Self::NoAbsorption | Self::NoScattering | Self::Black => "at-bound",
            Self::NoErrors => "no-errors",
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::NotConverged => "the fit did not converge: check the reflectances and the backings",
            Self::OneReflectance => {
                "one reflectance does not determine K and S: measure over a second backing or at a second thickness"
            }
            Self::NotSeparated => {
                "the reflectances do not separate K from S: measure over backings that differ more, or at another thickness"
            }
            Self::Opaque => "the backing does not show through: only K/S is determined; measure a thinner film",
            Self::NoAbsorption => {
                "K ended at 0: check the reflectances of the backings and the correction for the surface"
            }
            Self::NoScattering => {
                "S ended at 0: check the reflectances of the backings and the correction for the surface"
            }
            Self::Black => "K/S ended at its largest value, 1e6: nothing is reflected",
            Self::NoErrors => {
                "there are as many unknowns as reflectances: standard errors need a column 'sigma' or more reflectances"
            }
        })
    }
}

/// Largest K X and S X in the search: a larger value of either makes the film no more opaque.
const MOST: f64 = 1e4;
/// Largest K/S of opaque paint, whose reflectance is then 5e-7.
const BLACKEST: f64 = 1e6;
/// Values of S X that the search for a start tries: their number, and the ends between which they are evenly spaced in
/// the logarithm. Each is followed to its minimum. In films that nearly hide their backing K/S is determined much better
/// than the size of K X and S X, so the costs at the points of a grid do not show which size is best.
const SIZES: (u32, f64, f64) = (25, 1e-4, 1e2);
/// Values of K/S, of which the search takes the best for each S X: their number and ends, as in [`SIZES`].
const RATIOS: (u32, f64, f64) = (61, 1e-6, 1e6);
/// Number of iterations for which each start is followed before the best are chosen.
const ROUGH_ITERATIONS: u64 = 15;
/// Number of the best starts that are then followed to the end.
const FINALISTS: usize = 3;
/// If a smaller share of the light than this comes from the backing, the film counts as opaque: its thickness has no
/// measurable effect.
const OPAQUE: f64 = 1e-10;

/// Fits every channel.
///
/// # Errors
/// [`Error::Optimiser`] for a defect of this program.
pub fn fit(drawdown: &Drawdown, surface: Surface) -> Result<Vec<Fitted>, Error> {
    let series = drawdown.series.iter().enumerate();
    series.map(|(index, series)| fit_series(index, series, surface)).collect()
}

/// The reflectances of one channel as a least-squares problem in K X and S X, with X a typical thickness; in K/S if all
/// patches are opaque.
struct Problem<'a> {
    patches: &'a [Patch],
    surface: Surface,
    /// Typical thickness. `None` if all are infinite.
    unit: Option<f64>,
    /// Whether every patch has a standard deviation.
    weighted: bool,
}

impl<'a> Problem<'a> {
    fn new(series: &'a Series, surface: Surface) -> Self {
        let finite: Vec<f64> =
            series.patches.iter().map(|p| p.thickness).filter(|x| x.is_finite()).map(f64::ln).collect();
        let mean = finite.iter().sum::<f64>() / count(finite.len().max(1));
        Self {
            patches: &series.patches,
            surface,
            unit: (!finite.is_empty()).then(|| mean.exp()),
            weighted: series.patches.iter().all(|p| p.sigma.is_some()),
        }
    }

    fn unknowns(&self) -> usize {
        if self.unit.is_some() { 2 } else { 1 }
    }

    fn reflectance(&self, patch: &Patch, kx: Dual<f64, 2>, sx: Dual<f64, 2>) -> Dual<f64, 2> {
        let below = match self.unit {
            Some(unit) if patch.thickness.is_finite() => {
                let layers = patch.thickness / unit;
                Film::new(kx * layers, sx * layers).over(Dual::constant(patch.background))
            }
            _ => opaque(kx, sx),
        };
        saunderson(Dual::constant(self.surface.k1), Dual::constant(self.surface.k2), below)
    }

    /// Residuals and their derivatives with respect to K X and S X, divided by the standard deviations if `weighted`.
    fn residuals(&self, kx: f64, sx: f64, weighted: bool) -> Vec<Dual<f64, 2>> {
        let (kx, sx) = (Dual::variable(kx, 0), Dual::variable(sx, 1));
        let residual = |patch: &Patch| {
            let weight = patch.sigma.filter(|_| weighted).map_or(1.0, f64::recip);
            (self.reflectance(patch, kx, sx) - patch.reflectance) * weight
        };
        self.patches.iter().map(residual).collect()
    }

    fn point(&self, x: &DVector<f64>) -> (f64, f64) {
        // With opaque paint the only unknown is K/S.
        let at = |index: usize| x.get(index).copied();
        (at(0).unwrap_or(f64::NAN), at(1).unwrap_or(1.0))
    }
}

impl LeastSquares for Problem<'_> {
    fn linearise(&self, x: &DVector<f64>) -> Linearisation {
        let (kx, sx) = self.point(x);
        let residuals = self.residuals(kx, sx, self.weighted);
        let partial = |row: usize, column: usize| {
            residuals.get(row).and_then(|r| r.partials.get(column)).copied().unwrap_or(f64::NAN)
        };
        Linearisation::dense(
            DMatrix::from_fn(residuals.len(), x.len(), partial),
            DVector::from_iterator(residuals.len(), residuals.iter().map(|r| r.value)),
        )
    }

    fn bounds(&self) -> Vec<(f64, f64)> {
        vec![(0.0, if self.unit.is_some() { MOST } else { BLACKEST }), (0.0, MOST)]
            .into_iter()
            .take(self.unknowns())
            .collect()
    }

    fn cost_floor(&self) -> f64 {
        // Reflectances are at most 1 and accurate to rounding at best.
        let of_patch = |p: &Patch| (f64::EPSILON / p.sigma.filter(|_| self.weighted).unwrap_or(1.0)).powi(2);
        self.patches.iter().map(of_patch).sum()
    }
}

/// A solution without its standard errors.
struct Estimate {
    x: DVector<f64>,
    method: &'static str,
    termination: Option<Termination>,
}

fn fit_series(index: usize, series: &Series, surface: Surface) -> Result<Fitted, Error> {
    let problem = Problem::new(series, surface);
    let found = match closed_form(&problem) {
        Some(x) => Estimate { x, method: "closed-form", termination: None },
        None => by_least_squares(&problem)?,
    };
    Ok(judge(index, &problem, &found))
}

/// The exact solution for two reflectances of one thickness over two backings. `None` in any other case.
fn closed_form(problem: &Problem<'_>) -> Option<DVector<f64>> {
    let [one, two] = problem.patches else { return None };
    if one.thickness != two.thickness || !one.thickness.is_finite() {
        return None;
    }
    let Surface { k1, k2 } = problem.surface;
    let below = [one, two].map(|p| saunderson_inverse(k1, k2, p.reflectance));
    let (kx, sx) = from_two_backings(below, [one.background, two.background])?;
    (kx <= MOST && sx <= MOST).then(|| DVector::from_vec(vec![kx, sx]))
}

fn by_least_squares(problem: &Problem<'_>) -> Result<Estimate, Error> {
    let ratios: Vec<f64> = (0..RATIOS.0).map(|i| even(RATIOS, i)).collect();
    let sizes: Vec<Option<f64>> = match problem.unknowns() {
        1 => vec![None],
        _ => (0..SIZES.0).map(|i| Some(even(SIZES, i))).collect(),
    };
    // For each S X, the K/S that fits best.
    let start = |size: &Option<f64>| {
        let at = |ratio: &f64| match size {
            Some(sx) => DVector::from_vec(vec![ratio * sx, *sx]),
            None => DVector::from_vec(vec![*ratio]),
        };
        let cost = |x: &DVector<f64>| -> f64 {
            let (kx, sx) = problem.point(x);
            problem.residuals(kx, sx, problem.weighted).iter().map(|r| r.value * r.value).sum()
        };
        let within = |x: &DVector<f64>| x.iter().all(|v| *v <= MOST);
        ratios.iter().map(at).filter(within).min_by(|a, b| cost(a).total_cmp(&cost(b)))
    };
    let rough = Tolerances { refinements: 0, ..Tolerances::default() };
    let mut ends = Vec::new();
    for start in sizes.iter().filter_map(start) {
        ends.push(minimise(problem, start, rough, Limits::iterations(ROUGH_ITERATIONS))?);
    }
    ends.sort_by(|a, b| a.cost.total_cmp(&b.cost));
    let mut best = None;
    for end in ends.into_iter().take(FINALISTS) {
        let solution = minimise(problem, end.x, Tolerances::default(), Limits::default())?;
        let better = |(cost, _): &(f64, Estimate)| solution.cost < *cost;
        if best.as_ref().is_none_or(better) {
            let termination = Some(solution.termination);
            best = Some((solution.cost, Estimate { x: solution.x, method: "least-squares", termination }));
        }
    }
    best.map(|(_, found)| found).ok_or_else(|| Error::Optimiser("no start for a drawdown".to_owned()))
}

/// Value number `i` of `n` values between `low` and `high` that are evenly spaced in the logarithm.
fn even((n, low, high): (u32, f64, f64), i: u32) -> f64 {
    low * (high / low).powf(f64::from(i) / f64::from(n - 1))
}

/// Standard deviations of parameters with the derivatives `columns`, in units of the residuals' standard deviation. `None`
/// if the data do not determine them.
fn spread(columns: &[DVector<f64>]) -> Option<Vec<f64>> {
    let n = columns.len();
    let rows = columns.first()?.len();
    let model = Linearisation {
        cost: 1.0,
        ..Linearisation::dense(DMatrix::from_columns(columns), DVector::zeros(rows))
    };
    let spread = model.standard_deviations(n, 1)?;
    spread.iter().all(|s| s.is_finite()).then(|| spread.iter().copied().collect())
}

/// How well K and S are known. Standard deviations are in units of the residuals' size.
struct Certainty {
    /// Whether the backing does not show, so that only K/S counts.
    is_opaque: bool,
    /// Whether K ended at 0.
    at_k: bool,
    /// Whether S ended at 0.
    at_s: bool,
    /// Whether K/S ended at its largest value.
    is_black: bool,
    /// Standard deviations of those of K and S that are not at 0. `None` if they are not determined.
    of_both: Option<Vec<f64>>,
    /// Standard deviation of K/S. `None` if it is not determined, or at a bound.
    of_ratio: Option<f64>,
}

impl Certainty {
    /// `slopes` are the derivatives of each residual with respect to K and S.
    fn new(problem: &Problem<'_>, kx: f64, sx: f64, slopes: &[[f64; 2]]) -> Self {
        let n = slopes.len();
        let column = |f: &dyn Fn([f64; 2]) -> f64| DVector::from_iterator(n, slopes.iter().map(|s| f(*s)));
        let (by_k, by_s) = (column(&|[k, _]| k), column(&|[_, s]| s));
        // Change variables from K and S to K/S and S: dR/d(K/S) = S dR/dK, and dR/dS at constant K/S.
        let by_ratio = &by_k * sx;
        let by_size = &by_s + &by_k * (kx / sx);

        let through = share_of_backing(problem, kx, sx);
        let is_opaque = problem.unit.is_none() || through < OPAQUE || kx >= MOST || sx >= MOST;
        let (at_k, at_s) = (kx <= 0.0, sx <= 0.0);
        let is_black = problem.unit.is_none() && kx >= BLACKEST;

        // Do the reflectances determine K and S? Either may be at a bound; then it does not enter the error of the other.
        let known = n >= problem.unknowns() && !is_opaque && spread(&[by_k.clone(), by_s.clone()]).is_some();
        let free: Vec<DVector<f64>> = [(at_k, by_k), (at_s, by_s)]
            .into_iter()
            .filter(|(at, _)| !at)
            .map(|(_, column)| column)
            .collect();
        let of_both = known.then(|| if free.is_empty() { Some(Vec::new()) } else { spread(&free) }).flatten();
        let of_ratio = match (&of_both, is_opaque) {
            _ if at_k || at_s || is_black => None,
            (Some(_), _) => spread(&[by_ratio, by_size]).and_then(|s| s.first().copied()),
            (None, true) => spread(&[by_ratio]).and_then(|s| s.first().copied()),
            (None, false) => None,
        };
        Self { is_opaque, at_k, at_s, is_black, of_both, of_ratio }
    }

    /// Whether the reflectances determine K and S or, if the backing does not show through, K/S.
    fn determined(&self) -> bool {
        let ratio = self.of_ratio.is_some() || self.at_k || self.at_s || self.is_black;
        self.of_both.is_some() || (self.is_opaque && ratio)
    }
}

/// Derives the complete result of a channel from the K and S found.
fn judge(index: usize, problem: &Problem<'_>, found: &Estimate) -> Fitted {
    let (kx, sx) = problem.point(&found.x);
    let n = problem.patches.len();
    let dof = n.saturating_sub(problem.unknowns());

    // The size of the residuals: 1 if they have standard deviations, otherwise estimated from the residuals of the fit.
    let plain: f64 = problem.residuals(kx, sx, false).iter().map(|r| r.value * r.value).sum();
    let rows = problem.residuals(kx, sx, problem.weighted);
    let cost: f64 = rows.iter().map(|r| r.value * r.value).sum();
    let noise = match (problem.weighted, dof) {
        (true, _) => Some(1.0),
        (false, 0) => None,
        (false, _) => Some((cost / count(dof)).sqrt()),
    };

    // K, S, K/S and the reflectance of an opaque layer, each with its standard error.
    let slopes: Vec<[f64; 2]> = rows.iter().map(|r| r.partials).collect();
    let certainty = Certainty::new(problem, kx, sx, &slopes);
    let determined = certainty.determined();
    let quantity = |value: f64, deviation: Option<f64>| Quantity {
        value,
        std_error: deviation.zip(noise).map(|(deviation, noise)| deviation * noise),
    };
    let mut deviations = certainty.of_both.clone().unwrap_or_default().into_iter();
    let unit = problem.unit.unwrap_or(1.0);
    let mut coefficient = |at: bool, value: f64| {
        let deviation = if at { None } else { deviations.next() };
        certainty.of_both.as_ref().map(|_| quantity(value / unit, deviation.map(|d| d / unit)))
    };
    let (k, s) = (coefficient(certainty.at_k, kx), coefficient(certainty.at_s, sx));
    let ratio = kx / sx;
    let k_over_s = (determined && ratio.is_finite()).then(|| quantity(ratio, certainty.of_ratio));
    let r_inf = k_over_s.map(|_| {
        let r: Dual<f64, 1> = opaque(Dual::variable(ratio, 0), Dual::constant(1.0));
        let [slope] = r.partials;
        quantity(r.value, certainty.of_ratio.map(|d| d * slope.abs()))
    });

    let converged = found.termination.is_none_or(|t| t.converged() || is_exact(cost, problem));
    Fitted {
        series: index,
        k,
        s,
        k_over_s,
        r_inf,
        n,
        dof,
        rms: (plain / count(n.max(1))).sqrt(),
        reduced_chi2: (problem.weighted && dof > 0).then(|| cost / count(dof)),
        method: found.method,
        reason: found.termination.map_or("exact", Termination::name),
        usable: converged && determined,
        remarks: remarks(problem, converged, &certainty, noise.is_some()),
    }
}

/// The warnings about a result.
fn remarks(problem: &Problem<'_>, converged: bool, certainty: &Certainty, has_errors: bool) -> Vec<Remark> {
    let determined = certainty.determined();
    let mut remarks = Vec::new();
    if !converged {
        remarks.push(Remark::NotConverged);
    } else if !determined && problem.patches.len() < problem.unknowns() {
        remarks.push(Remark::OneReflectance);
    } else if !determined {
        remarks.push(Remark::NotSeparated);
    } else if certainty.is_opaque && problem.unit.is_some() {
        remarks.push(Remark::Opaque);
    }
    if determined && certainty.at_k {
        remarks.push(Remark::NoAbsorption);
    } else if determined && certainty.at_s {
        remarks.push(Remark::NoScattering);
    }
    if certainty.is_black {
        remarks.push(Remark::Black);
    }
    if determined && !has_errors {
        remarks.push(Remark::NoErrors);
    }
    remarks
}

/// Whether the residuals are only rounding; then it does not matter that no step reduces them.
fn is_exact(cost: f64, problem: &Problem<'_>) -> bool {
    cost <= 100.0 * problem.cost_floor()
}

/// The largest share of the reflected light, over all patches, that has reached the backing and returned.
fn share_of_backing(problem: &Problem<'_>, kx: f64, sx: f64) -> f64 {
    let of_patch = |patch: &Patch| {
        let layers = patch.thickness / problem.unit.unwrap_or(1.0);
        let film = Film::new(kx * layers, sx * layers);
        if layers.is_finite() { film.over(1.0) - film.reflectance() } else { 0.0 }
    };
    problem.patches.iter().map(of_patch).fold(0.0, f64::max)
}
