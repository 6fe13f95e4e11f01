//! Roughness, the same in all directions or different along x and y.
//!
//! Distributions that are stretched copies of one another depend on the geometry only through a few quantities, which are
//! given here for one roughness m and for two, mx and my (Heitz 2014, section 5.3, <https://jcgt.org/published/0003/02/03/>):
//!
//! ```text
//! product          mx my
//! squared_slope    (hx^2/mx^2 + hy^2/my^2)/hz^2              squared slope of the facet, in units of the roughness
//! stretched        mx my hz^2 + my/mx hx^2 + mx/my hy^2
//! projected_slope2 mx^2 vx^2 + my^2 vy^2                     (roughness seen from v, times sin(theta))^2
//! ```

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::{ParamSpec, Scale, Sharper, Values};

/// One or two roughnesses.
pub trait Roughness: 'static {
    /// Number of shapes that determine it.
    const SHAPES: usize;
    /// Quantities that depend only on the shapes.
    type Prepared<T: Scalar>: Copy + Send + Sync + 'static;

    /// The parameters: m, or mx and my.
    fn parameters() -> Vec<ParamSpec>;

    /// Takes the shapes, and computes the quantities that depend only on them.
    fn prepare<T: Scalar>(shapes: &mut Values<'_, T>) -> Self::Prepared<T>;

    /// mx^2 vx^2 + my^2 vy^2.
    fn projected_slope2<T: Scalar>(prepared: &Self::Prepared<T>, v: [T::Real; 3]) -> T;

    /// mx my.
    fn product<T: Scalar>(prepared: &Self::Prepared<T>) -> T;

    /// (hx^2/mx^2 + hy^2/my^2)/hz^2.
    fn squared_slope<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> T;

    /// mx my hz^2 + my/mx hx^2 + mx/my hy^2.
    fn stretched<T: Scalar>(prepared: &Self::Prepared<T>, g: &Geometry<T::Real>) -> T;
}

/// The declaration of a roughness as a parameter.
#[must_use]
pub fn roughness(name: &'static str, summary: &'static str) -> ParamSpec {
    ParamSpec::shape(name, summary, (1e-4, 1.0), (1e-3, 1.0), 0.2, Scale::Log)
}

/// One roughness, the same in all directions.
pub(crate) struct Isotropic;

/// m^2 and its inverse.
#[derive(Clone, Copy, Debug)]
pub struct One<T> {
    m2: T,
    inverse: T,
}

impl<T: Scalar> One<T> {
    /// Makes it from m^2.
    pub(super) fn squared(m2: T) -> Self {
        Self { m2, inverse: m2.recip() }
    }
}

impl Roughness for Isotropic {
    const SHAPES: usize = 1;
    type Prepared<T: Scalar> = One<T>;

    fn parameters() -> Vec<ParamSpec> {
        vec![roughness("m", "roughness").sharper_when(Sharper::Smaller)]
    }

    fn prepare<T: Scalar>(shapes: &mut Values<'_, T>) -> One<T> {
        let [m] = shapes.take();
        One::squared(m * m)
    }

    #[inline(always)]
    fn projected_slope2<T: Scalar>(one: &One<T>, [x, y, _]: [T::Real; 3]) -> T {
        let x2: T::Real = x * x;
        one.m2 * (x2 + y * y)
    }

    #[inline(always)]
    fn product<T: Scalar>(one: &One<T>) -> T {
        one.m2
    }

    #[inline(always)]
    fn squared_slope<T: Scalar>(one: &One<T>, g: &Geometry<T::Real>) -> T {
        one.inverse * g.tan2_h()
    }

    #[inline(always)]
    fn stretched<T: Scalar>(one: &One<T>, g: &Geometry<T::Real>) -> T {
        let cos2: T::Real = g.cos_h() * g.cos_h();
        one.m2 * cos2 + g.sin2_h()
    }
}

/// Two roughnesses, along x and y.
pub(crate) struct Anisotropic;

/// Products and quotients of mx and my.
#[derive(Clone, Copy, Debug)]
pub struct Two<T> {
    mx2: T,
    my2: T,
    inverse_mx2: T,
    inverse_my2: T,
    product: T,
    ratio: T,
    inverse_ratio: T,
}

impl Roughness for Anisotropic {
    const SHAPES: usize = 2;
    type Prepared<T: Scalar> = Two<T>;

    fn parameters() -> Vec<ParamSpec> {
        vec![
            roughness("mx", "roughness along x").sharper_when(Sharper::Smaller),
            roughness("my", "roughness along y").isotropic_as("mx"),
        ]
    }

    fn prepare<T: Scalar>(shapes: &mut Values<'_, T>) -> Two<T> {
        let [mx, my] = shapes.take();
        let (mx2, my2): (T, T) = (mx * mx, my * my);
        Two {
            mx2,
            my2,
            inverse_mx2: mx2.recip(),
            inverse_my2: my2.recip(),
            product: mx * my,
            ratio: my / mx,
            inverse_ratio: mx / my,
        }
    }

    #[inline(always)]
    fn projected_slope2<T: Scalar>(two: &Two<T>, [x, y, _]: [T::Real; 3]) -> T {
        let (x2, y2): (T::Real, T::Real) = (x * x, y * y);
        two.mx2 * x2 + two.my2 * y2
    }

    #[inline(always)]
    fn product<T: Scalar>(two: &Two<T>) -> T {
        two.product
    }

    #[inline(always)]
    fn squared_slope<T: Scalar>(two: &Two<T>, g: &Geometry<T::Real>) -> T {
        let [x, y, z] = g.h;
        let (x, y): (T::Real, T::Real) = (x / z, y / z);
        let (x2, y2): (T::Real, T::Real) = (x * x, y * y);
        two.inverse_mx2 * x2 + two.inverse_my2 * y2
    }

    #[inline(always)]
    fn stretched<T: Scalar>(two: &Two<T>, g: &Geometry<T::Real>) -> T {
        let [x2, y2, z2]: [T::Real; 3] = g.h.map(|component| component * component);
        two.product * z2 + two.ratio * x2 + two.inverse_ratio * y2
    }
}
