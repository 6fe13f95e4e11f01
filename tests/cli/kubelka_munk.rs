//! `brdfit kubelka-munk`: K and S from reflectances over known backings.
//!
//! The reflectances come from the formulas of Kubelka 1948 as printed, written here a second time.

use crate::common::{Folder, parse};
use brdfit::drawdown::{Drawdown, Fitted, Patch, Series, Surface, fit};
use brdfit::measurement::{Channel, Source};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64Mcg;
use serde_json::Value;
use std::fmt::Write as _;

/// R over Rg by the printed formula; opaque paint has X infinite.
fn printed(k: f64, s: f64, x: f64, rg: f64) -> f64 {
    let a = 1.0 + k / s;
    let b = (a * a - 1.0).sqrt();
    let coth = 1.0 / (b * s * x).tanh();
    (1.0 - rg * (a - b * coth)) / (a - rg + b * coth)
}

fn with_surface(surface: Surface, r: f64) -> f64 {
    let Surface { k1, k2 } = surface;
    k1 + (1.0 - k1) * (1.0 - k2) * r / (1.0 - k2 * r)
}

/// One channel of a drawdown without noise, at (thickness, background).
fn drawdown(k: f64, s: f64, surface: Surface, places: &[(f64, f64)], sigma: Option<f64>) -> Drawdown {
    let patches = places.iter().map(|&(thickness, background)| Patch {
        thickness,
        background,
        reflectance: with_surface(surface, printed(k, s, thickness, background)),
        sigma,
    });
    Drawdown {
        source: Source::default(),
        rows: places.len(),
        thickness_known: true,
        series: vec![Series { channel: Channel::named("550"), patches: patches.collect() }],
    }
}

fn only(drawdown: &Drawdown, surface: Surface) -> Fitted {
    fit(drawdown, surface).unwrap().remove(0)
}

/// Random K and S of paints, per millimetre: K/S from white to black.
fn paint(rng: &mut Pcg64Mcg) -> (f64, f64) {
    let mut log = |low: f64, high: f64| low * (high / low).powf(rng.random::<f64>());
    let s = log(5.0, 80.0);
    (s * log(1e-3, 3.0), s)
}

const GLOSSY: Surface = Surface { k1: 0.04, k2: 0.596 };
const CARD: [(f64, f64); 2] = [(0.02, 0.01), (0.02, 0.85)];
const SEVERAL: [(f64, f64); 6] =
    [(0.02, 0.01), (0.02, 0.85), (0.05, 0.01), (0.05, 0.85), (0.01, 0.4), (f64::INFINITY, 0.0)];
const OVER_BLACK: [(f64, f64); 3] = [(0.01, 0.0), (0.02, 0.0), (0.06, 0.0)];

fn assert_close(label: &str, found: f64, wanted: f64, tolerance: f64) {
    assert!((found / wanted - 1.0).abs() < tolerance, "{label}: {found} for {wanted}");
}

#[test]
fn finds_k_and_s_without_noise() {
    let mut rng = Pcg64Mcg::seed_from_u64(1);
    for (places, method) in
        [(&CARD[..], "closed-form"), (&SEVERAL[..], "least-squares"), (&OVER_BLACK[..], "least-squares")]
    {
        for surface in [Surface::default(), GLOSSY] {
            for set in 0..100 {
                let (k, s) = paint(&mut rng);
                let label =
                    format!("{method} {surface:?} set {set}, {} places, K = {k}, S = {s}", places.len());
                let found = only(&drawdown(k, s, surface, places, None), surface);
                assert!(found.usable && found.k.is_some(), "{label}: {found:?}");
                assert_eq!(found.method, method, "{label}");
                assert_close(&label, found.k.unwrap().value, k, 1e-6);
                assert_close(&label, found.s.unwrap().value, s, 1e-6);
                assert_close(&label, found.k_over_s.unwrap().value, k / s, 1e-6);
                assert_close(&label, found.r_inf.unwrap().value, printed(k, s, f64::INFINITY, 0.0), 1e-6);
            }
        }
    }
}

/// With noise of known size: within four standard errors, and the errors are of the right size: the mean square of
/// the deviations in their units is 1. With sigma given, and with sigma found from the residuals.
#[test]
fn errors_hold_with_noise() {
    const NOISE: f64 = 1e-3;
    let mut rng = Pcg64Mcg::seed_from_u64(2);
    let places: Vec<(f64, f64)> = SEVERAL.iter().cycle().take(24).copied().collect();
    for sigma in [Some(NOISE), None] {
        let (mut squares, mut n) = ([0.0; 4], 0.0);
        for set in 0..200 {
            let (k, s) = paint(&mut rng);
            let mut noisy = drawdown(k, s, GLOSSY, &places, sigma);
            for patch in &mut noisy.series[0].patches {
                patch.reflectance += NOISE * rng.sample::<f64, _>(StandardNormal);
            }
            let found = only(&noisy, GLOSSY);
            assert!(found.usable, "set {set}: {found:?}");
            let truth = [k, s, k / s, printed(k, s, f64::INFINITY, 0.0)];
            let quantities = [found.k, found.s, found.k_over_s, found.r_inf].map(Option::unwrap);
            for (i, (q, truth)) in quantities.iter().zip(truth).enumerate() {
                let off = (q.value - truth) / q.std_error.unwrap();
                assert!(off.abs() < 4.0, "set {set}, quantity {i}: {q:?} for {truth}");
                squares[i] += off * off;
            }
            n += 1.0;
        }
        // 200 squares of normal deviates have the mean 1 +/- 0.1.
        for square in squares {
            assert!((square / n - 1.0).abs() < 0.4, "{squares:?} over {n}");
        }
    }
}

/// Two reflectances leave nothing to find the noise from; with sigma they have errors.
#[test]
fn two_reflectances_need_sigma_for_errors() {
    let without = only(&drawdown(3.0, 20.0, GLOSSY, &CARD, None), GLOSSY);
    assert!(without.k.unwrap().std_error.is_none() && without.remarks[0].kind() == "no-errors");
    let mut rng = Pcg64Mcg::seed_from_u64(3);
    let mut squares = 0.0;
    for _ in 0..300 {
        let mut noisy = drawdown(3.0, 20.0, GLOSSY, &CARD, Some(1e-3));
        for patch in &mut noisy.series[0].patches {
            patch.reflectance += 1e-3 * rng.sample::<f64, _>(StandardNormal);
        }
        let found = only(&noisy, GLOSSY);
        assert_eq!((found.method, found.remarks.len()), ("closed-form", 0));
        squares += ((found.k.unwrap().value - 3.0) / found.k.unwrap().std_error.unwrap()).powi(2) / 300.0;
    }
    assert!((squares - 1.0).abs() < 0.35, "{squares}");
}

#[test]
fn what_is_not_determined_is_not_given() {
    // Opaque paint: K/S alone.
    let opaque = only(&drawdown(2.0, 8.0, GLOSSY, &[(f64::INFINITY, 0.0)], Some(1e-3)), GLOSSY);
    assert!(opaque.usable && opaque.k.is_none() && opaque.s.is_none(), "{opaque:?}");
    assert_close("K/S", opaque.k_over_s.unwrap().value, 0.25, 1e-9);
    assert!(opaque.k_over_s.unwrap().std_error.unwrap() > 0.0);
    // Opaque paint that reflects everything or nothing.
    for (reflectance, wanted) in [(1.0, 0.0), (0.0, 1e6)] {
        let patch = Patch { thickness: f64::INFINITY, background: 0.0, reflectance, sigma: Some(1e-3) };
        let series = vec![Series { channel: Channel::named("y"), patches: vec![patch] }];
        let end = Drawdown { source: Source::default(), rows: 1, thickness_known: true, series };
        let found = only(&end, Surface::default());
        assert!(found.usable && found.k_over_s.unwrap().std_error.is_none(), "{found:?}");
        assert!((found.k_over_s.unwrap().value - wanted).abs() <= 1e-6 * wanted, "{found:?}");
        assert_eq!(found.remarks[0].kind(), "at-bound");
    }
    // So thick that the backing does not show.
    let thick = only(&drawdown(2.0, 8.0, GLOSSY, &[(20.0, 0.0), (20.0, 1.0), (30.0, 0.5)], None), GLOSSY);
    assert!(thick.usable && thick.k.is_none() && thick.s.is_none(), "{thick:?}");
    assert_close("K/S", thick.k_over_s.unwrap().value, 0.25, 1e-6);
    assert_eq!(thick.remarks[0].kind(), "opaque");
    // One reflectance for two unknowns; the same one twice.
    for places in [&[(0.02, 0.0)][..], &[(0.02, 0.0), (0.02, 0.0)]] {
        let one = only(&drawdown(2.0, 8.0, GLOSSY, places, None), GLOSSY);
        assert!(!one.usable && one.k.is_none() && one.k_over_s.is_none(), "{one:?}");
        assert_eq!(one.remarks[0].kind(), "not-usable");
    }
    // A film that absorbs nothing: K ends at its bound, S has an error of its own.
    let clear: Vec<Patch> = [(0.1, 0.0), (0.1, 0.9), (0.3, 0.0), (0.3, 0.9)]
        .map(|(thickness, background)| {
            let sx: f64 = 7.0 * thickness;
            let r0 = sx / (1.0 + sx);
            let reflectance = r0 + (1.0 - r0).powi(2) * background / (1.0 - r0 * background);
            Patch { thickness, background, reflectance: (reflectance + 1e-4).min(1.0), sigma: Some(1e-3) }
        })
        .to_vec();
    let series = vec![Series { channel: Channel::named("y"), patches: clear }];
    let clear = Drawdown { source: Source::default(), rows: 4, thickness_known: true, series };
    let found = only(&clear, Surface::default());
    assert!(found.usable && found.k.unwrap().value == 0.0, "{found:?}");
    assert!(found.k.unwrap().std_error.is_none() && found.s.unwrap().std_error.is_some());
    assert!((found.s.unwrap().value - 7.0).abs() < 0.1 && found.remarks[0].kind() == "at-bound");
}

/// The two layouts of the same measurement, per film or with a thickness.
#[test]
fn both_layouts_say_the_same() {
    let (x, backings) = (0.05, [0.02, 0.83]);
    let paints = [("450nm", 4.0, 30.0), ("550nm", 1.5, 25.0), ("650nm", 0.2, 22.0)];
    let mut by_channel = "\u{feff}# a card\r\nwavelength,black,white,over_black,over_white\r\n".to_owned();
    for (name, k, s) in paints {
        let [b, w] = backings.map(|rg| printed(k, s, x, rg));
        write!(by_channel, "{name},{},{},{b},{w}\r\n", backings[0], backings[1]).unwrap();
    }
    let mut by_patch = "background, 450nm,550nm,650nm,background_650\n".to_owned();
    for rg in backings {
        let r: Vec<String> = paints.map(|(_, k, s)| printed(k, s, x, rg).to_string()).to_vec();
        // The common column is for the others.
        let common = rg;
        writeln!(by_patch, "{common},{},{rg}", r.join(",")).unwrap();
    }
    let folder = Folder::new();
    folder.write("channels.csv", by_channel);
    folder.write("patches.csv", by_patch);
    for name in ["channels", "patches"] {
        for (option, unit) in [("", x), ("--thickness 0.05", 1.0)] {
            let run = folder.brdfit(&format!("kubelka-munk {name}.csv {option} --json")).good();
            let report = run.json();
            assert_eq!(report["schema"], "brdfit.kubelka-munk/1");
            assert_eq!(report["data"]["wavelengths_nm"], serde_json::json!([450.0, 550.0, 650.0]));
            assert!(run.stderr.contains("every channel: there are as many unknowns"), "{}", run.stderr);
            for ((label, k, s), channel) in paints.iter().zip(report["channels"].as_array().unwrap()) {
                assert_close(label, channel["k"]["value"].as_f64().unwrap(), k * unit, 1e-6);
                assert_close(label, channel["s"]["value"].as_f64().unwrap(), s * unit, 1e-6);
                assert_eq!(channel["k"]["std_error"], Value::Null);
            }
        }
    }
}

#[test]
fn command_line() {
    let folder = Folder::new();
    let mut csv = "thickness,background,y,sigma\n".to_owned();
    for (x, rg) in SEVERAL {
        writeln!(csv, "{x},{rg},{},0.001", with_surface(GLOSSY, printed(2.0, 30.0, x, rg))).unwrap();
    }
    folder.write("card.csv", csv);
    let table = folder.brdfit("kubelka-munk card.csv --saunderson 0.04,0.596 -o report.json").good();
    assert!(table.stdout.contains("K/S") && table.stdout.contains("k2 = 0.5960"), "{}", table.stdout);
    let report = parse(&folder.read("report.json"));
    assert_close("K", report["channels"][0]["k"]["value"].as_f64().unwrap(), 2.0, 1e-6);
    assert_eq!(report["channels"][0]["n"], 6);
    assert_eq!(report["channels"][0]["dof"], 4);
    assert_eq!(report["usable"], true);
    // k1 and k2 from the index; the same bytes every time.
    let eta = folder.brdfit("kubelka-munk card.csv --eta 1.5 -o -").good();
    assert!((eta.json()["options"]["k2"].as_f64().unwrap() - 0.596).abs() < 5e-4);
    assert_eq!(eta.stdout, folder.brdfit("kubelka-munk card.csv --eta 1.5 --json").good().stdout);
    assert_eq!(folder.brdfit("kubelka-munk card.csv -q").good().stdout, "");
    // Not enough: exit code 1, a whole report.
    folder.write("one.csv", "background,y\n0,0.4\n");
    let one = folder.brdfit("kubelka-munk one.csv --json");
    assert_eq!(one.code, Some(1), "{one:?}");
    assert_eq!(one.json()["usable"], false);
    assert_eq!(one.json()["channels"][0]["k"], Value::Null);
    assert!(one.stderr.contains("second backing"), "{}", one.stderr);
    // Opaque paint needs no backing.
    folder.write("chips.csv", "r,g,b\n0.5,0.2,0.1\n");
    let chips = folder.brdfit("kubelka-munk chips.csv --thickness inf --json").good().json();
    assert_close("K/S", chips["channels"][0]["k_over_s"]["value"].as_f64().unwrap(), 0.25, 1e-9);
    assert_close("R_inf", chips["channels"][2]["r_inf"]["value"].as_f64().unwrap(), 0.1, 1e-9);
}

/// Exit code 2, one line that says where, what was expected and what was found, and no file written.
#[test]
fn broken_files_and_bad_usage_are_refused() {
    let good = "background,y\n0,0.4\n1,0.6\n";
    let cases: &[(&str, &[u8], &str, &[&str])] = &[
        ("empty", b"", "", &["expected", "an empty file"]),
        ("comments", b"# nothing\n", "", &["expected a header", "only comments"]),
        ("byte-order mark alone", b"\xef\xbb\xbf", "", &["expected a header"]),
        ("lone header", b"background,y\n", "", &["no usable sample"]),
        ("no channel", b"background,thickness\n0,1\n", "", &[":1:", "over_black", "'background,thickness'"]),
        ("no background", b"r,g\n0.1,0.2\n", "", &[":2:", "a column 'background'"]),
        ("unknown column", b"over_black,over_white,gloss\n0.1,0.2,3\n", "", &[":1:", "over_NAME", "'gloss'"]),
        ("unknown backing", b"over_black,over_grey\n0.1,0.2\n", "", &[":1:", "a column 'grey'"]),
        ("two names", b"channel,wavelength,over_black\nr,600,0.1\n", "", &[":1:", "one column of"]),
        ("duplicate column", b"background,y,y\n0,0.1,0.2\n", "", &[":1:", "'y' twice"]),
        ("duplicate channel", b"background,550,550nm\n0,0.1,0.2\n", "", &[":1:", "'550nm' twice"]),
        ("nameless column", b"background,,y\n0,0.1,0.2\n", "", &[":1:", "column 2"]),
        ("sigma of nothing", b"background,y,sigma_z\n0,0.1,0.2\n", "", &[":1:", "'z'"]),
        ("text in a number", b"background,y\n0,bright\n", "", &[":2:", "from 0 to 1 for y", "'bright'"]),
        ("empty field", b"background,y\n0,\n", "", &[":2:", "for y", "''"]),
        ("NaN", b"background,y\n0,NaN\n", "", &[":2:", "for y", "'NaN'"]),
        ("reflectance above 1", b"background,y\n0,1.01\n", "", &[":2:", "from 0 to 1", "'1.01'"]),
        ("per cent", b"background,y\n0,43.5\n", "", &[":2:", "per cent", "'43.5'"]),
        ("negative", b"background,y\r\n0,-0.1\r\n", "", &[":2:", "from 0 to 1", "'-0.1'"]),
        ("background above 1", b"background,y\n2,0.1\n", "", &[":2:", "background", "'2'"]),
        ("thickness of 0", b"thickness,background,y\n0,0,0.1\n", "", &[":2:", "thickness", "'0'"]),
        ("sigma of 0", b"background,y,sigma\n0,0.1,0\n", "", &[":2:", "sigma", "'0'"]),
        ("too few fields", b"background,y\n0\n", "", &[":2:", "2 fields", "found 1"]),
        ("not UTF-8", b"background,y\n0,\xff\n", "", &[":2:", "UTF-8"]),
        (
            "thickness twice",
            b"thickness,background,y\n1,0,0.1\n",
            "--thickness 2",
            &["--thickness", "without a column 'thickness'"],
        ),
        ("thickness below 0", good.as_bytes(), "--thickness -1", &["above 0"]),
        ("surface of one number", good.as_bytes(), "--saunderson 0.04", &["0.04,0.596"]),
        ("surface that lets nothing out", good.as_bytes(), "--saunderson 0.04,1", &["less than 1"]),
        ("surface twice", good.as_bytes(), "--saunderson 0,0 --eta 1.5", &["--eta"]),
        ("index below 1", good.as_bytes(), "--eta 0.9", &["refractive index"]),
    ];
    for (what, content, options, words) in cases {
        let folder = Folder::new();
        folder.write("card.csv", content);
        let before = folder.listing();
        let run = folder.brdfit(&format!("kubelka-munk card.csv {options} -o report.json"));
        assert_eq!((run.code, run.stdout.as_str()), (Some(2), ""), "{what}: {run:?}");
        assert!(run.stderr.starts_with("error: ") && run.stderr.lines().count() == 1, "{what}: {run:?}");
        for word in *words {
            assert!(run.stderr.contains(word), "{what}: '{word}' is not in {}", run.stderr);
        }
        assert_eq!(before, folder.listing(), "{what}");
    }
    let folder = Folder::new();
    folder.write("card.csv", good);
    let run = folder.brdfit("kubelka-munk card.csv -o card.csv");
    assert!(run.code == Some(2) && run.stderr.contains("a file other than the input"), "{run:?}");
    assert_eq!(folder.brdfit("kubelka-munk absent.csv").code, Some(2));
    assert_eq!(folder.brdfit("kubelka-munk").code, Some(2));
}

/// data/paint-drawdown.csv against the paint of scripts/drawdown_example.py.
#[test]
fn shipped_example() {
    let folder = Folder::new();
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/data/paint-drawdown.csv");
    let run = folder.run(["kubelka-munk", path, "--saunderson", "0.04,0.596", "--json"]).good();
    let report = run.json();
    let channels = report["channels"].as_array().unwrap();
    assert_eq!((channels.len(), run.stderr.as_str()), (16, ""));
    let band = |nm: f64, centre: f64, width: f64| (-((nm - centre) / width).powi(2)).exp();
    for (channel, nm) in channels.iter().zip(report["data"]["wavelengths_nm"].as_array().unwrap()) {
        let nm = nm.as_f64().unwrap();
        let k = 0.5 + 12.0 * band(nm, 420.0, 45.0) + 9.0 * band(nm, 650.0, 50.0);
        let s = 40.0 * (nm / 550.0).powf(-1.2);
        for (name, truth) in [("k", k), ("s", s), ("k_over_s", k / s)] {
            let of = |what: &str| channel[name][what].as_f64().unwrap();
            let off = (of("value") - truth) / of("std_error");
            assert!(off.abs() < 4.0, "{nm} nm, {name}: {} +/- {} for {truth}", of("value"), of("std_error"));
        }
    }
}
