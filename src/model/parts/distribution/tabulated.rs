//! A table of D instead of a formula, estimated from the data like any other parameters.
//!
//! On logarithmic axes, v = ln(1 + tan^2/m^2) and ln(D cos^4), the table is the local exponent s(v) at fixed knots,
//! linear between them and constant beyond the last:
//!
//! ```text
//! D cos^4 = exp(-int_0^v s(v') dv') / (pi m^2 n),   n = int_0^inf exp(v - int_0^v s) dv
//! knots     v = 0.5   1     2     3     4.5   6     8
//!           tan/m = 0.8   1.3   2.5   4.4   9.4   20    55
//! ```
//!
//! | parameter | unit | bounds | meaning |
//! |---|---|---|---|
//! | m | 1 | 1e-4..1 | roughness of the peak, where s = 2 |
//! | s1 .. s7 | 1 | 0..50, the last 1.6..50 | exponents at the knots; all 2 is GGX, e^v Beckmann, constant beyond the peak STD; s7 is fixed at 2 unless freed |
//!
//! With s >= 0, D cos^4 is monotone, and its logarithm has a continuous slope. The curvature of the peak defines m (s(0) = 2,
//! the exponent that GGX and Beckmann share there), so that m and the exponents do not trade off. The table helps to decide
//! whether an error comes from the model or from the data: the error that remains is not due to the distribution. The
//! normalisation and Smith's shadowing ([`SlopeTable`]) follow from the table. Dupuy, Heitz, Iehl, Poulin and Ostromoukhov
//! 2015 (doi:10.1145/2816795.2818067) estimate a table from backscattered light by a power iteration; here all data are used,
//! F and the amplitudes are fitted as well, and every exponent has a standard error. Knots that no sample reaches (for m > 0.3,
//! tan > 20 m is too close to the horizon) are not determined: their exponents have no standard error and, because of the
//! normalisation, the strength of F has none either; `--fix s6=2` and so on leaves them out.

use super::roughness::{One, roughness};
use super::slope_table::{ScaledTable, TableOfSlopes};
use super::{FacetDistribution, Isotropic, SlopeTable, exp_times};
use crate::geometry::Geometry;
use crate::math::{GaussLegendre, Scalar};
use crate::model::{ParamSpec, Scale, Sharper, Values};
use std::f64::consts::FRAC_1_PI;
use std::sync::LazyLock;

pub(super) struct Tabulated;

/// Number of exponents in addition to that of the peak.
const EXPONENTS: usize = 7;
/// Beginning and length of each segment between knots.
const SEGMENTS: [(f64, f64); EXPONENTS] =
    [(0.0, 0.5), (0.5, 0.5), (1.0, 1.0), (2.0, 1.0), (3.0, 1.5), (4.5, 1.5), (6.0, 2.0)];
/// The last knot.
const END: f64 = 8.0;
/// The exponent of the peak.
const AT_PEAK: f64 = 2.0;

static RULE: LazyLock<GaussLegendre> = LazyLock::new(|| GaussLegendre::new(24));

/// The table: for each knot, from the peak on, the exponent at the knot and half of its slope up to the next knot.
#[derive(Clone, Copy, Debug)]
pub struct Exponents<T> {
    knots: [[T; 2]; EXPONENTS + 1],
}

impl<T: Scalar> Exponents<T> {
    fn new(exponents: [T; EXPONENTS]) -> Self {
        let mut before = T::constant(AT_PEAK);
        let mut knots = [[before, T::constant(0.0)]; EXPONENTS + 1];
        let mut places = knots.iter_mut();
        for (exponent, (_, width)) in exponents.into_iter().zip(SEGMENTS) {
            if let Some(place) = places.next() {
                *place = [before, (exponent - before).times(0.5 / width)];
            }
            before = exponent;
        }
        if let Some(last) = places.next() {
            *last = [before, T::constant(0.0)];
        }
        Self { knots }
    }

    /// int_0^v s
    #[inline(always)]
    fn integral(&self, v: T) -> T {
        let zero = T::constant(0.0);
        let [.., [last, _]] = self.knots;
        let mut rest = v;
        let mut sum = zero;
        for ([exponent, half_slope], (_, width)) in self.knots.into_iter().zip(SEGMENTS) {
            let width = T::constant(width);
            // The part of v inside the segment.
            let inside = T::if_less(rest.value(), width.value(), rest, width);
            sum = sum + inside * (exponent + half_slope * inside);
            rest = rest - inside;
        }
        sum + last * rest
    }

    /// The integral of exp(v - int s) over all v.
    fn normaliser(&self) -> T {
        let integrand = |v: T| (v - self.integral(v)).exp();
        let segment = |(start, width): (f64, f64)| {
            RULE.integrate(T::constant(start), T::constant(start + width), integrand)
        };
        let inside = SEGMENTS.into_iter().map(segment).fold(T::constant(0.0), |sum, term| sum + term);
        let [.., [last, _]] = self.knots;
        inside + integrand(T::constant(END)) / last.plus(-1.0)
    }
}

impl FacetDistribution for Tabulated {
    const SHAPES: usize = 1 + EXPONENTS;
    const DENSITY_TAKES_LONG: bool = true;
    const SMITH_TAKES_LONG: bool = true;
    type Smith = TableOfSlopes<Isotropic>;
    type Beckmann = Isotropic;
    /// 1/m^2, D at the normal, the table.
    type Prepared<T: Scalar> = (T, T, Exponents<T>);

    fn parameters() -> Vec<ParamSpec> {
        const NAMES: [&str; EXPONENTS] = ["s1", "s2", "s3", "s4", "s5", "s6", "s7"];
        const SUMMARIES: [&str; EXPONENTS] = [
            "exponent at tan = 0.8 m",
            "exponent at tan = 1.3 m",
            "exponent at tan = 2.5 m",
            "exponent at tan = 4.4 m",
            "exponent at tan = 9.4 m",
            "exponent at tan = 20 m",
            "exponent from tan = 55 m on",
        ];
        let exponent = |(index, (name, summary)): (usize, (&'static str, &'static str))| {
            // The mean slope of the tail must be finite.
            let least = if index + 1 == EXPONENTS { 1.6 } else { 0.0 };
            let spec = ParamSpec::shape(name, summary, (least, 50.0), (1.6, 4.0), AT_PEAK, Scale::Linear);
            // Hardly any measurement reaches facets so steep; their effect on the normalisation is like that of another f0.
            if index + 1 == EXPONENTS { spec.unscanned().fixed() } else { spec.unscanned() }
        };
        let roughness = roughness("m", "roughness of the peak").sharper_when(Sharper::Smaller);
        [roughness].into_iter().chain(NAMES.into_iter().zip(SUMMARIES).enumerate().map(exponent)).collect()
    }

    fn prepare<T: Scalar>(mut shapes: Values<'_, T>) -> Self::Prepared<T> {
        let [m] = shapes.take();
        let table = Exponents::new(shapes.take());
        let inverse_m2: T = (m * m).recip();
        (inverse_m2, inverse_m2.times(FRAC_1_PI) / table.normaliser(), table)
    }

    #[inline(always)]
    fn density<T: Scalar>((inverse_m2, peak, table): &Self::Prepared<T>, g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        let cos4: T::Real = cos2 * cos2;
        let v = (*inverse_m2 * g.tan2_h()).ln_1p();
        exp_times(-table.integral(v), *peak / cos4)
    }

    fn prepare_smith<T: Scalar>(mut shapes: Values<'_, T>) -> ScaledTable<Isotropic, T> {
        let [m] = shapes.take();
        let table = Exponents::<T>::new(shapes.take());
        let peak = table.normaliser().recip().times(FRAC_1_PI);
        let density = |u2: T| (-table.integral(u2.ln_1p())).exp() * peak;
        (One::squared(m * m), SlopeTable::new(&density))
    }
}
