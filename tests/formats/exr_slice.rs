//! Slices of MERL tables as images.

use super::{CENTER, geometries, parse, read};
use crate::common::shared;
use approx::assert_abs_diff_eq;
use brdfit::measurement::Remark;
use exr::prelude::{SpecificChannels, WritableImage as _};
use std::io::Cursor;

/// An image whose red is 1000 row + column, its green half of that, its blue -1.
fn image(width: usize, height: usize) -> Vec<u8> {
    let channels = SpecificChannels::rgb(|at: exr::math::Vec2<usize>| {
        let number = (1000 * at.y() + at.x()) as f32;
        (number, 0.5 * number, -1.0_f32)
    });
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_channels((width, height), channels).write().to_buffered(&mut bytes).unwrap();
    bytes.into_inner()
}

/// theta_h, theta_d in degrees and the azimuth of the difference vector's sine, from the directions alone.
fn angles(wi: [f64; 3], wo: [f64; 3]) -> (f64, f64) {
    let sum: Vec<f64> = wi.iter().zip(wo).map(|(a, b)| a + b).collect();
    let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
    let dot: f64 = wi.iter().zip(&sum).map(|(a, b)| a * b / length).sum();
    ((sum[2] / length).acos().to_degrees(), dot.min(1.0).acos().to_degrees())
}

#[test]
fn columns_are_theta_h_and_rows_from_the_bottom_theta_d() {
    let m = parse("exr", &image(9, 3), &CENTER).unwrap();
    assert_eq!(m.channel_names(), ["r", "g", "b"]);
    assert!(matches!(m.remarks.as_slice(), [Remark::Assumed { .. }]));
    assert_eq!(m.directions.len(), 27);
    for ((index, g), f) in geometries(&m).iter().enumerate().zip(&m.values[0]) {
        let (column, row) = ((index % 9) as f64, (index / 9) as f64);
        assert_abs_diff_eq!(*f, 1000.0 * row + column, epsilon = 1e-9);
        let (theta_h, theta_d) = angles(g.wi, g.wo);
        assert_abs_diff_eq!(theta_h, 5.0 + 10.0 * column, epsilon = 1e-9);
        assert_abs_diff_eq!(theta_d, 75.0 - 30.0 * row, epsilon = 1e-9);
        // At phi_d = 90 degrees light and viewer are equally far from the normal.
        assert_abs_diff_eq!(g.cos_i(), g.cos_o(), epsilon = 1e-12);
    }
    assert_eq!((m.values[1][1], m.values[2][1]), (0.5, -1.0), "negatives are kept");
}

/// Count, extreme values and a sum found with OpenEXR's own library. The steps of the values lie at the borders of MERL's
/// cells, which are known: that is what the axes mean, and that a pixel stands for its centre.
#[test]
fn red_fabric() {
    let Some(path) = shared("merl-slices/red-fabric-slice.exr") else { return };
    let m = read(&path, None, &CENTER).unwrap();
    assert_eq!(m.source.format, "exr");
    assert_eq!(m.total(), 512 * 512);
    let red = &m.values[0];
    let sums: Vec<f64> = m.values.iter().map(|row| row.iter().sum()).collect();
    for (found, expected) in sums.into_iter().zip(SUMS) {
        assert_abs_diff_eq!(found, expected, epsilon = 1e-6);
    }
    let g = geometries(&m);
    let all: Vec<(f64, f64)> = g.iter().map(|g| angles(g.wi, g.wo)).collect();
    // Where cells are wider than pixels and nobody has mended the image.
    let row = 500;
    let cell = |index: usize| (90.0 * all[index].0).sqrt().floor();
    let borders: Vec<usize> =
        (335..512).filter(|x| (cell(512 * row + x) - cell(512 * row + x - 1)).abs() > 0.5).collect();
    let steps: Vec<usize> =
        (335..512).filter(|x| red[512 * row + x].to_bits() != red[512 * row + x - 1].to_bits()).collect();
    assert_eq!(steps, borders);
    assert_eq!(steps.len(), 17);
    // One degree of theta_d is 512/90 rows: six, then five or six at a time.
    let column = 300;
    let steps: Vec<usize> = (450..512)
        .filter(|y| red[512 * y + column].to_bits() != red[512 * (y - 1) + column].to_bits())
        .collect();
    let borders: Vec<usize> = (450..512)
        .filter(|y| all[512 * y + column].1.floor() < all[512 * (y - 1) + column].1.floor())
        .collect();
    assert_eq!(steps, borders);
}

const SUMS: [f64; 3] = [26_346.027_786_254_883, 8_317.998_573_303_223, 7_623.074_973_106_384];

#[test]
fn images_that_lie_are_refused() {
    let whole = image(9, 3);
    for length in [4, 8, 20, 100, whole.len() / 2, whole.len() - 1] {
        let message = parse("exr", &whole[..length], &CENTER).unwrap_err().to_string();
        assert!(
            message.starts_with("x: expected an OpenEXR image with channels R, G and B, found "),
            "{message}"
        );
    }
    // The windows claim 2^30 pixels.
    let mut huge = whole.clone();
    for name in ["dataWindow", "displayWindow"] {
        let at = huge.windows(name.len()).position(|w| w == name.as_bytes()).unwrap();
        let numbers = at + name.len() + 1 + "box2i".len() + 1 + 4;
        huge[numbers + 8..numbers + 12].copy_from_slice(&32767_i32.to_le_bytes());
        huge[numbers + 12..numbers + 16].copy_from_slice(&32767_i32.to_le_bytes());
    }
    let message = parse("exr", &huge, &CENTER).unwrap_err().to_string();
    assert!(message.contains("x: expected 1 to 4194304 pixels, found 32768 x 32768"), "{message}");
    let nan = SpecificChannels::rgb(|_| (f32::NAN, 0.0_f32, 0.0_f32));
    let mut bytes = Cursor::new(Vec::new());
    exr::prelude::Image::from_channels((2, 2), nan).write().to_buffered(&mut bytes).unwrap();
    let message = parse("exr", &bytes.into_inner(), &CENTER).unwrap_err().to_string();
    assert!(
        message.contains("expected finite values, found NaN or infinity in column 0 of row 0"),
        "{message}"
    );
}
