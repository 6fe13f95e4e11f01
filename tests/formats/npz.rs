//! Named arrays of NumPy. The seeds in fuzz/corpus/npz were written by NumPy.

use super::{CENTER, assert_direction, geometries, parse, parsed, read};
use crate::common::shared;
use approx::assert_abs_diff_eq;
use brdfit::geometry::{Pair, spherical_degrees};
use brdfit::measurement::formats::{AngleGrid, Subject, named};
use brdfit::measurement::{Channel, Measurement};
use std::f64::consts::PI;
use std::fs;
use std::path::Path;

/// A file that NumPy wrote.
fn seed(name: &str) -> Measurement {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus/npz").join(name);
    parse("npz", &fs::read(path).unwrap(), &CENTER).unwrap_or_else(|error| panic!("{error}"))
}

fn written(subject: &Subject<'_>) -> Vec<u8> {
    (named("npz").unwrap().write.unwrap())(subject).unwrap().bytes
}

/// A measurement as it is.
fn rewritten(m: &Measurement) -> Measurement {
    let subject = Subject {
        channels: &m.channels,
        at: &|_| panic!("a measurement is written as it is"),
        covered: &brdfit::measurement::formats::everywhere,
        measurement: Some(m),
        isotropic: true,
        about: "a sample of \u{e9}mail",
        grid: None,
    };
    parse("npz", &written(&subject), &CENTER).unwrap()
}

#[test]
fn what_numpy_wrote_is_read() {
    let m = seed("rgb.npz");
    assert_eq!(m.channel_names(), ["r", "g", "b"]);
    assert_eq!(m.values, [[0.1, 0.4, 0.7], [0.2, 0.5, 0.8], [0.3, 0.6, 0.9]]);
    assert!(m.sigma.is_none() && m.dropped.is_empty() && m.remarks.is_empty());
    let g = geometries(&m);
    assert_direction(g[0].wi, 10.0_f64.to_radians(), 0.0, 1e-15);
    assert_direction(g[0].wo, 5.0_f64.to_radians(), PI, 1e-15);
    assert_direction(g[2].wo, 60.0_f64.to_radians(), PI / 2.0, 1e-15);
    // Big-endian floats, integers, one array for each channel, compressed; one sigma for all.
    let m = seed("sigma.npz");
    assert_eq!(m.channel_names(), ["r", "g"]);
    assert_eq!(m.values, [[1.0, 2.0, 3.0], [1.0, 2.0, 3.0]]);
    assert_eq!(m.sigma, Some(vec![vec![0.1, 0.2, 0.3]; 2]));
    // Fortran order, wavelengths as short integers.
    let m = seed("spectral.npz");
    assert_eq!(m.channels, [Channel::at_wavelength(450.0), Channel::at_wavelength(550.0)]);
    assert_eq!(m.values, [[0.1, 0.4, 0.7], [0.2, 0.5, 0.8]]);
    // NaN means not measured.
    let m = seed("odd.npz");
    assert_eq!((m.values, m.dropped["not-measured"]), (vec![vec![1.0, 3.0]], 1));
    assert_eq!(m.instrument.description.as_deref(), Some("a sample"));
    assert_eq!(m.channels, [Channel::named("f")]);
}

/// Every bit of every number, and the directions to rounding.
#[test]
fn a_measurement_is_read_back_as_it_was() {
    let mut m = parsed(
        "csv",
        "theta_i,phi_i,theta_o,phi_o,550nm,\u{3b1} beta,sigma\n10,0,20,180,0.1,1e-300,0.01\n30,90,40,-10,-0.25,5e-324,0\n\
         50,3,0,0,1.7976931348623157e308,0.30000000000000004,7\n",
    );
    let again = rewritten(&m);
    assert_eq!(again.channels, m.channels);
    let bits = |m: &Measurement| -> Vec<u64> {
        m.values.iter().chain(m.sigma.iter().flatten()).flatten().map(|v| v.to_bits()).collect()
    };
    assert_eq!(bits(&again), bits(&m));
    assert_eq!(again.sigma.as_ref().map(Vec::len), Some(2));
    assert_eq!(again.instrument.description.as_deref(), Some("a sample of \u{e9}mail"));
    for (a, b) in geometries(&again).iter().zip(geometries(&m)) {
        for (a, b) in a.wi.iter().chain(&a.wo).zip(b.wi.iter().chain(&b.wo)) {
            assert_abs_diff_eq!(a, b, epsilon = 1e-15);
        }
    }
    // Without wavelengths and sigma, and with many samples.
    m.sigma = None;
    m.channels = vec![Channel::named("r"), Channel::named("g")];
    let again = rewritten(&m);
    assert_eq!((again.channels, again.sigma), (m.channels, None));
    let Some(path) = shared("cornell/cayman.brdf") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    let again = rewritten(&m);
    assert_eq!((again.channels, again.values), (m.channels, m.values));
}

/// A model is written on a grid: every combination of its angles, the viewer's azimuth counted from the light's.
#[test]
fn a_model_is_written_on_a_grid() {
    let channels = [Channel::named("x")];
    let at = |pairs: &[Pair]| {
        let f = |pair: &Pair| pair.wi.z + 10.0 * pair.wo.z;
        vec![pairs.iter().map(f).collect::<Vec<f64>>()]
    };
    let grid = AngleGrid::parse("theta_i=0:30:60,phi_i=45,theta_o=10,phi=0:90:180").unwrap();
    let subject = Subject {
        channels: &channels,
        at: &at,
        covered: &brdfit::measurement::formats::everywhere,
        measurement: None,
        isotropic: false,
        about: "",
        grid: Some(&grid),
    };
    let m = parse("npz", &written(&subject), &CENTER).unwrap();
    assert_eq!(m.directions.len(), 9);
    for (g, f) in geometries(&m).iter().zip(&m.values[0]) {
        assert_abs_diff_eq!(*f, g.cos_i() + 10.0 * g.cos_o(), epsilon = 1e-14);
    }
    let (theta, phi) = spherical_degrees(geometries(&m)[4].wo.into());
    assert_abs_diff_eq!(theta, 10.0, epsilon = 1e-12);
    assert_abs_diff_eq!(phi, 135.0, epsilon = 1e-12);
    let default = Subject { grid: None, isotropic: true, ..subject };
    assert_eq!(parse("npz", &written(&default), &CENTER).unwrap().directions.len(), 18 * 18 * 13);
}

/// Networks of Sztrajman et al. are arrays, but no measurements.
#[test]
fn networks_are_refused() {
    for (name, first) in [("merl", "alumina-oxide"), ("nielsen", ""), ("rgl-isotropic", "")] {
        let Some(path) = shared(&format!("nbrdf/{name}.npz")) else { return };
        let message = read(&path, None, &CENTER).unwrap_err().to_string();
        assert!(message.contains("expected arrays theta_i, phi_i, theta_o, phi_o"), "{message}");
        assert!(message.contains(&format!("found {first}")) && message.len() < 1500, "{message}");
    }
}
