//! Tables that are like MERL's but for the type, the byte order, the order or the scale of their numbers. All are made here, from formulas
//! of this file.

use super::{CENTER, EDGE, cell_angles, cosines, parse};
use crate::common::{CELLS, Folder, merl_header};
use brdfit::measurement::formats::{ReadOptions, read};
use brdfit::measurement::{Doubt, Measurement, Remark, TableAxis, TableFault, TablePart};
use std::f64::consts::{FRAC_PI_2, PI};

/// f of red, green and blue, by theta_h, theta_d and phi_d in radians.
type Material = fn([f64; 3]) -> [f64; 3];

/// The density of facets of GGX.
fn ggx(theta_h: f64, m: f64) -> f64 {
    let (sin, cos) = theta_h.sin_cos();
    m * m / (PI * (cos * cos * m * m + sin * sin).powi(2))
}

fn paint([h, d, _]: [f64; 3]) -> [f64; 3] {
    [0.4, 0.2, 0.1].map(|kd| kd / PI + 0.25 * (0.05 + 0.95 * (1.0 - d.cos()).powi(5)) * ggx(h, 0.2))
}

fn gold([h, d, _]: [f64; 3]) -> [f64; 3] {
    [1.0, 0.77, 0.34].map(|f0| 0.25 * (f0 + (1.0 - f0) * (1.0 - d.cos()).powi(5)) * ggx(h, 0.08))
}

fn mirror([h, _, _]: [f64; 3]) -> [f64; 3] {
    [0.9, 0.8, 0.6].map(|f0| 0.25 * f0 * ggx(h, 1e-3))
}

fn chalk(_: [f64; 3]) -> [f64; 3] {
    [0.9 / PI, 0.8 / PI, 0.7 / PI]
}

fn tape([_, d, _]: [f64; 3]) -> [f64; 3] {
    [0.5, 0.4, 0.1].map(|ks| 0.02 / PI + 0.25 * ks * ggx(d, 0.03))
}

/// A lobe back to the light that is far narrower than a bin.
fn narrow_tape([_, d, _]: [f64; 3]) -> [f64; 3] {
    [0.5, 0.4, 0.1].map(|ks| 0.25 * ks * ggx(d, 1e-4))
}

fn black_paint([h, _, _]: [f64; 3]) -> [f64; 3] {
    [0.003, 0.002, 0.0015].map(|kd| kd / PI + 0.25 * 0.001 * ggx(h, 0.3))
}

/// Less than the darkest coatings reflect, but grey.
fn black_hole(_: [f64; 3]) -> [f64; 3] {
    [3e-4 / PI; 3]
}

fn nothing(_: [f64; 3]) -> [f64; 3] {
    [0.0; 3]
}

/// So sharp that most values underflow to 0.
fn gaussian([h, _, _]: [f64; 3]) -> [f64; 3] {
    [0.3, 0.2, 0.1].map(|f0| f0 * (-(h.tan() / 0.003).powi(2)).exp() / 3.6e-5)
}

/// Lit at phi_d, too, and without light at large theta_h.
fn odd([h, d, p]: [f64; 3]) -> [f64; 3] {
    [1.0, 0.9, 0.8].map(|k| k * (0.1 + 0.05 * p.cos() * d.sin()) * (-20.0 * h).exp())
}

const MATERIALS: [(&str, Material); 11] = [
    ("paint", paint),
    ("gold", gold),
    ("mirror", mirror),
    ("chalk", chalk),
    ("tape", tape),
    ("narrow tape", narrow_tape),
    ("black paint", black_paint),
    ("black hole", black_hole),
    ("nothing", nothing),
    ("gaussian", gaussian),
    ("odd", odd),
];

/// The numbers of a material's table, colour slowest, with `gap` below the horizon. Cells stand for the place `offset` in their bins.
fn numbers(material: Material, offset: f64, linear: bool, gap: f64) -> Vec<f64> {
    let mut planes = [const { Vec::new() }; 3];
    for cell in 0..CELLS {
        let [mut h, d, p] = cell_angles(cell, offset);
        if linear {
            h = ((cell / 16_200) as f64 + offset) / 90.0 * FRAC_PI_2;
        }
        let (ci, co) = cosines([h, d, p]);
        let f = material([h, d, p]);
        for (plane, (f, factor)) in planes.iter_mut().zip(f.into_iter().zip([1.0, 1.15, 1.66])) {
            plane.push(if ci.min(co) > 0.0 { f * 1500.0 / factor } else { gap });
        }
    }
    planes.concat()
}

/// The numbers in an order in which these axes run from slowest to fastest.
fn ordered(numbers: &[f64], axes: [TableAxis; 4]) -> Vec<f64> {
    let all = [TableAxis::Colour, TableAxis::ThetaH, TableAxis::ThetaD, TableAxis::PhiD];
    let place = axes.map(|axis| all.iter().position(|a| *a == axis).unwrap());
    let sizes = [3, 90, 90, 180];
    let strides = [CELLS, 16_200, 180, 1];
    let [a, b, c, d] = place.map(|axis| (sizes[axis], strides[axis]));
    let mut moved = Vec::with_capacity(numbers.len());
    for i in 0..a.0 {
        for j in 0..b.0 {
            for k in 0..c.0 {
                let start = i * a.1 + j * b.1 + k * c.1;
                moved.extend((0..d.0).map(|l| numbers[start + l * d.1]));
            }
        }
    }
    moved
}

/// All orders of the axes.
fn permutations() -> Vec<[TableAxis; 4]> {
    let all = [TableAxis::Colour, TableAxis::ThetaH, TableAxis::ThetaD, TableAxis::PhiD];
    let mut found = vec![];
    for code in 0..256 {
        let axes = [code / 64, code / 16 % 4, code / 4 % 4, code % 4].map(|n| all[n]);
        if all.iter().all(|axis| axes.contains(axis)) {
            found.push(axes);
        }
    }
    assert_eq!((found.len(), found[0]), (24, all));
    found
}

fn file_of<const N: usize>(numbers: &[f64], encode: impl Fn(f64) -> [u8; N]) -> Vec<u8> {
    let mut bytes = merl_header([90, 90, 180]);
    bytes.extend(numbers.iter().flat_map(|x| encode(*x)));
    bytes
}

/// A number from 0 to 65535 without any pattern, by cell.
fn scattered(at: usize) -> u64 {
    let mixed = (at % CELLS) as u64 ^ 0x5851_f42d;
    let mixed = (mixed ^ mixed >> 9).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    ((mixed ^ mixed >> 29).wrapping_mul(0xbf58_476d_1ce4_e5b9)) >> 48
}

fn parse_numbers(numbers: &[f64], options: &ReadOptions) -> Measurement {
    parse("merl", &file_of(numbers, f64::to_le_bytes), options).unwrap()
}

fn faults(m: &Measurement) -> Vec<TableFault> {
    let fault = |doubt: &Doubt| match doubt {
        Doubt::SuspiciousTable(fault) => fault.clone(),
        other => panic!("{other}"),
    };
    m.doubts.iter().map(fault).collect()
}

#[expect(clippy::cast_possible_truncation, reason = "that is what the file has")]
fn single(x: f64) -> f32 {
    x as f32
}

/// The length tells 32-bit from 64-bit floats, whether it is known beforehand (a file) or not (a stream). The numbers tell their byte order,
/// whatever the header says.
#[test]
fn floats_of_both_sizes_in_both_byte_orders() {
    let folder = Folder::new();
    for (what, material, gap) in [
        ("paint", paint as Material, -1.0),
        ("mirror", mirror, 0.0),
        ("chalk", chalk, 0.0),
        ("black hole", black_hole, -1.0),
        ("gaussian", gaussian, -1.0),
    ] {
        let numbers = numbers(material, 0.5, false, gap);
        let plain = parse_numbers(&numbers, &CENTER);
        assert!(
            plain.remarks.is_empty() && plain.doubts.is_empty(),
            "{what}: {:?} {:?}",
            plain.remarks,
            plain.doubts
        );
        let forms = [
            (false, false, file_of(&numbers, f64::to_le_bytes)),
            (false, true, file_of(&numbers, f64::to_be_bytes)),
            (true, false, file_of(&numbers, |x| single(x).to_le_bytes())),
            (true, true, file_of(&numbers, |x| single(x).to_be_bytes())),
        ];
        for (is_single, is_big, mut bytes) in forms {
            for header_is_big in [false, true] {
                if header_is_big {
                    bytes[..12].copy_from_slice(&[90_i32, 90, 180].map(i32::to_be_bytes).concat());
                }
                folder.write("table", &bytes);
                for m in [
                    parse("merl", &bytes, &CENTER).unwrap(),
                    read(&folder.path("table"), None, &CENTER).unwrap(),
                ] {
                    let what = format!("{what} {is_single} {is_big} {header_is_big}");
                    let mut expected = vec![];
                    if is_single {
                        expected.push(Remark::SinglePrecision);
                    }
                    match (header_is_big, is_big) {
                        (false, false) => {}
                        (true, false) => expected.push(Remark::BigEndian { part: TablePart::Header }),
                        (false, true) => expected.push(Remark::BigEndian { part: TablePart::Numbers }),
                        (true, true) => expected.push(Remark::BigEndian { part: TablePart::Whole }),
                    }
                    assert_eq!(m.remarks, expected, "{what}");
                    assert_eq!(m.doubts, [], "{what}");
                    assert_eq!(m.dropped, plain.dropped, "{what}");
                    let as_read =
                        |f: f64, scale: f64| if is_single { f64::from(single(f / scale)) } else { f / scale };
                    for ((row, exact), factor) in m.values.iter().zip(&plain.values).zip([1.0, 1.15, 1.66]) {
                        let scale = factor / 1500.0;
                        let near = |f: f64, exact: f64| {
                            (f / scale - as_read(exact, scale)).abs() <= 1.2e-7 * (exact / scale).abs()
                        };
                        assert!(row.len() == exact.len(), "{what}");
                        assert!(row.iter().zip(exact).all(|(f, exact)| near(*f, *exact)), "{what}");
                        assert!(is_single || row == exact, "{what}");
                    }
                }
            }
        }
    }
}

/// What is not finite has no say in the byte order, nor has an absurd beginning.
#[test]
fn byte_order_of_tables_with_gaps() {
    let mut numbers = numbers(paint, 0.5, false, f64::NAN);
    for (at, x) in numbers.iter_mut().enumerate() {
        match at {
            0..40_000 => *x = 0.0,
            40_000..80_000 => *x = 1e-200,
            80_000..120_000 => *x = f64::INFINITY,
            _ => {}
        }
    }
    let little = parse_numbers(&numbers, &CENTER);
    let big = parse("merl", &file_of(&numbers, f64::to_be_bytes), &CENTER).unwrap();
    assert_eq!((&big.values, &big.dropped), (&little.values, &little.dropped));
    assert_eq!(big.remarks, [Remark::BigEndian { part: TablePart::Numbers }]);
    assert!(little.remarks.is_empty());
    // Nothing but zeros: MERL's own order, in either size.
    for bytes in [
        file_of(&[0.0; 3 * CELLS], f64::to_be_bytes),
        file_of(&[0.0; 3 * CELLS], |x| single(x).to_be_bytes()),
    ] {
        let m = parse("merl", &bytes, &CENTER).unwrap();
        assert!(m.remarks.iter().all(|remark| *remark == Remark::SinglePrecision), "{:?}", m.remarks);
        assert!(m.doubts.is_empty() && m.values.iter().flatten().all(|f| *f == 0.0));
    }
}

#[test]
fn every_order_of_the_axes_is_recognised() {
    for (material, gap, step) in
        [(paint as Material, -1.0, 1), (gold, 0.0, 4), (chalk, f64::NAN, 5), (mirror, -1.0, 6)]
    {
        let numbers = numbers(material, 0.5, false, gap);
        for axes in permutations().into_iter().skip(1).step_by(step) {
            let m = parse_numbers(&ordered(&numbers, axes), &CENTER);
            let found = faults(&m);
            let [TableFault::Order { axes: found, linear: false, maybe_exchanged: false, below_horizon }] =
                found.as_slice()
            else {
                panic!("{axes:?}: {found:?}");
            };
            assert_eq!(*found, axes);
            assert!((0.02..0.3).contains(below_horizon), "{axes:?}: {below_horizon}");
        }
    }
}

/// Measurements with many gaps: a quarter of the cells at random, or all over 75 degrees. The horizon of the latter does not tell theta_h
/// from theta_d.
#[test]
fn orders_of_tables_with_gaps_are_recognised() {
    let whole = numbers(gold, 0.0, false, -1.0);
    let steep = |at: usize| {
        let (ci, co) = cosines(cell_angles(at % CELLS, 0.0));
        ci.min(co) < 75.0_f64.to_radians().cos()
    };
    let random = |at: usize| scattered(at) & 3 == 0;
    let exchanged = |axes: [TableAxis; 4]| {
        axes.map(|axis| match axis {
            TableAxis::ThetaH => TableAxis::ThetaD,
            TableAxis::ThetaD => TableAxis::ThetaH,
            other => other,
        })
    };
    let gaps: [(bool, &dyn Fn(usize) -> bool); 2] = [(false, &random), (true, &steep)];
    for (ambiguous, gap) in gaps {
        let mut numbers = whole.clone();
        numbers.iter_mut().enumerate().filter(|(at, _)| gap(*at)).for_each(|(_, x)| *x = -1.0);
        for axes in permutations().into_iter().skip(1) {
            let found = faults(&parse_numbers(&ordered(&numbers, axes), &CENTER));
            // That the two angles alone are exchanged does not show over 75 degrees.
            if ambiguous && axes == exchanged(permutations()[0]) {
                assert_eq!(found, []);
                continue;
            }
            let [TableFault::Order { axes: found, linear: false, maybe_exchanged, .. }] = found.as_slice()
            else {
                panic!("{axes:?}: {found:?}");
            };
            assert!(*found == axes || ambiguous && *found == exchanged(axes), "{axes:?}: {found:?}");
            assert_eq!(*maybe_exchanged, ambiguous, "{axes:?}");
        }
    }
}

/// What a warning says names the axes, and what to do.
#[test]
fn texts_of_doubts() {
    use TableAxis::{Colour, PhiD, ThetaD, ThetaH};
    let text = |numbers: &[f64]| {
        parse_numbers(numbers, &CENTER).doubts.iter().map(ToString::to_string).collect::<String>()
    };
    let paint_numbers = numbers(paint, 0.5, false, -1.0);
    let moved = text(&ordered(&paint_numbers, [PhiD, ThetaD, ThetaH, Colour]));
    for words in
        ["axes", "horizon", "phi_d runs slowest, then theta_d, theta_h and colour", "interleaved", "rewrite"]
    {
        assert!(moved.contains(words), "{moved}");
    }
    let linear = text(&numbers(paint, 0.5, true, -1.0));
    for words in ["theta_h linearly", "square", "resample"] {
        assert!(linear.contains(words), "{linear}");
    }
    let scaled: Vec<f64> = paint_numbers.iter().map(|x| x / 1500.0).collect();
    let scaled = text(&scaled);
    for words in ["scaled twice", "multiply red by 1500"] {
        assert!(scaled.contains(words), "{scaled}");
    }
    // 32-bit floats, big-endian numbers and another order may come together.
    let bytes =
        file_of(&ordered(&paint_numbers, [Colour, PhiD, ThetaD, ThetaH]), |x| single(x).to_be_bytes());
    let m = parse("merl", &bytes, &CENTER).unwrap();
    assert_eq!((m.remarks.len(), m.doubts.len()), (2, 1));
}

#[test]
fn linear_theta_h_is_recognised() {
    for (what, material) in MATERIALS {
        for (offset, gap) in [(0.5, -1.0), (0.0, -1.0), (0.5, f64::NAN)] {
            let m = parse_numbers(&numbers(material, offset, true, gap), &CENTER);
            assert_eq!(faults(&m), [TableFault::LinearThetaH], "{what} {offset} {gap}");
        }
    }
    let moved = ordered(
        &numbers(gold, 0.5, true, -1.0),
        [TableAxis::PhiD, TableAxis::Colour, TableAxis::ThetaH, TableAxis::ThetaD],
    );
    let found = faults(&parse_numbers(&moved, &CENTER));
    assert!(
        matches!(found.as_slice(), [TableFault::Order { linear: true, maybe_exchanged: true, .. }]),
        "{found:?}"
    );
}

#[test]
fn tables_scaled_twice_are_recognised() {
    for (what, material) in
        [("paint", paint as Material), ("gold", gold), ("mirror", mirror), ("chalk", chalk), ("tape", tape)]
    {
        for gap in [-1.0, 0.0] {
            let mut numbers = numbers(material, 0.5, false, gap);
            for (plane, factor) in numbers.chunks_exact_mut(CELLS).zip([1.0, 1.15, 1.66]) {
                plane.iter_mut().filter(|x| **x > 0.0).for_each(|x| *x *= factor / 1500.0);
            }
            let found = faults(&parse_numbers(&numbers, &CENTER));
            let [TableFault::ScaledTwice { albedo }] = found.as_slice() else { panic!("{what}: {found:?}") };
            assert!((1e-5..1e-3).contains(albedo), "{what}: {albedo}");
        }
    }
}

/// Tables in MERL's layout: either place in the bins, whatever is below the horizon, with gaps that the instrument or noise makes.
#[test]
fn sound_tables_are_not_doubted() {
    /// A place of a cell: theta_i, theta_o and any number.
    type Gap = fn(f64, f64, u64) -> bool;
    let gaps: [(&str, Gap); 6] = [
        ("none", |_, _, _| false),
        ("over 80 degrees", |i, o, _| i.max(o) > 80.0),
        ("over 60 degrees", |i, o, _| i.max(o) > 60.0),
        ("light over 75 degrees", |i, _, _| i > 75.0),
        ("lamp in the way", |i, o, _| (i - o).abs() < 8.0),
        ("a third", |_, _, n| n % 3 == 0),
    ];
    /// What is left out is left out of these.
    const WITH_GAPS: [&str; 3] = ["paint", "gold", "tape"];
    let angles: Vec<(f64, f64)> = (0..CELLS)
        .map(|cell| {
            let (ci, co) = cosines(cell_angles(cell, 0.5));
            (ci.acos().to_degrees(), co.acos().to_degrees())
        })
        .collect();
    let mut tables = 0;
    for (what, material) in MATERIALS {
        for (offset, below) in [(0.5, -1.0), (0.0, -1.0), (0.5, 0.0), (0.5, 7.0), (0.0, f64::NAN)] {
            let whole = numbers(material, offset, false, below);
            for (place, gap) in gaps {
                if place != "none" && ((offset, below) != (0.5, -1.0) || !WITH_GAPS.contains(&what)) {
                    continue;
                }
                let mut numbers = whole.clone();
                for (at, x) in numbers.iter_mut().enumerate() {
                    let (i, o) = angles[at % CELLS];
                    if gap(i, o, scattered(at)) {
                        *x = -1.0;
                    }
                }
                // Whether the option fits the table or not.
                let few: [&ReadOptions; 1] = [if offset == 0.0 { &EDGE } else { &CENTER }];
                let options: &[&ReadOptions] = if what == "paint" { &[&CENTER, &EDGE] } else { &few };
                for options in options {
                    let m = parse_numbers(&numbers, options);
                    assert!(m.doubts.is_empty(), "{what}, {below} below, gaps {place}: {:?}", m.doubts);
                    tables += 1;
                }
            }
        }
    }
    println!("{tables} tables");
}
