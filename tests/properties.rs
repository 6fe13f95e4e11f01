//! Properties of the readers and writers, on made-up content: what is written is read back, what means the same is read
//! the same, and nothing makes a reader panic. The fuzz targets (docs/inside/fuzzing.md) check the same promises on bytes
//! that libFuzzer makes up; their corpora are checked here, too.

#![allow(clippy::print_stdout)]

use crate::oracles;
use brdfit::drawdown;
use brdfit::fit::{Options, evaluate};
use brdfit::geometry::{Directions, HalfDifferenceGrid, Pair, direction};
use brdfit::measurement::formats::{File, ReadOptions, csv, merl, read_file};
use brdfit::measurement::{Channel, Measurement};
use brdfit::model::{Expression, REGISTRY};
use brdfit::parameters::{Selector, Setting};
use brdfit::report::{Circumstances, OptionRecord, Report, Times, schema};
use proptest::prelude::*;
use std::fs;
use std::path::Path;
use std::sync::LazyLock;

fn read(format: &str, content: &[u8]) -> Measurement {
    let file = File::new(Path::new("x"), content).unwrap();
    read_file(file, Some(format), &ReadOptions::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// The inputs that fuzzing found to reach every part of the readers, and those that once broke one.
#[test]
fn corpora_of_the_fuzz_targets() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    let mut cases = 0;
    for (name, target) in oracles::TARGETS {
        for entry in fs::read_dir(corpora.join(name)).unwrap() {
            let path = entry.unwrap().path();
            println!("{}", path.display());
            target(&fs::read(path).unwrap());
            cases += 1;
        }
    }
    assert!(cases > 50, "{cases}");
    assert_eq!(fs::read_dir(corpora).unwrap().count(), oracles::TARGETS.len());
}

/// Every prefix and every single damaged byte of a small file of each kind.
#[test]
fn every_cut_and_every_damaged_byte() {
    let corpora = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus");
    for (name, seed) in [
        ("csv", "sigma.csv"),
        ("csv", "order-crlf-bom.csv"),
        ("cornell", "plain.brdf"),
        ("cornell", "lines.brdf"),
        ("alta", "tape.alta"),
        ("alta", "intervals.alta"),
        ("tables", "ptfe.csv"),
        ("tables", "metals.csv"),
        ("exr", "plain.exr"),
        ("exr", "small.exr"),
        ("npz", "rgb.npz"),
        ("npz", "sigma.npz"),
        ("merl", "cells.binary"),
        ("zemax", "plain.bsdf"),
        ("zemax", "xyz.bsdf"),
        ("ssdd", "text.ssdd"),
        ("ssdd", "binary.ssdd"),
        ("ssdd", "distorted.ssdd"),
        ("rgl", "rgb.bsdf"),
        ("drawdown", "own.csv"),
        ("drawdown", "channels.csv"),
        ("expression", "sum"),
        ("settings", "channels"),
        ("settings", "metals"),
    ] {
        let target = oracles::TARGETS.iter().find(|(n, _)| *n == name).unwrap().1;
        let whole = fs::read(corpora.join(name).join(seed)).unwrap();
        for at in 0..whole.len() {
            target(&whole[..at]);
            for byte in [0, b'\n', b'"', b',', b'9', b'-', b'+', b'(', b'[', 0x80, 0xff] {
                let mut damaged = whole.clone();
                damaged[at] = byte;
                target(&damaged);
            }
        }
    }
}

/// Names that a header can hold and a channel may have.
fn names() -> impl Strategy<Value = Vec<String>> {
    let name = prop_oneof![
        "[a-zA-Z][a-zA-Z0-9 ,\"#;.-]{0,10}[a-z0-9]",
        (1_u32..3000).prop_map(|nm| nm.to_string()),
        (1.0..3000.0).prop_map(|nm| format!("{nm}")),
        Just("\u{3bb}".to_owned()),
    ];
    let reserved = |name: &String| {
        !["sigma", "theta_i", "phi_i", "theta_o", "phi_o"].contains(&name.as_str())
            && !name.starts_with("sigma_")
    };
    let distinct = |names: &Vec<String>| (1..names.len()).all(|i| !names[..i].contains(&names[i]));
    let names = prop::collection::vec(name.prop_filter("a column of its own", reserved), 1..5);
    names
        .prop_map(|names| names.iter().map(|name| Channel::named(name).name).collect::<Vec<_>>())
        .prop_filter("distinct", distinct)
}

/// A measurement in scattered directions.
fn measurements() -> impl Strategy<Value = Measurement> {
    let pair = (0.0..1.57, -7.0..7.0, 0.0..1.57, -7.0..7.0)
        .prop_map(|(ti, pi, to, po)| Pair { wi: direction(ti, pi), wo: direction(to, po) });
    let number = prop_oneof![-1e3..1e3, any::<f64>().prop_filter("finite", |x| x.is_finite())];
    let sizes = (names(), 1_usize..8, any::<bool>());
    sizes.prop_flat_map(move |(names, samples, with_sigma)| {
        let channels = names.len();
        let rows = |numbers: BoxedStrategy<f64>| {
            prop::collection::vec(prop::collection::vec(numbers, samples), channels)
        };
        let values = rows(number.clone().boxed());
        let sigma = rows((0.0..10.0).boxed()).prop_map(move |sigma| with_sigma.then_some(sigma));
        let pairs = prop::collection::vec(pair.clone(), samples);
        (Just(names), pairs, values, sigma).prop_map(|(names, pairs, values, sigma)| {
            let channels = names.into_iter().zip(values);
            let measurement = Measurement::new(Directions::Scattered(pairs), channels).unwrap();
            match sigma {
                Some(sigma) => measurement.with_sigma(sigma).unwrap(),
                None => measurement,
            }
        })
    })
}

fn assert_same(a: &Measurement, b: &Measurement) {
    assert_eq!((&a.channels, &a.values, &a.sigma), (&b.channels, &b.values, &b.sigma));
    assert_eq!(a.directions.len(), b.directions.len());
    for (a, b) in a.directions.iter().zip(b.directions.iter()) {
        for (a, b) in [a.wi, a.wo].concat().into_iter().zip([b.wi, b.wo].concat()) {
            assert!((a - b).abs() < 1e-12, "{a} {b}");
        }
    }
}

/// A sum of models with every choice written out.
fn expressions() -> impl Strategy<Value = String> {
    let term = (0..REGISTRY.len(), any::<u64>(), any::<bool>()).prop_map(|(entry, choice, bare)| {
        let entry = &REGISTRY[entry];
        let mut choice = usize::try_from(choice % 1_000_003).unwrap();
        let chosen = entry.options.iter().map(|option| {
            let values = (option.values)();
            let value = values[choice % values.len()];
            choice /= values.len();
            format!("{}={value}", option.key)
        });
        let chosen = chosen.collect::<Vec<_>>().join(" , ");
        if bare || chosen.is_empty() { entry.name.to_owned() } else { format!("{} ( {chosen})", entry.name) }
    });
    prop::collection::vec(term, 1..6).prop_map(|terms| terms.join("+ "))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn csv_is_read_back(m in measurements()) {
        let text = csv::write(&m, &["line\nbreak".to_owned()]).unwrap();
        assert_same(&read("csv", text.as_bytes()), &m);
    }

    /// Line ends, byte-order mark, comments, blanks and blank lines mean nothing.
    #[test]
    fn csv_in_other_dress(m in measurements(), every in 1_usize..4) {
        let plain = csv::write(&m, &[]).unwrap();
        let mut dressed = "\u{feff}# comment, with commas\r\n\r\n".to_owned();
        for (index, line) in plain.lines().enumerate() {
            dressed.push_str(line);
            dressed.push_str("  \r\n");
            if index % every == 0 {
                dressed.push_str("#,,,\r\n\r\n   \r\n");
            }
        }
        assert_same(&read("csv", dressed.as_bytes()), &read("csv", plain.as_bytes()));
    }

    /// Cornell's table of the same numbers, in radians.
    #[test]
    fn cornell_is_read_like_csv(
        wavelengths in prop::collection::btree_set(200_u32..2500, 1..5),
        samples in prop::collection::vec((0.0..1.57, -7.0..7.0, 0.0..1.57, -7.0..7.0), 1..8),
        value in -1e3..1e3,
    ) {
        let listed: Vec<String> = wavelengths.iter().map(u32::to_string).collect();
        let mut cornell = format!("# made up\n{}\n{}\n", listed.len(), listed.join("\n"));
        let mut table = format!("theta_i,phi_i,theta_o,phi_o,{}\n", listed.join(","));
        let mut next: f64 = value;
        for (a, b, c, d) in samples {
            let values: Vec<String> = wavelengths.iter().map(|_| { next += 0.1; next.to_string() }).collect();
            cornell += &format!("{a} {b}\t{c} {d}  {} # a sample\n", values.join(" "));
            let degrees = [a, b, c, d].map(|angle: f64| angle.to_degrees().to_string());
            table += &format!("{},{}\n", degrees.join(","), values.join(","));
        }
        assert_same(&read("cornell", cornell.as_bytes()), &read("csv", table.as_bytes()));
    }

    /// A row per channel says the same as a row per patch.
    #[test]
    fn drawdowns_in_both_layouts(
        rows in prop::collection::vec((0.0..1.0, 0.0..1.0, 0.0..0.5, 0.5..1.0), 1..5),
        thickness in 0.01..10.0,
    ) {
        let mut by_channel = "wavelength,thickness,black,white,over_black,over_white\n".to_owned();
        let (rows, thickness): (Vec<(f64, f64, f64, f64)>, f64) = (rows, thickness);
        let mut by_patch = vec!["thickness".to_owned()];
        let (mut black, mut white) = (vec![thickness.to_string()], vec![thickness.to_string()]);
        for (index, (over_black, over_white, b, w)) in rows.iter().enumerate() {
            let nm = 400 + 10 * index;
            by_channel += &format!("{nm},{thickness},{b},{w},{over_black},{over_white}\n");
            by_patch.extend([format!("{nm}nm"), format!("background_{nm}")]);
            black.extend([over_black.to_string(), b.to_string()]);
            white.extend([over_white.to_string(), w.to_string()]);
        }
        let by_patch = [by_patch, black, white].map(|row| row.join(",")).join("\n");
        let read = |text: &str| {
            let file = File::new(Path::new("x"), text.as_bytes()).unwrap();
            let drawdown = drawdown::read_file(file, None).unwrap_or_else(|error| panic!("{error}\n{text}"));
            drawdown.series.into_iter().map(|s| (s.channel, s.patches)).collect::<Vec<_>>()
        };
        prop_assert_eq!(read(&by_channel), read(&by_patch));
    }

    #[test]
    fn expressions_are_understood_when_written_out(text in expressions()) {
        let expression = Expression::parse(&text).unwrap();
        let canonical = expression.canonical();
        prop_assert_eq!(Expression::parse(&canonical).unwrap().canonical(), canonical);
        oracles::expression(text.as_bytes());
    }

    /// The report of any measurement is JSON of its schema, and holds the numbers that it was made of.
    #[test]
    fn reports_are_read_back(m in measurements(), kd in 0.0..2.0) {
        let expression = Expression::parse("lambert").unwrap();
        let set = (Selector::parse("kd").unwrap(), Setting::Set(kd));
        let options = Options::default().with_settings(vec![set]);
        let Ok(fit) = evaluate(&m, &expression, &options) else { return Ok(()) };
        let circumstances = Circumstances {
            metric: options.metric,
            max_theta_deg: 80.0,
            options: OptionRecord::default(),
            times: Times::default(),
            fitted: false,
        };
        let report = Report::new(&m, &fit, &circumstances);
        let written: serde_json::Value = serde_json::from_str(&serde_json::to_string(&report).unwrap()).unwrap();
        // Making the validator takes far longer than using it.
        static VALIDATOR: LazyLock<jsonschema::Validator> =
            LazyLock::new(|| jsonschema::validator_for(&serde_json::to_value(schema()).unwrap()).unwrap());
        prop_assert!(VALIDATOR.is_valid(&written), "{}", written);
        let found: Vec<f64> =
            written["parameters"].as_array().unwrap().iter().map(|p| p["value"].as_f64().unwrap()).collect();
        prop_assert!(found.iter().all(|value| (value - kd).abs() <= 1e-15 * kd), "{:?}", found);
        let channels: Vec<&str> = written["data"]["channels"].as_array().unwrap().iter().map(|c| c.as_str().unwrap()).collect();
        let expected: Vec<&str> = m.channels.iter().map(|channel| channel.name.as_str()).collect();
        prop_assert_eq!(channels, expected);
    }

    /// Whatever it is, and in whatever language.
    #[test]
    fn bytes_and_tokens(
        bytes in prop::collection::vec(any::<u8>(), 0..200),
        tokens in "((theta_i|phi_i|theta_o|phi_o|sigma_?|r|g|550nm|over_|black|background|thickness|lambert|cook-torrance|f0|--fix|copper|[0-9]{1,3}(\\.[0-9])?|nan|1e999|-)[,\n \"#=+(.\\[\r]{0,2}){0,30}",
    ) {
        for (_, target) in oracles::TARGETS {
            target(&bytes);
            target(tokens.as_bytes());
        }
    }
}

proptest! {
    // A table has 35 MB.
    #![proptest_config(ProptestConfig { cases: 3, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn merl_is_read_back(seed in any::<u32>(), hole in 2_u32..50) {
        let value = |cell: u32| -> Option<[f64; 3]> {
            let x = f64::from(cell.wrapping_mul(2_654_435_761) ^ seed);
            (cell % hole != 1).then_some([x, x / 3.0, 1.0 / (1.0 + x)])
        };
        let bytes = merl::encode(Path::new("x"), value).unwrap();
        let m = read("merl", &bytes);
        let Directions::Grid { grid, cells } = &m.directions else { panic!("a grid") };
        let above = grid.above_horizon();
        let expected: Vec<u32> = (0_u32..)
            .take(HalfDifferenceGrid::CELLS)
            .filter(|cell| value(*cell).is_some() && above[usize::try_from(*cell).unwrap()])
            .collect();
        prop_assert!(*cells == expected);
        for (index, cell) in cells.iter().enumerate() {
            for (row, f) in m.values.iter().zip(value(*cell).unwrap()) {
                prop_assert!((row[index] - f).abs() <= 4.0 * f64::EPSILON * f, "{} {}", row[index], f);
            }
        }
    }
}
