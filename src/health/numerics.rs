//! Counts values and derivatives that are infinite or NaN, and the digits that a formula keeps.
//!
//! Directions and parameters are first rounded to the type under test; the same formulas then run on them in that type and
//! in [`Wide`]. So only rounding inside the formula is counted, not the rounding of its arguments. Deliberate
//! approximations, such as tables and truncated series, are the same in both and do not count.

use super::angles::{Angles, angles, written};
use super::physics;
use crate::geometry::{Block, Geometry, Pair, direction};
use crate::math::{Real, Wide};
use crate::model::{BasisBlock, Derivatives, Expression, LobeValues, Role};
use serde::Serialize;

/// How many values and derivatives are infinite or NaN.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Unfinished {
    /// Number of values that are.
    pub values: usize,
    /// Number of derivatives that are.
    pub derivatives: usize,
    /// Number of values and derivatives that were checked.
    pub tried: usize,
    /// Lobe and directions of the first one; null if there is none.
    pub first: Option<String>,
}

/// Digits kept in both precisions.
#[derive(Clone, Debug, Serialize)]
pub struct Digits {
    /// In double precision, of 16.
    pub f64: Kept,
    /// In single precision, of 7.
    pub f32: Kept,
}

/// Digits kept in one precision.
#[derive(Clone, Debug, Serialize)]
pub struct Kept {
    /// The smallest number over all pairs; null if every value is too small to have full precision.
    pub least: Option<LeastKept>,
    /// The median over all pairs; null likewise.
    pub median: Option<f64>,
    /// Number of pairs of directions at which digits were counted.
    pub pairs: usize,
}

/// Where the fewest digits are kept.
#[derive(Clone, Debug, Serialize)]
pub struct LeastKept {
    /// Number of digits.
    pub digits: f64,
    /// Directions, degrees: theta_i, phi_i, theta_o, phi_o.
    pub at_deg: Angles,
}

/// Pairs of directions at which formulas divide by 0 or nearly so: along the normal, mirrored, returned, and at or near
/// the horizon: both on the same side, on opposite sides, or only one of them.
fn extremes() -> Vec<Pair> {
    let at = |theta: f64, phi: f64| direction(theta.to_radians(), phi.to_radians());
    let mut pairs = vec![
        Pair { wi: at(0.0, 0.0), wo: at(0.0, 0.0) },
        Pair { wi: at(40.0, 0.0), wo: at(40.0, 180.0) },
        Pair { wi: at(40.0, 0.0), wo: at(40.0, 0.0) },
    ];
    for grazing in [89.9, 90.0 - 1e-7, 90.0] {
        pairs.extend(
            [
                (at(0.0, 0.0), 0.0),
                (at(grazing, 0.0), 180.0),
                (at(grazing, 0.0), 0.0),
                (at(grazing, 0.0), 90.0),
                (at(60.0, 0.0), 30.0),
            ]
            .map(|(wi, phi)| Pair { wi, wo: at(grazing, phi) }),
        );
    }
    pairs
}

/// Counts values and derivatives that are not finite in the extreme directions, at the parameters of every lobe.
pub(super) fn at_extremes(expression: &Expression, lobes: &[LobeValues]) -> Unfinished {
    let mut found = Unfinished::default();
    for (lobe, LobeValues { shapes, amplitudes }) in expression.lobes().iter().zip(lobes) {
        count(&mut found, lobe, shapes, amplitudes, "");
    }
    found
}

/// Counts values and derivatives that are not finite in the extreme directions, at every corner of the bounds of the
/// shapes.
pub(super) fn at_bounds(expression: &Expression) -> Unfinished {
    let mut found = Unfinished::default();
    for lobe in expression.lobes() {
        let specs = lobe.parameters();
        let of = |role: Role| specs.iter().filter(move |spec| spec.role == role);
        let bounds: Vec<(f64, f64)> = of(Role::Shape)
            .map(|spec| (spec.in_formula_units(spec.bounds.0), spec.in_formula_units(spec.bounds.1)))
            .collect();
        let amplitudes: Vec<f64> = of(Role::Amplitude).map(|spec| spec.bounds.1.min(1.0)).collect();
        // Shapes beyond the fourth are at the same end as the fourth: sixteen corners are enough.
        for corner in 0..1_usize << bounds.len().min(4) {
            let upper = |j: usize| corner >> j.min(3) & 1 == 1;
            let ends = bounds.iter().enumerate().map(|(j, (low, high))| if upper(j) { *high } else { *low });
            let shapes: Vec<f64> = ends.collect();
            let place = format!(" with shapes {shapes:?}");
            count(&mut found, lobe, &shapes, &amplitudes, &place);
        }
    }
    found
}

fn count(found: &mut Unfinished, lobe: &crate::model::Lobe, shapes: &[f64], amplitudes: &[f64], place: &str) {
    let pairs = extremes();
    let mut block = Block::new();
    block.fill(pairs.iter().map(Pair::geometry));
    let mut basis = BasisBlock::default();
    lobe.model.evaluate(&block, shapes, Derivatives::All, &mut basis);
    let coefficients = lobe.coefficients(amplitudes);
    for (index, pair) in pairs.iter().enumerate() {
        let sum = |rows: &[crate::geometry::Row], by: &[f64]| -> f64 {
            assert_eq!(rows.len(), by.len(), "one coefficient per basis function");
            rows.iter().zip(by).map(|(row, a)| a * row[index]).sum()
        };
        let value = sum(basis.values(), &coefficients.values);
        let by_shape = (0..shapes.len()).map(|shape| sum(basis.partials(shape), &coefficients.values));
        let by_amplitude = coefficients.partials.iter().map(|partials| sum(basis.values(), partials));
        let derivatives = by_shape.chain(by_amplitude).filter(|d| !d.is_finite()).count();
        let values = usize::from(!value.is_finite());
        found.tried += 1 + shapes.len() + amplitudes.len();
        found.values += values;
        found.derivatives += derivatives;
        if values + derivatives > 0 && found.first.is_none() {
            found.first = Some(format!("({} at {} deg{place})", lobe.name, written(&angles(pair))));
        }
    }
}

/// Values in the precision `R`, and wide ones at the same arguments.
fn both<R: Real>(
    expression: &Expression,
    lobes: &[LobeValues],
    pairs: &[Pair],
    widen: impl Fn(R) -> Wide + Copy,
) -> (Vec<Wide>, Vec<Wide>) {
    let geometries: Vec<([R; 3], [R; 3])> = pairs
        .iter()
        .map(|pair| (pair.wi.to_array().map(R::literal), pair.wo.to_array().map(R::literal)))
        .collect();
    let rounded = |values: &Vec<f64>| values.iter().map(|v| R::literal(*v)).collect::<Vec<R>>();
    let parameters: Vec<LobeValues<R>> = lobes
        .iter()
        .map(|of| LobeValues { shapes: rounded(&of.shapes), amplitudes: rounded(&of.amplitudes) })
        .collect();
    let all_wide = |values: &Vec<R>| values.iter().map(|v| widen(*v)).collect::<Vec<Wide>>();
    let wide_parameters: Vec<LobeValues<Wide>> = parameters
        .iter()
        .map(|of| LobeValues { shapes: all_wide(&of.shapes), amplitudes: all_wide(&of.amplitudes) })
        .collect();
    let narrow: Vec<Geometry<R>> = geometries.iter().map(|(wi, wo)| Geometry::new(*wi, *wo)).collect();
    let wide: Vec<Geometry<Wide>> =
        geometries.iter().map(|(wi, wo)| Geometry::new(wi.map(widen), wo.map(widen))).collect();
    let found = expression.values_in::<R>(&narrow, &parameters);
    let exact = expression.values_in::<Wide>(&wide, &wide_parameters);
    (found.into_iter().map(widen).collect(), exact)
}

/// Counts the digits that the values of a model keep.
pub(super) fn digits(expression: &Expression, lobes: &[LobeValues], pairs: usize) -> Digits {
    let pairs = physics::pairs(pairs);
    // Below this, intermediate results are so small that even the wide number loses digits.
    const SMALL_DOUBLE: f64 = 1e-280;
    let (double, (single, exact_single)) = rayon::join(
        || both::<f64>(expression, lobes, &pairs, Wide::literal),
        || both::<f32>(expression, lobes, &pairs, |x| Wide::literal(f64::from(x))),
    );
    let smallest = f64::from(f32::MIN_POSITIVE);
    Digits {
        f64: kept(&pairs, &double.0, &double.1, f64::EPSILON, (SMALL_DOUBLE, f64::MAX)),
        f32: kept(&pairs, &single, &exact_single, f64::from(f32::EPSILON), (smallest, f64::from(f32::MAX))),
    }
}

/// Number of digits that `found` shares with `exact`, at the pairs where `exact` is within `range`.
fn kept(pairs: &[Pair], found: &[Wide], exact: &[Wide], epsilon: f64, range: (f64, f64)) -> Kept {
    assert_eq!(found.len(), pairs.len(), "one value per pair");
    assert_eq!(exact.len(), pairs.len(), "one exact value per pair");
    let mut digits: Vec<(f64, &Pair)> = Vec::new();
    for ((found, exact), pair) in found.iter().zip(exact).zip(pairs) {
        let size = exact.abs().rounded();
        if !(size >= range.0 && size <= range.1) {
            continue;
        }
        let error = ((*found - *exact) / *exact).abs().rounded();
        // NaN and infinity have 0 digits, and no value has more digits than its type.
        let error = if error.is_finite() { error.clamp(0.5 * epsilon, 1.0) } else { 1.0 };
        digits.push((-error.log10(), pair));
    }
    digits.sort_by(|a, b| a.0.total_cmp(&b.0));
    Kept {
        least: digits.first().map(|(digits, pair)| LeastKept { digits: *digits, at_deg: angles(pair) }),
        median: digits.get(digits.len() / 2).map(|(digits, _)| *digits),
        pairs: digits.len(),
    }
}
