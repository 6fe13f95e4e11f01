//! Widths of distributions, given by the angle beta at which they fall to half of their peak.
//!
//! Blinn 1977 (doi:10.1145/563858.563893) compares three distributions by that angle, each scaled to a peak of 1:
//!
//! ```text
//! D1 = cos^c1(a)                              c1 = -ln 2/ln cos(beta)                                Phong
//! D2 = exp(-(c2 a)^2)                         c2 = sqrt(ln 2)/beta                                   Torrance-Sparrow
//! D3 = (c3^2/(cos^2 a (c3^2 - 1) + 1))^2      c3 = sqrt((cos^2 beta - 1)/(cos^2 beta - sqrt 2))      Trowbridge-Reitz
//! ```
//!
//! They are this crate's `blinn-phong` with exponent c1, `gaussian` with m = 1/c2 and `ggx` with m = c3, each divided by its
//! peak. Some texts print D3 without its square. beta lies between 0 and 90 degrees.

/// The exponent c1 of a power of the cosine that is 1/2 at `beta` radians.
#[must_use]
pub fn phong_exponent(beta: f64) -> f64 {
    let sin2 = beta.sin().powi(2);
    // This form of ln cos avoids the digits that 1 - sin^2 would lose.
    -std::f64::consts::LN_2 / (0.5 * crate::math::Scalar::ln_1p(-sin2))
}

/// The roughness m with which `blinn-phong` is half of its peak at `beta` radians.
#[must_use]
pub fn blinn_phong_m(beta: f64) -> f64 {
    (2.0 / (phong_exponent(beta) + 2.0)).sqrt()
}

/// The roughness m = 1/c2 with which `gaussian` is half of its peak at `beta` radians.
#[must_use]
pub fn gaussian_m(beta: f64) -> f64 {
    beta / std::f64::consts::LN_2.sqrt()
}

/// The roughness m = c3 with which `ggx` is half of its peak at `beta` radians.
#[must_use]
pub fn ggx_m(beta: f64) -> f64 {
    // (1 - cos^2)/(sqrt 2 - cos^2)
    (beta.sin().powi(2) / (std::f64::consts::SQRT_2 - beta.cos().powi(2))).sqrt()
}
