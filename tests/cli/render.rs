//! `brdfit render`.

use super::{assert_refused, refused};
use crate::common::Folder;

/// The numbers of the line about the differences: relative RMSE in per cent, and CIEDE2000.
fn differences(stderr: &str) -> (f64, f64) {
    let after = |key: &str| -> f64 {
        let rest = &stderr[stderr.find(key).unwrap_or_else(|| panic!("{stderr}")) + key.len()..];
        rest.split_whitespace().next().unwrap().parse().unwrap()
    };
    (after("relative RMSE"), after("within"))
}

#[test]
fn a_fit_that_is_right_looks_like_the_measurement() {
    let folder = Folder::new();
    let make =
        "synth -m lambert --set kd.r=0.6 kd.g=0.3 kd.b=0.1 --directions 3000 --max-theta 89 -o matte.csv";
    folder.brdfit(make).good();
    folder.brdfit("fit matte.csv -m lambert -o matte.json -q").good();
    let (rmse, colour) = differences(&folder.brdfit("render matte.json -o both.png").stderr);
    assert!(rmse < 0.01 && colour < 0.01, "{rmse} % {colour}");
    // Half the albedo is half the radiance.
    folder.brdfit("evaluate matte.csv -m lambert --set kd.r=0.3 kd.g=0.15 kd.b=0.05 -o dark.json -q");
    let (rmse, colour) = differences(&folder.brdfit("render dark.json -o dark.exr").stderr);
    assert!((rmse - 50.0).abs() < 0.1 && colour > 5.0, "{rmse} % {colour}");
    // One picture for a measurement, three for a fit; the same bytes each time.
    folder.brdfit("render matte.csv -o one.png").good();
    let size = |name: &str| {
        let bytes = std::fs::read(folder.path(name)).unwrap();
        assert_eq!(&bytes[..8], b"\x89PNG\r\n\x1a\n");
        [16, 20].map(|at| u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()))
    };
    assert_eq!(size("one.png"), [128, 128]);
    assert_eq!(size("both.png"), [3 * 128 + 8, 128]);
    folder.brdfit("render matte.json -o again.png");
    assert_eq!(
        std::fs::read(folder.path("again.png")).unwrap(),
        std::fs::read(folder.path("both.png")).unwrap()
    );
}

#[test]
fn what_cannot_be_rendered_is_refused_in_one_line() {
    let folder = Folder::new();
    folder.brdfit("synth -m lambert --directions 50 -o a.csv").good();
    folder.brdfit("fit a.csv -m lambert -o a.json -q").good();
    folder.write("gone.json", folder.read("a.json").replace("a.csv", "elsewhere.csv"));
    assert_refused(
        &folder,
        &[
            refused("no output", "render a.csv", &["--output"]),
            refused("another ending", "render a.csv -o a.jpg", &["a.jpg", ".exr or .png"]),
            refused("no such scene", "render a.csv --scene none.json -o a.png", &["none.json"]),
            refused(
                "the measurement is gone",
                "render gone.json -o a.png",
                &["elsewhere.csv", "--measurement"],
            ),
            refused("two measurements", "render a.csv --measurement a.csv -o a.png", &["--measurement"]),
            refused("beyond the horizon", "render a.csv --max-theta 91 -o a.png", &["91"]),
        ],
    );
}
