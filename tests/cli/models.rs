//! `brdfit models`.

use crate::common::Folder;
use serde_json::{Value, json};

#[test]
fn models_lists_the_zoo() {
    let folder = Folder::new();
    let text = folder.brdfit("models").good().stdout;
    let json = folder.brdfit("models --json").good().json();
    let names: Vec<&str> = json.as_array().unwrap().iter().map(|m| m["name"].as_str().unwrap()).collect();
    for name in ["lambert", "oren-nayar", "cook-torrance", "ashikhmin-shirley"] {
        assert!(names.contains(&name) && text.contains(name), "{name}");
    }
    let of = |name: &str| folder.brdfit(&format!("models {name} --json")).good().json()[0].clone();
    let bounds = |model: &str, parameter: &str| -> Vec<Value> {
        let model = of(model);
        let found = model["parameters"].as_array().unwrap().iter().filter(|p| p["name"] == parameter);
        found.map(|p| p["bounds"].clone()).collect()
    };
    // docs/inside/design.md, section 5.
    for (model, parameter, expected) in [
        ("lambert", "kd", json!([0.0, 2.0])),
        ("oren-nayar", "albedo", json!([0.0, 2.0])),
        ("oren-nayar", "sigma", json!([0.0, 90.0])),
        ("cook-torrance", "m", json!([1e-4, 1.0])),
        ("cook-torrance", "f0", json!([0.0, 1.0])),
        ("cook-torrance", "ks", json!([0.0, 1000.0])),
        ("ashikhmin-shirley", "rd", json!([0.0, 1.0])),
        ("ashikhmin-shirley", "rs", json!([0.0, 1.0])),
        ("eon", "albedo", json!([0.0, 1.0])),
        ("phong", "ks", json!([0.0, 1000.0])),
        ("blinn-phong", "n", json!([0.01, 1e6])),
        ("ward", "m", json!([1e-4, 1.0])),
        ("ward-duer", "my", json!([1e-4, 1.0])),
        // Published weights are negative forward.
        ("lafortune", "cxy", json!([-1.0, 1.0])),
    ] {
        let found = bounds(model, parameter);
        assert!(!found.is_empty() && found.iter().all(|b| *b == expected), "{model}.{parameter}: {found:?}");
    }
    let text = folder.brdfit("models cook-torrance").good().stdout;
    for word in ["cook-torrance", "beckmann", "ggx", "smith", "schlick", " m ", "f0"] {
        assert!(text.contains(word), "{word}: {text}");
    }
    assert!(!text.contains("oren-nayar"));
}

#[test]
fn a_model_without_a_report_becomes_code() {
    let folder = Folder::new();
    let code = folder.brdfit("models cook-torrance --code c").good().stdout;
    // For one channel names have no channel, and values are the defaults.
    assert!(code.contains("{\"cook_torrance_m\", \"cook_torrance_f0\", \"cook_torrance_ks\"}"), "{code}");
    assert!(code.contains("{0.2, 0.05, 1.0}"), "{code}");
    // An expression is as good as a name, and fixed parameters are in no argument.
    let given = "models lambert(kd=0.25)+cook-torrance(d=gtr) --code javascript --parameters fixed";
    let fixed = folder.brdfit(given).good().stdout;
    assert!(fixed.contains("model: lambert(kd=0.25) + cook-torrance(d=gtr"), "{fixed}");
    assert!(fixed.contains("const table1 = [") && !fixed.contains("lambert_kd"), "{fixed}");
    for (line, words) in [
        ("models cook-torrance(d=gtr) --code c", ["--parameters free", "use --parameters fixed"]),
        ("models --code c", ["NAME", "required"]),
        ("models lambert --code c --json", ["--json", "--code"]),
        ("models lambert --parameters fixed", ["--code", "required"]),
        ("models lamber --code c", ["lamber", "lambert"]),
        ("models lambert --code fortran", ["fortran", "javascript"]),
    ] {
        let run = folder.brdfit(line);
        assert_eq!(run.code, Some(2), "{line}: {run:?}");
        assert!(words.iter().all(|word| run.stderr.contains(word)), "{line}: {}", run.stderr);
    }
}
