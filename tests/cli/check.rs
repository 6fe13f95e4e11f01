//! `brdfit check`.

use super::{GOOD, complaints, refused};
use crate::common::{Folder, parse};
use serde_json::json;

/// `check` in its three forms: a model, a report, a measurement; its exit code is the verdict.
#[test]
fn check_tells_sound_from_unsound() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("negative.csv", GOOD.replace("0.12,", "-0.5,"));
    let both_ways =
        "theta_i,phi_i,theta_o,phi_o,f\n30,0,50,120,0.2\n50,120,30,0,0.1\n10,0,20,0,0.15\n20,0,10,0,0.15\n";
    folder.write("one-way.csv", both_ways);
    for (line, code, kind) in [
        ("check -m lambert --set kd=0.8", 0, ""),
        ("check -m lambert --set kd=1.5", 1, "gains-energy"),
        ("check -m lambert --set kd.r=0.8 kd.g=1.01", 1, "gains-energy"),
        ("check -m lambert --set kd=-0.1 --bounds kd=-1..2", 1, "negative"),
        ("check good.csv", 0, ""),
        ("check negative.csv", 1, "negative"),
        ("check one-way.csv", 1, "not-reciprocal"),
    ] {
        let run = folder.brdfit(line);
        assert_eq!(run.code, Some(code), "{line}: {run:?}");
        let json = folder.brdfit(&format!("{line} --json"));
        assert_eq!(json.code, Some(code), "{line}: {json:?}");
        let json = json.json();
        assert_eq!(json["schema"], "brdfit.check/1");
        // Four samples say nothing about energy.
        let judged = code == 1 || !line.contains(".csv");
        assert_eq!(json["sound"], if judged { json!(code == 0) } else { json!(null) }, "{line}");
        let broken = json["findings"].as_array().unwrap().iter().filter(|f| f["breaks"] == true);
        let kinds: Vec<&str> = broken.map(|f| f["kind"].as_str().unwrap()).collect();
        assert!(kinds.iter().all(|k| *k == kind), "{line}: {kinds:?}");
        assert_eq!(kinds.is_empty(), code == 0, "{line}");
        let last = run.stdout.lines().last().unwrap();
        let expected = match code {
            0 if judged => "sound",
            0 => "no law broken; reciprocity and energy not judged",
            _ => "BREAKS PHYSICS",
        };
        assert_eq!(last, expected, "{line}");
    }
    // The channel that breaks it is named.
    let run = folder.brdfit("check -m lambert --set kd.r=0.8 kd.g=1.01");
    assert!(run.stdout.contains("gains-energy: ") && run.stdout.contains("(channel g)"), "{run:?}");
}

/// What `fit` writes, `check` reads, one report or several; the files of data/ give sound models.
#[test]
fn check_reads_reports() {
    let folder = Folder::new();
    for (data, model) in
        [("satin-red-paint.csv", "lambert + cook-torrance"), ("rough-clay.csv", "oren-nayar")]
    {
        let path = format!("{}/data/{data}", env!("CARGO_MANIFEST_DIR"));
        folder.brdfit(&format!("fit '{path}' -m '{model}' -o report.json -q")).good();
        let run = folder.brdfit("check report.json").good();
        assert!(run.stdout.starts_with("report.json\n"), "{run:?}");
        let json = folder.brdfit("check report.json --json").good().json();
        let report = parse(&folder.read("report.json"));
        assert_eq!(json["model"], report["model"]);
        assert_eq!(json["path"], "report.json");
        for (ours, theirs) in
            json["parameters"].as_array().unwrap().iter().zip(report["parameters"].as_array().unwrap())
        {
            assert_eq!(ours["value"], theirs["value"]);
        }
        assert_eq!(json["channels"].as_array().unwrap().len(), 3);
    }
    folder.write("good.csv", GOOD);
    folder.brdfit("fit good.csv -m lambert -m phong -o several.json -q").good();
    let run = folder.brdfit("check several.json");
    assert!(run.stderr.starts_with(
        "warning: several.json: 2 reports; only the first, the best of the ranking, is used: good.csv, "
    ));
    // A model that a report calls fitted, but that breaks physics.
    let mut report = parse(&folder.read("several.json"))["reports"][0].clone();
    report["parameters"][0]["value"] = json!(1.75);
    folder.write("broken.json", report.to_string());
    assert_eq!(folder.brdfit("check broken.json").code, Some(1));
}

#[test]
fn check_refuses_what_it_cannot_read() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("other.json", "{\"schema\": \"other/1\"}");
    folder.write("torn.json", "{\n\"schema\": ");
    folder.write("empty.json", "{}");
    let cases = [
        refused("nothing to check", "check", &["--help"]),
        refused("both", "check good.csv -m lambert", &["cannot be used with"]),
        refused("values without a model", "check good.csv --set kd=1", &["--set", "-m EXPR"]),
        refused("no such file", "check none.csv", &["none.csv", "cannot read"]),
        refused("no such model", "check -m lambrt", &["lambrt"]),
        refused("no such parameter", "check -m lambert --set ks=1", &["ks"]),
        refused("beyond the bounds", "check -m lambert --set kd=3", &["kd", "0..2"]),
        refused("another schema", "check other.json", &["other.json", "expected a report", "'other/1'"]),
        refused("a torn report", "check torn.json", &["torn.json:2", "expected a report"]),
        refused("no schema", "check empty.json", &["empty.json:1", "schema"]),
    ];
    for case in &cases {
        assert_eq!(complaints(&folder, case), Vec::<String>::new(), "{}: {}", case.what, case.line);
    }
}
