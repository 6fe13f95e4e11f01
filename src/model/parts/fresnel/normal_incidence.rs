//! Reflectance at normal incidence: conversion from and to the index of refraction, and values for named materials.
//!
//! ```text
//! f0 = ((eta - 1)^2 + k^2)/((eta + 1)^2 + k^2),     eta = (1 + sqrt f0)/(1 - sqrt f0) for k = 0
//! ```

/// f0 of a dielectric with refractive index `eta`: 0 for an index of 1, 1 for an infinite index.
#[must_use]
pub fn f0_of_eta(eta: f64) -> f64 {
    if eta.is_infinite() { 1.0 } else { ((eta - 1.0) / (eta + 1.0)).powi(2) }
}

/// The refractive index, at least 1, of a dielectric with reflectance `f0` at normal incidence; infinite for `f0` = 1.
#[must_use]
pub fn eta_of_f0(f0: f64) -> f64 {
    let r = f0.sqrt();
    (1.0 + r) / (1.0 - r)
}

/// f0 of a conductor with complex refractive index `eta` + i `k`.
#[must_use]
pub fn f0_of_index(eta: f64, k: f64) -> f64 {
    ((eta - 1.0).powi(2) + k * k) / ((eta + 1.0).powi(2) + k * k)
}

/// The known f0 of a material: one number, or r, g and b in linear sRGB.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// The same in all channels.
    Grey(f64),
    /// Red, green and blue.
    Rgb([f64; 3]),
}

/// Names of the materials. f0 of dielectrics follows from their index at 589 nm, rounded as in textbooks. Metals are from the
/// table of Akenine-Moller, Haines and Hoffman 2008, Real-Time Rendering, 3rd edition, section 7.5.3, which is also in
/// Hoffman's notes for the course Physically-Based Shading Models in Film and Game Production (SIGGRAPH 2010).
pub const NAMES: [&str; 9] =
    ["water", "plastic", "glass", "diamond", "copper", "aluminium", "gold", "silver", "iron"];

/// f0 of the material `name`. `None` if it is not known.
#[must_use]
pub fn known_f0(name: &str) -> Option<Known> {
    Some(match name {
        "water" => Known::Grey(f0_of_eta(1.333)),
        "plastic" | "glass" => Known::Grey(f0_of_eta(1.5)),
        "diamond" => Known::Grey(f0_of_eta(2.417)),
        "copper" => Known::Rgb([0.95, 0.64, 0.54]),
        "aluminium" => Known::Rgb([0.91, 0.92, 0.92]),
        "gold" => Known::Rgb([1.00, 0.71, 0.29]),
        "silver" => Known::Rgb([0.95, 0.93, 0.88]),
        "iron" => Known::Rgb([0.56, 0.57, 0.58]),
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    #[test]
    fn index_and_back() {
        assert_eq!((f0_of_eta(1.0), eta_of_f0(0.0)), (0.0, 1.0));
        assert_eq!((f0_of_eta(f64::INFINITY), eta_of_f0(1.0)), (1.0, f64::INFINITY));
        for eta in [1.0 + 1e-9, 1.333, 1.5, 2.417, 10.4, 1e6] {
            assert_relative_eq!(eta_of_f0(f0_of_eta(eta)) - 1.0, eta - 1.0, max_relative = 1e-6);
            assert_relative_eq!(f0_of_index(eta, 0.0), f0_of_eta(eta), max_relative = 1e-14);
        }
        // 0.04, and the conductor of the golden value at normal incidence.
        assert_relative_eq!(f0_of_eta(1.5), 0.04, max_relative = 1e-15);
        assert_relative_eq!(f0_of_index(0.2, 3.0), 0.923_371_647_509_578_5, max_relative = 1e-15);
    }

    /// The same table rounds water to 0.02, plastic and glass to 0.03 to 0.08, diamond to 0.17.
    #[test]
    fn materials_by_name() {
        for name in NAMES {
            assert!(known_f0(name).is_some(), "{name}");
        }
        for (name, rounded) in [("water", 0.02), ("glass", 0.04), ("diamond", 0.17)] {
            let Some(Known::Grey(f0)) = known_f0(name) else { panic!("{name}") };
            assert!((f0 - rounded).abs() < 0.005, "{name}: {f0}");
        }
        assert_eq!(known_f0("unobtainium"), None);
    }
}
