//! Laws that every model of the registry obeys, or is documented not to.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]

use approx::assert_relative_eq;
use brdfit::geometry::{Geometry, Pair, direction};
use brdfit::math::{GaussLegendre, Real as _, Scalar as _};
use brdfit::model::{AnyModel, REGISTRY, Role};
use brdfit::synthetic::scattered_directions;
use std::f64::consts::{FRAC_PI_2, PI};

fn geometry(pair: &Pair) -> Geometry<f64> {
    Geometry::new(pair.wi.to_array(), pair.wo.to_array())
}

/// Default values in formula units: shapes, amplitudes.
fn defaults(model: &AnyModel) -> (Vec<f64>, Vec<f64>) {
    let of = |role: Role| {
        let specs = model.parameters().into_iter().filter(move |spec| spec.role == role);
        specs.map(|spec| spec.initial * spec.unit.factor()).collect::<Vec<f64>>()
    };
    (of(Role::Shape), of(Role::Amplitude))
}

/// Directional albedo int f cos(theta_o) dwo at incidence `theta_i`, by panels that refine towards the
/// mirror direction's neighbourhood and grazing.
fn albedo(model: &AnyModel, shapes: &[f64], amplitudes: &[f64], theta_i: f64) -> f64 {
    let rule = GaussLegendre::new(48);
    let wi = direction(theta_i, 0.0).to_array();
    let mut edges = vec![0.0, theta_i, FRAC_PI_2];
    for k in 1..6 {
        let step = 0.5_f64.powi(k);
        edges.extend([theta_i - step * theta_i, theta_i + step * (FRAC_PI_2 - theta_i)]);
    }
    edges.sort_by(f64::total_cmp);
    edges.dedup_by(|a, b| (*a - *b).abs() < 1e-12);
    let turns = [0.0, 0.5, 0.8, 0.95, 1.0].map(|t| t * PI);
    let ring = |theta: f64| -> f64 {
        let at = |phi: f64| {
            model.value::<f64>(&Geometry::new(wi, direction(theta, phi).to_array()), shapes, amplitudes)
        };
        2.0 * turns.windows(2).map(|t| rule.integrate(t[0], t[1], at)).sum::<f64>()
    };
    edges.windows(2).map(|e| rule.integrate(e[0], e[1], |t: f64| ring(t) * t.sin() * t.cos())).sum()
}

#[test]
fn every_model_is_reciprocal_and_finite() {
    for entry in REGISTRY {
        for (model, choices) in entry.variants() {
            let (shapes, amplitudes) = defaults(&model);
            for pair in scattered_directions(500, 89.9, 11) {
                let there: f64 = model.value(&geometry(&pair), &shapes, &amplitudes);
                let back: f64 = {
                    let swapped = Pair { wi: pair.wo, wo: pair.wi };
                    model.value(&geometry(&swapped), &shapes, &amplitudes)
                };
                assert!(there.is_finite() && there >= 0.0, "{} {}: {there}", entry.name, choices.text());
                assert_relative_eq!(there, back, max_relative = 1e-9, epsilon = 1e-300);
            }
        }
    }
}

#[test]
fn single_precision_follows_double() {
    for entry in REGISTRY {
        for (model, choices) in entry.variants() {
            let (shapes, amplitudes) = defaults(&model);
            let single = |values: &[f64]| values.iter().map(|v| f32::literal(*v)).collect::<Vec<f32>>();
            for pair in scattered_directions(200, 80.0, 12) {
                let double = geometry(&pair);
                let rounded = Geometry::<f32>::new(double.wi.map(f32::literal), double.wo.map(f32::literal));
                let f: f64 = model.value(&double, &shapes, &amplitudes);
                let f32: f32 = model.value(&rounded, &single(&shapes), &single(&amplitudes));
                let label = format!("{} {}", entry.name, choices.text());
                // Rounding the directions alone moves a lobe of width 0.2 by about 1e-6/0.2 of its value,
                // times the exponent where it is steep.
                assert!((f64::from(f32.value()) - f).abs() <= 1e-3 * f + 1e-12, "{label}: {f32} for {f}");
            }
        }
    }
}

#[test]
fn lambert_reflects_its_albedo() {
    let (model, _) = REGISTRY.iter().find(|e| e.name == "lambert").unwrap().variants().remove(0);
    for theta in [0.0, 0.7, 1.5] {
        assert_relative_eq!(albedo(&model, &[], &[0.37], theta), 0.37, max_relative = 1e-9);
    }
}

/// With white facets (F = 1) a surface with Smith shadowing may lose light to multiple scattering, but
/// gains none; a smooth one loses next to nothing.
#[test]
fn white_facets_do_not_create_light() {
    let entry = REGISTRY.iter().find(|e| e.name == "cook-torrance").unwrap();
    for (model, choices) in entry.variants() {
        let exact_pair = matches!(choices.get("d"), "ggx" | "beckmann");
        if choices.get("f") != "none" || !choices.get("g").starts_with("smith") || !exact_pair {
            continue;
        }
        for m in [0.1, 0.3, 0.6, 1.0] {
            for degrees in [0.0_f64, 40.0, 70.0] {
                let a = albedo(&model, &[m], &[1.0], degrees.to_radians());
                let label = format!("{} m={m} at {degrees}: {a}", choices.text());
                assert!(a <= 1.0 + 1e-6, "{label}");
                if m == 0.1 && degrees < 50.0 {
                    assert!(a > 0.98, "{label}");
                }
            }
        }
    }
}

/// A dielectric at normal incidence on a nearly smooth surface reflects f0.
#[test]
fn smooth_dielectric_reflects_f0() {
    let entry = REGISTRY.iter().find(|e| e.name == "cook-torrance").unwrap();
    let (model, _) = entry.variants().into_iter().find(|(_, c)| c.get("f") == "dielectric").unwrap();
    let a = albedo(&model, &[0.05, 0.04], &[1.0], 0.0);
    assert_relative_eq!(a, 0.04, max_relative = 0.02);
}

/// Ashikhmin and Shirley's diffuse term: 28/(23 pi) is the inverse of int (1 - (1 - c/2)^5) c dw, so that at
/// rs = 0 light from theta is reflected by rd (1 - (1 - cos(theta)/2)^5).
#[test]
fn coupled_diffuse_is_normalised() {
    let (model, _) = REGISTRY.iter().find(|e| e.name == "ashikhmin-shirley").unwrap().variants().remove(0);
    for theta in [0.0_f64, 0.6, 1.3] {
        // The lobe still reflects at grazing with rs = 0; a difference in rd leaves the diffuse term alone.
        let at = |rd: f64| albedo(&model, &[10.0, 10.0], &[rd, 0.0], theta);
        let expected = 0.5 * (1.0 - (1.0 - theta.cos() / 2.0).powi(5));
        assert_relative_eq!(at(0.5) - at(0.0), expected, max_relative = 1e-6);
    }
}

/// Paint, the dipole and single scattering return no more light than falls on them, even where nothing is absorbed.
#[test]
fn layers_do_not_create_light() {
    let variants = REGISTRY.iter().flat_map(|entry| entry.variants());
    for (model, choices) in variants {
        let cases: &[(&[f64], &[f64], f64)] = match (model.name(), choices.get("layer")) {
            // The reflectance itself: (K/S = 0.25) 1/2; clear film over white 1; Saunderson's loss at the surface.
            ("kubelka-munk", "opaque") => &[(&[], &[0.25, 0.0, 0.0], 0.5), (&[], &[0.25, 0.04, 0.0], 0.48)],
            ("kubelka-munk", _) => {
                &[(&[], &[0.0, 3.0, 1.0, 0.0, 0.0], 1.0), (&[], &[0.0, 3.0, 0.0, 0.0, 0.0], 0.75)]
            }
            ("dipole", _) => &[(&[0.999_999, 1.5], &[], f64::NAN), (&[0.9, 1.05], &[], f64::NAN)],
            ("hanrahan-krueger", _) => {
                &[(&[-0.9, 100.0, 1.0], &[1.0], f64::NAN), (&[0.5, 100.0, 1.5], &[1.0], f64::NAN)]
            }
            _ => continue,
        };
        for (shapes, amplitudes, expected) in cases {
            for theta in [0.0, 0.7, 1.3, 1.5] {
                let a = albedo(&model, shapes, amplitudes, theta);
                assert!(a <= 1.0 + 1e-9, "{} {shapes:?} {amplitudes:?} at {theta}: {a}", model.name());
                if expected.is_finite() {
                    assert_relative_eq!(a, *expected, max_relative = 1e-9);
                }
            }
        }
    }
}
