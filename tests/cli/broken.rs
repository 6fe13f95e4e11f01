//! The corpus of broken inputs, tests/corpus: each is refused with exit code 2 and one line that helps, in little
//! time and memory.

#![allow(clippy::print_stdout)]

use crate::common::{Folder, merl_filled, merl_header};
use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The most memory that a refusal may take, kB.
const MOST_MEMORY_KB: u32 = 100_000;
/// A refusal takes milliseconds (docs/inside/fuzzing.md); this is room for a machine that is busy with other things.
const LONGEST: Duration = Duration::from_secs(10);

fn corpus() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/corpus")
}

/// The arguments that make the program read a file of a folder of the corpus.
fn arguments(folder: &str, path: &Path) -> Vec<String> {
    let text = || fs::read_to_string(path).unwrap();
    let path = path.to_str().unwrap().to_owned();
    let words = |words: &[&str]| words.iter().map(|word| (*word).to_owned()).collect::<Vec<_>>();
    match folder {
        "directions" => [words(&["synth", "-m", "lambert", "-o", "-", "--at"]), vec![path]].concat(),
        "drawdown" => vec!["kubelka-munk".to_owned(), path],
        "expression" => [words(&["fit", "good.csv", "-m"]), vec![text()]].concat(),
        "settings" => {
            let settings = text().lines().map(str::to_owned).collect();
            [words(&["fit", "good.csv", "-m", "lambert + cook-torrance"]), settings].concat()
        }
        "report" => vec!["check".to_owned(), path],
        "scene" => [words(&["select", "good.csv", "-m", "lambert", "--scene"]), vec![path]].concat(),
        _ => vec!["info".to_owned(), path],
    }
}

/// Runs the program with little memory, and says what is wrong with its refusal.
fn complaints(
    folder: &Folder,
    what: &str,
    words: &[&str],
    arguments: &[String],
    stdin: Stdio,
) -> Vec<String> {
    let started = Instant::now();
    // On Linux the limit counts all memory that is not shared with others or backed by a file, resident or not.
    let limit =
        if cfg!(target_os = "linux") { format!("ulimit -d {MOST_MEMORY_KB} && ") } else { String::new() };
    let mut child = Command::new("sh")
        .current_dir(folder.path("."))
        .args(["-c", &format!("{limit}exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_brdfit")])
        .args(arguments)
        // Stacks count, too: no more threads than the smallest machine has.
        .env("RAYON_NUM_THREADS", "2")
        .stdin(stdin)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while child.try_wait().unwrap().is_none() && started.elapsed() < LONGEST {
        std::thread::sleep(Duration::from_millis(1));
    }
    let elapsed = started.elapsed();
    // It has ended, or is ended here: what it wrote fits in a pipe.
    let _ = child.kill();
    let output = child.wait_with_output().unwrap();
    let stderr = String::from_utf8(output.stderr).unwrap();
    let mut wrong = Vec::new();
    if output.status.code() != Some(2) {
        wrong.push(format!("{:?} after {elapsed:?}", output.status));
    }
    if !output.stdout.is_empty() {
        wrong.push("something on standard output".to_owned());
    }
    if stderr.matches('\n').count() != 1 || !stderr.ends_with('\n') || !stderr.starts_with("error: ") {
        wrong.push("not one line of an error".to_owned());
    }
    if stderr.chars().any(|c| c.is_control() && c != '\n') || stderr.len() > 1500 {
        wrong.push("a line that nobody can read".to_owned());
    }
    wrong.extend(words.iter().filter(|w| !stderr.contains(**w)).map(|w| format!("'{w}' is not in the line")));
    wrong.iter().map(|w| format!("{what}: {w}\n    {stderr}")).collect()
}

const GOOD: &str = "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.10\n30,0,40,90,0.11\n50,0,10,0,0.12\n";

#[cfg(unix)]
#[test]
fn every_broken_input_is_refused() {
    // Those of scenes are for tests/scene.rs, too.
    let listed =
        ["lines.txt", "scene.txt"].map(|name| fs::read_to_string(corpus().join(name)).unwrap()).concat();
    let lines: Vec<&str> = listed.lines().filter(|line| !line.starts_with('#')).collect();
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    let mut names = BTreeSet::new();
    let mut wrong = Vec::new();
    let mut longest = Duration::ZERO;
    for line in &lines {
        let (name, words) = line.split_once(" | ").unwrap();
        let mut words: Vec<&str> = words.split(" | ").collect();
        let (kind, file) = name.split_once('/').unwrap();
        // What is wrong with a scene may be in a mesh or a map that it names.
        if !["expression", "settings", "scene"].contains(&kind) {
            words.push(file);
        }
        let started = Instant::now();
        wrong.extend(complaints(
            &folder,
            name,
            &words,
            &arguments(kind, &corpus().join(name)),
            Stdio::null(),
        ));
        longest = longest.max(started.elapsed());
        names.insert(name.to_owned());
    }
    println!("{} inputs, the longest took {longest:?}", lines.len());
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));

    // Every file has its line, and every line its own file.
    let files = fs::read_dir(corpus()).unwrap().map(|entry| entry.unwrap().path());
    // Those in dialects are read: tests/formats/dialects.rs.
    let files = files.filter(|path| path.is_dir() && !path.ends_with("dialects"));
    let files = files.flat_map(|folder| fs::read_dir(folder).unwrap()).map(|entry| entry.unwrap().path());
    let relative = |path: PathBuf| path.strip_prefix(corpus()).unwrap().to_str().unwrap().to_owned();
    assert_eq!(files.map(relative).collect::<BTreeSet<_>>(), names);
    assert_eq!(names.len(), lines.len());
    assert_eq!(folder.listing().len(), 1, "nothing is left behind");
}

/// Files that are too large to be kept in the tree: sparse ones of a terabyte, and whole tables.
#[cfg(target_os = "linux")]
#[test]
fn gigantic_inputs_are_refused() {
    let folder = Folder::new();
    let sparse = |name: &str, head: &[u8], bytes: u64| {
        folder.write(name, head);
        fs::File::options().write(true).open(folder.path(name)).unwrap().set_len(bytes).unwrap();
    };
    let header = merl_header([90, 90, 180]);
    let terabyte = 1 << 40;
    let rows = GOOD.as_bytes().to_vec();
    let cornell: Vec<u8> = b"1\n400\n0.1 0 0.2 3 1\n".to_vec();
    let paint = b"background,r\n0.1,0.3\n0.9,0.5\n";
    // Beyond what is looked at to recognise a file.
    let long = |head: &[u8], line: &str| [head, line.repeat(70_000 / line.len()).as_bytes()].concat();
    sparse("terabyte.binary", &header, terabyte);
    sparse("float.binary", &header, 12 + 3 * 4 * 1_458_000 - 4);
    sparse("double.binary", &header, 2 * 34_992_012);
    sparse("terabyte.csv", &long(&rows, "10,0,20,180,0.1\n"), terabyte);
    sparse("terabyte.brdf", &long(&cornell, "0.1 0 0.2 3 1\n"), terabyte);
    sparse("paint.csv", &long(paint, "0.5,0.4\n"), terabyte);
    sparse("nothing.csv", b"", terabyte);
    folder.write("nan.binary", merl_filled(f64::NAN));
    folder.write("minus.binary", merl_filled(-1.0));
    let mut wrong = Vec::new();
    for (kind, name, words) in [
        ("merl", "terabyte.binary", ["byte 34992012", "found 1099511627776 (too long)"]),
        ("merl", "float.binary", ["byte 17496008", "found 17496008 (truncated)"]),
        ("merl", "double.binary", ["byte 34992012", "found 69984024 (too long)"]),
        ("csv", "terabyte.csv", [":4380:", "a zero byte"]),
        ("cornell", "terabyte.brdf", [":5004:", "a zero byte"]),
        ("drawdown", "paint.csv", [":8754:", "a zero byte"]),
        ("directions", "terabyte.csv", [":4380:", "a zero byte"]),
        (
            "csv",
            "nothing.csv",
            ["expected a measurement in one of the formats merl", "found other binary data"],
        ),
        ("merl", "nan.binary", ["no usable sample", "not-finite"]),
        ("merl", "minus.binary", ["no usable sample", "1458000 not-measured"]),
    ] {
        let path = folder.path(name);
        wrong.extend(complaints(&folder, name, &words, &arguments(kind, &path), Stdio::null()));
    }
    // What has no end is not waited for.
    for (what, head, words) in [
        ("an endless table", header.as_slice(), ["34992012 bytes", "found 34992013 or more (too long)"]),
        ("an endless CSV", rows.as_slice(), ["expected", "found other binary data"]),
    ] {
        folder.write("head", head);
        let mut cat = Command::new("cat")
            .current_dir(folder.path("."))
            .args(["head", "/dev/zero"])
            .stdout(Stdio::piped())
            .spawn()
            .unwrap();
        let arguments = ["info", "/dev/stdin"].map(str::to_owned);
        wrong.extend(complaints(&folder, what, &words, &arguments, cat.stdout.take().unwrap().into()));
        cat.wait().unwrap();
    }
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}
