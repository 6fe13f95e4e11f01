//! What the data cannot show is held, not fitted: anisotropy without azimuths, and the shapes of a dead channel.

use crate::common::every_variant;
use brdfit::fit::{Fit, NoStandardError, Options, ParameterState, WarningKind, fit};
use brdfit::geometry::{Azimuths, Directions, Pair};
use brdfit::measurement::Measurement;
use brdfit::model::{Expression, Scale};
use brdfit::parameters::{ParameterTable, Selector, Setting, Settings};
use brdfit::progress::{Progress, Quiet};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use glam::DMat3;
use std::sync::Arc;

fn fitted(data: &Measurement, model: &str, settings: &[(&str, Setting)]) -> Fit {
    let settings: Settings =
        settings.iter().map(|(name, s)| (Selector::parse(name).unwrap(), s.clone())).collect();
    let options = Options::default().with_settings(settings);
    let quiet = Arc::new(Quiet) as Arc<dyn Progress>;
    fit(data, &Expression::parse(model).unwrap(), &options, &quiet).unwrap()
}

fn kinds(fit: &Fit) -> Vec<WarningKind> {
    fit.warnings.iter().map(brdfit::fit::Warning::kind).collect()
}

/// An isotropic material looks the same after a turn about the normal. Every variant of every model is one on a grid, even if
/// the user frees all of its parameters; and those that are not elsewhere are those that declare what makes them anisotropic.
#[test]
fn a_grid_leaves_every_model_isotropic() {
    let pairs = scattered_directions(60, 75.0, 7);
    let turn = DMat3::from_rotation_z(0.7);
    let turned = pairs.iter().map(|pair| Pair { wi: turn * pair.wi, wo: turn * pair.wo }).collect();
    let (pairs, turned) = (Directions::Scattered(pairs), Directions::Scattered(turned));
    let mut anisotropic = 0;
    for (entry, model, choices) in every_variant() {
        let text = format!("{}({})", entry.name, choices.text());
        let expression = Expression::parse(&text).unwrap();
        let all = model.parameters();
        let free: Settings =
            all.iter().map(|spec| (Selector::parse(spec.name).unwrap(), Setting::Free)).collect();
        let change = |azimuths: Azimuths| {
            let mut table = ParameterTable::new(&expression, &["y".to_owned()], azimuths, &free).unwrap();
            for (count, index) in table.free().to_vec().into_iter().enumerate() {
                // Values at different places of their ranges, so that those along x and y differ.
                let spec = &table.rows()[index].spec;
                let (low, high) = spec.typical;
                let share = if count % 2 == 0 { 0.3 } else { 0.6 };
                let value = match spec.scale {
                    Scale::Log => low * (high / low).powf(share),
                    _ => low + share * (high - low),
                };
                table.set_value(index, value);
            }
            let values = |at: &Directions| expression.values(at, &[table.formula_values(0)]).remove(0);
            let (one, other) = (values(&pairs), values(&turned));
            let largest = one.iter().fold(0.0, |most: f64, f| most.max(f.abs()));
            one.iter()
                .zip(&other)
                .map(|(f, g)| (f - g).abs() / f.abs().max(1e-3 * largest))
                .fold(0.0, f64::max)
        };
        assert!(change(Azimuths::Lost) < 1e-9, "{text}: {}", change(Azimuths::Lost));
        let declared = all.iter().any(|spec| spec.isotropy.is_some());
        assert_eq!(change(Azimuths::Several) > 1e-6, declared, "{text}: {}", change(Azimuths::Several));
        anisotropic += usize::from(declared);
    }
    assert!(anisotropic > 100, "{anisotropic}");
}

const ANISOTROPIC: &str = "lambert + cook-torrance(d=ggx-anisotropic)";

/// A brushed metal lit from `lights`, azimuths in degrees.
fn brushed(lights: &[f64], across: bool) -> Measurement {
    let mut angles = Vec::new();
    for light in lights {
        for theta_i in [10.0, 30.0, 50.0, 70.0] {
            for step in 0..15 {
                let theta_o = 5.0 * f64::from(step);
                let around: &[f64] = if across { &[0.0, 60.0, 120.0, 180.0, 250.0] } else { &[0.0, 180.0] };
                angles.extend(around.iter().map(|phi| [theta_i, *light, theta_o, light + phi]));
            }
        }
    }
    let expression = Expression::parse(ANISOTROPIC).unwrap();
    let set = [("kd", 0.1), ("mx", 0.2), ("my", 0.4), ("f0", 0.5)];
    let settings = set.map(|(name, v)| (Selector::parse(name).unwrap(), Setting::Set(v))).to_vec();
    let table = ParameterTable::new(&expression, &["y".to_owned()], Azimuths::Several, &settings).unwrap();
    let noise = Noise { relative: 0.01, absolute: 0.0 };
    measurement(&expression, &table, Directions::from_degrees(angles).unwrap(), noise, 3)
}

#[test]
fn light_from_a_single_azimuth_ties_roughnesses_unless_they_are_freed() {
    for across in [false, true] {
        let data = brushed(&[20.0], across);
        let found = fitted(&data, ANISOTROPIC, &[]);
        let (mx, my) = (found.parameter("mx").unwrap(), found.parameter("my").unwrap());
        assert!(matches!(my.state, ParameterState::Tied { .. }) && mx.value == my.value, "{my}");
        let warning = found.warnings.iter().find(|w| w.kind() == WarningKind::Isotropic).unwrap();
        assert!(warning.to_string().contains("single azimuth"), "{warning}");
        assert_eq!(warning.suggestions()[0].value, "cook-torrance.my");

        let freed = fitted(&data, ANISOTROPIC, &[("mx", Setting::Free), ("my", Setting::Free)]);
        assert_eq!(freed.parameter("my").unwrap().state, ParameterState::Free);
        assert!(!kinds(&freed).contains(&WarningKind::Isotropic));
        // In the model line the wish is repeated, so that the line gives the same fit.
        assert!(freed.model.canonical().contains("my=free"), "{}", freed.model.canonical());
    }
    // A sample that was turned shows its anisotropy.
    let found = fitted(&brushed(&[0.0, 45.0, 90.0], true), ANISOTROPIC, &[]);
    let (mx, my) = (found.parameter("mx").unwrap().value, found.parameter("my").unwrap().value);
    assert!((mx - 0.2).abs() < 0.005 && (my - 0.4).abs() < 0.01, "{mx} {my}");
    assert!(!kinds(&found).contains(&WarningKind::Isotropic));
}

/// A parameter that is fixed by default is not advised where the data cannot show it, and a user who frees it on a grid is told.
#[test]
fn a_grid_holds_an_anisotropy_that_the_user_frees() {
    let expression = Expression::parse("disney-2012").unwrap();
    let channels = ["r", "g", "b"].map(str::to_owned);
    let table = ParameterTable::new(&expression, &channels, Azimuths::Lost, &Vec::new()).unwrap();
    let grid = Arc::new(brdfit::geometry::HalfDifferenceGrid::merl(0.5));
    let cells = (0..1_458_000).step_by(1501).filter(|cell| {
        let g = grid.geometry(*cell);
        g.cos_i() > 0.2 && g.cos_o() > 0.2
    });
    let directions = Directions::Grid { cells: cells.collect(), grid: Arc::clone(&grid) };
    let noise = Noise { relative: 0.3, absolute: 0.0 };
    let data = measurement(&expression, &table, directions, noise, 1);
    let about = |fit: &Fit| {
        let own = fit.warnings.iter().filter(|w| w.parameter() == Some("disney-2012.anisotropic"));
        own.map(brdfit::fit::Warning::kind).collect::<Vec<_>>()
    };
    assert_eq!(about(&fitted(&data, "disney-2012", &[])), []);
    let freed = fitted(&data, "disney-2012", &[("anisotropic", Setting::Free)]);
    let anisotropic = freed.parameter("anisotropic").unwrap();
    assert_eq!((anisotropic.value, anisotropic.state), (0.0, ParameterState::Fixed));
    assert_eq!(about(&freed), [WarningKind::Isotropic]);
    // A value that the user knows stands.
    let fixed = fitted(&data, "disney-2012", &[("anisotropic", Setting::Fix(0.5))]);
    assert_eq!(fixed.parameter("anisotropic").unwrap().value, 0.5);
}

/// A channel without a signal neither changes the shapes nor the other channels, and its own amplitudes are those of its values.
#[test]
fn a_dead_channel_has_no_say() {
    let model = "lambert + cook-torrance";
    let expression = Expression::parse(model).unwrap();
    let set = [("kd", 0.3), ("m", 0.25), ("f0", 0.06)];
    let settings: Settings = set.map(|(name, v)| (Selector::parse(name).unwrap(), Setting::Set(v))).to_vec();
    let channels = ["400", "500", "600", "700", "800", "900"].map(str::to_owned);
    let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &settings).unwrap();
    let directions = Directions::Scattered(scattered_directions(400, 80.0, 5));
    let noise = Noise { relative: 0.02, absolute: 0.0 };
    let data = measurement(&expression, &table, directions, noise, 2);
    // The search uses all of three channels, and four of six.
    for count in [3, 6] {
        let mut with = data.clone();
        with.channels.truncate(count);
        with.values.truncate(count);
        with.sigma = None;
        let mut without = with.clone();
        without.channels.remove(1);
        without.values.remove(1);
        for dead in [0.0, 0.1] {
            with.values[1].fill(dead);
            let (with, without) = (fitted(&with, model, &[]), fitted(&without, model, &[]));
            let same = |name: &str| {
                let (a, b) = (with.parameter(name).unwrap(), without.parameter(name).unwrap());
                assert!((a.value / b.value - 1.0).abs() < 1e-9, "{a} {b}");
                assert!((a.std_error.unwrap() / b.std_error.unwrap() - 1.0).abs() < 1e-6, "{a} {b}");
            };
            ["m", "kd[400]", "kd[600]", "f0[600]"].into_iter().for_each(same);
            assert_eq!((with.n, with.dof), (without.n, without.dof));
            assert!((with.errors.all.cbrt / without.errors.all.cbrt - 1.0).abs() < 1e-9);
            let kd = with.parameter("kd[500]").unwrap();
            let found = kd.value / std::f64::consts::PI;
            // With the strength of its lobe at 1 a Schlick lobe still rises towards grazing, so the body takes a little less.
            assert!((found - dead).abs() <= 0.1 * dead.max(1e-3), "{kd}");
            assert_eq!((kd.std_error, kd.no_std_error), (None, Some(NoStandardError::DeadChannel)));
            assert_eq!(kinds(&with).iter().filter(|kind| **kind == WarningKind::DeadChannel).count(), 1);
            assert!(!kinds(&without).contains(&WarningKind::DeadChannel));
        }
    }
}
