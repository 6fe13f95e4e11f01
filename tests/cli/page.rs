//! `brdfit report`: the web page.

use super::{assert_refused, refused};
use crate::common::Folder;
use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use serde_json::Value;
use sha2::{Digest as _, Sha256};
use std::collections::HashSet;

/// A folder with a matte measurement and its report.
fn matte() -> Folder {
    let folder = Folder::new();
    folder.brdfit("synth -m lambert --set kd=0.5 --directions 100 --noise 0.01 -o a.csv").good();
    folder.brdfit("fit a.csv -m lambert -o one.json -q").good();
    folder
}

/// A folder with a noisy measurement, a report of one model, and one of three.
fn fitted() -> Folder {
    let folder = Folder::new();
    folder
        .brdfit(
            "synth -m 'lambert + cook-torrance' --set kd.r=0.4 kd.g=0.2 kd.b=0.1 m=0.25 f0=0.06 --directions 600 --noise 0.02 --max-theta 85 -o a.csv",
        )
        .good();
    folder.brdfit("fit a.csv -m 'lambert + cook-torrance' -o one.json -q").good();
    folder.brdfit("fit a.csv -m lambert -m oren-nayar -m 'lambert + cook-torrance' -o three.json -q");
    folder
}

/// The text between two marks, after the first place of `start`.
fn between<'t>(text: &'t str, start: &str, end: &str) -> &'t str {
    let rest = text.split_once(start).unwrap_or_else(|| panic!("{start}")).1;
    rest.split_once(end).unwrap().0
}

/// Every value of an attribute.
fn attributes<'t>(page: &'t str, name: &str) -> Vec<&'t str> {
    page.split(&format!(" {name}=\"")).skip(1).map(|rest| rest.split_once('"').unwrap().0).collect()
}

/// What every page keeps: one document that asks for nothing, runs nothing, and whose links lead somewhere.
fn well_formed(page: &str) {
    assert!(page.starts_with("<!DOCTYPE html>") && page.trim_end().ends_with("</html>"));
    assert!(!page.contains("<script") && !page.contains(" style=") && !page.contains(" onload"));
    for address in attributes(page, "href").into_iter().chain(attributes(page, "src")) {
        let local = address.strip_prefix('#').map(|id| page.contains(&format!(" id=\"{id}\"")));
        assert!(local.unwrap_or_else(|| address.starts_with("data:image/png;base64,")), "{address}");
    }
    let ids = attributes(page, "id");
    assert_eq!(ids.iter().collect::<HashSet<_>>().len(), ids.len(), "ids are unique");
    // The browser applies the style sheet only if its hash is the one in the policy.
    let hash = BASE64_STANDARD.encode(Sha256::digest(between(page, "<style>", "</style>")));
    let policy = between(page, "Content-Security-Policy\" content=\"", "\">").replace("&#39;", "'");
    assert!(
        policy.starts_with("default-src 'none'; ") && policy.contains(&format!("'sha256-{hash}'")),
        "{policy}"
    );
}

#[test]
fn a_page_says_what_its_report_says() {
    let folder = fitted();
    folder.brdfit("report one.json -o one.html").good();
    let page = folder.read("one.html");
    well_formed(&page);
    let report: Value = serde_json::from_str(&folder.read("one.json")).unwrap();
    for parameter in report["parameters"].as_array().unwrap() {
        let channel = parameter["channel"].as_str().map_or_else(String::new, |channel| format!(".{channel}"));
        let name = format!(
            "{}.{}{channel}",
            parameter["lobe"].as_str().unwrap(),
            parameter["name"].as_str().unwrap()
        );
        let row = between(&page, &format!("<th scope=\"row\">{name}</th><td>"), "</tr>");
        let shown: f64 = row.split([' ', '<']).next().unwrap().parse().unwrap();
        let value = parameter["value"].as_f64().unwrap();
        assert!((shown - value).abs() <= 0.01 * value.abs(), "{name}: {shown} for {value}");
        let fitted = parameter["status"] == "free";
        assert_eq!(row.contains('\u{b1}'), fitted, "{row}");
    }
    for kind in ["sphere", "map", "lobe", "residuals", "profile", "fresnel", "convergence"] {
        assert!(page.contains(&format!("<figure class=\"{kind}")), "{kind}");
    }
    assert!(page.contains(report["data"]["sha256"].as_str().unwrap()));
    folder.brdfit("report one.json -o again.html").good();
    assert_eq!(page, folder.read("again.html"), "the same bytes again");
}

#[test]
fn models_are_ranked_and_compared() {
    let folder = fitted();
    folder.brdfit("report three.json -o x.html --title 'A paint & more'").good();
    let page = folder.read("x.html");
    well_formed(&page);
    assert!(page.contains("<title>A paint &#38; more</title>"), "{}", between(&page, "<title>", "</title>"));
    let reports: Value = serde_json::from_str(&folder.read("three.json")).unwrap();
    let places: Vec<usize> = reports["ranking"]
        .as_array()
        .unwrap()
        .iter()
        .map(|rank| {
            let index = usize::try_from(rank["index"].as_u64().unwrap()).unwrap();
            let model = reports["reports"][index]["model"].as_str().unwrap();
            page.find(&format!("\">{model}</a></th>")).unwrap_or_else(|| panic!("{model}"))
        })
        .collect();
    assert!(places.is_sorted(), "{places:?}");
    assert_eq!(page.matches("<figure class=\"front").count(), 2, "against parameters and against cost");
    assert_eq!(page.matches("<figure class=\"profile").count(), 2, "lambert has no shape");
    assert_eq!(page.matches("<figure class=\"sphere").count(), 1, "a row for each model");
    for which in ["fit A", "fit B", "fit C", "difference C", "error C"] {
        assert!(page.contains(&format!(">{which}<")), "{which}");
    }
}

#[test]
fn several_materials_have_a_picture_each() {
    let folder = matte();
    folder.brdfit("synth -m lambert --set kd=0.3 --directions 100 --noise 0.01 -o b.csv").good();
    folder.brdfit("fit b.csv -m lambert -o b.json -q").good();
    folder.brdfit("report one.json b.json -o x.html").good();
    let page = folder.read("x.html");
    well_formed(&page);
    assert!(page.contains("<title>2 materials</title>"));
    let list = between(&page, "<ul class=\"materials\">", "</ul>");
    assert_eq!(list.matches("<img ").count(), 2);
    for (id, name) in [("material-1", "a"), ("material-2", "b")] {
        assert!(list.contains(&format!("<a href=\"#{id}\">{name}</a>")), "{list}");
        assert!(page.contains(&format!("<div id=\"{id}\">")), "what opens is inside what is folded");
    }
    // A report given twice is shown twice, with ids of its own.
    folder.brdfit("report b.json b.json -o x.html").good();
    well_formed(&folder.read("x.html"));
}

/// Names come from files, and files from anywhere.
#[test]
fn names_are_shown_and_do_nothing_else() {
    let folder = fitted();
    let rows = folder.read("a.csv");
    // The standard deviations that the file ends with are left out.
    let cut = |line: &str| line.split(',').take(7).collect::<Vec<_>>().join(",");
    let body = rows.lines().skip_while(|line| line.starts_with('#')).skip(1).map(cut);
    let names = ["</script><script>alert(1)</script>", "x'); alert(2)//", "<img src=x onerror=alert(3)>"];
    let header =
        format!("theta_i,phi_i,theta_o,phi_o,{}\n", names.map(|name| format!("\"{name}\"")).join(","));
    let file = "<b onclick=alert(4)>.csv";
    folder.write(file, &(header + &body.collect::<Vec<_>>().join("\n")));
    folder.brdfit(&format!("fit '{file}' -m 'lambert + cook-torrance' -o h.json -q")).good();
    folder.brdfit("report h.json -o x.html").good();
    let page = folder.read("x.html");
    well_formed(&page);
    for harm in ["<img src=x", "<b onclick", "</script>"] {
        assert!(!page.contains(harm), "{harm}");
    }
    assert!(page.contains("alert(1)") && page.contains("onerror=alert(3)"), "the names are shown");
}

/// The page is for others: it names files, not where they are.
#[test]
fn a_measurement_that_moved_is_found_and_folders_stay_private() {
    let folder = matte();
    let whole = folder.path("a.csv").display().to_string();
    let json = folder.read("one.json").replace("\"a.csv\"", &format!("{whole:?}"));
    folder.write("absolute.json", &json);
    folder.brdfit("report absolute.json -o x.html").good();
    let home = folder.path("").display().to_string();
    assert!(!folder.read("x.html").contains(home.trim_end_matches('/')));

    std::fs::create_dir(folder.path("elsewhere")).unwrap();
    std::fs::rename(folder.path("a.csv"), folder.path("elsewhere/a.csv")).unwrap();
    let moved = refused("moved", "report one.json -o y.html", &["one.json", "--measurement"]);
    assert_refused(&folder, &[moved]);
    folder.brdfit("report one.json -o y.html --measurement elsewhere").good();
    std::fs::rename(folder.path("elsewhere/a.csv"), folder.path("elsewhere/c.csv")).unwrap();
    folder.brdfit("report one.json -o y.html --measurement elsewhere/c.csv").good();
    well_formed(&folder.read("y.html"));

    folder.write("a.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,10,180,0.1\n");
    let other =
        refused("another file of the same name", "report one.json -o z.html", &["one.json", "SHA-256"]);
    assert_refused(&folder, &[other]);
}

#[test]
fn mistakes_are_named() {
    let folder = matte();
    let cases = [
        ("no report", "report a.csv -o x.html", "a.csv: expected a report of brdfit"),
        ("another ending", "report one.json -o x.json", "expected a name that ends in .html"),
        ("no ending", "report one.json -o x", "expected a name that ends in .html"),
        ("no such report", "report none.json -o x.html", "none.json"),
        ("no such measurement", "report one.json -o x.html --measurement none.csv", "none.csv"),
        ("no such folder", "report one.json -o nowhere/x.html", "nowhere/x.html"),
        ("a file called -", "plot one.json --kind lobe -o x.svg --data -", "/dev/stdout"),
        ("no output", "report one.json", "--output"),
        ("no input", "report -o x.html", "REPORT"),
    ];
    let cases: Vec<_> = cases.iter().map(|(what, line, words)| refused(what, line, &[words])).collect();
    assert_refused(&folder, &cases);
}
