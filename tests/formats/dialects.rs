//! Tables as people write them: names, separators, encodings and orders of others. docs/use/formats.md lists them.

use super::{CENTER, parse, parsed};
use crate::common::{Folder, shared};
use approx::assert_abs_diff_eq;
use brdfit::Error;
use brdfit::doctor::examine;
use brdfit::error::OptionName;
use brdfit::measurement::formats::{ReadOptions, read};
use brdfit::measurement::reading::Conventions;
use brdfit::measurement::{Doubt, Evidence, Measurement, Remark};
use std::fs;
use std::path::Path;

/// The directions of the samples, as components of wi and wo.
fn components(m: &Measurement) -> Vec<[f64; 6]> {
    m.directions.iter().map(|g| [g.wi[0], g.wi[1], g.wi[2], g.wo[0], g.wo[1], g.wo[2]]).collect()
}

fn assert_same(found: &Measurement, expected: &Measurement, what: &str) {
    assert_eq!(found.values, expected.values, "{what}");
    for (found, expected) in components(found).iter().zip(components(expected)) {
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-9, "{what}: {found:?} for {expected:?}");
        }
    }
}

fn with(option: OptionName, text: &str) -> ReadOptions {
    ReadOptions::new().with_conventions(Conventions::default().with(option, text).unwrap())
}

/// Each file of tests/corpus/dialects holds the same four samples, some of them three times.
#[test]
fn the_same_table_in_many_dialects() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus/dialects");
    let plain = read(&folder.join("plain.csv"), None, &CENTER).unwrap();
    assert_eq!((plain.values.len(), plain.directions.len()), (1, 4));
    assert!(plain.remarks.is_empty(), "the project's own layout needs no words");
    let mut files: Vec<_> = fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    assert!(files.len() > 30);
    for path in files {
        let what = path.display().to_string();
        let mut found = read(&path, None, &CENTER).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(found.source.format, "csv", "{what}");
        assert_eq!(found.directions.len() % 4, 0, "{what}: {} samples", found.directions.len());
        for values in &mut found.values {
            values.truncate(4);
        }
        assert_same(&found, &plain, &what);
        assert!(found.doubts.is_empty(), "{what}: {:?}", found.doubts);
    }
}

/// Without azimuths a positive angle of the viewer is on the mirror side, unless signs of both angles show that they count from one axis.
#[test]
fn tables_in_the_plane() {
    let mirror = parsed("csv", "theta_i,phi_i,theta_o,phi_o,f\n30,0,40,180,1\n30,0,20,0,2\n");
    let signed = parsed("csv", "theta_i,theta_o,f\n30,40,1\n30,-20,2\n");
    assert_same(&signed, &mirror, "positive on the mirror side");
    assert!(
        matches!(signed.remarks[..], [Remark::Columns { .. }, Remark::Assumed { .. }]),
        "{:?}",
        signed.remarks
    );
    let one_axis = parsed("csv", "theta_i,theta_o,f\n-30,40,1\n-30,-20,2\n");
    for (a, b) in one_axis.directions.iter().zip(mirror.directions.iter()) {
        assert_abs_diff_eq!(a.h[2], b.h[2], epsilon = 1e-12);
        assert_abs_diff_eq!(a.cos_o(), b.cos_o(), epsilon = 1e-12);
    }
    let options = with(OptionName::Azimuth, "from-light");
    let from_light = parse("csv", b"theta_i,theta_o,f\n30,-40,1\n30,20,2\n", &options).unwrap();
    assert_same(&from_light, &mirror, "counted from the light's side");
    // A lobe on the light's side is noticed.
    let rows: String =
        (-8..=8).map(|k| format!("40,{},{}\n", 10 * k, if k == -4 { 5.0 } else { 0.1 })).collect();
    let found = parsed("csv", &format!("theta_i,theta_o,f\n{rows}"));
    let doubts = examine(&found, &Conventions::default());
    let [Doubt::OtherReading(other)] = doubts.as_slice() else { panic!("{doubts:?}") };
    assert!(matches!(other.evidence, Evidence::LightSide { .. }), "{other:?}");
    assert_eq!(doubts[0].suggestions(), [(OptionName::Azimuth, "from-light".to_owned())]);
}

/// A row for each wavelength, in nanometres or micrometres, with values that some directions lack.
#[test]
fn a_row_for_each_wavelength() {
    let wide = parsed("csv", "theta_i,phi_i,theta_o,phi_o,450,650\n30,0,40,180,1,2\n50,0,20,90,3,nan\n");
    for text in [
        "wavelength,theta_i,phi_i,theta_o,phi_o,brdf\n450,30,0,40,180,1\n650,30,0,40,180,2\n450,50,0,20,90,3\n",
        "theta_i,phi_i,theta_o,phi_o,f,lambda [um]\n30,0,40,180,2,0.65\n30,0,40,180,1,0.45\n50,0,20,90,3,0.45\n",
        "theta_i,phi_i,theta_o,phi_o,f,wl\n30,0,40,180,2,0.65\n30,0,40,180,1,0.45\n50,0,20,90,3,0.45\n",
    ] {
        let long = parsed("csv", text);
        assert_eq!(long.channels, wide.channels);
        assert_eq!(long.values[0], wide.values[0]);
        assert_eq!(long.values[1][0], 2.0);
        assert!(long.values[1][1].is_nan());
    }
    // Wavelengths as names of columns in micrometres.
    let m = parsed("csv", "theta_i,theta_o,0.45,0.55,0.65\n30,40,1,2,3\n");
    assert_eq!(m.channel_names(), ["450", "550", "650"]);
    // A direction that is measured twice gives two samples.
    let m =
        parsed("csv", "wavelength,theta_i,theta_o,f\n450,30,40,1\n450,30,40,2\n550,30,40,3\n550,30,40,4\n");
    assert_eq!(m.values, [[1.0, 2.0], [3.0, 4.0]]);
    // Every wavelength in a direction of its own would fill the memory.
    let rows: String =
        (0..20_000).map(|k| format!("{},{},40,1\n", 400.0 + f64::from(k), f64::from(k) * 0.004)).collect();
    let error =
        parse("csv", format!("wavelength,theta_i,theta_o,f\n{rows}").as_bytes(), &CENTER).unwrap_err();
    assert!(error.to_string().contains("wavelengths that share directions"), "{error}");
}

/// Standard deviations under other names, relative ones, and expanded uncertainties.
#[test]
fn columns_of_uncertainties() {
    let sigma = |header: &str, row: &str| {
        let m = parsed("csv", &format!("theta_i,phi_i,theta_o,phi_o,{header}\n1,2,3,4,{row}\n"));
        (m.channels.len(), m.sigma)
    };
    assert_eq!(sigma("f,uncertainty", "2,0.1"), (1, Some(vec![vec![0.1]])));
    assert_eq!(sigma("brdf,brdf_std", "2,0.1"), (1, Some(vec![vec![0.1]])));
    assert_eq!(sigma("r,g,u_r,u_g", "2,4,0.1,0.2"), (2, Some(vec![vec![0.1], vec![0.2]])));
    assert_eq!(sigma("450,450_err", "2,0.1"), (1, Some(vec![vec![0.1]])));
    assert_eq!(sigma("f,uncertainty [%]", "2,5"), (1, Some(vec![vec![0.1]])));
    assert_eq!(sigma("f,U (k=2)", "2,0.2"), (1, Some(vec![vec![0.1]])));
    // Those of no channel are left out, never fitted.
    assert_eq!(sigma("f,sigma_f,error_code", "2,0.1,7"), (1, Some(vec![vec![0.1]])));
}

#[test]
fn missing_cells() {
    let text = "theta_i,phi_i,theta_o,phi_o,r,g\n10,0,20,180,0.1,\n10,0,30,180,NaN,0.2\n10,0,40,180,N/A,--\n10,0,50,180,1,2\n";
    let folder = Folder::new();
    folder.write("holes.csv", text);
    let m = read(&folder.path("holes.csv"), None, &CENTER).unwrap();
    assert_eq!(m.directions.len(), 3);
    assert_eq!(m.dropped["not-measured"], 1);
    assert_eq!(m.values[0].iter().filter(|f| f.is_nan()).count(), 1);
    assert_eq!(m.values[1].iter().filter(|f| f.is_nan()).count(), 1);
    // A named marker, in one channel.
    folder
        .write("marked.csv", "theta_i,phi_i,theta_o,phi_o,r,g\n10,0,20,180,0.1,-999\n10,0,30,180,0.3,0.2\n");
    let m = read(&folder.path("marked.csv"), None, &with(OptionName::Missing, "-999")).unwrap();
    assert!(m.values[1][0].is_nan() && m.values[1][1] == 0.2);
}

/// What the user says about columns comes before what names say.
#[test]
fn columns_that_the_user_chooses() {
    let expected =
        parsed("csv", "theta_i,phi_i,theta_o,phi_o,R,sigma\n30,0,40,180,0.5,0.1\n50,0,20,90,0.25,0.2\n");
    let text = "A,B,C,D,R,G,err\n30,0,40,180,0.5,7,0.1\n50,0,20,90,0.25,8,0.2\n";
    let choice = "theta_i=A,phi_i=B,theta_o=C,phi_o=D,channels=R,sigma=err";
    let found = parse("csv", text.as_bytes(), &with(OptionName::Columns, choice)).unwrap();
    assert_same(&found, &expected, "by name");
    assert_eq!(found.sigma, expected.sigma);
    // Without a header, by number.
    let rows = text.split_once('\n').unwrap().1.replace(',', " ");
    let choice = "theta_i=1,phi_i=2,theta_o=3,phi_o=4,channels=5,sigma=7";
    let found = parse("csv", rows.as_bytes(), &with(OptionName::Columns, choice)).unwrap();
    assert_same(&found, &expected, "by number");
    assert_eq!(found.sigma, expected.sigma);
    for (choice, word) in [
        ("theta_i=X,theta_o=C,channels=R", "'X'"),
        ("theta_i=A,theta_o=A,channels=R", "two for 'A'"),
        ("theta_i=A,theta_o=C,channels=R;G,sigma=err;B;D", "2 channels"),
    ] {
        let error = parse("csv", text.as_bytes(), &with(OptionName::Columns, choice)).unwrap_err();
        assert!(error.to_string().contains(word), "{choice}: {error}");
    }
}

/// Other columns are left out, and it is said.
#[test]
fn columns_that_are_no_values() {
    let m = parsed(
        "csv",
        "no,theta_i,phi_i,theta_o,phi_o,f,time [s],phi_d\n1,30,0,40,180,0.5,12,3\n2,50,0,20,90,0.25,13,4\n",
    );
    assert_eq!(m.channel_names(), ["f"]);
    let said = m.remarks[0].to_string();
    for word in ["'no' (row numbers)", "'time [s]' (times)", "'phi_d' (an angle"] {
        assert!(said.contains(word), "{word}: {said}");
    }
    // Names that speak of another quantity are doubted, not changed.
    let m = parsed("csv", "theta_i,theta_o,BRF\n30,40,0.5\n30,50,0.6\n");
    assert!(matches!(m.doubts[..], [Doubt::NotReflectance { .. }]), "{:?}", m.doubts);
    assert_eq!(m.values, [[0.5, 0.6]]);
    assert_eq!(m.doubts[0].suggestions(), [(OptionName::Quantity, "reflectance-factor".to_owned())]);
}

/// A refusal names the option that would read the file, and shows tabs.
#[test]
fn refusals_name_the_option() {
    let refusal = |text: &str| match parse("csv", text.as_bytes(), &CENTER) {
        Err(error @ Error::Malformed { .. }) => error.to_string(),
        other => panic!("{other:?}"),
    };
    for (text, words) in [
        ("10 0 20 180 0.1\n20 0 30 180 0.2\n", &["names the columns", "columns theta_i=1"][..]),
        ("alpha\tbeta\tf\n1\t2\t3\n", &["column 'theta_i'", "alpha\\tbeta\\tf", "columns theta_i=COLUMN"]),
        ("theta_i,theta_o\n1,2\n", &["a column of values", "columns channels=COLUMN"]),
        (
            "theta_in,theta_inc,theta_o,f\n1,2,3,4\n",
            &["one column for theta_i", "'theta_in' and 'theta_inc'"],
        ),
        ("theta_i,theta_o,f\n10,5,20,5,0,1\n", &[":2:", "3 fields", "found 6"]),
    ] {
        let error = refusal(text);
        for word in words {
            assert!(error.contains(word), "{word}: {error}");
        }
    }
}

/// Real tables of others.
#[test]
fn tables_of_others() {
    let Some(folder) = shared("more") else { return };
    let m = read(&folder.join("ansys-optical-automation/in_plane_spectral_2D.csv"), None, &CENTER).unwrap();
    assert_eq!((m.channels.len(), m.directions.len()), (35, 329));
    assert_eq!(m.channels[0].wavelength_nm, Some(390.0));
    // The peak at 60 degrees of incidence is in the mirror direction.
    let peak = m.values[0].iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1)).unwrap().0;
    let g = m.directions.iter().nth(peak).unwrap();
    assert!(g.h[2] > 0.999, "{g:?}");
    let m = read(&folder.join("spectralon-brf/panel-BRFs.csv"), None, &CENTER).unwrap();
    assert_eq!(m.channel_names(), ["800", "1220", "1850"]);
    assert!(matches!(m.doubts[..], [Doubt::NotReflectance { .. }]), "{:?}", m.doubts);
}
