//! The JSON report, field by field, and its schema.

use super::{HEADER, laboratory};
use crate::common::{Folder, parse};
use approx::assert_abs_diff_eq;
use brdfit::fit::Metric;
use brdfit::report::{ParameterStatus, Report, StopReason};
use brdfit::solver::Termination;
use serde_json::{Value, json};
use std::fs;

/// The number tokens of a JSON text, outside strings.
fn numbers(text: &str) -> Vec<&str> {
    let mut found = Vec::new();
    let mut in_string = false;
    let mut escaped = false;
    let mut start = None;
    for (at, c) in text.char_indices() {
        let numeric = !in_string && (c.is_ascii_digit() || "+-.eE".contains(c));
        match (numeric, start) {
            (true, None) => start = Some(at),
            (false, Some(from)) => {
                found.push(&text[from..at]);
                start = None;
            }
            _ => {}
        }
        if c == '"' && !escaped {
            in_string = !in_string;
        }
        escaped = in_string && c == '\\' && !escaped;
    }
    // 'e' of true, false and null counts as numeric above.
    found.into_iter().filter(|token| token.contains(|c: char| c.is_ascii_digit())).collect()
}

#[test]
fn floats_round_trip() {
    let folder = laboratory();
    let text = folder.brdfit("fit a.csv -m 'lambert + cook-torrance' --json").good().stdout;
    let tokens = numbers(&text);
    assert!(tokens.len() > 80, "{}", tokens.len());
    for token in &tokens {
        let value: f64 = token.parse().unwrap();
        assert!(value.is_finite());
        // The shortest text that reads back as the same number.
        if token.contains(['.', 'e', 'E']) {
            assert_eq!(serde_json::to_string(&value).unwrap(), *token);
        }
    }
    // Full precision is there: most results need 16 or 17 digits.
    let long = tokens.iter().filter(|t| t.bytes().filter(u8::is_ascii_digit).count() >= 16).count();
    assert!(long > 40, "{long} of {}", tokens.len());

    // What was given comes back to the last bit.
    for value in [0.1 + 0.2, 1.0 / 3.0, 2.0 - f64::EPSILON, 1e-300, 5e-324, f64::MIN_POSITIVE] {
        let text = folder.brdfit(&format!("evaluate a.csv -m lambert --set kd={value:?} --json")).stdout;
        let written = format!("\"value\": {}", serde_json::to_string(&value).unwrap());
        assert!(text.contains(&written), "{written}");
    }
}

/// The kinds of JSON value.
fn kind(value: &Value) -> &'static str {
    match value {
        Value::Null => "null",
        Value::Bool(_) => "bool",
        Value::Number(n) if n.is_u64() => "count",
        Value::Number(_) => "number",
        Value::String(_) => "string",
        Value::Array(_) => "array",
        Value::Object(_) => "object",
    }
}

/// Asserts that an object has exactly these fields, each of one of the kinds named (`number` may be whole).
fn assert_fields(what: &str, object: &Value, fields: &[(&str, &str)]) {
    let found = object.as_object().unwrap_or_else(|| panic!("{what}: not an object"));
    let names: Vec<&str> = found.keys().map(String::as_str).collect();
    let mut expected: Vec<&str> = fields.iter().map(|(name, _)| *name).collect();
    let mut sorted = names.clone();
    sorted.sort_unstable();
    expected.sort_unstable();
    assert_eq!(sorted, expected, "{what}");
    for (name, kinds) in fields {
        let is = kind(&object[name]);
        let allowed = kinds.split('|').any(|allowed| allowed == is || (allowed == "number" && is == "count"));
        assert!(allowed, "{what}.{name}: {is} is not {kinds}");
    }
}

/// docs/inside/design.md, section 6, field by field.
fn assert_report(report: &Value) {
    assert_fields(
        "report",
        report,
        &[
            ("schema", "string"),
            ("version", "string"),
            ("model", "string"),
            ("data", "object"),
            ("filters", "object"),
            ("metric", "string"),
            ("parameters", "array"),
            ("derived", "array"),
            ("correlation", "object|null"),
            ("errors", "object"),
            ("errors_on_all", "object|null"),
            ("misfit", "object|null"),
            ("errors_by_channel", "object"),
            ("fit", "object"),
            ("selection", "object"),
            ("starts", "array"),
            ("termination", "object"),
            ("options", "object"),
            ("time_s", "object"),
            ("warnings", "array"),
        ],
    );
    assert_eq!(report["schema"], "brdfit.report/1");
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    let data = &report["data"];
    assert_fields(
        "data",
        data,
        &[
            ("path", "string"),
            ("format", "string"),
            ("sha256", "string"),
            ("channels", "array"),
            ("wavelengths_nm", "array|null"),
            ("samples", "count"),
            ("used", "count"),
            ("dropped", "object"),
            ("remarks", "array"),
        ],
    );
    let sha = data["sha256"].as_str().unwrap();
    assert!(sha.len() == 64 && sha.bytes().all(|b| b.is_ascii_hexdigit()));
    let dropped: u64 = data["dropped"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(data["used"].as_u64().unwrap() + dropped, data["samples"].as_u64().unwrap());
    let fields = [("max_theta_deg", "number"), ("weights", "string"), ("sigma_unused", "bool")];
    assert_fields("filters", &report["filters"], &fields);
    let misfit = &report["misfit"];
    if !misfit.is_null() {
        let fields = [
            ("ratio", "number|null"),
            ("noise", "string|null"),
            ("relative", "number"),
            ("limit", "number"),
            ("worst", "object|null"),
        ];
        assert_fields("misfit", misfit, &fields);
        assert_eq!(misfit["ratio"].is_null(), misfit["noise"].is_null());
        if !misfit["worst"].is_null() {
            let fields = [("theta_i_deg", "array"), ("near_mirror", "bool")];
            assert_fields("misfit.worst", &misfit["worst"], &fields);
        }
    }
    for parameter in report["parameters"].as_array().unwrap() {
        assert_fields(
            "parameter",
            parameter,
            &[
                ("lobe", "string"),
                ("name", "string"),
                ("channel", "string|null"),
                ("value", "number"),
                ("unit", "string"),
                ("std_error", "number|null"),
                ("ci95", "array|null"),
                ("ci95_open", "array"),
                ("bounds", "array"),
                ("initial", "number"),
                ("status", "string"),
            ],
        );
        let status = parameter["status"].as_str().unwrap();
        assert!(["free", "fixed", "tied", "at-lower", "at-upper", "absent"].contains(&status), "{status}");
        if status != "free" {
            assert_eq!(parameter["std_error"], Value::Null, "{parameter}");
        }
        assert_eq!(parameter["std_error"].is_null(), parameter["ci95"].is_null());
        if let Some([low, high]) = parameter["ci95"].as_array().map(Vec::as_slice) {
            let value = parameter["value"].as_f64().unwrap();
            assert!(low.as_f64().unwrap() <= value && value <= high.as_f64().unwrap());
        }
        let [low, value, high] = [&parameter["bounds"][0], &parameter["value"], &parameter["bounds"][1]]
            .map(|v| v.as_f64().unwrap());
        assert!(low <= value && value <= high, "{parameter}");
        if let Some(channel) = parameter["channel"].as_str() {
            assert!(data["channels"].as_array().unwrap().iter().any(|c| c == channel));
        }
    }
    for derived in report["derived"].as_array().unwrap() {
        assert_fields(
            "derived",
            derived,
            &[
                ("name", "string"),
                ("channel", "string|null"),
                ("value", "number"),
                ("std_error", "number|null"),
                ("ci95", "array|null"),
            ],
        );
    }
    if report["correlation"].is_object() {
        assert_fields("correlation", &report["correlation"], &[("parameters", "array"), ("matrix", "array")]);
        let n = report["correlation"]["parameters"].as_array().unwrap().len();
        let matrix = report["correlation"]["matrix"].as_array().unwrap();
        assert_eq!(matrix.len(), n);
        for (i, row) in matrix.iter().enumerate() {
            assert_eq!(row.as_array().unwrap().len(), n);
            for j in 0..n {
                if let Some(value) = row[j].as_f64() {
                    assert!(value.abs() <= 1.0 + 1e-12);
                    assert!(i != j || (value - 1.0).abs() < 1e-12);
                    assert_abs_diff_eq!(value, matrix[j][i].as_f64().unwrap(), epsilon = 1e-12);
                }
            }
        }
    }
    let metrics = [
        ("l2", "number"),
        ("log", "number"),
        ("cbrt", "number"),
        ("unbiased_cbrt", "number"),
        ("log_ratio", "number"),
        ("relative", "number|null"),
    ];
    assert_fields("errors", &report["errors"], &metrics);
    let by_channel = report["errors_by_channel"].as_object().unwrap();
    assert_eq!(by_channel.len(), data["channels"].as_array().unwrap().len());
    for channel in data["channels"].as_array().unwrap() {
        assert_fields("errors_by_channel", &by_channel[channel.as_str().unwrap()], &metrics);
    }
    assert_fields(
        "fit",
        &report["fit"],
        &[
            ("n", "count"),
            ("dof", "number"),
            ("cost", "number"),
            ("reduced_chi2", "number|null"),
            ("condition", "number|null"),
            ("grouping", "object|null"),
            ("uncertainty_method", "string|null"),
            ("resampling", "object|null"),
        ],
    );
    assert_fields(
        "selection",
        &report["selection"],
        &[("aicc", "number|null"), ("bic", "number|null"), ("held_out", "object|null")],
    );
    for start in report["starts"].as_array().unwrap() {
        assert!(start["cost"].as_f64().unwrap() >= 0.0);
    }
    assert_fields(
        "termination",
        &report["termination"],
        &[("reason", "string"), ("usable", "bool"), ("iterations", "count"), ("evaluations", "count")],
    );
    assert_fields(
        "time_s",
        &report["time_s"],
        &[("read", "number"), ("fit", "number"), ("total", "number"), ("threads", "count")],
    );
    for warning in report["warnings"].as_array().unwrap() {
        assert_fields(
            "warning",
            warning,
            &[("kind", "string"), ("parameter", "string|null"), ("text", "string"), ("suggestions", "array")],
        );
        for suggestion in warning["suggestions"].as_array().unwrap() {
            assert_fields("suggestion", suggestion, &[("option", "string"), ("value", "string")]);
        }
    }
}

/// Reports of every kind: a fit, one with null uncertainties, an evaluation, spectral data, a timeout.
fn all_kinds(folder: &Folder) -> Vec<String> {
    folder.write("few.csv", "theta_i,phi_i,theta_o,phi_o,550\n10,0,20,180,0.1\n");
    folder.write("black.csv", format!("{HEADER}\n{}", "30,0,40,180,0\n".repeat(5)));
    [
        "fit a.csv -m 'lambert + cook-torrance' --json",
        "fit a.csv -m 'lambert + cook-torrance' --free ks --json",
        "fit a.csv -m 'lambert + cook-torrance' --weights sigma --tie kd.r=kd.g --bounds m=0.5..1 --json",
        "fit a.csv -m 'oren-nayar + ashikhmin-shirley' --fix sigma=20 --json",
        "fit a.csv -m lambert --fix kd=0.5 --json",
        "fit few.csv -m 'lambert + cook-torrance' --json",
        "fit black.csv -m 'lambert + cook-torrance' --json",
        "fit a.csv -m 'lambert + cook-torrance' --timeout 1e-9 --json",
        "evaluate a.csv -m 'lambert + cook-torrance' --set kd=0.2 --json",
    ]
    .map(|line| {
        let run = folder.brdfit(line);
        assert!(matches!(run.code, Some(0 | 1)), "{line}: {run:?}");
        run.stdout
    })
    .to_vec()
}

#[test]
fn reports_have_every_field_of_the_contract() {
    let folder = laboratory();
    for text in all_kinds(&folder) {
        assert_report(&parse(&text));
        assert!(!text.contains("NaN") && !text.contains("Infinity"));
    }
    let several = folder.brdfit("fit a.csv b.csv nothing.csv -m lambert --json").json();
    assert_fields(
        "reports",
        &several,
        &[("schema", "string"), ("reports", "array"), ("ranking", "array"), ("failed", "array")],
    );
    several["reports"].as_array().unwrap().iter().for_each(assert_report);
    for rank in several["ranking"].as_array().unwrap() {
        let fields = [
            ("index", "count"),
            ("criterion", "string"),
            ("value", "number"),
            ("not_told_apart", "array|null"),
        ];
        assert_fields("rank", rank, &fields);
    }
    for failure in several["failed"].as_array().unwrap() {
        assert_fields("failed", failure, &[("path", "string"), ("error", "string")]);
    }
}

#[test]
fn report_names_and_states() {
    let folder = laboratory();
    let line = "fit a.csv -m 'lambert+cook-torrance(d=beckmann)+cook-torrance' --fix cook-torrance.ks=1 \
                --fix cook-torrance#2.ks=1 --json";
    let report = folder.brdfit(line).json();
    assert_eq!(
        report["model"],
        "lambert + cook-torrance(d=beckmann, g=smith, f=schlick, ks=1) + cook-torrance(d=ggx, g=smith, f=schlick, ks=1)"
    );
    let lobes: Vec<&str> =
        report["parameters"].as_array().unwrap().iter().map(|p| p["lobe"].as_str().unwrap()).collect();
    for lobe in ["lambert", "cook-torrance", "cook-torrance#2"] {
        assert!(lobes.contains(&lobe), "{lobe}");
    }
    // Fixed parameters are listed: ks of both lobes, per channel.
    let ks = report["parameters"].as_array().unwrap().iter().filter(|p| p["name"] == "ks");
    assert_eq!(ks.filter(|p| p["status"] == "fixed" && p["value"] == 1.0).count(), 6);
    // One channel: its name, not null; a shared parameter has null.
    folder.write("one.csv", "theta_i,phi_i,theta_o,phi_o,550\n10,0,20,180,0.1\n30,0,30,180,0.12\n");
    let report = folder.brdfit("fit one.csv -m oren-nayar --fix sigma=10 --json").json();
    assert_eq!(report["data"]["wavelengths_nm"], json!([550.0]));
    let channel = |name: &str| {
        let of = report["parameters"].as_array().unwrap().iter().find(|p| p["name"] == name).unwrap();
        (of["channel"].clone(), of["unit"].clone())
    };
    assert_eq!(channel("albedo"), (json!("550"), json!("1")));
    assert_eq!(channel("sigma"), (Value::Null, json!("deg")));
    // A number as channel stands in brackets.
    let report = folder.brdfit("fit one.csv -m lambert --fix kd[550]=0.3 --json").good().json();
    assert_eq!(report["parameters"][0]["value"], 0.3);
}

fn schema() -> Value {
    serde_json::to_value(brdfit::report::schema()).unwrap()
}

#[test]
fn reports_match_the_schema() {
    let validator = jsonschema::validator_for(&schema()).expect("a valid JSON Schema");
    let folder = laboratory();
    let mut texts = all_kinds(&folder);
    texts.push(folder.brdfit("fit a.csv b.csv nothing.csv -m lambert -m oren-nayar --json").stdout);
    for text in &texts {
        let report = parse(text);
        let errors: Vec<String> =
            validator.iter_errors(&report).map(|e| format!("{}: {e}", e.instance_path())).collect();
        assert!(errors.is_empty(), "{errors:?}");
    }
    // The schema refuses what is not a report.
    let good = parse(&texts[0]);
    assert!(!validator.is_valid(&json!({})));
    let nullable = ["correlation", "errors_on_all"];
    for field in good.as_object().unwrap().keys().filter(|name| !nullable.contains(&name.as_str())) {
        let mut bad = good.clone();
        bad[field] = json!(true);
        assert!(!validator.is_valid(&bad), "{field}: true");
        bad.as_object_mut().unwrap().remove(field);
        assert!(!validator.is_valid(&bad), "no {field}");
    }
}

/// `BRDFIT_UPDATE=1 cargo test --release --test integration schema` writes the file anew.
#[test]
fn the_schema_file_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/use/report.schema.json");
    let generated = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/docs")).unwrap();
        fs::write(path, &generated).unwrap();
    }
    let found = fs::read_to_string(path).unwrap_or_default().replace("\r\n", "\n");
    assert!(
        found == generated,
        "docs/use/report.schema.json is stale: BRDFIT_UPDATE=1 cargo test --release --test integration schema"
    );
}

/// Reports of earlier versions can still be read, and `check` judges their models. This one was written before warnings had suggestions.
#[test]
fn reports_of_earlier_versions_are_read() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/reports/2026-11-28.json");
    let text = fs::read_to_string(path).unwrap();
    let report: Report = serde_json::from_str(&text).unwrap();
    assert_eq!(report.metric, Metric::Cbrt);
    assert_eq!(report.termination.reason, StopReason::from(Termination::ConvergedCost));
    assert!(report.parameters.iter().any(|p| p.name == "m" && p.status == ParameterStatus::Free));
    let held_out = report.selection.held_out.as_ref().unwrap();
    assert!(held_out.samples > 0 && held_out.errors.cbrt.is_some());
    // What this version writes of it differs in nothing but what was added.
    let (mut written, read) = (serde_json::to_value(&report).unwrap(), parse(&text));
    for warning in written["warnings"].as_array_mut().unwrap() {
        assert_eq!(warning.as_object_mut().unwrap().remove("suggestions"), Some(json!([])));
    }
    for parameter in written["parameters"].as_array_mut().unwrap() {
        assert_eq!(parameter.as_object_mut().unwrap().remove("ci95_open"), Some(json!([null, null])));
    }
    let mut remove = |object: &str, field: &str, value: Value| {
        let object = if object.is_empty() { &mut written } else { &mut written[object] };
        assert_eq!(object.as_object_mut().unwrap().remove(field), Some(value));
    };
    remove("", "misfit", Value::Null);
    remove("filters", "sigma_unused", json!(false));
    remove("fit", "grouping", Value::Null);
    remove("options", "sigma_scale", Value::Null);
    remove("options", "scale_error", Value::Null);
    remove("options", "material", Value::Null);
    remove("options", "reading", json!([]));
    remove("data", "remarks", json!([]));
    let without_unbiased = |errors: &mut Value| {
        assert_eq!(errors.as_object_mut().unwrap().remove("unbiased_cbrt"), Some(Value::Null));
    };
    without_unbiased(&mut written["errors"]);
    without_unbiased(&mut written["selection"]["held_out"]);
    for (field, value) in [("mean", Value::Null), ("std_dev", Value::Null), ("folds", json!([]))] {
        assert_eq!(written["selection"]["held_out"].as_object_mut().unwrap().remove(field), Some(value));
    }
    written["errors_by_channel"].as_object_mut().unwrap().values_mut().for_each(without_unbiased);
    assert_eq!(written, read);
    let folder = Folder::new();
    folder.write("earlier.json", &text);
    folder.brdfit("check earlier.json").good();
}

/// Settings are part of the model line, which alone makes the same report.
#[test]
fn the_model_line_reproduces_the_report() {
    let folder = Folder::new();
    let made = "synth -m 'lambert + cook-torrance' --set kd=0.2 m=0.3 f0=0.06 --directions 60 --noise 0.02 --seed 1 -o a.csv";
    folder.brdfit(made).good();
    let report = |model: &str, options: &str| {
        let run = folder.brdfit(&format!("fit a.csv -m '{model}' {options} --json"));
        assert!(matches!(run.code, Some(0 | 1)), "{run:?}");
        let mut report = run.json();
        report.as_object_mut().unwrap().remove("time_s");
        report["options"].as_object_mut().unwrap().remove("parameters");
        report
    };
    let models = brdfit::model::REGISTRY.iter().map(|entry| (entry.name, ""));
    let sums = [
        (
            "lambert + cook-torrance + cook-torrance",
            "--fix cook-torrance.m=0.3 --bounds cook-torrance#2.m=0.05..0.9",
        ),
        ("lambert + cook-torrance(d=beckmann, m=0.3)", "--free ks --fix kd=0.2 f0.f=0.05"),
        ("eon(r=0.2..0.4) + ashikhmin-shirley(nv=nu)", "--free strength"),
        ("lambert + ashikhmin-shirley", "--tie nv=NU --shared rd"),
    ];
    for (model, options) in models.chain(sums) {
        let first = report(model, options);
        let line = first["model"].as_str().unwrap();
        assert_eq!(report(line, ""), first, "{line}");
    }
}
