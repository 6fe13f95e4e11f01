//! The largest albedo of every variant, by a search over the bounds of its shapes and the ends of its amplitudes.
//!
//! `src/model/largest_albedos.csv` holds what was found, and the manuals are made from it. `BRDFIT_UPDATE=1 cargo test --release --test
//! integration albedos -- --ignored` searches anew and writes the file; without the variable it only checks that nothing larger is
//! found.

use crate::common::every_variant;
use brdfit::geometry::direction;
use brdfit::health::{ALBEDO_SLACK, Integral, Quadrature, directional_albedo};
use brdfit::model::{
    AnyModel, Choices, Expression, LobeValues, ModelEntry, ParamSpec, Role, Scale, largest_albedo,
};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;

/// The largest angle of incidence, degrees: towards 90 some models gain without bound.
const GRAZING_DEG: f64 = 89.9;
/// Quadratures for looking around, for climbing, and for the figure that is written.
const ROUGH: Quadrature = Quadrature { tolerance: 1e-2, most_cells: 800 };
const FAIR: Quadrature = Quadrature { tolerance: 1e-3, most_cells: 1500 };
const FINE: Quadrature = Quadrature { tolerance: 1e-6, most_cells: 6000 };
/// The most cells for the figure that is written, and the relative error at which it is good enough: sharp lobes at grazing need many.
const MOST_CELLS: usize = 200_000;
const GOOD_ENOUGH: f64 = 1e-3;
/// Number of sets of shapes that are looked at, for one shape and for several.
const SETS: [usize; 2] = [24, 72];
/// Number of the best ones that are looked at again with care, and from which of these the search climbs.
const AGAIN: usize = 12;
const CLIMBS: usize = 3;

/// A place in the search: each shape between its bounds, then the angle of incidence, as numbers from 0 to 1; and the azimuth.
#[derive(Clone, Debug)]
struct Place {
    unit: Vec<f64>,
    phi: f64,
}

/// A variant to be searched.
struct Variant {
    entry: &'static ModelEntry,
    choices: Choices,
    expression: Expression,
    shapes: Vec<ParamSpec>,
    /// The ends of the amplitudes, with a channel for each combination.
    corners: Vec<Vec<f64>>,
    anisotropic: bool,
}

impl Variant {
    fn new(entry: &'static ModelEntry, model: &AnyModel, choices: Choices) -> Self {
        let specs = model.parameters();
        let of = |role: Role| specs.iter().filter(move |spec| spec.role == role);
        let amplitudes: Vec<&ParamSpec> = of(Role::Amplitude).collect();
        let mut corners = vec![Vec::new()];
        for spec in &amplitudes {
            let ends = [spec.bounds.0.max(0.0), spec.bounds.1.min(1.0)];
            let with = |corner: &Vec<f64>| ends.map(|end| [corner.as_slice(), &[end]].concat());
            corners = corners.iter().flat_map(with).collect();
        }
        // A base and a lobe that are added may each give back everything.
        if let Some(base) =
            amplitudes.iter().position(|spec| spec.name == "kd").filter(|_| amplitudes.len() > 1)
        {
            corners.retain(|corner| {
                corner[base] == 0.0 || corner.iter().enumerate().all(|(k, a)| k == base || *a == 0.0)
            });
        }
        Self {
            entry,
            expression: Expression::parse(&format!("{}({})", entry.name, choices.text())).unwrap(),
            shapes: of(Role::Shape).cloned().collect(),
            corners,
            anisotropic: specs.iter().any(|spec| spec.isotropy.is_some()),
            choices,
        }
    }

    /// The variant without its Fresnel part.
    fn label(&self) -> String {
        let (name, choices) = (self.entry.name, self.choices.without("f").text());
        if choices.is_empty() { name.to_owned() } else { format!("{name}({choices})") }
    }

    /// The shapes at a place, in units of the parameters.
    fn values(&self, place: &Place) -> Vec<f64> {
        let value = |(spec, u): (&ParamSpec, &f64)| {
            let (low, high) = spec.bounds;
            match spec.scale {
                Scale::Log => low * (high / low).powf(*u),
                _ => low + (high - low) * u,
            }
        };
        self.shapes.iter().zip(&place.unit).map(value).collect()
    }

    fn theta_deg(&self, place: &Place) -> f64 {
        GRAZING_DEG * place.unit[self.shapes.len()]
    }

    /// The largest albedo of all corners, and which corner has it.
    fn albedo(&self, place: &Place, quadrature: &Quadrature) -> (Integral, usize) {
        let values = self.values(place);
        let shapes: Vec<f64> =
            self.shapes.iter().zip(values).map(|(spec, v)| spec.in_formula_units(v)).collect();
        let channel = |amplitudes: &Vec<f64>| {
            vec![LobeValues { shapes: shapes.clone(), amplitudes: amplitudes.clone() }]
        };
        let parameters: Vec<Vec<LobeValues>> = self.corners.iter().map(channel).collect();
        let wi = direction(self.theta_deg(place).to_radians(), place.phi);
        // Ridges are worth their many cells only for the last figure.
        let ridges = self.anisotropic && quadrature.tolerance <= FINE.tolerance;
        let found = directional_albedo(&self.expression, &parameters, wi, ridges, quadrature);
        found.into_iter().zip(0..).max_by(|(a, _), (b, _)| a.value.total_cmp(&b.value)).unwrap()
    }

    /// The albedo with as many cells as it takes; less its error where even the most do not suffice.
    fn finely(&self, place: &Place) -> (f64, usize) {
        let mut most_cells = FINE.most_cells;
        loop {
            let (Integral { value, error }, corner) = self.albedo(place, &Quadrature { most_cells, ..FINE });
            if error <= GOOD_ENOUGH * value {
                return (value, corner);
            }
            if most_cells >= MOST_CELLS {
                return (value - error, corner);
            }
            most_cells *= 3;
        }
    }

    /// Places spread over the bounds, at four angles of incidence: multiples of the powers of a root (Roberts 2018).
    fn spread(&self) -> Vec<Place> {
        let n = self.shapes.len();
        let sets = if n == 0 { 1 } else { SETS[usize::from(n > 1)] };
        let dimensions = f64::from(u32::try_from(n).unwrap());
        let root = (0..60).fold(1.5_f64, |x, _| (1.0 + x).powf(1.0 / (dimensions + 1.0)));
        let mut units: Vec<Vec<f64>> = (1..=sets)
            .map(|i| {
                let place = |k: usize| (0.5 + count(i) / root.powi(i32::try_from(k + 1).unwrap())).fract();
                (0..n).map(place).collect()
            })
            .collect();
        // Both ends together, and the corners of few shapes.
        let corners = if n <= 3 { 1_usize << n } else { 2 };
        units.extend(
            (0..corners).map(|bits| {
                (0..n).map(|k| if n <= 3 { count(bits >> k & 1) } else { count(bits) }).collect()
            }),
        );
        let azimuths: &[f64] = if self.anisotropic { &[0.0, FRAC_PI_2] } else { &[0.0] };
        let mut places = Vec::new();
        for unit in units {
            for theta in [0.0, 55.0, 82.0, GRAZING_DEG] {
                let unit = [unit.as_slice(), &[theta / GRAZING_DEG]].concat();
                places.extend(azimuths.iter().map(|phi| Place { unit: unit.clone(), phi: *phi }));
            }
        }
        places
    }

    /// Climbs from a place along one coordinate after the other, with steps that shrink.
    fn climb(&self, place: Place) -> (f64, Place) {
        let mut best = (self.albedo(&place, &FAIR).0.value, place);
        let mut step = 0.2;
        while step > 0.004 {
            let mut moved = false;
            for k in 0..best.1.unit.len() {
                for sign in [1.0, -1.0] {
                    let mut next = best.1.clone();
                    next.unit[k] = (next.unit[k] + sign * step).clamp(0.0, 1.0);
                    if next.unit[k] == best.1.unit[k] {
                        continue;
                    }
                    let albedo = self.albedo(&next, &FAIR).0.value;
                    if albedo > best.0 * (1.0 + 1e-4) {
                        best = (albedo, next);
                        moved = true;
                        break;
                    }
                }
            }
            if !moved {
                step *= 0.4;
            }
        }
        best
    }

    /// The line of the file: variant, albedo, angle of incidence, shapes and amplitudes where it was found.
    fn largest(&self) -> (f64, String) {
        let sorted = |places: Vec<Place>, quadrature: &Quadrature| -> Vec<Place> {
            let with = |place: Place| (self.albedo(&place, quadrature).0.value, place);
            let mut places: Vec<(f64, Place)> = places.into_iter().map(with).collect();
            places.sort_by(|a, b| b.0.total_cmp(&a.0));
            places.into_iter().map(|(_, place)| place).collect()
        };
        let mut places = sorted(self.spread(), &ROUGH);
        places.truncate(AGAIN);
        let climbed = sorted(places, &FAIR).into_iter().take(CLIMBS).map(|place| self.climb(place).1);
        let finely = climbed.map(|place| (self.finely(&place), place));
        let ((albedo, corner), place) = finely.max_by(|((a, _), _), ((b, _), _)| a.total_cmp(b)).unwrap();
        let named = |name: &str, value: f64| format!("{name}={}", rounded(value));
        let shapes = self.shapes.iter().zip(self.values(&place)).map(|(spec, value)| named(spec.name, value));
        let model = &self.expression.lobes()[0].model;
        let amplitudes = model.parameters().into_iter().filter(|spec| spec.role == Role::Amplitude);
        let amplitudes = amplitudes.zip(&self.corners[corner]).map(|(spec, value)| named(spec.name, *value));
        let at: Vec<String> = shapes.chain(amplitudes).collect();
        let theta = rounded(self.theta_deg(&place));
        let phi = if self.anisotropic {
            format!(" at azimuth {}", rounded(place.phi.to_degrees()))
        } else {
            String::new()
        };
        (albedo, format!("{};{};{theta}{phi};{}", self.label(), rounded(albedo), at.join(" ")))
    }
}

fn count(n: usize) -> f64 {
    f64::from(u32::try_from(n).unwrap())
}

/// Four significant digits, without zeros at the end.
fn rounded(x: f64) -> String {
    let exponent = if x == 0.0 { 0.0 } else { x.abs().log10().floor() };
    let scale = 10_f64.powf(3.0 - exponent);
    format!("{}", (x * scale).round() / scale)
}

/// Every variant whose Fresnel part, if it has one, is absent.
fn variants() -> Vec<Variant> {
    every_variant()
        .filter(|(_, _, choices)| ["", "none"].contains(&choices.get("f")))
        .map(|(entry, model, choices)| Variant::new(entry, &model, choices))
        .collect()
}

#[test]
#[ignore = "takes half an hour"]
fn nothing_reflects_more_than_its_manual_says() {
    let only = std::env::var("BRDFIT_ONLY").unwrap_or_default();
    let all = variants();
    let variants: Vec<&Variant> = all.iter().filter(|variant| variant.label().contains(&only)).collect();
    let found: Vec<(f64, String)> = variants
        .par_iter()
        .map(|variant| {
            let start = std::time::Instant::now();
            let found = variant.largest();
            eprintln!("{:.1} s {}", start.elapsed().as_secs_f64(), found.1);
            found
        })
        .collect();
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/model/largest_albedos.csv");
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        // Variants that were not searched keep their lines.
        let old = std::fs::read_to_string(&path).unwrap_or_default();
        let mut lines: Vec<String> = Vec::new();
        for name in all.iter().map(Variant::label) {
            match variants.iter().zip(&found).find(|(variant, _)| variant.label() == name) {
                Some((_, (albedo, line))) if *albedo > 1.0 + ALBEDO_SLACK => lines.push(line.clone()),
                Some(_) => {}
                None => lines.extend(
                    old.lines().filter(|line| line.split(';').next() == Some(&name)).map(str::to_owned),
                ),
            }
        }
        std::fs::write(path, format!("variant;albedo;theta_i_deg;at\n{}\n", lines.join("\n"))).unwrap();
        return;
    }
    let mut wrong = Vec::new();
    for (variant, (albedo, line)) in variants.iter().zip(&found) {
        let said = largest_albedo(variant.entry.name, &variant.choices).map_or(1.0, |largest| largest.albedo);
        if *albedo > 1.01 * said.max(1.0 - ALBEDO_SLACK) {
            wrong.push(format!("says {said}, found {line}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}
