//! The readers, against files written by hand, by independent arithmetic, and at random.

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::float_cmp, clippy::cast_precision_loss)]

mod alta;
mod dialects;
#[cfg(feature = "images")]
mod exr_slice;
mod merl_like;
mod npz;
mod published_tables;

use crate::common::{CELLS, Folder, merl_filled, merl_header, shared};
use approx::{assert_abs_diff_eq, assert_relative_eq};
use brdfit::Error;
use brdfit::geometry::{Azimuths, Directions, Geometry};
use brdfit::measurement::formats::{
    BinPosition, File, REGISTRY, ReadOptions, csv, merl, named, read, read_directions, read_file,
};
use brdfit::measurement::{Channel, Filters, Measurement, Samples, Weighting};
use brdfit::model::Expression;
use brdfit::parameters::{ParameterTable, Selector, Setting};
use brdfit::synthetic::{Noise, measurement, scattered_directions};
use proptest::prelude::*;
use sha2::{Digest as _, Sha256};
use std::f64::consts::{FRAC_PI_2, PI};
use std::io::Read;
use std::path::Path;
use std::sync::{Arc, LazyLock};

static CENTER: LazyLock<ReadOptions> = LazyLock::new(ReadOptions::new);
static EDGE: LazyLock<ReadOptions> = LazyLock::new(|| ReadOptions::new().with_merl_bins(BinPosition::Edge));

/// Reads bytes in the format of that name.
fn parse(format: &str, bytes: &[u8], options: &ReadOptions) -> Result<Measurement, Error> {
    read_file(File::new(Path::new("x"), bytes).unwrap(), Some(format), options)
}

fn parsed(format: &str, text: &str) -> Measurement {
    parse(format, text.as_bytes(), &CENTER).unwrap_or_else(|e| panic!("{e}"))
}

fn geometries(m: &Measurement) -> Vec<Geometry<f64>> {
    m.directions.iter().collect()
}

fn assert_direction(found: [f64; 3], theta: f64, phi: f64, epsilon: f64) {
    let expected = [theta.sin() * phi.cos(), theta.sin() * phi.sin(), theta.cos()];
    for (f, e) in found.into_iter().zip(expected) {
        assert_abs_diff_eq!(f, e, epsilon = epsilon);
    }
}

// CSV

#[test]
fn what_synth_writes_is_read_back() {
    let expression = Expression::parse("lambert + cook-torrance").unwrap();
    let channels = ["r", "550", "x.y"].map(str::to_owned);
    let set = |name: &str, value| (Selector::parse(name).unwrap(), Setting::Set(value));
    let settings = vec![set("kd", 0.3), set("kd.r", 0.7), set("m", 0.15), set("f0[550]", 0.9)];
    let table = ParameterTable::new(&expression, &channels, Azimuths::Several, &settings).unwrap();
    let directions = Directions::Scattered(scattered_directions(500, 89.0, 3));
    let noise = Noise { relative: 0.1, absolute: 1e-3 };
    let written = measurement(&expression, &table, directions, noise, 9);
    let text = csv::write(&written, &["a comment".to_owned()]).unwrap();
    let again = parsed("csv", &text);

    assert_eq!(again.channels, written.channels);
    assert_eq!(again.channels[1].wavelength_nm, Some(550.0));
    assert_eq!(again.values, written.values, "values are written to the last bit");
    assert_eq!(again.sigma, written.sigma);
    assert_eq!(again.total(), 500);
    for (a, b) in geometries(&again).iter().zip(geometries(&written)) {
        for (a, b) in [(a.wi, b.wi), (a.wo, b.wo)] {
            for (a, b) in a.into_iter().zip(b) {
                assert_abs_diff_eq!(a, b, epsilon = 1e-12);
            }
        }
    }
}

#[test]
fn csv_by_hand() {
    let m = parsed(
        "csv",
        "# comment\nphi_o,theta_o,blue,phi_i,theta_i,532 nm\n180, 60, 0.5, 90, 30, -0.25\n-10,0,1e-3,0,90,7\n",
    );
    assert_eq!(m.channels, [Channel::named("blue"), Channel::at_wavelength(532.0)]);
    assert_eq!(m.channels[1].name, "532");
    assert_eq!(m.values, [vec![0.5, 1e-3], vec![-0.25, 7.0]], "negatives are kept");
    assert!(m.sigma.is_none() && m.dropped.is_empty());
    let g = geometries(&m);
    assert_direction(g[0].wi, PI / 6.0, FRAC_PI_2, 1e-15);
    assert_direction(g[0].wo, PI / 3.0, PI, 1e-15);
    assert_direction(g[1].wi, FRAC_PI_2, 0.0, 1e-15);
    assert_direction(g[1].wo, 0.0, 0.0, 1e-15);
}

/// In-plane scans: a negative theta lies on the other side of the normal, at phi + 180 degrees.
#[test]
fn negative_theta_is_on_the_other_side() {
    let m = parsed("csv", "theta_i,phi_i,theta_o,phi_o,f\n-30,0,45,10,1\n30,180,-45,-170,1\n");
    let g = geometries(&m);
    assert_direction(g[0].wi, PI / 6.0, PI, 1e-15);
    for (a, b) in [(g[0].wi, g[1].wi), (g[0].wo, g[1].wo)] {
        for (a, b) in a.into_iter().zip(b) {
            assert_abs_diff_eq!(a, b, epsilon = 1e-15);
        }
    }
}

#[test]
fn sigma_columns() {
    let sigma = |header: &str, row: &str| {
        parsed("csv", &format!("theta_i,phi_i,theta_o,phi_o,{header}\n1,2,3,4,{row}\n")).sigma
    };
    assert_eq!(sigma("f", "1"), None);
    assert_eq!(sigma("f,sigma", "1,0.1"), Some(vec![vec![0.1]]));
    assert_eq!(sigma("sigma,r,g", "0.1,1,2"), Some(vec![vec![0.1], vec![0.1]]), "one for all channels");
    assert_eq!(sigma("r,g,sigma_g,sigma_r", "1,2,0.2,0.1"), Some(vec![vec![0.1], vec![0.2]]));
    assert_eq!(
        sigma("r,g,sigma_g,sigma", "1,2,0.2,0.3"),
        Some(vec![vec![0.3], vec![0.2]]),
        "own before common"
    );
    assert_eq!(sigma("550,sigma_550nm", "1,0.5"), Some(vec![vec![0.5]]), "the same wavelength");
    // A channel without one leaves the weights undefined: none are given.
    assert_eq!(sigma("r,g,sigma_r", "1,2,0.1"), None);
    // Zero is a statement (perhaps of missing knowledge), but no weight.
    let m = parsed("csv", "theta_i,phi_i,theta_o,phi_o,f,sigma\n1,2,3,4,5,0\n");
    assert_eq!(m.sigma, Some(vec![vec![0.0]]));
    let filters = Filters::default().with_weighting(Weighting::Sigma);
    assert!(Samples::select(&m, &filters).is_err());
    assert!(Samples::select(&m, &Filters::default()).is_ok());
}

#[test]
fn channel_names_and_wavelengths() {
    for (given, name, nm) in [
        ("r", "r", None),
        ("550", "550", Some(550.0)),
        ("550nm", "550", Some(550.0)),
        ("550 nm", "550", Some(550.0)),
        ("632.8", "632.8", Some(632.8)),
        ("1064.0", "1064", Some(1064.0)),
        ("X", "X", None),
        ("nm", "nm", None),
        ("-5", "-5", None),
        ("inf", "inf", None),
        ("NaN", "NaN", None),
    ] {
        let channel = Channel::named(given);
        assert_eq!((channel.name.as_str(), channel.wavelength_nm), (name, nm), "{given}");
    }
}

#[test]
fn directions_alone() {
    let folder = Folder::new();
    folder.write("angles.csv", "site,theta_i,phi_i,theta_o,phi_o,note\nA,10,0,20,180,dry\nB,-30,0,0,0,wet\n");
    let pairs = read_directions(&folder.path("angles.csv"), &CENTER).unwrap();
    assert_eq!(pairs.len(), 2);
    assert_direction(pairs[0].wo.to_array(), 20.0_f64.to_radians(), PI, 1e-15);
    assert_direction(pairs[1].wi.to_array(), PI / 6.0, PI, 1e-15);
}

// Cornell

#[test]
fn cornell_by_hand() {
    let text = "# a hand-written sample\n2 # wavelengths\n\n450\n550.5 # nm\n\n\
                0.5 0.0 1.0 3.0 0.25 -0.125\n\
                # a comment between\n\
                \t-0.5  0.0\t1.5707963 0.0 1e-3 2e-3 # behind\n";
    for text in [text.to_owned(), text.replace('\n', "\r\n"), format!("\u{feff}{text}")] {
        let m = parsed("cornell", &text);
        assert_eq!(m.channels, [Channel::at_wavelength(450.0), Channel::at_wavelength(550.5)]);
        assert_eq!(m.values, [vec![0.25, 1e-3], vec![-0.125, 2e-3]]);
        let g = geometries(&m);
        assert_direction(g[0].wi, 0.5, 0.0, 1e-15);
        assert_direction(g[0].wo, 1.0, 3.0, 1e-15);
        assert_direction(g[1].wi, 0.5, PI, 1e-15);
        assert!(m.sigma.is_none() && m.dropped.is_empty());
    }
}

/// Counts and sums found with awk:
/// `awk '!/^#/ && NF==35 {n++; a+=$5; b+=$20} END {print n, a, b}' FILE`.
#[test]
fn measured_cornell_files() {
    for (name, first, sum_400, sum_550) in [
        ("cayman", [0.000_874, 0.001_991, 0.002_000], 646.669_911, 670.770_898),
        ("garnet_red", [0.023_025, 0.013_790, 0.050_083], 88.664_884, 90.741_162),
        ("krylon_blue", [0.017_415, 0.036_844, 0.005_187], 119.242_196, 99.376_721),
    ] {
        let Some(path) = shared(&format!("cornell/{name}.brdf")) else { continue };
        let m = read(&path, None, &CENTER).unwrap();
        assert_eq!(m.source.format, "cornell");
        let wavelengths: Vec<f64> = m.channels.iter().map(|c| c.wavelength_nm.unwrap()).collect();
        let expected: Vec<f64> = (0..31).map(|i| f64::from(400 + 10 * i)).collect();
        assert_eq!(wavelengths, expected);
        assert_eq!(m.total(), 1439);
        assert!(m.dropped.is_empty());
        assert_eq!([m.values[0][0], m.values[1][0], m.values[30][0]], first);
        assert_abs_diff_eq!(m.values[0].iter().sum::<f64>(), sum_400, epsilon = 1e-5);
        assert_abs_diff_eq!(m.values[15].iter().sum::<f64>(), sum_550, epsilon = 1e-5);
        let g = geometries(&m);
        assert_direction(g[0].wi, 0.872_665, 0.0, 1e-15);
        assert_direction(g[0].wo, 0.573_513, 0.0, 1e-15);
        // No direction of these files is steeper than 80 degrees.
        let samples = Samples::select(&m, &Filters::default()).unwrap();
        assert_eq!((samples.len(), samples.weighting), (1439, Weighting::Uniform));
    }
}

// MERL

/// The half/difference angles of a cell, as MERL's own reading code defines them: theta_h grows with the
/// square of its index; theta_d and phi_d are linear; phi_d runs fastest.
fn cell_angles(cell: usize, offset: f64) -> [f64; 3] {
    let (h, d, p) = (cell / (90 * 180), cell / 180 % 90, cell % 180);
    let fraction = |i: usize, n: f64| (i as f64 + offset) / n;
    [fraction(h, 90.0).powi(2) * FRAC_PI_2, fraction(d, 90.0) * FRAC_PI_2, fraction(p, 180.0) * PI]
}

/// cos(theta_i) and cos(theta_o) of half/difference angles: the z components of Rusinkiewicz's rotation.
fn cosines([theta_h, theta_d, phi_d]: [f64; 3]) -> (f64, f64) {
    let along = theta_h.cos() * theta_d.cos();
    let across = theta_h.sin() * theta_d.sin() * phi_d.cos();
    (along - across, along + across)
}

/// Rusinkiewicz's angles of two directions, the half vector's azimuth left out.
fn half_difference(wi: [f64; 3], wo: [f64; 3]) -> [f64; 3] {
    let sum: Vec<f64> = wi.iter().zip(wo).map(|(a, b)| a + b).collect();
    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    let h: Vec<f64> = sum.iter().map(|x| x / length).collect();
    let (theta_h, phi_h) = (h[0].hypot(h[1]).atan2(h[2]), h[1].atan2(h[0]));
    // Turn wi back by phi_h about z, then by theta_h about y.
    let x = wi[0] * phi_h.cos() + wi[1] * phi_h.sin();
    let y = wi[1] * phi_h.cos() - wi[0] * phi_h.sin();
    let dx = x * theta_h.cos() - wi[2] * theta_h.sin();
    let dz = x * theta_h.sin() + wi[2] * theta_h.cos();
    [theta_h, dx.hypot(y).atan2(dz), y.atan2(dx)]
}

/// A value that tells cells and channels apart.
fn pattern(cell: usize) -> [f64; 3] {
    let x = cell as f64;
    [1.0 + x, 0.5 / (1.0 + x), 1e-3 * (x % 977.0)]
}

#[test]
fn merl_tables_round_trip() {
    // Every seventh cell was not measured.
    let bytes = merl::encode(Path::new("x"), |cell| {
        let cell = cell as usize;
        (cell % 7 != 3).then(|| pattern(cell))
    })
    .unwrap();
    assert_eq!(bytes.len(), 34_992_012);
    assert_eq!(bytes[..12], merl_header([90, 90, 180]));
    // f = stored x (1, 1.15, 1.66)/1500, planes in the order red, green, blue.
    let stored = |plane: usize, cell: usize| {
        let at = 12 + 8 * (plane * CELLS + cell);
        f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap())
    };
    for cell in [0, 1, 180, 16_200, 700_000] {
        for (plane, scale) in [1.0, 1.15, 1.66].into_iter().enumerate() {
            assert_relative_eq!(
                stored(plane, cell) * scale / 1500.0,
                pattern(cell)[plane],
                max_relative = 1e-14
            );
        }
    }
    assert!((0..3).all(|plane| stored(plane, 3) < 0.0));

    for (options, offset) in [(&CENTER, 0.5), (&EDGE, 0.0)] {
        let m = parse("merl", &bytes, options).unwrap();
        let names: Vec<&str> = m.channels.iter().map(|c| c.name.as_str()).collect();
        assert_eq!(names, ["r", "g", "b"]);
        assert_eq!(m.total(), CELLS);
        let Directions::Grid { cells, .. } = &m.directions else { panic!("a grid") };
        assert!(cells.is_sorted());

        // What must have been left out, from the definition of the grid alone. Cells whose direction lies
        // in the horizon to rounding may fall on either side.
        let horizon = |cell: usize| {
            let (ci, co) = cosines(cell_angles(cell, offset));
            ci.min(co)
        };
        let below = (0..CELLS).filter(|c| c % 7 != 3 && horizon(*c) < -1e-12).count();
        let unsure = (0..CELLS).filter(|c| c % 7 != 3 && horizon(*c).abs() <= 1e-12).count();
        let unmeasured = (0..CELLS).filter(|c| c % 7 == 3).count();
        assert_eq!(m.dropped["not-measured"], unmeasured);
        assert!((below..=below + unsure).contains(&m.dropped["below-horizon"]), "{:?} {below}", m.dropped);
        assert_eq!(m.dropped.len(), 2);

        for (index, (cell, g)) in cells.iter().zip(m.directions.iter()).enumerate().step_by(101) {
            let cell = *cell as usize;
            assert!(horizon(cell) > -1e-12);
            for (row, expected) in m.values.iter().zip(pattern(cell)) {
                assert_relative_eq!(row[index], expected, max_relative = 1e-12);
            }
            let [theta_h, theta_d, phi_d] = cell_angles(cell, offset);
            let found = half_difference(g.wi, g.wo);
            assert_abs_diff_eq!(found[0], theta_h, epsilon = 1e-12);
            assert_abs_diff_eq!(found[1], theta_d, epsilon = 1e-12);
            // Without a difference angle there is no azimuth of it; 0 and 180 degrees are one by reciprocity.
            if theta_d > 0.0 {
                assert_abs_diff_eq!((found[2] - phi_d).sin() * theta_d.sin(), 0.0, epsilon = 1e-12);
            }
        }
    }
}

#[test]
fn merl_cells_are_dropped_for_a_reason() {
    let mut bytes = merl_filled(1.0);
    let mut put = |plane: usize, cell: usize, value: f64| {
        let at = 12 + 8 * (plane * CELLS + cell);
        bytes[at..at + 8].copy_from_slice(&value.to_le_bytes());
    };
    // One channel is enough; cells 0.. lie at theta_h = theta_d = 0, far above the horizon.
    put(0, 0, -1.0);
    put(2, 1, -1e-300);
    put(1, 2, f64::NAN);
    put(2, 3, f64::INFINITY);
    put(0, 4, f64::NEG_INFINITY);
    put(0, 5, 0.0);
    put(1, 6, -0.0);
    let m = parse("merl", &bytes, &CENTER).unwrap();
    assert_eq!(m.dropped["not-finite"], 2);
    assert_eq!(m.dropped["not-measured"], 3, "negative infinity is negative");
    let Directions::Grid { cells, .. } = &m.directions else { panic!("a grid") };
    assert_eq!(cells[..3], [5, 6, 7], "zero is a measurement");
    assert_eq!(m.values[0][0], 0.0);
    assert!(m.values.iter().flatten().all(|v| v.is_finite()));
    assert_eq!(m.total(), CELLS);
}

#[test]
fn formats_are_recognised_by_content() {
    let folder = Folder::new();
    folder.write("no-extension", merl_filled(1.0));
    folder.write("cornell.csv", "1\n550\n0.1 0 0.2 0 0.5\n");
    folder.write("table.brdf", "theta_i,phi_i,theta_o,phi_o,f\n1,2,3,4,5\n");
    folder.write("table.binary", "theta_i,phi_i,theta_o,phi_o,f\n1,2,3,4,5\n");
    for (name, format) in
        [("no-extension", "merl"), ("cornell.csv", "cornell"), ("table.brdf", "csv"), ("table.binary", "csv")]
    {
        let m = read(&folder.path(name), None, &CENTER).unwrap();
        assert_eq!(m.source.format, format, "{name}");
        assert_eq!(m.source.path, folder.path(name));
    }
}

/// A source that gives a few bytes at a time, and is interrupted now and then, as a pipe may be.
struct Trickle<'a> {
    rest: &'a [u8],
    reads: usize,
}

impl Read for Trickle<'_> {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        self.reads += 1;
        if self.reads.is_multiple_of(10) {
            return Err(std::io::ErrorKind::Interrupted.into());
        }
        let most = into.len().min(4099);
        self.rest.read(&mut into[..most])
    }
}

/// Numbers and hash do not depend on the pieces in which a file arrives.
#[test]
fn files_may_arrive_in_pieces() {
    let merl = merl::encode(Path::new("x"), |cell| (cell % 7 != 3).then(|| pattern(cell as usize))).unwrap();
    let csv = format!("\u{feff}theta_i,phi_i,theta_o,phi_o,f\n{}", "1,2,3,4,5\n".repeat(20_000)).into_bytes();
    for (format, bytes) in [("merl", &merl), ("csv", &csv)] {
        let mut file = File::new(Path::new("x"), Trickle { rest: bytes, reads: 0 }).unwrap();
        let m = (named(format).unwrap().read)(&mut file, &CENTER).unwrap();
        let whole = parse(format, bytes, &CENTER).unwrap();
        assert!(m.values == whole.values && m.dropped == whole.dropped && m.total() == whole.total());
        let digest = Sha256::digest(bytes);
        let expected: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(file.sha256(), expected, "{format}");
    }
}

#[test]
fn tables_share_one_grid() {
    let grid = |options| match parse("merl", &WHOLE, options).unwrap().directions {
        Directions::Grid { grid, .. } => grid,
        Directions::Scattered(_) => panic!("a grid"),
    };
    assert!(Arc::ptr_eq(&grid(&CENTER), &grid(&CENTER)));
    assert!(Arc::ptr_eq(&grid(&EDGE), &grid(&EDGE)));
    assert!(!Arc::ptr_eq(&grid(&CENTER), &grid(&EDGE)));
}

// Anything at all: an error of one line, or a measurement that keeps its promises; never a panic.

/// Offers bytes to every reader by name, and to every sniffer.
fn offer(bytes: &[u8]) -> Result<(), TestCaseError> {
    for name in ["x", "x.binary", "x.csv"] {
        for format in REGISTRY {
            // Bytes that begin like gzip, and are not, reach no reader.
            let Ok(mut file) = File::new(Path::new(name), bytes) else { continue };
            let _ = (format.sniff)(&file);
            match (format.read)(&mut file, &CENTER) {
                Err(error) => {
                    let message = error.to_string();
                    prop_assert!(message.starts_with(name), "{}", message);
                    prop_assert!(!message.chars().any(char::is_control), "{:?}", message);
                    prop_assert!(message.len() < 500, "{}", message);
                }
                Ok(m) => {
                    prop_assert!(!m.channels.is_empty());
                    prop_assert_eq!(m.values.len(), m.channels.len());
                    // NaN is a value that was not measured, whose standard deviation means nothing.
                    for row in m.values.iter().chain(m.sigma.iter().flatten()) {
                        prop_assert_eq!(row.len(), m.directions.len());
                    }
                    for row in &m.values {
                        prop_assert!(row.iter().all(|v| v.is_finite() || v.is_nan()));
                    }
                    for (values, sigma) in m.values.iter().zip(m.sigma.iter().flatten()) {
                        let mut both = values.iter().zip(sigma);
                        prop_assert!(both.all(|(v, sigma)| v.is_nan() || sigma.is_finite()));
                    }
                    for g in m.directions.iter() {
                        prop_assert!(g.wi.iter().chain(&g.wo).all(|v| v.is_finite()));
                        prop_assert!(g.cos_i() > -1e-4 && g.cos_o() > -1e-4);
                    }
                    let names: Vec<&str> = m.channels.iter().map(|c| c.name.as_str()).collect();
                    prop_assert!((1..names.len()).all(|i| !names[..i].contains(&names[i])), "{:?}", names);
                }
            }
        }
    }
    Ok(())
}

static WHOLE: LazyLock<Vec<u8>> = LazyLock::new(|| merl_filled(1.0));

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn random_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..300)) {
        offer(&bytes)?;
    }

    #[test]
    fn random_numbers_and_separators(text in "[0-9,.eE+\\-# \t\r\n;naif\"]{0,200}") {
        offer(text.as_bytes())?;
    }

    #[test]
    fn random_rows_below_a_csv_header(
        names in "(,[a-z0-9_\"\n\u{1b}. ]{0,9}){0,4}(,sigma)?",
        rows in "([0-9]{1,3}(\\.[0-9])?,){4,6}[0-9.,\\-en\n\"]{0,60}",
    ) {
        offer(format!("theta_i,phi_i,theta_o,phi_o{names}\n{rows}").as_bytes())?;
    }

    #[test]
    fn valid_rows_below_a_csv_header(
        rows in proptest::collection::vec((-90.0..90.0, any::<f64>(), -90.0..90.0, -1e3..1e3, any::<f64>()), 0..9),
    ) {
        let lines: String =
            rows.iter().map(|(a, b, c, d, f)| format!("{a},{b},{c},{d},{f:e}\n")).collect();
        let text = format!("theta_i,phi_i,theta_o,phi_o,f\n{lines}");
        offer(text.as_bytes())?;
        // Finite numbers are read to the last bit; one that is not refuses the file.
        let m = parse("csv", text.as_bytes(), &CENTER);
        if rows.iter().all(|row| row.1.is_finite() && row.4.is_finite()) {
            let expected: Vec<f64> = rows.iter().map(|row| row.4).collect();
            prop_assert_eq!(&m.unwrap().values[0], &expected);
        } else {
            prop_assert!(m.is_err());
        }
    }

    #[test]
    fn random_rows_below_a_cornell_header(
        count in "-?[0-9]{1,25}",
        rest in "[ \n](400|550.5|-1|nan)( [0-9]{3}){0,3}\n([0-9.\\-e]{1,4}[ \t\n#]){0,40}",
    ) {
        offer(format!("{count}{rest}").as_bytes())?;
    }

    #[test]
    fn merl_cut_near_its_header(length in 0_usize..64, dimensions in any::<[i32; 3]>()) {
        let whole = &WHOLE[..length];
        offer(whole)?;
        prop_assert!(parse("merl", whole, &CENTER).is_err());
        let mut other = [merl_header(dimensions), vec![0; 64]].concat();
        other.truncate(length);
        offer(&other)?;
    }
}

proptest! {
    // A table is long: fewer of them.
    #![proptest_config(ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn merl_cut_anywhere(length in 12_usize..12 + 24 * CELLS) {
        let Err(Error::Malformed { found, .. }) = parse("merl", &WHOLE[..length], &CENTER) else {
            return Err(TestCaseError::fail("a truncated table was accepted"));
        };
        prop_assert!(found.contains(&length.to_string()), "{}", found);
    }
}
