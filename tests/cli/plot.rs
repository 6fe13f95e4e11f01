//! `brdfit plot`.

use super::{assert_refused, refused};
use crate::common::Folder;

/// A folder with a noisy measurement and reports of two models.
fn fitted() -> Folder {
    let folder = Folder::new();
    folder
        .brdfit(
            "synth -m 'lambert + cook-torrance' --set kd.r=0.4 kd.g=0.2 kd.b=0.1 m=0.25 f0=0.06 --directions 800 --noise 0.02 --max-theta 85 -o a.csv",
        )
        .good();
    folder.brdfit("fit a.csv -m 'lambert + cook-torrance' -o a.json -q").good();
    folder.brdfit("fit a.csv -m lambert -m 'lambert + cook-torrance(d=beckmann)' -o two.json -q");
    folder
}

/// The rows of a CSV file without quoted commas, as lists of cells.
fn rows(text: &str) -> Vec<Vec<String>> {
    text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
}

#[test]
fn every_kind_is_drawn_with_its_numbers() {
    let folder = fitted();
    for (kind, input, header) in [
        ("lobe", "a.json", "panel,series,theta_o (deg),f (1/sr),low f (1/sr),high f (1/sr)"),
        ("lobe", "a.csv", "panel,series,theta_o (deg),f (1/sr),low f (1/sr),high f (1/sr)"),
        ("map", "a.json", "panel,theta_h (deg),theta_d (deg),quantity,value"),
        ("sphere", "a.json", "panel,row,column,r (W/m^2 sr),g (W/m^2 sr),b (W/m^2 sr)"),
        (
            "residuals",
            "a.json",
            "panel,series,x quantity,x,residual (sr^-1/3),low residual (sr^-1/3),high residual (sr^-1/3)",
        ),
        ("profile", "a.json", "panel,series,m,cost/least cost,low cost/least cost,high cost/least cost"),
        ("fresnel", "a.json", "panel,series,theta_d (deg),F,low F,high F"),
        (
            "front",
            "two.json",
            "panel,series,number of fitted parameters,unbiased-cbrt error,low unbiased-cbrt error,high unbiased-cbrt error",
        ),
        ("convergence", "a.json", "panel,series,iteration,cost,low cost,high cost"),
    ] {
        for width in ["one", "two"] {
            folder
                .brdfit(&format!("plot {input} --kind {kind} --width {width} -o x.svg --data x.csv"))
                .good();
            let (svg, csv) = (folder.read("x.svg"), folder.read("x.csv"));
            assert!(svg.starts_with("<svg ") && svg.ends_with("</svg>\n"), "{kind}");
            assert_eq!(csv.lines().next(), Some(header), "{kind}");
            assert!(csv.lines().count() > 2, "{kind}");
            if width == "two" {
                continue;
            }
            folder
                .brdfit(&format!("plot {input} --kind {kind} --width {width} -o y.svg --data y.csv"))
                .good();
            assert_eq!(
                (svg, csv),
                (folder.read("y.svg"), folder.read("y.csv")),
                "{kind}: the same bytes again"
            );
        }
    }
}

#[test]
fn reports_are_compared_and_rasters_are_png() {
    let folder = fitted();
    for kind in ["lobe", "residuals", "fresnel"] {
        folder.brdfit(&format!("plot a.json two.json --kind {kind} -o x.svg --data x.csv")).good();
        let csv = folder.read("x.csv");
        assert!(csv.contains("d=beckmann") && csv.contains("d=ggx"), "{kind}");
    }
    folder.brdfit("plot a.json --kind lobe --axes polar --f-scale linear --theta-i 30 --channel r -o x.svg --data x.csv").good();
    let csv = folder.read("x.csv");
    let fit: Vec<Vec<String>> = rows(&csv)
        .into_iter()
        .filter(|row| row[1] == "theta_i = 30 deg" || row[1].starts_with("theta_i"))
        .collect();
    assert!(fit.iter().all(|row| row[1].contains("30 deg") || row[1].contains("light")), "{fit:?}");
    for kind in ["map", "sphere"] {
        let run = folder.brdfit(&format!("plot a.json --kind {kind} -o x.png"));
        assert_eq!(run.code, Some(0), "{run:?}");
        assert!(run.stderr.starts_with("note: x.png: a"), "{run:?}");
        assert!(std::fs::read(folder.path("x.png")).unwrap().starts_with(b"\x89PNG\r\n\x1a\n"));
    }
    let run = folder.brdfit("plot a.json --kind fresnel --no-caption -o x.svg");
    assert!(run.code == Some(0) && run.stderr.starts_with("note: x.svg: Fresnel"), "{run:?}");
}

#[test]
fn what_cannot_be_drawn_is_refused_in_one_line() {
    let folder = fitted();
    folder.write("gone.json", folder.read("a.json").replace("a.csv", "elsewhere.csv"));
    folder.write("b.csv", folder.read("a.csv") + "10,0,10,0,1,1,1,1,1,1\n");
    folder.brdfit("synth -m lambert --set kd=0.3 --directions 50 -o other.csv").good();
    folder.brdfit("fit other.csv -m lambert -o other.json -q");
    assert_refused(
        &folder,
        &[
            refused("no kind", "plot a.json -o x.svg", &["--kind"]),
            refused("no such kind", "plot a.json --kind pie -o x.svg", &["pie"]),
            refused("no output", "plot a.json --kind lobe", &["--output"]),
            refused("another ending", "plot a.json --kind lobe -o x.pdf", &["x.pdf", ".svg"]),
            refused("lines as a raster", "plot a.json --kind lobe -o x.png", &["x.png", "sphere and map"]),
            refused("no such file", "plot none.json --kind lobe -o x.svg", &["none.json"]),
            refused("gone", "plot gone.json --kind lobe -o x.svg", &["elsewhere.csv", "--measurement"]),
            refused("no report", "plot a.csv --kind residuals -o x.svg", &["a.csv", "a report of brdfit"]),
            refused("no report", "plot a.csv --kind fresnel -o x.svg", &["a.csv", "a report of brdfit"]),
            refused(
                "two measurements",
                "plot a.csv --kind lobe --measurement a.csv -o x.svg",
                &["--measurement"],
            ),
            refused(
                "two profiles",
                "plot a.json two.json --kind profile -o x.svg",
                &["profile", "one report"],
            ),
            refused(
                "below the horizon",
                "plot a.json --kind lobe --theta-i 90 -o x.svg",
                &["--theta-i", "90"],
            ),
            refused("no such channel", "plot a.json --kind lobe --channel x -o x.svg", &["--channel", "'x'"]),
            refused(
                "other data",
                "plot a.json other.json --kind front -o x.svg",
                &["front", "one measurement"],
            ),
            refused("no Fresnel term", "plot other.json --kind fresnel -o x.svg", &["fresnel", "lambert"]),
            refused(
                "the input as output",
                "plot a.json --kind lobe -o x.svg --data a.csv --measurement a.csv",
                &["--data"],
            ),
        ],
    );
}
