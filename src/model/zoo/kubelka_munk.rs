//! Kubelka-Munk: the diffuse reflectance of paint, from the absorption and scattering of its pigment.
//!
//! ```text
//! f = (1 - k1)(1 - k2) R/(1 - k2 R)/pi
//! layer=opaque   R = 1 + K/S - sqrt((K/S)^2 + 2 K/S)
//! layer=film     R = (1 - rg (a - b coth(b SX)))/(a - rg + b coth(b SX)),   a = 1 + KX/SX,  b = sqrt(a^2 - 1)
//! ```
//!
//! | parameter | with | unit | bounds | meaning |
//! |---|---|---|---|---|
//! | k_over_s | opaque | 1 | 1e-6..1e6 | absorption over scattering, K/S; 0.01 white paint, 1 middle grey, 20 black |
//! | kx | film | 1 | 1e-6..1e4 | absorption times thickness, K X |
//! | sx | film | 1 | 0..1e4 | scattering times thickness, S X; fixed at 1 unless freed |
//! | rg | film | 1 | 0..1 | reflectance of the background, Rg; fixed at 1 unless freed |
//! | k1 | both | 1 | 0..0.99 | share of light from outside that the surface reflects; fixed at 0 unless freed |
//! | k2 | both | 1 | 0..0.99 | share of diffuse light from inside that it reflects; fixed at 0 unless freed |
//!
//! Kubelka and Munk 1931; Kubelka 1948, doi:10.1364/JOSA.38.000448; k1 and k2: Saunderson 1942,
//! doi:10.1364/JOSA.32.000727. The formulas for layers are in [`paint_layers`](crate::model::parts::paint_layers); `brdfit kubelka-munk` fits K and S to
//! reflectances over known backings (docs/use/kubelka-munk.md).
//!
//! A BRDF determines only one number of all these, the albedo: each parameter alone is another way to write `lambert.kd`, and
//! two free at once are not determined, which the fit reports. So one per channel is free, on a logarithmic scale, since K/S
//! spans decades. The others are fixed unless freed; fix them at values that are known from elsewhere
//! (`--fix sx=3 --fix rg=0.8`). rg is 1 by default because then every albedo from 0 to 1 belongs to some KX, whatever SX is.
//!
//! Departures: Saunderson's k1 itself, the reflection at the surface, is left out, because it is not diffuse: it belongs to a
//! specular lobe that is added to this one (`kubelka-munk + cook-torrance`); the corresponding loss, 1 - k1, stays. k1 and k2
//! are 0 by default, so that K/S is that of the visible reflectance, as in tables of K/S = (1 - R)^2/(2R). For the pigment
//! below a glossy surface of index 1.5 use `--fix k1=0.04 --fix k2=0.596`; for a grey that reflects 0.2, K/S is then 0.3 times
//! as large. K and S assume isotropic scattering: they are not the coefficients sigma_a, sigma_s of a transport equation.
//!
//! Reciprocal, and energy conserving, since R is at most 1. The same at all angles, including grazing.

use crate::geometry::Geometry;
use crate::math::Scalar;
use crate::model::parts::paint_layers::{Film, opaque, opaque_absorptance, through_surface_of};
use crate::model::{
    Choices, Kernel, Model, ModelOption, ParamSpec, Part, Scale, Sharing, Strength, Values, Visitor,
};
use std::f64::consts::FRAC_1_PI;

/// The diffuse reflectance of paint.
#[derive(Clone, Copy, Debug)]
pub struct KubelkaMunk {
    /// Whether the layer hides its background.
    opaque: bool,
}

impl Kernel for KubelkaMunk {
    type Prepared<T: Scalar> = ();
    type Output<T: Scalar> = [T; 1];

    #[inline(always)]
    fn at<T: Scalar>((): &(), _: &Geometry<T::Real>) -> [T; 1] {
        [T::constant(FRAC_1_PI)]
    }
}

impl Part for KubelkaMunk {
    type Kernel = Self;
    const SHAPES: usize = 0;

    fn prepare<T: Scalar>(_: Values<'_, T>) {}
}

impl Model for KubelkaMunk {
    type Coefficients<T: Scalar> = [T; 1];

    const NAME: &'static str = "kubelka-munk";
    const SUMMARY: &'static str = "diffuse base of paint, by absorption and scattering";
    const REFERENCE: &'static str = "Kubelka 1948, New Contributions to the Optics of Intensely Light-Scattering \
                                     Materials, doi:10.1364/JOSA.38.000448";
    const OPTIONS: &'static [ModelOption] = &[ModelOption {
        key: "layer",
        summary: "opaque paint, or a film over a background",
        values: || vec!["opaque", "film"],
        default: "opaque",
    }];

    fn build(choices: &Choices) -> Self {
        Self { opaque: choices.get("layer") == "opaque" }
    }

    fn parameters(&self) -> Vec<ParamSpec> {
        let decades = |name, summary, bounds, initial| {
            let spec = ParamSpec::amplitude(name, summary, 1.0, initial);
            ParamSpec { bounds, typical: (1e-3, 1e2), scale: Scale::Log, ..spec }
        };
        let known = |name, summary, upper, value| {
            let spec = ParamSpec::amplitude(name, summary, upper, value).fixed();
            ParamSpec { sharing: Sharing::Shared, ..spec }
        };
        let mut parameters = if self.opaque {
            vec![decades("k_over_s", "absorption over scattering K/S", (1e-6, 1e6), 1.6)]
        } else {
            vec![
                decades("kx", "absorption times thickness KX", (1e-6, 1e4), 1.0),
                known("sx", "scattering times thickness SX", 1e4, 1.0),
                known("rg", "reflectance of the background", 1.0, 1.0).per_channel(),
            ]
        };
        parameters.push(known("k1", "reflectance of the surface from outside", 0.99, 0.0));
        parameters.push(known("k2", "reflectance of the surface from inside", 0.99, 0.0));
        parameters
    }

    fn visit(&self, visitor: &mut impl Visitor) {
        visitor.part::<Self>(0);
    }

    fn coefficients<T: Scalar>(&self, mut amplitudes: Values<'_, T>) -> [T; 1] {
        let (r, absorptance) = if self.opaque {
            let ([ratio], one) = (amplitudes.take(), T::constant(1.0));
            (opaque(ratio, one), opaque_absorptance(ratio, one))
        } else {
            let [kx, sx, rg] = amplitudes.take();
            let film = Film::new(kx, sx);
            (film.over(rg), film.absorptance_over(rg))
        };
        let [k1, k2] = amplitudes.take();
        [through_surface_of(k1, k2, r, absorptance)]
    }

    fn strength(&self) -> Strength {
        Strength::Missing
    }
}
