//! Values that were not measured, from the file to every output.

use super::{Refused, assert_refused, refused, with_notes};
use crate::common::{Folder, parse};
use std::fmt::Write as _;

/// A glossy paint at three wavelengths, as Cornell's text: every fifth sample lacks the second one, and one sample all of them.
fn paint(folder: &Folder, name: &str) -> usize {
    let mut text = "3\n450 550 650\n".to_owned();
    let (mut samples, mut gaps) = (0, 0);
    for theta_i in [5.0, 20.0, 35.0, 50.0, 65.0] {
        for theta_o in (0..16).map(|k| 5.0 * f64::from(k)) {
            for phi in [0.0, 45.0, 90.0, 135.0, 180.0] {
                let [i, o, p] = [theta_i, theta_o, phi].map(f64::to_radians);
                // The half vector's height over its length.
                let (x, y) = (i.sin() + o.sin() * p.cos(), o.sin() * p.sin());
                let z = i.cos() + o.cos();
                let tan2 = (x * x + y * y) / (z * z);
                let f = |kd: f64| kd / std::f64::consts::PI + 0.3 * (-tan2 / 0.05).exp();
                let second = if samples % 5 == 2 { "nan".to_owned() } else { f(0.3).to_string() };
                gaps += usize::from(samples % 5 == 2);
                writeln!(text, "{i} 0 {o} {p} {} {second} {}", f(0.5), f(0.1)).unwrap();
                samples += 1;
            }
        }
    }
    text += "0.5 0 0.5 0 nan NaN -nan\n";
    folder.write(name, text);
    gaps
}

#[test]
fn info_counts_what_each_channel_lacks() {
    let folder = Folder::new();
    let gaps = paint(&folder, "paint.brdf");
    let text = folder.brdfit("info paint.brdf").good().stdout;
    assert!(text.contains("400 of 401; left out: 1 not-measured"), "{text}");
    assert!(text.contains("negative   missing"), "{text}");
    let info = folder.brdfit("info paint.brdf --json").good().json();
    let missing: Vec<u64> =
        info["channels"].as_array().unwrap().iter().map(|c| c["missing"].as_u64().unwrap()).collect();
    assert_eq!(missing, [0, u64::try_from(gaps).unwrap(), 0]);
    assert!(info["channels"][1]["range"][1].as_f64().unwrap() > 0.3);
    folder.brdfit("check paint.brdf").good();
}

#[test]
fn a_fit_reports_what_is_missing() {
    let folder = Folder::new();
    let gaps = paint(&folder, "paint.brdf");
    let run = folder.brdfit("fit paint.brdf -m 'lambert + cook-torrance' --max-theta 89 -o fit.json").good();
    assert!(run.stdout.contains(&format!("values not measured: {gaps} in 550")), "{}", run.stdout);
    assert!(!run.stdout.contains("NaN"), "{}", run.stdout);
    let report = parse(&folder.read("fit.json"));
    assert_eq!(report["data"]["missing"], serde_json::json!({ "550": gaps }));
    assert_eq!(report["fit"]["n"], 3 * 400 - gaps);
    assert_eq!(report["data"]["dropped"]["not-measured"], 1);
    let run = folder.brdfit("evaluate fit.json --max-theta 89 --json").good();
    let again = run.json();
    for (name, error) in report["errors"].as_object().unwrap() {
        let (a, b) = (error.as_f64().unwrap(), again["errors"][name].as_f64().unwrap());
        assert!((a / b - 1.0).abs() < 1e-6, "{name}: {a} {b}");
    }
    let run = folder.brdfit("tradeoff paint.brdf -m lambert --json");
    assert!(run.code == Some(0) && run.json()["models"][0]["errors"]["l2"].is_number(), "{run:?}");
    let plain = folder.brdfit("fit paint.brdf -m lambert --json --max-theta 89 --fix kd=0.3");
    assert_eq!(plain.json()["data"]["missing"]["550"], gaps);
}

/// Arrays keep gaps, tables are filled and say so, and mixtures lack what one of their channels lacks.
#[test]
fn every_format_says_what_becomes_of_gaps() {
    let folder = Folder::new();
    let gaps = paint(&folder, "paint.brdf");
    with_notes(&folder, "convert paint.brdf -o paint.npz");
    let info = folder.brdfit("info paint.npz --json").good().json();
    assert_eq!(info["channels"][1]["missing"], gaps);
    let filled = format!("{gaps} values were not measured: they are interpolated");
    for output in ["paint.zemax.bsdf --to zemax", "paint.ssdd", "paint.rgl.bsdf --to rgl"] {
        let run = with_notes(&folder, &format!("convert paint.brdf -o {output}"));
        assert!(run.stderr.contains(&filled), "{output}: {}", run.stderr);
        assert!(!run.stderr.contains("NaN"), "{output}: {}", run.stderr);
    }
    let run = with_notes(&folder, "convert paint.brdf --rgb -o rgb.csv");
    assert!(run.stderr.contains(&format!("note: {gaps} of 400 samples lack a channel")), "{}", run.stderr);
    assert_eq!(folder.read("rgb.csv").lines().count(), 3 + 400 - gaps);
    let run = with_notes(&folder, "convert paint.brdf --rgb -o paint.binary");
    assert!(run.stderr.contains("marked as not measured"), "{}", run.stderr);
    // At a sample's own directions a channel that lacks it is interpolated.
    let run = with_notes(&folder, "convert paint.brdf --at paint.brdf -o there.csv");
    assert!(!folder.read("there.csv").contains("nan"), "{}", run.stderr);
}

#[cfg(feature = "images")]
#[test]
fn an_image_of_a_measurement_with_gaps_is_made() {
    let folder = Folder::new();
    let gaps = paint(&folder, "paint.brdf");
    let run = folder.brdfit("render paint.brdf -o paint.png");
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(run.stderr.contains(&format!("note: {gaps} of 400 samples lack")), "{}", run.stderr);
}

/// Marks of other formats, and what is no mark.
#[test]
fn text_formats_mark_gaps() {
    let folder = Folder::new();
    folder.write("a.alta", "#DIM 3 2\n#PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI\n#PARAM_OUT INV_STERADIAN_COSINE_FACTOR\n#VS 1 1\n0.2 0.3 0.1 0.5 nan 0.1 nan\n0.3 0.3 0.1 0.5 0.2 0.1 0.1\n");
    folder.write("n.csv", "lambda,thetai,phi,thetar,phir,f_r11\n0.5,10,0,20,0,0.3\n0.5,30,0,20,0,0.3\n0.6,10,0,20,0,\n0.6,30,0,20,0,0.2\n");
    folder.write(
        "m.csv",
        "material,theta_i_deg,theta_o_deg,brdf_per_sr\nsteel,10,20,0.3\nsteel,20,20,\nsteel,30,20,nan\n",
    );
    let missing = |name: &str| -> Vec<u64> {
        let info = folder.brdfit(&format!("info {name} --json")).json();
        info["channels"].as_array().unwrap().iter().map(|c| c["missing"].as_u64().unwrap()).collect()
    };
    assert_eq!(missing("a.alta"), [0, 1]);
    assert_eq!(missing("n.csv"), [0, 1]);
    assert_eq!(missing("m.csv"), [0]);
    let info = folder.brdfit("info m.csv --json").json();
    assert_eq!((&info["usable"], &info["dropped"]["not-measured"]), (&1.into(), &2.into()));

    folder.write("none.brdf", "2\n450 550\n0.1 0 0.2 1 0.3 nan\n0.2 0 0.2 1 0.3 nan\n0.3 0 0.2 2 0.2 nan\n");
    folder.write("bound.alta", "#DIM 3 1\n#PARAM_IN ISOTROPIC_TL_TV_PROJ_DPHI\n#PARAM_OUT INV_STERADIAN\n#VS 1\n0.2 0.3 0.1 0.5 nan\n");
    folder.write("angle.brdf", "1\n450\nnan 0 0.2 1 0.3\n");
    folder.write("infinite.brdf", "1\n450\n0.1 0 0.2 1 inf\n");
    let cases: Vec<Refused> = vec![
        refused(
            "no values",
            "fit none.brdf -m lambert",
            &["none.brdf", "channel 550 was not measured at any of 3"],
        ),
        refused("no values", "convert none.brdf -o x.ssdd", &["channel 550 was not measured"]),
        refused("no values", "convert none.brdf --to zemax -o x.bsdf", &["channel 550 was not measured"]),
        refused("a bound", "info bound.alta", &[":5:", "finite number for a bound", "'nan'"]),
        refused("an angle", "info angle.brdf", &[":3:", "finite number for theta_i", "'nan'"]),
        refused(
            "infinity",
            "info infinite.brdf",
            &[":3:", "450 nm, or nan where it was not measured", "'inf'"],
        ),
    ];
    assert_refused(&folder, &cases);
}
