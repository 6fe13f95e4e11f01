//! `brdfit tradeoff`: what it counts, the front, and the files that it writes.

use crate::common::{Folder, parse};
use serde_json::Value;

/// A synthetic GGX dielectric with a little noise.
fn folder() -> Folder {
    let folder = Folder::new();
    folder
        .brdfit(
            "synth -m 'lambert + cook-torrance(f=dielectric)' --directions 3000 --noise 0.01 --seed 5 -o a.csv \
             --set lambert.kd=0.4 cook-torrance.m=0.2 cook-torrance.f0=0.05",
        )
        .good();
    folder
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is no number"))
}

/// Everything but what a clock says.
fn without_times(mut found: Value) -> Value {
    for entry in found["models"].as_array_mut().unwrap() {
        entry["fit_s"] = Value::Null;
        entry["cost"]["time_ns"] = Value::Null;
    }
    for fit in found["samples"]["fits"].as_array_mut().unwrap() {
        fit["fit_s"] = Value::Null;
    }
    found
}

#[test]
fn the_ladder_shows_what_the_data_were_made_of() {
    let folder = folder();
    let done = folder.brdfit("tradeoff a.csv -o a.json --csv a-models.csv --svg a.svg").good();
    let found = parse(&folder.read("a.json"));
    let models = found["models"].as_array().unwrap();
    let of = |name: &str| models.iter().find(|m| m["model"] == name).unwrap_or_else(|| panic!("no {name}"));
    let cbrt = |name: &str| number(&of(name)["errors"]["cbrt"]);

    // The model that made the data has the least error of those with as many parameters, up to what noise lets others gain.
    let truth = "lambert + cook-torrance(d=ggx, g=smith, f=dielectric)";
    for other in
        ["lambert", "lambert + blinn-phong", "lambert + cook-torrance(d=beckmann, g=v-cavity, f=schlick)"]
    {
        assert!(cbrt(truth) < 0.5 * cbrt(other), "{other}: {} for {}", cbrt(other), cbrt(truth));
        assert!(number(&of(truth)["held_out"]["cbrt"]) < number(&of(other)["held_out"]["cbrt"]), "{other}");
    }
    // kd/pi: the model counts no operation but the sum and the product of its one lobe.
    let lambert = &of("lambert")["cost"];
    assert!(number(&lambert["weighted"]) <= 8.0, "{lambert}");
    assert_eq!(lambert["operations"]["transcendental"], 0);
    assert_eq!(number(&of("lambert")["parameters"]), 1.0);
    assert_eq!(number(&of(truth)["parameters"]), 3.0);
    // Beckmann's distribution has an exponential, GGX with Schlick's Fresnel has none.
    let transcendental = |name: &str| number(&of(name)["cost"]["operations"]["transcendental"]);
    assert!(transcendental("lambert + cook-torrance(d=beckmann, g=v-cavity, f=schlick)") >= 1.0);
    assert_eq!(transcendental("lambert + cook-torrance(d=ggx, g=smith, f=schlick)"), 0.0);
    // The exact Fresnel term has a root that Schlick's has not.
    let roots = |name: &str| number(&of(name)["cost"]["operations"]["roots"]);
    assert!(roots(truth) > roots("lambert + cook-torrance(d=ggx, g=smith, f=schlick)"));
    for model in models {
        let off = number(&model["single_precision"]);
        assert!(off < 1e-4, "{}: single precision is {off} off", model["model"]);
        for kind in ["scalar_f64", "scalar_f32", "blocks_f64"] {
            let spread = &model["cost"]["time_ns"][kind];
            let [low, median, high] = ["low", "median", "high"].map(|key| number(&spread[key]));
            assert!(low <= median && median <= high && high > 0.0, "{}: {spread}", model["model"]);
        }
    }

    // The front, once more and slowly.
    let points: Vec<(f64, f64, bool, bool)> = models
        .iter()
        .map(|m| {
            let flag = |key: &str| m[key].as_bool().unwrap();
            (number(&m["cost"]["weighted"]), number(&m["errors"]["cbrt"]), flag("usable"), flag("on_front"))
        })
        .collect();
    let mut reach = f64::INFINITY;
    let mut sorted: Vec<_> = points.into_iter().filter(|p| p.2).collect();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
    for (cost, error, _, on_front) in sorted {
        assert_eq!(on_front, error < reach, "cost {cost}, error {error}");
        reach = reach.min(error);
    }

    // Schlick's Fresnel taken for the exact one without a fit is off by more than 1 %, and fitted hardly at all.
    let schlick = found["approximations"].as_array().unwrap();
    let schlick = schlick.iter().find(|a| a["name"] == "Schlick's Fresnel for the exact one").unwrap();
    assert!(number(&schlick["unfitted"]) > 1e-3, "{schlick}");
    assert!(number(&schlick["weighted"][1]) < number(&schlick["weighted"][0]));

    // More samples never end far above what all reach, and all reach the least.
    let fits = found["samples"]["fits"].as_array().unwrap();
    let errors: Vec<f64> = fits.iter().map(|fit| number(&fit["error"])).collect();
    let last = *errors.last().unwrap();
    assert!(errors.iter().all(|error| *error >= last * (1.0 - 1e-9)), "{errors:?}");
    assert!(errors[errors.len() - 2] < 1.02 * last, "{errors:?}");

    let csv = folder.read("a-models.csv");
    assert_eq!(csv.lines().count(), 1 + models.len());
    let svg = folder.read("a.svg");
    assert!(svg.starts_with("<svg") && svg.trim_end().ends_with("</svg>"));
    // A point for every model, and its mark in the legend.
    let usable = models.iter().filter(|m| m["usable"] == true).count();
    assert_eq!(svg.matches("<circle").count(), 2 * usable);
    assert!(done.stdout.contains("* no model has both a lower cost and a smaller error"));
}

#[test]
fn the_same_bytes_at_any_number_of_threads() {
    let folder = folder();
    let with = |threads: &str| {
        let line = format!("tradeoff a.csv --json -m lambert -m lambert+phong --threads {threads}");
        without_times(folder.brdfit(&line).good().json())
    };
    let one = with("1");
    assert_eq!(one, with("3"));
    assert_eq!(one["models"].as_array().unwrap().len(), 2);
    assert_eq!(one["approximations"].as_array().unwrap().len(), 0);
}

#[test]
fn mistakes_are_one_line() {
    let folder = folder();
    folder.write("one.csv", "theta_i,phi_i,theta_o,phi_o,r\n30,0,30,180,0.5\n");
    for (words, part) in [
        ("tradeoff", "INPUT"),
        ("tradeoff missing.csv", "missing.csv"),
        ("tradeoff a.csv -m lambrt", "found 'lambrt'"),
        ("tradeoff a.csv --samples 0", "at least 1"),
        ("tradeoff a.csv --svg no/where.svg", "no/where.svg"),
    ] {
        let done = folder.brdfit(words);
        assert_eq!(done.code, Some(2), "{words}: {done:?}");
        assert_eq!(done.stderr.lines().count(), 1, "{words}: {done:?}");
        assert!(done.stderr.contains(part), "{words}: {done:?}");
        assert!(done.stdout.is_empty());
    } // Fewer values than parameters: shown, and not usable.
    let done = folder.brdfit("tradeoff one.csv -m lambert+phong");
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stdout.contains("(not usable)"), "{done:?}");
}
