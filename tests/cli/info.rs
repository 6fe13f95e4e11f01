//! `brdfit info`.

use super::{GOOD, assert_refused, refused};
use crate::common::Folder;
use approx::{assert_abs_diff_eq, assert_relative_eq};
use serde_json::json;

#[test]
fn info_describes_a_file() {
    let folder = Folder::new();
    // Two directions measured both ways, f = 1 and 3: rms difference 2 relative to rms f = sqrt(5).
    let content = "theta_i,phi_i,theta_o,phi_o,450,650nm\n20,0,50,180,1,-0.5\n50,0,20,180,3,-0.5\n";
    folder.write("pair.csv", content);
    let info = folder.brdfit("info pair.csv --json").good().json();
    assert_eq!(info["path"], "pair.csv");
    assert_eq!(info["format"], "csv");
    // printf 'theta_i,...' | sha256sum
    assert_eq!(info["sha256"], SHA256_OF_PAIR);
    assert_eq!(info["channels"][0]["name"], "450");
    assert_eq!(info["channels"][1]["name"], "650");
    assert_eq!(info["wavelengths_nm"], json!([450.0, 650.0]));
    assert_eq!(info["samples"], 2);
    assert_eq!(info["usable"], 2);
    assert_eq!(info["has_sigma"], false);
    assert_eq!(info["in_plane"], true);
    assert_eq!(info["incidence_angles"], 2);
    assert_eq!(info["channels"][0]["range"], json!([1.0, 3.0]));
    assert_eq!(info["channels"][1]["negative"], 2);
    assert_eq!(info["reciprocity"]["pairs"], 1);
    // Both channels together: sqrt((2^2 + 0) / ((1 + 9)/2 + 0.25))
    assert_relative_eq!(
        info["reciprocity"]["relative_rms"].as_f64().unwrap(),
        (4.0_f64 / 5.25).sqrt(),
        max_relative = 1e-12
    );
    for (key, low, high) in
        [("theta_i_deg", 20.0, 50.0), ("theta_o_deg", 20.0, 50.0), ("theta_h_deg", 15.0, 15.0)]
    {
        assert_abs_diff_eq!(info[key][0].as_f64().unwrap(), low, epsilon = 1e-9);
        assert_abs_diff_eq!(info[key][1].as_f64().unwrap(), high, epsilon = 1e-9);
    }
    let text = folder.brdfit("info pair.csv").good().stdout;
    for word in ["pair.csv", "csv", SHA256_OF_PAIR, "450", "650", "in plane", "reciprocity"] {
        assert!(text.contains(word), "{word}: {text}");
    }
}

const SHA256_OF_PAIR: &str = "baee70616e4b4261aae1aa97bb51eb4dd31d0b82413462904bebc94246ae3f44";

#[test]
fn a_material_is_named_only_where_there_are_several() {
    let folder = Folder::new();
    folder.write("one.csv", GOOD);
    let rows = "steel,30,40,0.5,1\nsteel,50,20,0.4,1\nbrass,30,40,0.9,1\n";
    folder.write("two.csv", format!("material,theta_i_deg,theta_o_deg,brdf_per_sr,L_o\n{rows}"));
    let of = |line: &str| {
        let run = folder.brdfit(line);
        assert_eq!(run.code, Some(0), "{run:?}");
        assert!(run.stderr.contains("one of 2: 'steel', 'brass'"), "{run:?}");
        run.json()["samples"].as_u64().unwrap()
    };
    assert_eq!(of("info two.csv --json"), 2);
    assert_eq!(of("info two.csv --material brass --json"), 1);
    assert_refused(
        &folder,
        &[
            refused(
                "no such material",
                "info two.csv --material bras",
                &["steel, brass", "did you mean 'brass'"],
            ),
            refused(
                "a file of one",
                "info one.csv --material steel",
                &["--material", "one material", "mwir"],
            ),
        ],
    );
}
