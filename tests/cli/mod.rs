//! The command line as a user or a script sees it: arguments and files in, exit code, standard output,
//! standard error and files out. The contract is docs/inside/design.md, sections 5 and 6.

mod broken;
mod check;
mod convert;
mod evaluate;
mod export;
mod fit;
mod general;
mod info;
mod input;
mod kubelka_munk;
mod missing;
mod models;
mod page;
mod plot;
mod reading;
mod render;
mod report;
mod select;
mod synth;
mod terminal;
mod tradeoff;

use crate::common::{Folder, Run};

/// A small valid measurement of three channels.
const GOOD: &str = "theta_i,phi_i,theta_o,phi_o,r,g,b
10,0,20,180,0.10,0.20,0.30
30,0,40,90,0.11,0.21,0.31
50,0,10,0,0.12,0.22,0.32
60,0,60,170,0.13,0.23,0.33
";

/// One run that must be refused, and the words that its one line must hold.
struct Refused {
    what: String,
    line: String,
    words: Vec<String>,
}

fn refused(what: &str, line: &str, words: &[&str]) -> Refused {
    Refused {
        what: what.to_owned(),
        line: line.to_owned(),
        words: words.iter().map(|w| (*w).to_owned()).collect(),
    }
}

/// What is wrong with a run that should have been refused: exit code 2, one line on standard error that
/// holds `words`, nothing on standard output, and every file as it was.
fn complaints(folder: &Folder, case: &Refused) -> Vec<String> {
    let before = folder.listing();
    let run = folder.brdfit(&case.line);
    let after = folder.listing();
    let mut wrong = Vec::new();
    if run.code != Some(2) {
        wrong.push(format!("exit code {:?}", run.code));
    }
    if !run.stdout.is_empty() {
        wrong.push("something on stdout".to_owned());
    }
    if run.stderr.matches('\n').count() != 1 || !run.stderr.ends_with('\n') || run.stderr.len() < 10 {
        wrong.push("not one line on stderr".to_owned());
    }
    if run.stderr.chars().any(|c| c.is_control() && c != '\n') {
        wrong.push("control characters on stderr".to_owned());
    }
    if run.stderr.contains("panicked") {
        wrong.push("a panic".to_owned());
    }
    for word in case.words.iter().filter(|word| !run.stderr.contains(word.as_str())) {
        wrong.push(format!("'{word}' is not in the line"));
    }
    for path in after.keys().filter(|path| !before.contains_key(*path)) {
        wrong.push(format!("left behind: {}", path.display()));
    }
    if before.iter().any(|(path, content)| after.get(path) != Some(content)) {
        wrong.push("a file was changed or removed".to_owned());
    }
    wrong.iter().map(|w| format!("{} (brdfit {}): {w}\n    {}", case.what, case.line, run.stderr)).collect()
}

fn assert_refused(folder: &Folder, cases: &[Refused]) {
    let wrong: Vec<String> = cases.iter().flat_map(|case| complaints(folder, case)).collect();
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

/// A run that must succeed; what is said on standard error is notes and warnings.
fn with_notes(folder: &Folder, line: &str) -> Run {
    let run = folder.brdfit(line);
    assert_eq!(run.code, Some(0), "{run:?}");
    assert!(
        run.stderr.lines().all(|line| line.starts_with("note: ") || line.starts_with("warning: ")),
        "{run:?}"
    );
    run
}

/// A paint in three channels, measured without noise as `paint.csv`, and its fit, `paint.json`.
fn paint(folder: &Folder) {
    let model = "lambert + cook-torrance";
    let set = "kd.r=0.4 kd.g=0.1 kd.b=0.05 m=0.2 f0=0.05";
    folder.brdfit(&format!("synth -m '{model}' --set {set} --directions 400 --seed 1 -o paint.csv")).good();
    folder.brdfit(&format!("fit paint.csv -m '{model}' -o paint.json -q")).good();
}

const HEADER: &str = "theta_i,phi_i,theta_o,phi_o,r";

/// A folder with noisy synthetic measurements `a.csv`, `b.csv` and a noise-free one `clean.csv`.
fn laboratory() -> Folder {
    let folder = Folder::new();
    let truth = "--set kd.r=0.5 kd.g=0.3 kd.b=0.1 f0=0.05 m=0.3";
    for (name, noise) in
        [("a", "--noise 0.02 --seed 1"), ("b", "--noise 0.05 --seed 2"), ("clean", "--seed 3")]
    {
        folder
            .brdfit(&format!(
                "synth -m 'lambert + cook-torrance' {truth} --directions 200 {noise} -o {name}.csv"
            ))
            .good();
    }
    folder
}

/// The text of a report without its times.
fn timeless(text: &str) -> String {
    let mut rest = text;
    let mut kept = String::new();
    while let Some((before, after)) = rest.split_once("\"time_s\": {") {
        kept += before;
        rest = after.split_once('}').expect("the end of time_s").1;
    }
    kept + rest
}
