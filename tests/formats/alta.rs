//! ALTA's text files.

use super::{CENTER, assert_direction, geometries, parse, parsed, read};
use crate::common::shared;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use brdfit::geometry::{Geometry, Pair, direction};
use brdfit::measurement::{Channel, Measurement, Remark};
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use std::f64::consts::{FRAC_PI_2, PI};

/// A file of these coordinates and values.
fn file(parameterisation: &str, rows: &[(Vec<f64>, f64)]) -> String {
    let coordinates = rows[0].0.len();
    let mut text = format!("#DIM {coordinates} 1\n#PARAM_IN {parameterisation}\n#PARAM_OUT INV_STERADIAN\n");
    for (x, f) in rows {
        let words: Vec<String> = x.iter().chain([f]).map(|v| format!("{v:?}")).collect();
        text += &format!("{}\n", words.join("\t"));
    }
    text
}

/// Sums over the samples of a channel, that move if a value or a direction does: of f, f^2, f wi.x, f wo.x, f cos_i cos_o.
pub fn sums(m: &Measurement, channel: usize) -> [f64; 5] {
    let of = |term: &dyn Fn(f64, &Geometry<f64>) -> f64| {
        m.values[channel].iter().zip(m.directions.iter()).map(|(f, g)| term(*f, &g)).sum()
    };
    [
        of(&|f, _| f),
        of(&|f, _| f * f),
        of(&|f, g| f * g.wi[0]),
        of(&|f, g| f * g.wo[0]),
        of(&|f, g| f * g.wi[2] * g.wo[2]),
    ]
}

/// Number of samples, number left out and sums of a second implementation in Python (math.fsum over the rows, the viewer's
/// cosine divided out), which read the file before this program did.
#[test]
fn retro_reflective_tape() {
    let Some(path) = shared("cea-retro/retro-3M-yellow.dat") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    assert_eq!(m.source.format, "alta");
    assert_eq!(m.channels, [Channel::named("y")]);
    assert_eq!(m.directions.len(), 7311);
    assert_eq!(m.dropped.iter().collect::<Vec<_>>(), [(&"below-horizon", &86)]);
    assert_eq!(m.remarks, [Remark::CosineDividedOut { angle: "theta_o" }]);
    let said = m.instrument.description.as_deref().unwrap();
    assert!(said.starts_with("3M Yellow; retro-reflection BRDF measures from CEA; https://"), "{said}");
    let expected = [
        11_052.602_071_381_5,
        131_038.536_042_887,
        6_398.714_646_025_93,
        -741.498_242_062_731,
        6_573.964_296_076_29,
    ];
    for (found, expected) in sums(&m, 0).into_iter().zip(expected) {
        assert_relative_eq!(found, expected, max_relative = 1e-10);
    }
}

/// That the cosine in the file is the viewer's is physics: only so are exchanged pairs reciprocal. With the light's cosine
/// divided out they would differ by factors of 1.2 to 3.7.
#[test]
fn the_tape_is_reciprocal() {
    let Some(path) = shared("cea-retro/retro-3M-yellow.dat") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    let in_plane: Vec<(f64, f64, f64)> = geometries(&m)
        .iter()
        .zip(&m.values[0])
        .filter(|(g, _)| g.wi[1].abs() + g.wo[1].abs() < 1e-6)
        .map(|(g, f)| (g.wi[0].atan2(g.wi[2]), g.wo[0].atan2(g.wo[2]), *f))
        .collect();
    let close = 0.6_f64.to_radians();
    let mut pairs = 0;
    for (light, viewer, f) in &in_plane {
        for (other, back, exchanged) in &in_plane {
            // The plane may be turned by half a turn.
            let turn = viewer.signum();
            if (other - viewer.abs()).abs() < close && (light * turn - back).abs() < close && light < other {
                assert_relative_eq!(f / exchanged, 1.0, epsilon = 0.031);
                pairs += 1;
            }
        }
    }
    assert_eq!(pairs, 6);
}

/// Count and first values by eye; the slice is of half vectors alone.
#[test]
fn pink_felt() {
    let Some(path) = shared("merl-slices/pink-felt-1d.alta") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    assert_eq!(m.source.format, "alta");
    assert_eq!(m.channel_names(), ["r", "g", "b"]);
    let [first, rest @ ..] = m.remarks.as_slice() else { panic!("no remark") };
    assert!(rest.is_empty() && first.to_string().contains("theta_d = 0"), "{first}");
    assert_eq!(
        m.values.iter().map(|row| row[0]).collect::<Vec<_>>(),
        [0.109_704_419_970_512, 0.079_440_519_213_676_5, 0.061_623_286_455_869_7]
    );
    let g = geometries(&m);
    assert_abs_diff_eq!(g[0].cos_i(), 0.999_984_567_305_837, epsilon = 1e-15);
    for g in g {
        for (a, b) in g.wi.into_iter().zip(g.wo) {
            assert_abs_diff_eq!(a, b, epsilon = 1e-15);
        }
    }
    assert_eq!(m.total(), 90);
}

/// The coordinates of a pair by their definitions in ALTA's documentation.
fn coordinates(name: &str, l: DVec3, v: DVec3) -> Vec<f64> {
    let polar = |w: DVec3| w.z.acos();
    let azimuth = |w: DVec3| w.y.atan2(w.x);
    let h = (l + v).normalize();
    let (half, back) = ((l + v) / 2.0, (l - v) / 2.0);
    let k = DVec3::new(v.x - l.x, v.y - l.y, v.z + l.z).normalize();
    let flat = |w: DVec3| w.x.hypot(w.y);
    // The viewer in the frame of h.
    let (phi_h, theta_h) = (azimuth(h), polar(h));
    let along = DVec3::new(theta_h.cos() * phi_h.cos(), theta_h.cos() * phi_h.sin(), -theta_h.sin());
    let across = DVec3::new(-phi_h.sin(), phi_h.cos(), 0.0);
    let phi_d = v.dot(across).atan2(v.dot(along));
    let theta_d = h.dot(v).acos();
    let dphi = azimuth(v) - azimuth(l);
    let projected = |theta: f64, phi: f64| vec![theta * phi.cos(), theta * phi.sin()];
    match name {
        "RUSIN_TH_PH_TD_PD" => vec![theta_h, phi_h, theta_d, phi_d],
        "RUSIN_TH_TD_PD" => vec![theta_h, theta_d, phi_d],
        "SPHERICAL_TL_PL_TV_PV" => vec![polar(l), azimuth(l), polar(v), azimuth(v)],
        "CARTESIAN" => vec![v.x, v.y, v.z, l.x, l.y, l.z],
        "STEREOGRAPHIC" => vec![v.x / (1.0 + v.z), v.y / (1.0 + v.z), l.x / (1.0 + l.z), l.y / (1.0 + l.z)],
        "ISOTROPIC_TV_TL_DPHI" => vec![polar(v), polar(l), dphi],
        "ISOTROPIC_TL_TV_PROJ_DPHI" => [vec![polar(l)], projected(polar(v), dphi)].concat(),
        "SCHLICK_TL_TK_PROJ_DPHI" => [vec![polar(l)], projected(polar(k), azimuth(k) - azimuth(l))].concat(),
        "RETRO_TL_TVL_PROJ_DPHI" => {
            let between = l.dot(v).acos();
            // The spherical triangle of light, viewer and normal: its angle at the light, by the laws of cosines and sines.
            let cos = (v.z - l.z * l.dot(v)) / (flat(l) * between.sin());
            let sin = flat(v) * dphi.sin() / between.sin();
            vec![polar(l), between * cos, between * sin]
        }
        "STARK_3D" => vec![flat(half), back.length(), azimuth(back) - azimuth(half)],
        "NEUMANN_3D" => vec![flat(half), flat(back), azimuth(back) - azimuth(half)],
        _ => panic!("{name}"),
    }
}

fn random_pair(rng: &mut Pcg64Mcg) -> Pair {
    let mut one = || direction(1.5 * rng.random::<f64>(), 2.0 * PI * rng.random::<f64>());
    Pair { wi: one(), wo: one() }
}

/// Every parameterisation that determines two directions gives back the pair whose coordinates it was given.
#[test]
fn coordinates_lead_back_to_the_directions() {
    let mut rng = Pcg64Mcg::seed_from_u64(7);
    let pairs: Vec<Pair> = (0..200).map(|_| random_pair(&mut rng)).collect();
    for (name, whole) in [
        ("RUSIN_TH_PH_TD_PD", true),
        ("SPHERICAL_TL_PL_TV_PV", true),
        ("CARTESIAN", true),
        ("STEREOGRAPHIC", true),
        ("RUSIN_TH_TD_PD", false),
        ("ISOTROPIC_TV_TL_DPHI", false),
        ("ISOTROPIC_TL_TV_PROJ_DPHI", false),
        ("SCHLICK_TL_TK_PROJ_DPHI", false),
        ("RETRO_TL_TVL_PROJ_DPHI", false),
        ("STARK_3D", false),
        ("NEUMANN_3D", false),
    ] {
        let rows: Vec<(Vec<f64>, f64)> =
            pairs.iter().zip(1..).map(|(p, n)| (coordinates(name, p.wi, p.wo), f64::from(n))).collect();
        let m = parsed("alta", &file(name, &rows));
        assert_eq!(m.directions.len(), pairs.len(), "{name}: {:?}", m.dropped);
        assert!(m.remarks.is_empty(), "{name}");
        for (g, pair) in geometries(&m).iter().zip(&pairs) {
            let (wi, wo) = (DVec3::from(g.wi), DVec3::from(g.wo));
            let message = format!("{name}: {pair:?}");
            if whole {
                assert!((wi - pair.wi).length() + (wo - pair.wo).length() < 1e-7, "{message}");
            }
            // What determines a pair up to a turn about the normal and a mirror.
            let known = [(wi.z, pair.wi.z), (wo.z, pair.wo.z), (wi.dot(wo), pair.wi.dot(pair.wo))];
            for (found, expected) in known {
                assert!((found - expected).abs() < 1e-7, "{message}: {found} {expected}");
            }
        }
    }
}

/// One sample of a parameterisation that leaves something open: the directions, and that the remark says what was assumed.
#[test]
fn what_is_open_is_fixed_and_said() {
    let (sin, cos) = 0.6_f64.sin_cos();
    let back = format!("{sin} 0 {cos}");
    for (name, coordinates, light, viewer, word) in [
        ("COS_TH", format!("{cos}"), (0.6, 0.0), (0.6, 0.0), "theta_d = 0"),
        ("RUSIN_TH", "0.6".to_owned(), (0.6, 0.0), (0.6, 0.0), "theta_d = 0"),
        ("RUSIN_VH", back.clone(), (0.6, 0.0), (0.6, 0.0), "theta_d = 0"),
        // cos_i = cos_o = cos(theta_h) cos(theta_d).
        ("RUSIN_TH_TD", "0 0.6".to_owned(), (0.6, -FRAC_PI_2), (0.6, FRAC_PI_2), "90 degrees"),
        ("COS_TH_TD", format!("{cos} 1"), (0.6, 0.0), (0.6, 0.0), "phi_d: 0"),
        ("RUSIN_TH_PH_TD", "0.4 0 0.2".to_owned(), (0.2, 0.0), (0.6, 0.0), "phi_d: 0"),
        ("SCHLICK_VK", back.clone(), (0.6, 0.0), (0.6, PI), "mirror"),
        ("SCHLICK_VH", back, (0.6, 0.0), (0.6, PI), "mirror"),
        ("SCHLICK_TK_PK", "0.6 0".to_owned(), (0.6, 0.0), (0.6, PI), "mirror"),
        ("COS_TK", format!("{cos}"), (0.6, 0.0), (0.6, PI), "mirror"),
        ("COS_TLV", format!("{cos}"), (0.0, 0.0), (0.6, 0.0), "normal incidence"),
        ("COS_TLR", format!("{cos}"), (0.0, 0.0), (0.6, 0.0), "normal incidence"),
        ("ISOTROPIC_TV_PROJ_DPHI", "0 0.6".to_owned(), (0.0, 0.0), (0.6, FRAC_PI_2), "normal incidence"),
        // H and B perpendicular, both in directions of their own: light and viewer mirror each other in the x-z plane.
        ("NEUMANN_2D", format!("0 {sin}"), (0.6, FRAC_PI_2), (0.6, -FRAC_PI_2), "azimuth"),
        ("STARK_2D", format!("0 {sin}"), (0.6, FRAC_PI_2), (0.6, -FRAC_PI_2), "azimuth"),
    ] {
        let number = coordinates.split(' ').count();
        let text =
            format!("#DIM {number} 1\n#PARAM_IN {name}\n#PARAM_OUT INV_STERADIAN\n{coordinates} 0.25\n");
        let m = parsed("alta", &text);
        assert_eq!(m.values, [vec![0.25]], "{name}");
        let g = geometries(&m)[0];
        assert_direction(g.wi, light.0, light.1, 1e-12);
        assert_direction(g.wo, viewer.0, viewer.1, 1e-12);
        assert!(m.remarks.len() == 1 && m.remarks[0].to_string().contains(word), "{name}: {:?}", m.remarks);
    }
}

#[test]
fn values_are_f_or_f_times_the_cosine() {
    let of = |output: &str, values: usize, row: &str| {
        parsed("alta", &format!("#DIM 1 {values}\n#PARAM_IN RUSIN_TH\n{output}\n{row}\n"))
    };
    let cosine = 0.6_f64.cos();
    assert_eq!(of("#PARAM_OUT INV_STERADIAN", 1, "0.6 -0.5").values, [[-0.5]], "negatives are kept");
    let m = of("#PARAM_OUT INV_STERADIAN_COSINE_FACTOR", 2, "0.6 0.5 1");
    assert_eq!(m.channel_names(), ["y1", "y2"]);
    assert_relative_eq!(m.values[0][0], 0.5 / cosine, max_relative = 1e-15);
    assert_relative_eq!(m.values[1][0], 1.0 / cosine, max_relative = 1e-15);
    assert_eq!(of("#PARAM_OUT XYZ_COLOR", 3, "0.6 1 2 3").channel_names(), ["X", "Y", "Z"]);
    for output in ["#PARAM_OUT UNKNOWN_OUTPUT", "# nothing"] {
        let m = of(output, 1, "0.6 0.5");
        assert_eq!(m.values, [[0.5]]);
        assert!(m.remarks.iter().any(|r| r.to_string().contains("taken as f in 1/sr")), "{:?}", m.remarks);
    }
}

/// The standard deviation of what is equally likely anywhere in an interval is half its width over sqrt(3).
#[test]
fn intervals_become_standard_deviations() {
    let of = |segments: &str, row: &str| {
        parsed(
            "alta",
            &format!("#DIM 1 2\n#PARAM_IN RUSIN_TH\n#PARAM_OUT INV_STERADIAN\n{segments}\n{row}\n"),
        )
    };
    let third = 1.0 / 3.0_f64.sqrt();
    for (segments, row, half) in [
        ("#VS 1", "0.6 1 2 0.1 0.2", Some([0.1, 0.2])),
        ("#VS 1 1", "0.6 1 2 0.1 0.2", Some([0.1, 0.2])),
        ("#VS 2", "0.6 1 2 0.9 1.1 1.8 2.2", Some([0.1, 0.2])),
        // Later versions of ALTA give the first value alone an interval.
        ("#VS 2", "0.6 1 2 0.9 1.1", None),
        ("#VS 1", "0.6 1 2 0.1", None),
        ("#VS 0", "0.6 1 2", None),
        ("", "0.6 1 2", None),
    ] {
        let m = of(segments, row);
        assert_eq!(m.values, [[1.0], [2.0]], "{segments}");
        assert_eq!(m.sigma.is_some(), half.is_some(), "{segments}");
        for (row, half) in m.sigma.iter().flatten().zip(half.into_iter().flatten()) {
            assert_relative_eq!(row[0], half * third, max_relative = 1e-14);
        }
        let said = m.remarks.iter().any(|remark| remark.to_string().contains("interval"));
        assert_eq!(said, row.split(' ').count() > 3, "{segments} {:?}", m.remarks);
    }
}

#[test]
fn what_cannot_be_is_left_out_and_counted() {
    let m = parsed(
        "alta",
        "#DIM 2 1\n#PARAM_IN STARK_2D\n#PARAM_OUT INV_STERADIAN\n0.1 0.2 1\n0.9 0.9 1\n\n# between\n0 1 1\n",
    );
    assert_eq!(m.directions.len(), 1);
    assert_eq!((m.dropped["impossible-direction"], m.dropped["below-horizon"]), (1, 1));
    // Degrees where radians are meant are no angles.
    let degrees = "#DIM 1 1\n#PARAM_IN RUSIN_TH\n#PARAM_OUT INV_STERADIAN\n45 1\n";
    let message = parse("alta", degrees.as_bytes(), &CENTER).unwrap_err().to_string();
    assert!(message.contains("x:4: expected an angle in radians") && message.contains("'45'"), "{message}");
}
