//! The command line as a user or a script sees it: arguments and files in, exit code, standard output,
//! standard error and files out. The contract is docs/design.md, sections 5 and 6.

#![cfg(feature = "cli")]
// A broken expectation fails its test, which is what a panic is for here; indices are checked by tests.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::indexing_slicing)]
#![allow(clippy::print_stdout, clippy::print_stderr)]

mod common;

use approx::{assert_abs_diff_eq, assert_relative_eq};
use common::{Folder, Run, merl_filled, merl_header, parse, shared, typed};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::fs;

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

/// A file that no subcommand may accept: `fit`, `evaluate` and `info` must all name it, and say what was
/// expected and what was found in `words`.
fn assert_bad_files(files: &[(&str, &str, &[u8], &[&str])]) {
    let mut wrong = Vec::new();
    for (what, name, content, words) in files {
        let folder = Folder::new();
        folder.write(name, content);
        folder.write("precious.json", "written before");
        for line in [
            format!("fit {name} -m lambert -o precious.json"),
            format!("fit {name} -m lambert --json -o new.json"),
            format!("evaluate {name} -m lambert --set kd=0.5 -o new.json"),
            format!("info {name}"),
        ] {
            let mut case = refused(what, &line, words);
            case.words.push((*name).to_owned());
            wrong.extend(complaints(&folder, &case));
        }
    }
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

const HEADER: &str = "theta_i,phi_i,theta_o,phi_o,r";

#[test]
fn bad_csv_files_are_refused() {
    let with = |rows: &str| format!("{HEADER}\n10,0,20,180,0.1\n{rows}\n").into_bytes();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("empty file", b"".to_vec(), &["expected", "empty file"]),
        ("blank lines only", b" \n\n\t\n".to_vec(), &["expected", "found"]),
        ("comments only", b"# nothing\n# at all\n".to_vec(), &["expected", "found"]),
        ("lone header", format!("{HEADER}\n").into(), &["no usable sample"]),
        ("lone header, no line end", HEADER.into(), &["no usable sample"]),
        ("text in a number", with("10,0,20,180,abc"), &[":3:", "number", " r,", "'abc'"]),
        ("text in an angle", with("10,zero,20,180,0.1"), &[":3:", "number", "phi_i", "'zero'"]),
        ("NaN", with("10,0,20,180,NaN"), &[":3:", "finite", " r,", "'NaN'"]),
        ("nan in an angle", with("nan,0,20,180,0.1"), &[":3:", "finite", "theta_i", "'nan'"]),
        ("infinity", with("10,0,20,180,inf"), &[":3:", "finite", "'inf'"]),
        ("minus infinity", with("10,0,20,180,-infinity"), &[":3:", "finite", "'-infinity'"]),
        ("beyond the largest number", with("10,0,20,180,1e999"), &[":3:", "finite", "'1e999'"]),
        ("empty field", with("10,0,20,180,"), &[":3:", "number", "''"]),
        ("hexadecimal number", with("0x10,0,20,180,0.1"), &[":3:", "number", "'0x10'"]),
        ("two points in a number", with("10,0,20,180,0.1.2"), &[":3:", "number", "'0.1.2'"]),
        ("a unit behind a number", with("10deg,0,20,180,0.1"), &[":3:", "number", "'10deg'"]),
        ("decimal commas", with("10,0,0,0,20,0,180,0,0,1"), &[":3:", "5 fields", "found 10"]),
        (
            "semicolons and decimal commas",
            b"theta_i;phi_i;theta_o;phi_o;r\n10,0;0,0;20,0;180,0;0,1\n".to_vec(),
            &[":1:", "column 'theta_i'", "theta_i;phi_i"],
        ),
        (
            "tabs",
            b"theta_i\tphi_i\ttheta_o\tphi_o\tr\n10\t0\t20\t180\t0.1\n".to_vec(),
            &[":1:", "column 'theta_i'"],
        ),
        ("short row", with("10,0,20,180"), &[":3:", "5 fields", "found 4"]),
        ("long row", with("10,0,20,180,0.1,0.2"), &[":3:", "5 fields", "found 6"]),
        ("last row cut off", with("10,0,2"), &[":3:", "5 fields", "found 3"]),
        (
            "missing angle",
            b"theta_i,phi_i,phi_o,r\n10,0,180,0.1\n".to_vec(),
            &[":1:", "column 'theta_o'", "theta_i,phi_i,phi_o,r"],
        ),
        (
            "angles with other names",
            b"theta_in,phi_in,theta_out,phi_out,r\n10,0,20,180,0.1\n".to_vec(),
            &[":1:", "column 'theta_i'", "theta_in"],
        ),
        (
            "no values",
            b"theta_i,phi_i,theta_o,phi_o\n10,0,20,180\n".to_vec(),
            &[":1:", "expected", "values", "found"],
        ),
        ("no header", b"10,0,20,180,0.1\n11,0,20,180,0.1\n".to_vec(), &["expected", "header", "found"]),
        (
            "angle twice",
            b"theta_i,phi_i,theta_i,theta_o,phi_o,r\n1,2,3,4,5,6\n".to_vec(),
            &[":1:", "'theta_i' twice"],
        ),
        (
            "channel twice",
            b"theta_i,phi_i,theta_o,phi_o,r,r\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "'r' twice"],
        ),
        (
            "wavelength twice",
            b"theta_i,phi_i,theta_o,phi_o,550,550nm\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "'550nm' twice"],
        ),
        (
            "column without a name",
            b"theta_i,phi_i,theta_o,phi_o,,r\n10,0,20,180,0.1,0.2\n".to_vec(),
            &[":1:", "name for every column", "column 5"],
        ),
        (
            "trailing comma in the header",
            b"theta_i,phi_i,theta_o,phi_o,r,\n10,0,20,180,0.1,\n".to_vec(),
            &[":1:", "name for every column", "column 6"],
        ),
        (
            "sigma of a channel that is not there",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma_g\n10,0,20,180,0.1,0.01\n".to_vec(),
            &[":1:", "column 'g'", "'sigma_g'", "found"],
        ),
        (
            "sigma alone",
            b"theta_i,phi_i,theta_o,phi_o,sigma\n10,0,20,180,0.1\n".to_vec(),
            &[":1:", "values", "found"],
        ),
        (
            "negative sigma",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma\n10,0,20,180,0.1,-0.01\n".to_vec(),
            &[":2:", "sigma of r", "0 or more", "'-0.01'"],
        ),
        (
            "NaN sigma",
            b"theta_i,phi_i,theta_o,phi_o,r,sigma_r\n10,0,20,180,0.1,NaN\n".to_vec(),
            &[":2:", "finite number", "sigma of r", "'NaN'"],
        ),
        ("theta_i beyond 90", with("95,0,20,180,0.1"), &[":3:", "theta_i", "90 degrees", "found 95"]),
        ("theta_o beyond 90", with("10,0,90.1,180,0.1"), &[":3:", "theta_o", "90 degrees", "found 90.1"]),
        ("negative theta beyond 90", with("10,0,-91,180,0.1"), &[":3:", "theta_o", "found -91"]),
        ("theta of 1e308", with("1e308,0,20,180,0.1"), &[":3:", "theta_i", "90 degrees", "found"]),
        (
            "bad UTF-8",
            [b"theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.1\n10,0,20,180,".as_slice(), b"\xff\xfe\n"]
                .concat(),
            &[":3:", "UTF-8", "found"],
        ),
        (
            "Latin-1 in a comment",
            b"# R\xe9flectance\ntheta_i,phi_i,theta_o,phi_o,r\n1,2,3,4,5\n".to_vec(),
            &[":1:", "UTF-8", "found"],
        ),
        ("UTF-16", [0xff, 0xfe, b't', 0, b'h', 0, b'e', 0].to_vec(), &["expected", "found"]),
        ("zero byte", with("10,0,20,180,0\0.1"), &["expected", "found"]),
        ("binary garbage", (0..=255).cycle().take(5000).collect(), &["expected", "MERL", "CSV", "found"]),
        ("prose", b"Dear colleague, here is the data.\n".to_vec(), &["expected", "found"]),
        ("JSON", b"{\"theta_i\": [1, 2, 3]}\n".to_vec(), &["expected", "found"]),
        ("unclosed quote", with("\"10,0,20,180,0.1"), &[":3:", "expected", "found"]),
        (
            "line break in a quoted name",
            b"theta_i,phi_i,theta_o,phi_o,\"re\nd\"\n1,2,3,4,x\n".to_vec(),
            &["names without control characters", "'re d'"],
        ),
        (
            "escape sequence in a name",
            b"theta_i,phi_i,theta_o,phi_o,\x1b[31mred\n1,2,3,4,x\n".to_vec(),
            &[":1:", "names without control characters", "[31mred"],
        ),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> =
        cases.iter().map(|(what, content, words)| (*what, "bad.csv", content.as_slice(), *words)).collect();
    assert_bad_files(&cases);
}

#[test]
fn bad_cornell_files_are_refused() {
    let cases: Vec<(&str, &str, &[&str])> = vec![
        ("empty", "", &["expected", "empty file"]),
        ("count of zero", "0\n400\n0 0 0 0 1\n", &[":1:", "number of wavelengths", "'0'"]),
        ("negative count", "-3\n400 500 600\n0 0 0 0 1 2 3\n", &[":1:", "number of wavelengths", "'-3'"]),
        ("huge count", "4000000000\n400\n0 0 0 0 1\n", &[":1:", "number of wavelengths", "'4000000000'"]),
        ("count of 2^63 - 1", "9223372036854775807\n400\n", &[":1:", "number of wavelengths"]),
        (
            "count beyond 64 bits",
            "99999999999999999999\n400\n0 0 0 0 1\n",
            &["expected", "found '99999999999999999999'"],
        ),
        ("count that is no integer", "1.5\n400\n0 0 0 0 1\n", &["expected", "found '1.5'"]),
        ("count too large", "# c\n3\n400 500\n", &[":3:", "3 wavelengths", "found 2"]),
        ("count larger than the list", "3\n400 500\n0.1 0 0.2 0 1 2\n", &["expected", "found"]),
        ("count smaller than the list", "2\n400 500 600\n0.1 0 0.2 0 1 2\n", &[":2:", "expected", "found"]),
        (
            "sample on the line of the wavelengths",
            "1\n400 0.1 0 0.2 0 1\n0.1 0 0.2 0 1\n",
            &[":2:", "expected", "found"],
        ),
        ("count alone", "2\n", &[":1:", "2 wavelengths", "found 0"]),
        ("no samples", "2\n400 500\n", &["no usable sample"]),
        ("text as a wavelength", "2\n400 blue\n", &[":2:", "wavelength", "'blue'"]),
        ("NaN as a wavelength", "2\n400 NaN\n", &[":2:", "wavelength", "'NaN'"]),
        ("negative wavelength", "2\n400 -500\n", &[":2:", "wavelength", "'-500'"]),
        ("wavelength twice", "2\n400 400.0\n", &[":2:", "wavelength", "'400.0'"]),
        (
            "truncated row",
            "2\n400 500\n0.1 0 0.2 0 1 2\n0.1 0 0.2 0 1\n",
            &[":4:", "4 angles and 2 values", "5"],
        ),
        ("long row", "2\n400 500\n0.1 0 0.2 0 1 2 3\n", &[":3:", "4 angles and 2 values", "7"]),
        ("angles alone", "2\n400 500\n0.1 0 0.2\n", &[":3:", "4 angles and 2 values", "3"]),
        ("text in a value", "1\n400\n0.1 0 0.2 0 x\n", &[":3:", "number", "400", "'x'"]),
        ("NaN in a value", "1\n400\n0.1 0 0.2 0 NaN\n", &[":3:", "finite", "400", "'NaN'"]),
        ("text in an angle", "1\n400\n0.1 north 0.2 0 1\n", &[":3:", "number", "phi_i", "'north'"]),
        ("decimal commas", "1\n400\n0,1 0 0,2 0 1,5\n", &[":3:", "number", "'0,1'"]),
        ("degrees in place of radians", "1\n400\n50 0 20 0 1\n", &[":3:", "theta_i", "90 degrees", "found"]),
        ("theta_o below the horizon", "1\n400\n0.1 0 1.6 0 1\n", &[":3:", "theta_o", "found 91.67"]),
        ("theta_o of 1e308", "1\n400\n0.1 0 1e308 0 1\n", &[":3:", "theta_o", "90 degrees"]),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> =
        cases.iter().map(|(what, content, words)| (*what, "bad.brdf", content.as_bytes(), *words)).collect();
    assert_bad_files(&cases);
}

#[test]
fn bad_merl_files_are_refused() {
    // The most that a header can claim: none of it may be allocated or multiplied.
    let huge = merl_header([i32::MAX; 3]);
    let cut = |bytes: usize| -> Vec<u8> {
        let mut table = merl_header([90, 90, 180]);
        table.resize(bytes, 0);
        table
    };
    let whole = 12 + 3 * 8 * common::CELLS;
    assert_eq!(whole, 34_992_012); // the size of the files of the MERL database
    let dimensions = |d: [i32; 3]| [merl_header(d), vec![0; 1000]].concat();
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("empty", vec![], &["expected", "empty file"]),
        ("one byte", vec![90], &["byte 0", "90 x 90 x 180", "found"]),
        ("eleven bytes", cut(11), &["byte 0", "90 x 90 x 180", "11 bytes"]),
        ("header alone", cut(12), &["byte 12", "34992012 bytes", "found 12"]),
        ("a few cells", cut(1000), &["byte 1000", "34992012 bytes", "found 1000"]),
        ("one byte short", cut(whole - 1), &["byte 34992011", "34992012 bytes", "found 34992011"]),
        ("one byte long", cut(whole + 1), &["byte 34992012", "34992012 bytes", "found 34992013"]),
        ("wrong dimensions", dimensions([90, 90, 360]), &["byte 0", "90 x 90 x 180", "90 x 90 x 360"]),
        ("dimensions in another order", dimensions([180, 90, 90]), &["byte 0", "found 180 x 90 x 90"]),
        ("zero dimensions", dimensions([0, 0, 0]), &["byte 0", "found 0 x 0 x 0"]),
        ("negative dimensions", dimensions([-90, -90, -180]), &["byte 0", "found -90 x -90 x -180"]),
        ("huge dimensions", huge, &["byte 0", "90 x 90 x 180", "found 2147483647 x"]),
        ("dimensions whose product overflows to 0", dimensions([1 << 30, 4, 16]), &["byte 0", "found"]),
        (
            "big-endian",
            [90_i32, 90, 180].map(i32::to_be_bytes).concat(),
            &["byte 0", "expected the dimensions 90 x 90 x 180", "found"],
        ),
        ("text", GOOD.replace("theta", "angle").into(), &["expected", "found"]),
        ("nothing measured", merl_filled(-1.0), &["no usable sample", "1458000 not-measured"]),
        ("nothing finite", merl_filled(f64::NAN), &["no usable sample", "not-finite"]),
    ];
    let cases: Vec<(&str, &str, &[u8], &[&str])> = cases
        .iter()
        .map(|(what, content, words)| (*what, "bad.binary", content.as_slice(), *words))
        .collect();
    assert_bad_files(&cases);
}

/// Headers may claim anything: with 1 GB of address space the claims must still be refused as such.
#[cfg(unix)]
#[test]
fn headers_do_not_decide_about_memory() {
    let folder = Folder::new();
    folder.write("huge.binary", merl_header([i32::MAX; 3]));
    folder.write("huge.brdf", "9223372036854775807\n400\n");
    folder.write("many.brdf", "99999\n400\n0 0 0 0 1\n");
    for name in ["huge.binary", "huge.brdf", "many.brdf"] {
        let output = assert_cmd::Command::new("sh")
            .current_dir(folder.path("."))
            .args(["-c", "ulimit -v 1000000 && exec \"$0\" info \"$1\"", env!("CARGO_BIN_EXE_brdfit"), name])
            .output()
            .unwrap();
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
        assert!(stderr.contains(name) && stderr.contains("expected"), "{stderr}");
    }
}

#[test]
fn bad_paths_are_refused() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("folder/inside.txt", "x");
    folder.write("a-file", "x");
    folder.write("scene.json", include_str!("../data/scenes/studio-sphere.json"));
    assert_refused(
        &folder,
        &[
            refused("missing input", "fit nothing.csv -m lambert", &["nothing.csv", "No such file"]),
            refused("missing input", "info nothing.csv", &["nothing.csv", "No such file"]),
            refused("missing input", "evaluate no/thing.csv -m lambert", &["no/thing.csv", "No such file"]),
            refused("a folder as input", "fit folder -m lambert", &["folder", "cannot read", "directory"]),
            refused("a folder as input", "info folder", &["folder", "cannot read", "directory"]),
            refused("-o in a missing folder", "fit good.csv -m lambert -o no/r.json", &["no/r.json"]),
            refused("-o below a file", "fit good.csv -m lambert -o a-file/r.json", &["a-file/r.json"]),
            refused("a folder below a file", "fit good.csv -m lambert -o a-file/", &["a-file"]),
            refused(
                "evaluate -o in a missing folder",
                "evaluate good.csv -m lambert -o no/r.json",
                &["no/r"],
            ),
            refused("evaluate -o on a folder", "evaluate good.csv -m lambert -o folder", &["folder", "file"]),
            refused(
                "synth -o in a missing folder",
                "synth -m lambert --directions 3 -o no/f.csv",
                &["no/f.csv"],
            ),
            refused("synth -o on a folder", "synth -m lambert --directions 3 -o folder", &["folder", "file"]),
            refused(
                "synth --at a missing file",
                "synth -m lambert --at no.csv -o f.csv",
                &["no.csv", "No such"],
            ),
            refused(
                "synth --at a folder",
                "synth -m lambert --at folder -o f.csv",
                &["folder", "cannot read"],
            ),
            refused(
                "-o on the input",
                "tradeoff good.csv -o good.csv",
                &["good.csv", "another file than the input"],
            ),
            refused(
                "-o on the input",
                "select good.csv --scene scene.json -o ./good.csv",
                &["good.csv", "another file than the input"],
            ),
            refused(
                "-o on the scene",
                "select good.csv --scene scene.json -o scene.json",
                &["scene.json", "another file than the input"],
            ),
            refused(
                "--csv on the input",
                "tradeoff good.csv --csv good.csv",
                &["--csv good.csv", "another file than the input"],
            ),
            refused(
                "--svg on the input",
                "tradeoff good.csv --svg ./good.csv",
                &["--svg", "good.csv", "another file than the input"],
            ),
            refused(
                "-o on the directions",
                "synth -m lambert --at good.csv -o good.csv",
                &["-o good.csv", "another file than the input"],
            ),
            // "Nothing is written": not even the folder that reports would have gone to.
            refused("missing input, -o new/", "fit nothing.csv -m lambert -o new/", &["nothing.csv"]),
            refused("unknown parameter, -o new/", "fit good.csv -m lambert --fix zz=1 -o new/", &["zz"]),
        ],
    );
}

#[test]
fn mistyped_commands_are_refused() {
    let folder = Folder::new();
    folder.write("good.csv", GOOD);
    folder.write("one.csv", GOOD.replace(",g,b", ",sigma_r,b"));
    folder.write("zero-sigma.csv", "theta_i,phi_i,theta_o,phi_o,r,sigma\n10,0,20,180,0.1,0\n");
    folder.write("angles.csv", "theta_i,phi_i,theta_o,phi_o\n10,0,20,180\n");
    folder.write("header.csv", "theta_i,phi_i,theta_o,phi_o\n");
    folder.write("steep.csv", "theta_i,phi_i,theta_o,phi_o,r\n85,0,20,180,0.1\n10,0,81,180,0.1\n");
    let fit = |what: &str, rest: &str, words: &[&str]| refused(what, &format!("fit good.csv {rest}"), words);
    let lambert = |what: &str, rest: &str, words: &[&str]| fit(what, &format!("-m lambert {rest}"), words);
    let ct = |what: &str, rest: &str, words: &[&str]| {
        fit(what, &format!("-m 'lambert + cook-torrance' {rest}"), words)
    };
    let evaluate = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("evaluate good.csv -m lambert {rest}"), words)
    };
    let synth = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("synth -m lambert {rest} -o made.csv"), words)
    };
    let heightfield = |what: &str, rest: &str, words: &[&str]| {
        refused(what, &format!("synth --from-heightfield {rest} -o made.csv"), words)
    };
    let cases = [
        refused("no arguments", "", &["subcommand"]),
        refused("unknown subcommand", "fti good.csv", &["'fti'", "fit"]),
        refused("unknown option", "--verbosity", &["--verbosity"]),
        refused("fit of nothing", "fit", &["INPUT"]),
        refused("fit without an input", "fit -m lambert", &["INPUT"]),
        fit("fit without a model", "", &["model"]),
        fit("-m without its value", "-m", &["--model"]),
        lambert("mistyped option", "--metrc l2", &["--metrc", "--metric"]),
        lambert("mistyped short option", "-x", &["-x"]),
        lambert("value for a switch", "--json=yes", &["--json", "yes"]),
        lambert("option of another subcommand", "--set kd=0.5", &["--set"]),
        // models
        fit("empty model", "-m ''", &["model", "expected", "found"]),
        fit("unknown model", "-m lambrt", &["'lambrt'", "lambert", "cook-torrance", "oren-nayar"]),
        fit("known and unknown model", "-m 'lambert + phongg'", &["'phongg'"]),
        fit("upper case", "-m Lambert", &["'Lambert'", "lambert"]),
        fit("term missing", "-m 'lambert +'", &["model", "expected"]),
        fit("unknown distribution", "-m 'cook-torrance(d=ggy)'", &["'ggy'", "ggx", "beckmann"]),
        fit("unknown option of a model", "-m 'cook-torrance(q=ggx)'", &["'q'", "d"]),
        fit("option of a model without any", "-m 'lambert(d=ggx)'", &["lambert", "option"]),
        fit("option twice", "-m 'cook-torrance(d=ggx, d=ggx)'", &["d", "twice"]),
        fit("option without a value", "-m 'cook-torrance(d)'", &["d=ggx", "'cook-torrance(d)'"]),
        fit("open parenthesis", "-m 'cook-torrance(d=ggx'", &["')'"]),
        fit("text behind the parenthesis", "-m 'cook-torrance(d=ggx)x'", &["')'"]),
        fit("variant of oren-nayar", "-m 'oren-nayar(variant=half)'", &["'half'", "full"]),
        refused("one good and one unknown model", "fit good.csv -m lambert -m lambrt", &["'lambrt'"]),
        refused("evaluate an unknown model", "evaluate good.csv -m lambrt", &["'lambrt'"]),
        refused("models of no model", "models lambrt", &["'lambrt'", "lambert"]),
        refused("synth of no model", "synth -m lambrt --directions 3 -o f.csv", &["'lambrt'"]),
        // values of options
        lambert("unknown metric", "--metric l3", &["'l3'", "l2", "log", "cbrt"]),
        lambert("metric that is only reported", "--metric relative", &["'relative'"]),
        lambert("unknown weights", "--weights heavy", &["'heavy'", "uniform", "sigma"]),
        lambert("sigma without sigma", "--weights sigma", &["good.csv", "sigma"]),
        lambert("solid angles of scattered data", "--weights solid-angle", &["good.csv", "solid-angle"]),
        refused(
            "sigma of zero",
            "fit zero-sigma.csv -m lambert --weights sigma",
            &["zero-sigma.csv", "positive", "found 0"],
        ),
        refused("sigma of some channels", "fit one.csv -m lambert --weights sigma", &["one.csv", "sigma"]),
        lambert("max-theta of 0", "--max-theta 0", &["--max-theta", "found 0"]),
        lambert("max-theta beyond 90", "--max-theta 91", &["--max-theta", "90", "found 91"]),
        lambert("negative max-theta", "--max-theta -5", &["--max-theta", "found -5"]),
        lambert("max-theta NaN", "--max-theta NaN", &["--max-theta", "NaN"]),
        lambert("max-theta infinite", "--max-theta inf", &["--max-theta", "inf"]),
        lambert("max-theta in words", "--max-theta steep", &["--max-theta", "'steep'"]),
        lambert("max-theta with a unit", "--max-theta 80deg", &["--max-theta", "'80deg'"]),
        lambert("samples 0", "--samples 0", &["--samples", "'0'"]),
        lambert("negative samples", "--samples -5", &["--samples", "-5"]),
        lambert("broken samples", "--samples 1.5", &["--samples", "'1.5'"]),
        lambert("samples in words", "--samples most", &["--samples", "'most'", "all"]),
        lambert("threads 0", "--threads 0", &["--threads", "0"]),
        lambert("negative threads", "--threads -1", &["--threads", "-1"]),
        lambert("threads in words", "--threads all", &["--threads", "'all'"]),
        lambert("negative timeout", "--timeout -1", &["--timeout", "-1"]),
        lambert("timeout 0", "--timeout 0", &["--timeout", "0"]),
        lambert("timeout NaN", "--timeout nan", &["--timeout"]),
        lambert("timeout infinite", "--timeout inf", &["--timeout", "inf"]),
        lambert("timeout in words", "--timeout soon", &["--timeout", "'soon'"]),
        lambert("negative seed", "--seed -1", &["--seed", "-1"]),
        lambert("broken seed", "--seed 1.5", &["--seed", "'1.5'"]),
        lambert("unknown format", "--format xyz", &["--format", "'xyz'", "merl", "cornell", "csv"]),
        lambert("unknown bins", "--merl-bins corner", &["--merl-bins", "'corner'", "center", "edge"]),
        lambert("CSV read as Cornell", "--format cornell", &["good.csv:1:", "number of wavelengths"]),
        lambert("CSV read as MERL", "--format merl", &["good.csv", "90 x 90 x 180"]),
        refused(
            "nothing within 80 degrees",
            "fit steep.csv -m lambert",
            &["steep.csv", "2 beyond-max-theta"],
        ),
        lambert("nothing within 5 degrees", "--max-theta 5", &["no usable sample", "4 beyond-max-theta"]),
        // parameters
        lambert("unknown parameter", "--fix zz=1", &["zz", "lambert.kd"]),
        lambert("unknown parameter to free", "--free zz", &["zz", "lambert.kd"]),
        lambert("unknown parameter to start", "--init zz=1", &["zz"]),
        lambert("unknown parameter to bound", "--bounds zz=0..1", &["zz"]),
        lambert("unknown parameter to tie", "--tie zz=kd", &["zz"]),
        lambert("unknown parameter to tie to", "--tie kd.r=zz", &["zz"]),
        lambert("unknown parameter per channel", "--per-channel zz", &["zz"]),
        lambert("unknown parameter to share", "--shared zz", &["zz"]),
        lambert("unknown channel", "--fix kd.x=0.5", &["kd.x", "'x'", "r, g, b"]),
        lambert("unknown channel in brackets", "--fix kd[550]=0.5", &["kd[550]", "'550'", "r, g, b"]),
        lambert("unknown lobe", "--fix lambrt.kd=0.5", &["'lambrt'", "lambert"]),
        lambert("lobe that is not repeated", "--fix lambert#2.kd=0.5", &["'lambert#2'"]),
        ct("channel of a shared parameter", "--fix m.r=0.2", &["m", "shared"]),
        fit(
            "parameter of two lobes",
            "-m 'cook-torrance + cook-torrance' --fix m=0.2",
            &["m", "cook-torrance.m", "cook-torrance#2.m"],
        ),
        lambert("bracket left open", "--fix kd[r=0.5", &["kd[r"]),
        lambert("four parts of a name", "--fix a.b.c.d=0.5", &["a.b.c.d"]),
        lambert("no name", "--fix =1", &["expected a name"]),
        lambert("no value", "--fix kd", &["--fix", "P=V", "'kd'"]),
        lambert("empty value", "--fix kd=", &["--fix", "P=V", "'kd='"]),
        lambert("value in words", "--fix kd=half", &["--fix", "'kd=half'"]),
        lambert("value NaN", "--fix kd=NaN", &["--fix", "'kd=NaN'"]),
        lambert("value infinite", "--fix kd=inf", &["--fix", "'kd=inf'"]),
        lambert("decimal comma", "--fix kd=0,5", &["--fix", "'kd=0,5'"]),
        lambert("fixed above its bounds", "--fix kd=5", &["kd", "0..2", "found 5"]),
        lambert("fixed below its bounds", "--fix kd=-0.1", &["kd", "0..2", "found -0.1"]),
        lambert("fixed outside given bounds", "--fix kd=0.5 --bounds kd=0.6..1", &["kd", "0.6..1", "0.5"]),
        ct("started above its bounds", "--init m=2", &["m", "0.0001..1", "found 2"]),
        ct("started at zero roughness", "--init m=0", &["m", "0.0001..1", "found 0"]),
        lambert("bounds without a range", "--bounds kd", &["--bounds", "P=LO..HI", "'kd'"]),
        lambert("bounds of one number", "--bounds kd=1", &["--bounds", "P=LO..HI", "'kd=1'"]),
        lambert("no upper bound", "--bounds kd=0..", &["--bounds", "P=LO..HI", "'kd=0..'"]),
        lambert("no lower bound", "--bounds kd=..1", &["--bounds", "P=LO..HI", "'kd=..1'"]),
        lambert("bounds in words", "--bounds kd=low..high", &["--bounds", "'kd=low..high'"]),
        lambert("bounds NaN", "--bounds kd=nan..1", &["--bounds", "'kd=nan..1'"]),
        lambert("bounds with a dash", "--bounds kd=0-1", &["--bounds", "P=LO..HI", "'kd=0-1'"]),
        lambert("bounds the wrong way round", "--bounds kd=1..0.5", &["--bounds", "kd", "1..0.5"]),
        lambert("bounds without room", "--bounds kd=0.5..0.5", &["--bounds", "kd", "0.5..0.5"]),
        ct("roughness bounded at zero", "--bounds m=0..0.5", &["--bounds", "m", "above 0"]),
        ct("negative roughness bound", "--bounds m=-1..0.5", &["--bounds", "m", "above 0"]),
        lambert("tied to itself", "--tie kd=kd", &["--tie", "kd=kd", "different"]),
        lambert("tied to nothing", "--tie kd", &["--tie", "P=Q", "'kd'"]),
        lambert("tied in a circle", "--tie kd.r=kd.g --tie kd.g=kd.r", &["--tie", "circle"]),
        lambert("channel told per channel", "--per-channel kd.r", &["kd.r", "without a channel"]),
        // bad usage is one line however many inputs there are
        refused("two inputs", "fit good.csv one.csv good.csv -m lambert --fix zz=1", &["zz"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --bounds kd=1..0.5", &["--bounds"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --format xyz", &["'xyz'"]),
        refused("two inputs", "fit good.csv good.csv -m lambert --fix kd=5", &["0..2"]),
        // evaluate
        refused("evaluate without an input", "evaluate -m lambert --set kd=0.5", &["INPUT"]),
        refused("evaluate without a model", "evaluate good.csv --set kd=0.5", &["--model"]),
        evaluate("set without a value", "--set kd", &["--set", "P=V", "'kd'"]),
        evaluate("one of two without a value", "--set kd.r=0.5 kd.g", &["--set", "P=V", "'kd.g'"]),
        evaluate("set nothing", "--set", &["--set"]),
        evaluate("set in words", "--set kd=half", &["--set", "'kd=half'"]),
        evaluate("set an unknown parameter", "--set zz=1", &["zz", "lambert.kd"]),
        evaluate("set an unknown channel", "--set kd.x=1", &["'x'", "r, g, b"]),
        evaluate("set beyond the bounds", "--set kd=3", &["kd", "0..2", "found 3"]),
        evaluate("weights", "--weights sigma", &["good.csv", "sigma"]),
        evaluate("max-theta", "--max-theta 0", &["--max-theta"]),
        evaluate("option of fit", "--fix kd=1", &["--fix"]),
        refused("two inputs to evaluate", "evaluate good.csv good.csv -m lambert", &["good.csv"]),
        // info
        refused("info of nothing", "info", &["INPUT"]),
        refused("info in an unknown format", "info good.csv --format xyz", &["'xyz'"]),
        refused("info of angles", "info angles.csv", &["angles.csv:1:", "values"]),
        // synth
        synth("nowhere to evaluate", "", &["--grid", "--directions", "--at"]),
        synth("two places", "--directions 3 --at angles.csv", &["--directions", "--at"]),
        synth("no directions", "--directions 0", &["--directions", "0"]),
        synth("negative directions", "--directions -3", &["--directions", "-3"]),
        synth("directions in words", "--directions some", &["--directions", "'some'"]),
        synth("more directions than fit in memory", "--directions 99999999999", &["--directions"]),
        synth("unknown grid", "--grid utia", &["--grid", "'utia'", "merl"]),
        synth("no direction in the file", "--at header.csv", &["header.csv", "expected", "found none"]),
        synth("negative noise", "--directions 3 --noise -0.1", &["--noise", "-0.1"]),
        synth("noise NaN", "--directions 3 --noise nan", &["--noise"]),
        synth("infinite noise", "--directions 3 --noise-abs inf", &["--noise-abs"]),
        synth("negative absolute noise", "--directions 3 --noise-abs -1", &["--noise-abs", "-1"]),
        synth("max-theta", "--directions 3 --max-theta 91", &["--max-theta", "91"]),
        synth("unknown parameter", "--directions 3 --set zz=1", &["zz"]),
        synth("value beyond its bounds", "--directions 3 --set kd=3", &["kd", "0..2"]),
        synth("set without a value", "--directions 3 --set kd", &["--set", "P=V"]),
        synth("spectral MERL", "--grid merl --set kd[550]=0.1", &["r, g and b", "'550'"]),
        synth(
            "a height field of a model",
            "--from-heightfield gaussian --set m=0.3",
            &["--from-heightfield", "--model"],
        ),
        refused("synth of nothing", "synth --directions 3 -o f.csv", &["--model"]),
        heightfield("unknown surface", "waves --set m=0.3", &["'waves'", "gaussian", "v-groove"]),
        heightfield("height field without m", "gaussian", &["--set", "m=V", "nothing"]),
        heightfield("another parameter", "gaussian --set ks=0.3", &["--set", "m=V", "'ks=0.3'"]),
        heightfield("m and another parameter", "gaussian --set m=0.3 ks=1", &["--set", "'m=0.3 ks=1'"]),
        heightfield("m in words", "v-groove --set m=rough", &["--set", "'m=rough'"]),
        heightfield("m beyond its bounds", "v-groove --set m=1.5", &["m", "0.01..1", "found 1.5"]),
        heightfield("m NaN", "v-groove --set m=nan", &["m", "0.01..1", "NaN"]),
        heightfield("height field and directions", "gaussian --set m=0.3 --directions 3", &["--directions"]),
        heightfield("height field and a grid", "gaussian --set m=0.3 --grid merl", &["--grid"]),
        heightfield("height field and noise", "gaussian --set m=0.3 --noise 0.1", &["--noise"]),
        heightfield("no rays", "gaussian --set m=0.3 --rays 0", &["rays", "found 0"]),
        heightfield("rays in words", "gaussian --set m=0.3 --rays many", &["--rays", "'many'"]),
        heightfield("tile too small", "gaussian --set m=0.3 --tile 8", &["tile", "16..128", "found 8"]),
        heightfield("tile of grooves", "v-groove --set m=0.3 --tile 32", &["--tile", "gaussian"]),
        heightfield(
            "facets of a gaussian surface",
            "gaussian --set m=0.3 --facets ggx",
            &["--facets", "v-groove"],
        ),
        heightfield("unknown facets", "v-groove --set m=0.3 --facets flat", &["'flat'", "beckmann", "ggx"]),
        heightfield(
            "incidence at the horizon",
            "gaussian --set m=0.3 --theta-i 30,90",
            &["incidence", "found 90"],
        ),
        heightfield("incidence in words", "gaussian --set m=0.3 --theta-i steep", &["--theta-i", "'steep'"]),
        heightfield(
            "max-theta of a height field",
            "gaussian --set m=0.3 --max-theta 91",
            &["--max-theta", "91"],
        ),
        heightfield(
            "nothing to see",
            "v-groove --set m=0.05 --rays 6400 --theta-i 60 --max-theta 10",
            &["within 10 degrees"],
        ),
        synth("rays of a model", "--directions 3 --rays 5", &["--rays", "--from-heightfield"]),
        synth("incidence of a model", "--directions 3 --theta-i 5", &["--theta-i", "--from-heightfield"]),
        refused("synth to nowhere", "synth -m lambert --directions 3", &["--output"]),
        refused("MERL on stdout", "synth -m lambert --grid merl -o -", &["merl", "-o FILE"]),
    ];
    assert!(cases.len() > 100);
    assert_refused(&folder, &cases);
}

/// Formats that the program does not read (yet): one line that helps.
#[test]
fn measured_files_of_other_formats_are_refused() {
    for name in [
        "rgl/paper_white_rgb.bsdf",
        "mwir/mwir_metals_lacquers.csv",
        "nist-ptfe/PTFE.data.csv",
        "cea-retro/retro-3M-yellow.dat",
        "merl-slices/pink-felt-1d.alta",
        "merl-slices/red-fabric-slice.exr",
        "nbrdf/merl.npz",
        "nist-strd/Gauss1.dat",
        "published/published_params.csv",
    ] {
        let Some(path) = shared(name) else { continue };
        let folder = Folder::new();
        let run = folder.run([
            "fit".as_ref(),
            path.as_os_str(),
            "-m".as_ref(),
            "lambert".as_ref(),
            "-o".as_ref(),
            "r.json".as_ref(),
        ]);
        println!("{}", run.stderr);
        assert_eq!(run.code, Some(2), "{run:?}");
        assert_eq!(run.stdout, "");
        assert_eq!(run.stderr.matches('\n').count(), 1, "{run:?}");
        assert!(!run.stderr.chars().any(|c| c.is_control() && c != '\n'), "{run:?}");
        assert!(run.stderr.contains(path.file_name().unwrap().to_str().unwrap()), "{run:?}");
        assert!(run.stderr.contains("expected") && run.stderr.contains("found"), "{run:?}");
        // Either the formats that exist, or what this one lacks.
        let formats = ["MERL", "Cornell", "CSV"].iter().all(|format| run.stderr.contains(format));
        assert!(formats || run.stderr.contains("column 'theta_i'"), "{run:?}");
        assert!(folder.listing().is_empty());
    }
}

#[test]
fn several_bad_inputs_are_each_named() {
    let folder = Folder::new();
    folder.write("a.csv", "");
    folder.write("b.csv", "theta_i\n");
    let run = folder.brdfit("fit a.csv b.csv c.csv -m lambert --json -o r.json");
    assert_eq!(run.code, Some(2), "{run:?}");
    assert_eq!(run.stdout, "");
    for name in ["a.csv", "b.csv", "c.csv"] {
        assert_eq!(run.stderr.lines().filter(|line| line.contains(name)).count(), 1, "{run:?}");
    }
    assert_eq!(folder.listing().len(), 2);
}

/// What spreadsheets and other systems do to a CSV without harming it.
#[test]
fn unusual_but_valid_files_are_read() {
    let plain = GOOD.to_owned();
    let quoted: String = GOOD.lines().map(|l| format!("\"{}\"\n", l.replace(',', "\",\""))).collect();
    let cases = [
        ("CRLF", plain.replace('\n', "\r\n")),
        ("byte-order mark", format!("\u{feff}{plain}")),
        ("byte-order mark and CRLF", format!("\u{feff}{}", plain.replace('\n', "\r\n"))),
        ("comments and blank lines", format!("# made by hand\n\n{plain}\n# end\n\n")),
        ("byte-order mark before a comment", format!("\u{feff}# made by hand\n{plain}")),
        ("blanks around fields", plain.replace(',', " , ")),
        ("no line end", plain.trim_end().to_owned()),
        ("quotes", quoted),
        ("exponents and signs", plain.replace("0.10", "+1.0e-1")),
        ("columns in another order", {
            let swap = |line: &str| {
                let f: Vec<&str> = line.split(',').collect();
                [f[4], f[3], f[5], f[2], f[1], f[6], f[0]].join(",") + "\n"
            };
            plain.lines().map(swap).collect()
        }),
    ];
    let folder = Folder::new();
    folder.write("good.csv", &plain);
    let expected = folder.brdfit("fit good.csv -m lambert --json").good().json();
    for (what, content) in cases {
        folder.write("other.csv", content);
        let run = folder.brdfit("fit other.csv -m lambert --json");
        assert_eq!((run.code, run.stderr.as_str()), (Some(0), ""), "{what}");
        let report = run.json();
        assert_eq!(report["data"]["format"], "csv", "{what}");
        assert_eq!(report["data"]["used"], 4, "{what}");
        assert_eq!(report["data"]["channels"], json!(["r", "g", "b"]), "{what}");
        assert_eq!(report["errors"], expected["errors"], "{what}");
        assert_eq!(report["parameters"], expected["parameters"], "{what}");
    }
}

/// Values and directions at the ends of what is allowed: any exit code of the contract, but no panic.
#[test]
fn extreme_values_do_not_panic() {
    let rows = [
        "90,0,90,180,1e308",
        "90,0,90,0,1",
        "0,0,0,0,1e-308",
        "89.9999,0,89.9999,180,-1e300",
        "45,1e300,45,-1e300,0",
        "-90,0,90,0,5e-324",
        "0,0,0,0,-0",
    ];
    let folder = Folder::new();
    let mut cases: Vec<String> = rows.iter().map(|row| format!("{HEADER}\n{row}\n")).collect();
    cases.push(format!("{HEADER}\n{}\n", rows.join("\n")));
    cases.push(format!("{HEADER}\n{}", "30,0,40,180,0\n".repeat(50)));
    let mut wrong = Vec::new();
    for content in &cases {
        folder.write("x.csv", content);
        let mut lines = vec!["info x.csv --json".to_owned()];
        for options in ["", "--max-theta 90", "--max-theta 90 --metric l2", "--max-theta 90 --metric log"] {
            for model in ["lambert", "oren-nayar", "lambert + cook-torrance", "ashikhmin-shirley"] {
                lines.push(format!("fit x.csv -m '{model}' {options} --json"));
            }
        }
        for line in lines {
            let run = folder.brdfit(&line);
            let good = match run.code {
                Some(2) => run.stdout.is_empty() && run.stderr.lines().count() == 1,
                Some(code @ (0 | 1)) => {
                    let report = serde_json::from_str::<Value>(&run.stdout).unwrap_or_default();
                    line.starts_with("info") || report["termination"]["usable"] == json!(code == 0)
                }
                _ => false,
            };
            if !good || run.stderr.contains("panicked") {
                wrong.push(format!("brdfit {line}: {:?}\n{}{content}", run.code, run.stderr));
            }
        }
    }
    assert!(wrong.is_empty(), "{} complaints:\n{}", wrong.len(), wrong.join("\n"));
}

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

#[test]
fn table_on_stdout_and_warnings_on_stderr() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv -m 'lambert + cook-torrance'").good();
    assert!(serde_json::from_str::<Value>(&run.stdout).is_err(), "a table, not JSON");
    for word in ["a.csv", "lambert", "cook-torrance", "kd", "m", "f0", "cbrt", "l2", "log"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
    assert!(!run.stdout.contains("NaN") && !run.stdout.contains('\u{1b}'), "{}", run.stdout);
    // Several inputs and models: each in the table, and a ranking.
    let run = folder.brdfit("fit a.csv b.csv -m lambert -m oren-nayar").good();
    for word in ["a.csv", "b.csv", "oren-nayar", "ranking"] {
        assert!(run.stdout.contains(word), "{word}: {}", run.stdout);
    }
}

#[test]
fn json_on_stdout_is_alone_and_the_same_in_a_file() {
    let folder = laboratory();
    let json = folder.brdfit("fit a.csv -m lambert --json").good();
    assert_eq!(json.json()["schema"], "brdfit.report/1");
    assert!(json.stdout.ends_with("}\n"));

    let table = folder.brdfit("fit a.csv -m lambert -o r.json").good();
    assert!(table.stdout.contains("lambert") && !table.stdout.starts_with('{'));
    assert_eq!(timeless(&folder.read("r.json")), timeless(&json.stdout));

    let dash = folder.brdfit("fit a.csv -m lambert -o -").good();
    assert_eq!(timeless(&dash.stdout), timeless(&json.stdout));

    // Both at once; an older file is replaced.
    folder.write("r.json", "old");
    let both = folder.brdfit("fit a.csv -m lambert --json -o r.json").good();
    assert_eq!(folder.read("r.json"), both.stdout);
    assert_eq!(timeless(&both.stdout), timeless(&json.stdout));

    // No temporary file stays behind, and the report can be read by whom other files can.
    let names: Vec<_> = folder.listing().into_keys().collect();
    assert_eq!(names, ["a.csv", "b.csv", "clean.csv", "r.json"].map(std::path::PathBuf::from));
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt as _;
        folder.write("plain", "");
        let mode = |name: &str| fs::metadata(folder.path(name)).unwrap().permissions().mode();
        assert_eq!(mode("r.json"), mode("plain"));
    }
}

#[test]
fn quiet_prints_nothing() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv -m lambert -q -o r.json").good();
    assert_eq!(run.stdout, "");
    assert_eq!(parse(&folder.read("r.json"))["schema"], "brdfit.report/1");
    assert_eq!(folder.brdfit("fit a.csv b.csv -m lambert --quiet").good().stdout, "");
    assert_eq!(folder.brdfit("evaluate a.csv -m lambert -q").good().stdout, "");
    // Quiet is not mute: bad input is still named.
    let run = folder.brdfit("fit nothing.csv -m lambert -q");
    assert_eq!((run.code, run.stderr.lines().count()), (Some(2), 1));
}

#[test]
fn a_folder_takes_one_report_per_input() {
    let folder = laboratory();
    fs::create_dir(folder.path("there")).unwrap();
    folder.write("sub/a.csv", folder.read("b.csv"));
    for target in ["new/", "there", "there/"] {
        folder.brdfit(&format!("fit a.csv b.csv -m lambert -o {target}")).good();
        for (name, input) in [("a.json", "a.csv"), ("b.json", "b.csv")] {
            let report = parse(&folder.read(&format!("{}/{name}", target.trim_end_matches('/'))));
            assert_eq!(report["schema"], "brdfit.report/1");
            assert_eq!(report["data"]["path"], input);
        }
    }
    // Several models of one input share its file; inputs of one name do not share.
    folder.brdfit("fit a.csv sub/a.csv -m lambert -m oren-nayar -o both/").good();
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("both")).collect();
    assert_eq!(names.len(), 3, "{names:?}");
    let mut inputs = Vec::new();
    for name in &names[1..] {
        let reports = parse(&folder.read(name.to_str().unwrap()));
        assert_eq!(reports["schema"], "brdfit.reports/1");
        assert_eq!(reports["reports"].as_array().unwrap().len(), 2);
        inputs.push(reports["reports"][0]["data"]["path"].clone());
    }
    inputs.sort_by_key(ToString::to_string);
    assert_eq!(inputs, [json!("a.csv"), json!("sub/a.csv")]);
}

#[test]
fn several_fits_are_ranked() {
    let folder = laboratory();
    let line = "fit a.csv b.csv -m lambert -m 'lambert + cook-torrance' -m oren-nayar --json";
    for metric in ["cbrt", "l2"] {
        let all = folder.brdfit(&format!("{line} --metric {metric}")).json();
        assert_eq!(all["schema"], "brdfit.reports/1");
        assert_eq!(all["failed"], json!([]));
        let reports = all["reports"].as_array().unwrap();
        assert_eq!(reports.len(), 6);
        let ranking = all["ranking"].as_array().unwrap();
        let order: Vec<usize> =
            ranking.iter().map(|r| usize::try_from(r["index"].as_u64().unwrap()).unwrap()).collect();
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, [0, 1, 2, 3, 4, 5], "every report has one rank");
        for rank in ranking {
            assert!(rank["criterion"].as_str().unwrap().contains(metric), "{rank}");
            let report = &reports[usize::try_from(rank["index"].as_u64().unwrap()).unwrap()];
            assert_eq!(rank["value"], report["errors"][metric]);
        }
        for input in ["a.csv", "b.csv"] {
            let of_input: Vec<&Value> = ranking
                .iter()
                .filter(|r| {
                    reports[usize::try_from(r["index"].as_u64().unwrap()).unwrap()]["data"]["path"] == input
                })
                .collect();
            let values: Vec<f64> = of_input.iter().map(|r| r["value"].as_f64().unwrap()).collect();
            assert!(values.is_sorted(), "{input}: {values:?}");
            // The model that made the data wins.
            let best = usize::try_from(of_input[0]["index"].as_u64().unwrap()).unwrap();
            assert!(reports[best]["model"].as_str().unwrap().starts_with("lambert + cook-torrance"));
        }
    }
}

#[test]
fn one_bad_input_among_several() {
    let folder = laboratory();
    folder.write("bad.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,abc\n");
    let run = folder.brdfit("fit a.csv bad.csv nothing.csv b.csv -m lambert --json");
    assert_eq!(run.code, Some(1), "{run:?}");
    let all = run.json();
    assert_eq!(all["schema"], "brdfit.reports/1");
    let paths: Vec<&Value> = all["reports"].as_array().unwrap().iter().map(|r| &r["data"]["path"]).collect();
    assert_eq!(paths, [&json!("a.csv"), &json!("b.csv")]);
    assert_eq!(all["ranking"].as_array().unwrap().len(), 2);
    let failed = all["failed"].as_array().unwrap();
    assert_eq!(failed.len(), 2);
    assert_eq!(failed[0]["path"], "bad.csv");
    let error = failed[0]["error"].as_str().unwrap();
    assert!(error.contains("bad.csv:2:") && error.contains("'abc'") && !error.contains('\n'), "{error}");
    assert_eq!(failed[1]["path"], "nothing.csv");
    assert_eq!(run.stderr.lines().count(), 2, "{}", run.stderr);

    // A folder gets the files of the good inputs alone; the file for all gets everything.
    let run = folder.brdfit("fit a.csv bad.csv -m lambert -q -o out/");
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("out")).collect();
    assert_eq!(names, ["out", "out/a.json"].map(std::path::PathBuf::from));
    let run = folder.brdfit("fit bad.csv a.csv -m lambert -q -o all.json");
    assert_eq!((run.code, run.stdout.as_str()), (Some(1), ""));
    assert_eq!(parse(&folder.read("all.json"))["failed"].as_array().unwrap().len(), 1);
}

/// A database: a table that broke off in the middle costs its own report, and nothing else.
#[test]
fn a_broken_file_in_a_database_stops_nothing() {
    let folder = laboratory();
    let mut broken = merl_filled(1.0);
    broken.truncate(1_000_000);
    folder.write("broken.binary", broken);
    let models = "-m lambert -m 'lambert + cook-torrance'";
    let run = folder.brdfit(&format!("fit a.csv broken.binary b.csv {models} -o out/"));
    assert_eq!(run.code, Some(1), "{run:?}");
    let error = "broken.binary: byte 1000000: expected 34992012 bytes in all, found 1000000 (truncated)";
    assert!(run.stderr.contains(&format!("error: {error}\n")), "{}", run.stderr);
    assert!(run.stdout.ends_with(&format!("\n  failed: {error}\n")), "{}", run.stdout);
    let names: Vec<_> = folder.listing().into_keys().filter(|p| p.starts_with("out")).collect();
    assert_eq!(names, ["out", "out/a.json", "out/b.json"].map(std::path::PathBuf::from));
    // Each is what the input gives alone.
    for name in ["a", "b"] {
        folder.brdfit(&format!("fit {name}.csv {models} -q -o alone.json")).good();
        let together = folder.read(&format!("out/{name}.json"));
        assert_eq!(timeless(&together), timeless(&folder.read("alone.json")), "{name}");
    }
}

#[test]
fn inputs_that_the_time_does_not_reach_are_listed() {
    let folder = laboratory();
    let run = folder.brdfit("fit a.csv b.csv nothing.csv -m lambert --timeout 1e-9 --json");
    assert_eq!(run.code, Some(1), "{run:?}");
    assert!(run.stderr.contains("error: timeout: 2 of 3 inputs not begun\n"), "{}", run.stderr);
    let all = run.json();
    assert_eq!(all["reports"].as_array().unwrap().len(), 1);
    let failed = json!([{"path": "b.csv", "error": "timeout"}, {"path": "nothing.csv", "error": "timeout"}]);
    assert_eq!(all["failed"], failed);
    let table = folder.brdfit("fit a.csv b.csv -m lambert --timeout 1e-9");
    assert!(table.stdout.ends_with("\n  failed: b.csv: timeout\n"), "{}", table.stdout);
}

/// A report that must be complete although its fit is not usable.
fn assert_unusable(run: &Run) -> Value {
    assert_eq!(run.code, Some(1), "{run:?}");
    let report = run.json();
    assert_eq!(report["schema"], "brdfit.report/1");
    assert_eq!(report["termination"]["usable"], false);
    let why: Vec<&Value> =
        report["warnings"].as_array().unwrap().iter().filter(|w| w["kind"] == "not-usable").collect();
    assert_eq!(why.len(), 1, "{report}");
    assert!(why[0]["text"].as_str().unwrap().len() > 20);
    assert!(!report["parameters"].as_array().unwrap().is_empty());
    report
}

#[test]
fn unusable_fits_are_still_reported() {
    let folder = laboratory();
    folder.write("few.csv", "theta_i,phi_i,theta_o,phi_o,r\n10,0,20,180,0.1\n");
    let report = assert_unusable(&folder.brdfit("fit few.csv -m 'lambert + cook-torrance' --json"));
    // One value, three free parameters.
    assert_eq!(report["fit"]["n"], 1);
    assert_eq!(report["fit"]["dof"].as_f64(), Some(-2.0));
    for parameter in report["parameters"].as_array().unwrap() {
        assert_eq!(parameter["std_error"], Value::Null, "nothing is known about it: {parameter}");
    }
    // The same in a file and as a table.
    let run = folder.brdfit("fit few.csv -m 'lambert + cook-torrance' -o r.json");
    assert_eq!(run.code, Some(1));
    assert!(run.stderr.contains("fewer values") && run.stdout.contains("NOT USABLE"), "{run:?}");
    assert_eq!(parse(&folder.read("r.json"))["termination"]["usable"], false);

    let run = folder.brdfit("fit a.csv -m 'lambert + cook-torrance' --timeout 1e-9 --json");
    assert_eq!(assert_unusable(&run)["termination"]["reason"], "timeout");
    // A generous limit changes nothing.
    let run = folder.brdfit("fit a.csv -m lambert --timeout 600 --json").good();
    assert_eq!(run.json()["termination"]["usable"], true);

    // One of several that is not usable makes the command's exit code 1.
    let run = folder.brdfit("fit a.csv few.csv -m 'lambert + cook-torrance' --json");
    assert_eq!(run.code, Some(1));
    let usable: Vec<bool> = run.json()["reports"]
        .as_array()
        .unwrap()
        .iter()
        .map(|r| r["termination"]["usable"].as_bool().unwrap())
        .collect();
    assert_eq!(usable, [true, false]);
}

#[test]
fn evaluation_of_the_truth_is_exact() {
    let folder = laboratory();
    let truth = "--set kd.r=0.5 kd.g=0.3 kd.b=0.1 f0=0.05 m=0.3";
    let line = format!("evaluate clean.csv -m 'lambert + cook-torrance' {truth}");
    let report = folder.brdfit(&format!("{line} --json -o r.json")).good().json();
    for metric in ["l2", "log", "cbrt", "log_ratio", "relative"] {
        assert!(report["errors"][metric].as_f64().unwrap() < 1e-12, "{}", report["errors"]);
        for channel in ["r", "g", "b"] {
            assert!(report["errors_by_channel"][channel][metric].as_f64().unwrap() < 1e-12);
        }
    }
    assert_eq!(report["termination"]["reason"], "evaluated");
    assert_eq!(timeless(&folder.read("r.json")), timeless(&folder.brdfit(&format!("{line} -o -")).stdout));
    // As a table.
    let table = folder.brdfit(&line).good();
    assert!(table.stdout.contains("clean.csv") && table.stdout.contains("cbrt"));
    // With a dash in the order of the contract, options may also be repeated.
    let again = folder
        .brdfit(
            "evaluate clean.csv -m 'lambert + cook-torrance' --set kd.r=0.5 --set kd.g=0.3 --set kd.b=0.1 \
             --set cook-torrance.f0=0.05 --set cook-torrance.m=0.3 --json",
        )
        .good();
    assert_eq!(again.json()["errors"], report["errors"]);
}

/// Two samples, two channels, worked out here from the definitions of the metrics.
#[test]
fn errors_are_what_their_definitions_say() {
    let folder = Folder::new();
    folder.write(
        "two.csv",
        "theta_i,phi_i,theta_o,phi_o,p,q\n60,0,30,180,0.2,0.1\n0,0,45,90,0.05,0.3\n85,0,0,0,9,9\n",
    );
    let report = folder.brdfit("evaluate two.csv -m lambert --set kd.p=0.5 kd.q=0.8 --json").good().json();
    // f cos(theta_i) of the model and measured; 85 degrees lies beyond the default limit of 80.
    let (co, ci) = ([30.0_f64, 45.0].map(|t| t.to_radians().cos()), [0.5, 1.0]);
    let measured = [[0.2, 0.05], [0.1, 0.3]];
    let model = [0.5 / PI, 0.8 / PI];
    let mut expected = [0.0; 5];
    let mut of_q = [0.0; 5];
    let mut scale = [0.0; 2];
    for channel in 0..2 {
        for sample in 0..2 {
            let (f, g) = (model[channel], measured[channel][sample]);
            let (x, y) = (f * ci[sample], g * ci[sample]);
            let e = 1e-3;
            let q = (ci[sample] * co[sample]).max(e);
            let terms = [
                (x - y).powi(2),
                ((1.0 + x).ln() - (1.0 + y).ln()).powi(2),
                (x.cbrt() - y.cbrt()).powi(2),
                ((f * q + e) / (g * q + e)).ln().abs(),
                (x - y).abs(),
            ];
            for (sum, term) in expected.iter_mut().zip(terms) {
                *sum += term;
            }
            scale[0] += y;
            if channel == 1 {
                of_q.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                scale[1] += y;
            }
        }
    }
    let names = ["l2", "log", "cbrt", "log_ratio", "relative"];
    for (sums, n, scale, found) in [
        (expected, 4.0, scale[0], &report["errors"]),
        (of_q, 2.0, scale[1], &report["errors_by_channel"]["q"]),
    ] {
        let [l2, log, cbrt, log_ratio, relative] = sums;
        let values = [(l2 / n).sqrt(), (log / n).sqrt(), (cbrt / n).sqrt(), log_ratio / n, relative / scale];
        for (name, value) in names.into_iter().zip(values) {
            assert_relative_eq!(found[name].as_f64().unwrap(), value, max_relative = 1e-12);
        }
    }
    assert_eq!(report["data"]["samples"], 3);
    assert_eq!(report["data"]["used"], 2);
    assert_eq!(report["data"]["dropped"], json!({"beyond-max-theta": 1}));
    assert_eq!(report["fit"]["n"], 4);
}

/// The mean is the least-squares albedo of a constant BRDF: kd = pi times the weighted mean of f.
#[test]
fn lambert_fit_in_l2_is_the_weighted_mean() {
    let folder = Folder::new();
    folder.write("m.csv", "theta_i,phi_i,theta_o,phi_o,f\n60,0,30,180,0.2\n0,0,45,90,0.05\n30,0,10,0,0.1\n");
    let report = folder.brdfit("fit m.csv -m lambert --metric l2 --json").good().json();
    // Residuals are (kd/pi - f) cos(theta_i), so the weights are cos^2.
    let (w, f) = ([0.25, 1.0, 0.75], [0.2, 0.05, 0.1]);
    let mean = w.iter().zip(f).map(|(w, f)| w * f).sum::<f64>() / w.iter().sum::<f64>();
    let kd = &report["parameters"][0];
    assert_relative_eq!(kd["value"].as_f64().unwrap(), PI * mean, max_relative = 1e-9);
    assert_eq!(kd["status"], "free");
    assert_eq!(kd["channel"], "f");
    assert_eq!(report["fit"]["dof"].as_f64(), Some(2.0));
}

#[test]
fn options_do_what_they_say() {
    let folder = laboratory();
    let fit = |rest: &str| {
        folder.brdfit(&format!("fit a.csv -m 'lambert + cook-torrance' {rest} --json")).good().json()
    };
    let of = |report: &Value, name: &str, channel: Value| -> Value {
        let found: Vec<&Value> = report["parameters"]
            .as_array()
            .unwrap()
            .iter()
            .filter(|p| p["name"] == name && p["channel"] == channel)
            .collect();
        assert_eq!(found.len(), 1, "{name} {channel}");
        found[0].clone()
    };
    let report = fit("--fix kd.r=0.25 --fix m=0.4");
    assert_eq!(of(&report, "kd", json!("r"))["value"], 0.25);
    assert_eq!(of(&report, "kd", json!("r"))["status"], "fixed");
    assert_eq!(of(&report, "kd", json!("r"))["std_error"], Value::Null);
    assert_eq!(of(&report, "kd", json!("g"))["status"], "free");
    assert_eq!(of(&report, "m", Value::Null)["value"], 0.4);

    let report = fit("--bounds m=0.5..0.9");
    assert_eq!(of(&report, "m", Value::Null)["bounds"], json!([0.5, 0.9]));
    assert_eq!(of(&report, "m", Value::Null)["status"], "at-lower", "the truth is 0.3");
    assert_eq!(of(&report, "m", Value::Null)["value"], 0.5);
    assert_eq!(of(&report, "m", Value::Null)["ci95"], Value::Null);

    let report = fit("--tie kd.g=kd.r");
    assert_eq!(of(&report, "kd", json!("g"))["status"], "tied");
    assert_eq!(of(&report, "kd", json!("g"))["value"], of(&report, "kd", json!("r"))["value"]);

    let report = fit("--free ks");
    assert_eq!(of(&report, "ks", json!("r"))["status"], "free");
    assert!(report["derived"].as_array().unwrap().iter().any(|d| d["name"] == "cook-torrance.ks*f0"));

    let report = fit("--shared kd --per-channel m");
    of(&report, "kd", Value::Null);
    for channel in ["r", "g", "b"] {
        of(&report, "m", json!(channel));
    }
    let report = fit("--samples 50");
    assert_eq!(report["data"]["used"], 50);
    assert_eq!(report["options"]["samples"], 50);
    assert_eq!(fit("--samples all")["data"]["used"], 200);
    assert_eq!(fit("--samples 100000")["data"]["used"], 200);
    let report = fit("--max-theta 45");
    assert_eq!(report["filters"]["max_theta_deg"], 45.0);
    let used = report["data"]["used"].as_u64().unwrap();
    assert_eq!(used + report["data"]["dropped"]["beyond-max-theta"].as_u64().unwrap(), 200);
    let report = fit("--weights sigma");
    assert_eq!(report["filters"]["weights"], "sigma");
    let chi2 = report["fit"]["reduced_chi2"].as_f64().unwrap();
    // 600 values of known noise: chi^2/dof has a standard deviation of 0.06.
    assert!((chi2 - 1.0).abs() < 0.3, "{chi2}");
    assert_eq!(fit("")["fit"]["reduced_chi2"], Value::Null);
    assert_eq!(fit("")["filters"]["weights"], "uniform");
    for (metric, report) in ["l2", "log", "cbrt"].map(|m| (m, fit(&format!("--metric {m}")))) {
        assert_eq!(report["metric"], metric);
    }
    assert_eq!(fit("")["metric"], "cbrt");
}

/// Angles at the limit count: `--max-theta` is inclusive.
#[test]
fn max_theta_is_inclusive() {
    let folder = Folder::new();
    let rows: String = (0..=90).map(|theta| format!("{theta},0,10,180,0.1\n")).collect();
    folder.write("m.csv", format!("{HEADER}\n{rows}"));
    for limit in [1, 17, 45, 60, 75, 80, 89, 90] {
        if limit < 10 {
            continue; // theta_o is 10
        }
        let report =
            folder.brdfit(&format!("evaluate m.csv -m lambert --max-theta {limit} --json")).good().json();
        assert_eq!(report["data"]["used"], limit + 1, "--max-theta {limit}");
    }
}

#[test]
fn reports_are_the_same_bytes_every_time() {
    let folder = laboratory();
    let line = "fit a.csv b.csv -m 'lambert + cook-torrance' -m oren-nayar --samples 150 --seed 7 --json";
    let runs: Vec<String> = ["", "--threads 1", "--threads 2", "--threads 7", ""]
        .iter()
        .map(|threads| {
            let run = folder.brdfit(&format!("{line} {threads}")).good();
            let report = &run.json()["reports"][0];
            if let Some((_, n)) = threads.split_once(' ') {
                assert_eq!(report["time_s"]["threads"].to_string(), n);
            }
            assert!(report["options"].get("threads").is_none(), "threads belong to time_s");
            timeless(&run.stdout)
        })
        .collect();
    for run in &runs {
        assert!(*run == runs[0], "the reports differ");
    }
    assert!(runs[0].len() > 5000);
}

/// Enough samples to be divided over threads in many ways.
#[test]
fn thread_count_does_not_change_a_large_fit() {
    let folder = Folder::new();
    folder
        .brdfit("synth -m 'lambert + cook-torrance' --set kd.r=0.4 kd.g=0.2 m=0.25 f0=0.1 --directions 20000 --noise 0.1 -o l.csv")
        .good();
    let run = |threads| {
        let line = format!("fit l.csv -m 'lambert + cook-torrance' --json --threads {threads}");
        timeless(&folder.brdfit(&line).good().stdout)
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5), "the reports differ");
}

#[test]
fn synth_writes_what_it_was_asked_for() {
    let folder = Folder::new();
    // Anything may stand beside the angles; a negative theta is on the other side of the normal.
    folder.write(
        "angles.csv",
        "# places\nname,theta_i,phi_i,theta_o,phi_o\nhere,10,20,30,40\nthere,0,0,89.5,-170\nback,-25,30,60,0\n",
    );
    let run = folder.brdfit("synth -m lambert --set kd=0.5 --at angles.csv -o -").good();
    let rows = table(&run.stdout);
    assert_eq!(rows.0, ["theta_i", "phi_i", "theta_o", "phi_o", "f"]);
    let expected = [[10.0, 20.0, 30.0, 40.0], [0.0, 0.0, 89.5, -170.0], [25.0, -150.0, 60.0, 0.0]];
    assert_eq!(rows.1.len(), 3);
    for (row, expected) in rows.1.iter().zip(expected) {
        for (angle, expected) in row.iter().zip(expected) {
            assert_abs_diff_eq!(*angle, expected, epsilon = 1e-10);
        }
        assert_relative_eq!(row[4], 0.5 / PI, max_relative = 1e-14);
    }
    folder.brdfit("synth -m lambert --set kd=0.5 --at angles.csv -o f.csv").good();
    assert_eq!(folder.read("f.csv"), run.stdout);

    // Channels by name; the same seed draws the same bytes, another seed others.
    let line =
        "synth -m 'lambert + cook-torrance' --set kd.r=0.1 kd[550]=0.3 --directions 100 --max-theta 50 -o -";
    let first = folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 5")).good().stdout;
    assert_eq!(folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 5")).stdout, first);
    assert_ne!(folder.brdfit(&format!("{line} --noise 0.1 --noise-abs 0.001 --seed 6")).stdout, first);
    let (names, rows) = table(&first);
    assert_eq!(names[4..], ["r", "550", "sigma_r", "sigma_550"]);
    assert_eq!(rows.len(), 100);
    let clean = table(&folder.brdfit(&format!("{line} --seed 5")).good().stdout);
    assert_eq!(clean.0[4..], ["r", "550"], "no sigma without noise");
    for (noisy, clean) in rows.iter().zip(&clean.1) {
        assert_eq!(noisy[..4], clean[..4], "noise does not move the directions");
        assert!(noisy[0] <= 50.0 + 1e-9 && noisy[2] <= 50.0 + 1e-9);
        for channel in [4, 5] {
            // sigma^2 = (REL f)^2 + S^2; 6 sigma happen once in 10^9 draws.
            let sigma = (0.1 * clean[channel]).hypot(0.001);
            assert_relative_eq!(noisy[channel + 2], sigma, max_relative = 1e-12);
            assert!((noisy[channel] - clean[channel]).abs() < 6.0 * sigma);
            assert!(noisy[channel] != clean[channel]);
        }
    }
}

#[test]
fn a_height_field_is_measured_and_fitted() {
    let folder = Folder::new();
    let line = "synth --from-heightfield v-groove --set m=0.3 --rays 50000 --seed 4";
    let text = folder.brdfit(&format!("{line} -o -")).good().stdout;
    folder.brdfit(&format!("{line} -o groove.csv")).good();
    assert_eq!(folder.read("groove.csv"), text, "the same seed traces the same rays");
    let other = folder.brdfit(&format!("{} -o -", line.replace("--seed 4", "--seed 5"))).good().stdout;
    assert_ne!(other, text);

    let (names, rows) = table(&text);
    assert_eq!(names, ["theta_i", "phi_i", "theta_o", "phi_o", "f", "sigma"]);
    let mut angles: Vec<f64> = rows.iter().map(|row| row[0].round()).collect();
    angles.dedup();
    assert_eq!(angles, [0.0, 15.0, 30.0, 45.0, 60.0, 75.0]);
    for row in &rows {
        assert!(row[1] == 0.0 && row[2] <= 80.0 && row[4] >= 0.0 && row[5] > 0.0, "{row:?}");
    }
    // What became of the rays is in the head.
    assert!(text.contains("# 51200 rays for each theta_i, seed 4\n"), "{text:.400}");

    // Full strength and the slope that was asked for, to four standard errors and the 0.2 % of the bins.
    let model = "-m 'cook-torrance(d=beckmann, g=v-cavity, f=none)' --metric l2 --weights sigma";
    let report = folder.brdfit(&format!("fit groove.csv {model} --json")).good().json();
    for (name, truth) in [("m", 0.3), ("ks", 1.0)] {
        let parameters = report["parameters"].as_array().unwrap();
        let row = parameters.iter().find(|row| row["name"] == name).unwrap();
        let error = row["std_error"].as_f64().unwrap();
        assert_abs_diff_eq!(row["value"].as_f64().unwrap(), truth, epsilon = 4.0 * error + 0.002 * truth);
    }

    // Angles and facets of one's own; a smaller limit of viewing.
    let line =
        "synth --from-heightfield gaussian --set m=0.5 --tile 16 --rays 6400 --theta-i 20,40 --max-theta 50";
    let (_, rows) = table(&folder.brdfit(&format!("{line} -o -")).good().stdout);
    assert!(rows.iter().all(|row| row[2] <= 50.0 && [20.0, 40.0].contains(&row[0].round())));
    let line = "synth --from-heightfield v-groove --facets ggx --set m=0.5 --rays 6400 -o ggx.csv";
    folder.brdfit(line).good();
    assert!(folder.read("ggx.csv").contains("facets ggx"));
}

/// Names and numbers of a CSV.
fn table(text: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let mut lines = text.lines().filter(|line| !line.starts_with('#'));
    let names = lines.next().unwrap().split(',').map(str::to_owned).collect();
    (names, lines.map(|line| line.split(',').map(|f| f.parse().unwrap()).collect()).collect())
}

#[test]
fn merl_tables_can_be_made_described_and_fitted() {
    let folder = Folder::new();
    folder
        .brdfit("synth -m 'lambert + cook-torrance' --set kd.r=0.5 kd.g=0.2 kd.b=0.1 m=0.2 --grid merl -o m.binary")
        .good();
    assert_eq!(fs::metadata(folder.path("m.binary")).unwrap().len(), 34_992_012);
    let info = folder.brdfit("info m.binary --json").good().json();
    assert_eq!(info["format"], "merl");
    assert_eq!(info["samples"], 1_458_000);
    assert_eq!(info["genuine_merl"], Value::Null);
    let dropped: u64 = info["dropped"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(info["usable"].as_u64().unwrap() + dropped, 1_458_000);
    let text = folder.brdfit("info m.binary").good().stdout;
    assert!(text.contains("merl") && text.contains("1458000"), "{text}");

    let line = "fit m.binary -m 'lambert + cook-torrance' --samples 3000 --json";
    let report = folder.brdfit(line).good().json();
    assert_eq!(report["data"]["format"], "merl");
    assert_eq!(report["filters"]["weights"], "solid-angle");
    assert_eq!(report["options"]["merl_bins"], "center");
    let m = report["parameters"].as_array().unwrap().iter().find(|p| p["name"] == "m").unwrap();
    assert_relative_eq!(m["value"].as_f64().unwrap(), 0.2, max_relative = 1e-6);
    // Read by the other convention, the same table is another measurement.
    let edge = folder.brdfit(&format!("{line} --merl-bins edge")).json();
    assert_eq!(edge["options"]["merl_bins"], "edge");
    assert!(edge["errors"]["cbrt"].as_f64().unwrap() > 100.0 * report["errors"]["cbrt"].as_f64().unwrap());
}

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
    // docs/design.md, section 5.
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
fn help_and_version_are_not_errors() {
    let folder = Folder::new();
    for line in
        ["--help", "-h", "help", "fit --help", "evaluate -h", "models --help", "info -h", "synth --help"]
    {
        let run = folder.brdfit(line).good();
        assert!(run.stdout.contains("Usage: brdfit"), "{line}: {}", run.stdout);
    }
    let version = folder.brdfit("--version").good().stdout;
    assert_eq!(version, format!("brdfit {}\n", env!("CARGO_PKG_VERSION")));
}

/// `brdfit models | head -1`: a reader that goes away is nobody's error.
#[cfg(unix)]
#[test]
fn a_closed_pipe_ends_quietly() {
    use std::io::Read as _;
    use std::process::{Command, Stdio};
    let folder = laboratory();
    for line in [
        "models",
        "models --json",
        "--help",
        "info a.csv",
        "fit a.csv -m lambert",
        "fit a.csv b.csv -m lambert --json",
        "evaluate a.csv -m lambert -o -",
        "synth -m lambert --directions 20000 -o -",
    ] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .current_dir(folder.path("."))
            .args(typed(line))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // Closed before anything can have been read.
        drop(child.stdout.take());
        let mut stderr = String::new();
        child.stderr.take().unwrap().read_to_string(&mut stderr).unwrap();
        let status = child.wait().unwrap();
        assert_eq!(status.code(), Some(0), "{line}");
        assert!(common::only_warnings(&stderr), "{line}: {stderr}");
    }
}

/// A device cannot be replaced by a file: it is written to.
#[cfg(unix)]
#[test]
fn devices_are_written_directly() {
    use std::os::unix::fs::FileTypeExt as _;
    let folder = laboratory();
    folder.brdfit("fit a.csv -m lambert -q -o /dev/null").good();
    folder.brdfit("synth -m lambert --directions 5 -o /dev/null").good();
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}

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

/// docs/design.md, section 6, field by field.
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
        ],
    );
    let sha = data["sha256"].as_str().unwrap();
    assert!(sha.len() == 64 && sha.bytes().all(|b| b.is_ascii_hexdigit()));
    let dropped: u64 = data["dropped"].as_object().unwrap().values().map(|n| n.as_u64().unwrap()).sum();
    assert_eq!(data["used"].as_u64().unwrap() + dropped, data["samples"].as_u64().unwrap());
    assert_fields("filters", &report["filters"], &[("max_theta_deg", "number"), ("weights", "string")]);
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
                ("bounds", "array"),
                ("initial", "number"),
                ("status", "string"),
            ],
        );
        let status = parameter["status"].as_str().unwrap();
        assert!(["free", "fixed", "tied", "at-lower", "at-upper"].contains(&status), "{status}");
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
            &[("kind", "string"), ("parameter", "string|null"), ("text", "string")],
        );
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
        assert_fields("rank", rank, &[("index", "count"), ("criterion", "string"), ("value", "number")]);
    }
    for failure in several["failed"].as_array().unwrap() {
        assert_fields("failed", failure, &[("path", "string"), ("error", "string")]);
    }
}

#[test]
fn report_names_and_states() {
    let folder = laboratory();
    let line = "fit a.csv -m 'lambert+cook-torrance(d=beckmann)+cook-torrance' --json";
    let report = folder.brdfit(line).json();
    assert_eq!(
        report["model"],
        "lambert + cook-torrance(d=beckmann, g=smith, f=schlick) + cook-torrance(d=ggx, g=smith, f=schlick)"
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

/// `BRDFIT_UPDATE=1 cargo test --test cli` writes the file anew.
#[test]
fn the_schema_file_is_up_to_date() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/docs/report.schema.json");
    let generated = serde_json::to_string_pretty(&schema()).unwrap() + "\n";
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        fs::create_dir_all(concat!(env!("CARGO_MANIFEST_DIR"), "/docs")).unwrap();
        fs::write(path, &generated).unwrap();
    }
    let found = fs::read_to_string(path).unwrap_or_default().replace("\r\n", "\n");
    assert!(found == generated, "docs/report.schema.json is stale: BRDFIT_UPDATE=1 cargo test --test cli");
}

/// What the README shows is what the program prints, but for the time that it took.
#[test]
fn the_readme_shows_real_output() {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = std::fs::read_to_string(root.join("README.md")).unwrap();
    let block = |kind: &str| {
        let after = readme.split(&format!("```{kind}\n")).nth(1).unwrap();
        after.split("```").next().unwrap().to_owned()
    };
    let command = block("sh");
    let arguments =
        command.trim().strip_prefix("cargo run --release -- ").expect("the first command fits a file");
    let (arguments, model) = arguments.split_once(" -m ").unwrap();
    let run = |more: &[&str]| {
        let output = std::process::Command::new(env!("CARGO_BIN_EXE_brdfit"))
            .current_dir(root)
            .args(arguments.split(' '))
            .args(["-m", model.trim_matches('"')])
            .args(more)
            .output()
            .unwrap();
        assert!(output.status.success(), "{output:?}");
        String::from_utf8(output.stdout).unwrap()
    };
    let timeless = |text: &str| text.trim_end().rsplit_once(", ").unwrap().0.to_owned();
    let (table, report) = (run(&[]), run(&["--json"]));
    if std::env::var_os("BRDFIT_UPDATE").is_some() {
        // The excerpt keeps its lines; their numbers come from the next line of the report of the same shape.
        let shape = |line: &str| line.replace(|c: char| c.is_ascii_digit() || ".e-".contains(c), "");
        let mut lines = report.lines();
        let excerpt = block("json");
        let excerpt = excerpt.lines().map(|line| match line.trim() {
            "..." => format!("{line}\n"),
            _ => format!("{}\n", lines.find(|found| shape(found) == shape(line)).expect(line)),
        });
        let readme = readme
            .replace(&block("json"), &excerpt.collect::<String>())
            .replace(&block("text"), &format!("{}\n", table.trim_end()));
        std::fs::write(root.join("README.md"), readme).unwrap();
        return;
    }
    assert_eq!(timeless(&table), timeless(&block("text")));

    // Every line of the excerpt stands in the report, in that order.
    let mut lines = report.lines();
    for line in block("json").lines().filter(|line| line.trim() != "...") {
        assert!(lines.any(|found| found == line), "the report does not say {line}");
    }
}

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
        assert_eq!(json["sound"], code == 0, "{line}");
        let broken = json["findings"].as_array().unwrap().iter().filter(|f| f["breaks"] == true);
        let kinds: Vec<&str> = broken.map(|f| f["kind"].as_str().unwrap()).collect();
        assert!(kinds.iter().all(|k| *k == kind), "{line}: {kinds:?}");
        assert_eq!(kinds.is_empty(), code == 0, "{line}");
        let last = run.stdout.lines().last().unwrap();
        assert_eq!(last, if code == 0 { "sound" } else { "BREAKS PHYSICS" }, "{line}");
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
    assert!(
        run.stderr
            .starts_with("warning: several.json: 2 reports, checked is the first of the ranking: good.csv, ")
    );
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
        refused("values without a model", "check good.csv --set kd=1", &["--set", "expected -m"]),
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
